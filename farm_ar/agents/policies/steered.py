"""A policy that carries out the analytic policy's plan with a hand that is steered."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from farm_ar.agents.policies.analytic import Step, move_of, plan_of, terms_of
from farm_ar.agents.policies.base import Policy, Visit
from farm_ar.arrays import FloatArray
from farm_ar.envs import FarmToTableEnv
from farm_ar.errors import OptionError
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.game_logic.physics.gripper import MAX_HAND_SPEED, MAX_TWIST, HandState
from farm_ar.geometry import wrap

CARRYING = 0.5
"""How fast it goes with a building, as a share of the hand's highest speed."""

NEAR_M, NEAR_RAD = 0.01, 0.05
"""From so near on, a building is where it was to go."""

PATIENCE = 40
"""Steps after which a building that does not arrive is let go."""


class SteeredPolicy(Policy):
    """Goes to the next building of the plan, grips it, carries and turns it, and lets go; then plans anew.

    Args:
        rng: not needed; every policy is made with one.
        moves: how many buildings it moves in a visit at most.
        beam: how many unfinished plans are kept.
    """

    def __init__(self, rng: np.random.Generator | None = None, moves: int = 6, beam: int = 32) -> None:
        self._moves, self._beam, self._visit = moves, beam, Visit()
        self._left, self._steps = moves, 0
        self._next: Step | None = None
        self._goal: tuple[FloatArray, float] | None = None

    def act(self, env: FarmToTableEnv) -> Any:
        """(4,) where to steer the hand.

        Raises:
            OptionError: the hand is not steered by velocities, or the policy is a helper.
        """
        game, option = env.world, env.config
        if not (isinstance(game, FarmGame) and option.control == "hand"):
            raise OptionError("control", "must be hand for a policy that steers", option.control)
        if not isinstance(env.action_space, spaces.Box):
            raise OptionError("action", "must be velocity for a policy that steers", option.action)
        if option.sign != 1:
            raise OptionError("sign", "must be 1 for a policy that plans", option.sign)
        if self._visit.is_new(env):
            self._left, self._next, self._goal = self._moves, None, None
        hand = game.tabletop.hand
        assert hand is not None
        seconds = 1 / option.steps_per_second
        if hand.gripped is not None and self._goal is not None:
            return self._carry(env, hand, seconds)
        self._goal = None
        if self._next is None and self._left > 0:
            terms = terms_of(env.view.scene, "slot", option.effort_weight)
            plan = plan_of(env, self._left, terms, self._beam)
            self._next, self._left = (plan[0], self._left - 1) if plan else (None, 0)
        if self._next is None:  # out of view, for half a second
            return _towards(np.array([env.view.size[0] / 2, -1.0]) - hand.position, 0.0, 1.0, seconds, False)
        return self._reach(env, hand, self._next, seconds)

    def _reach(
        self, env: FarmToTableEnv, hand: HandState, step: Step, seconds: float
    ) -> npt.NDArray[np.float32]:
        """Go over the building, and close the hand there."""
        way = env.view.truth.position[step.mover] - hand.position
        if not env.view.in_view[step.mover]:
            self._next = None
        if np.linalg.norm(way) > NEAR_M:
            return _towards(way, 0.0, 1.0, seconds, False)
        move = move_of(env.view, step)
        truth = env.view.truth
        self._goal = truth.position[step.mover] + move.displacement, float(truth.yaw[step.mover]) + move.turn
        self._next, self._steps = None, 0
        return _towards(np.zeros(2), 0.0, 0.0, seconds, True)

    def _carry(self, env: FarmToTableEnv, hand: HandState, seconds: float) -> npt.NDArray[np.float32]:
        """Bring the building that is held where it is to go, and let go there."""
        assert self._goal is not None
        place, yaw = self._goal
        truth, held = env.view.truth, hand.gripped
        way = place - truth.position[held]
        turn = float(wrap(yaw - truth.yaw[held]))
        self._steps += 1
        arrived = np.linalg.norm(way) < NEAR_M and abs(turn) < NEAR_RAD
        if arrived or self._steps > PATIENCE:
            self._goal = None
            return _towards(np.zeros(2), 0.0, 0.0, seconds, False)
        return _towards(way, turn, CARRYING, seconds, True)


def _towards(
    way: FloatArray, turn: float, share: float, seconds: float, closed: bool
) -> npt.NDArray[np.float32]:
    """The action that goes a way, metres, and makes a turn, radians, in a step, or as far as it can."""
    velocity = way / seconds
    speed = float(np.linalg.norm(velocity))
    if speed > share * MAX_HAND_SPEED:
        velocity = velocity * (share * MAX_HAND_SPEED / speed)
    twist = np.clip(turn / seconds / MAX_TWIST, -share, share)
    grip = 1.0 if closed else -1.0
    return np.array([*(velocity / MAX_HAND_SPEED), twist, grip], dtype=np.float32)
