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
from farm_ar.envs.actions import SteeringAction
from farm_ar.errors import OptionError
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.game_logic.physics.gripper import MAX_HAND_SPEED, MAX_TWIST, HandState
from farm_ar.geometry import wrap

CARRYING = 0.5
"""How fast it goes with a building, as a share of the hand's highest speed."""

NEAR_M, NEAR_RAD = 0.01, 0.05
"""From so near on, a building is where it was to go."""

NEAR_CHOSEN_M, NEAR_CHOSEN_RAD = 0.04, 0.15
"""The same where a step is one of a few choices: about half of what one of a tenth of a second does."""

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
        """Where to steer the hand: (4,) velocities, or the choice that comes nearest to them.

        Raises:
            OptionError: the hand is not steered, or the policy is a helper.
        """
        wanted = self._wanted(env)
        if not isinstance(env.action_space, spaces.Discrete):
            return wanted
        return _chosen(wanted, 1 / env.config.steps_per_second)

    def _wanted(self, env: FarmToTableEnv) -> npt.NDArray[np.float32]:
        """(4,) velocities and grip."""
        game, option = env.world, env.config
        if not (isinstance(game, FarmGame) and option.control == "hand"):
            raise OptionError("control", "must be hand for a policy that steers", option.control)
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

    def _near(self, env: FarmToTableEnv) -> tuple[float, float]:
        """From how near on something is where it was to go, metres and radians."""
        chosen = isinstance(env.action_space, spaces.Discrete)
        return (NEAR_CHOSEN_M, NEAR_CHOSEN_RAD) if chosen else (NEAR_M, NEAR_RAD)

    def _reach(
        self, env: FarmToTableEnv, hand: HandState, step: Step, seconds: float
    ) -> npt.NDArray[np.float32]:
        """Go over the building, and close the hand there."""
        way = env.view.truth.position[step.mover] - hand.position
        if not env.view.in_view[step.mover]:
            self._next = None
        if np.linalg.norm(way) > self._near(env)[0]:
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
        near_m, near_rad = self._near(env)
        arrived = np.linalg.norm(way) <= near_m and abs(turn) <= near_rad
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


def _chosen(wanted: npt.NDArray[np.float32], seconds: float) -> int:
    """The choice that goes most nearly there, or twists where no way is left that a step makes shorter."""
    steering = SteeringAction()
    velocity, twist, closed = MAX_HAND_SPEED * wanted[:2], MAX_TWIST * float(wanted[2]), bool(wanted[3] > 0)
    if np.linalg.norm(velocity) * seconds > NEAR_CHOSEN_M:
        ways = [steering.decode(closed * steering.WAYS + k) for k in range(steering.WAYS)]
        return closed * steering.WAYS + int(np.argmax([np.dot(way[:2], velocity) for way in ways]))
    if closed and abs(twist) * seconds > NEAR_CHOSEN_RAD:
        return 2 * steering.WAYS + int(twist > 0)
    return closed * steering.WAYS
