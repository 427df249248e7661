"""The ways to play a visit: by whole moves, or by steering the hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.envs.actions import MoveAction
from farm_ar.envs.budget import Budget
from farm_ar.envs.moves import Move
from farm_ar.envs.table import TableView
from farm_ar.envs.worlds import World
from farm_ar.game_logic.farm_game import FarmGame, Phase
from farm_ar.game_logic.hand import MAX_HAND_SPEED, MAX_TWIST
from farm_ar.game_logic.motion import Motion
from farm_ar.game_logic.physics import TICK
from farm_ar.game_logic.tracker import Sighting
from farm_ar.scenes import visible

STEPS_PER_SECOND = 10
"""How often the hand is steered."""

TICKS_PER_STEP = round(1 / TICK / STEPS_PER_SECOND)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What an action did.

    Args:
        motion: of all objects.
        over: whether the visit is over.
        sighting: the snapshot that ended it, where the game has taken it already.
    """

    motion: Motion
    over: bool
    sighting: Sighting | None = None


class Control(Protocol):
    """A way to play a visit."""

    space: spaces.Space[Any]

    def begin(self, world: World) -> None:
        """A visit begins."""
        ...

    def act(self, action: Any, view: TableView, world: World, budget: Budget) -> Outcome:
        """Carry out an action."""
        ...

    @property
    def left(self) -> float:
        """Share of the visit's moves, or of its time, that is left."""
        ...

    def mask(self, view: TableView) -> BoolArray | None:
        """Which choices make sense now; None where nothing can be masked."""
        ...

    def hand(self, world: World) -> FloatArray | None:
        """(8,) the hand: x, z, sin and cos of its yaw, velocity, grip, visible; None without one."""
        ...


class MoveControl:
    """Whole moves, each carried out by the hand before the next is asked for.

    Args:
        action: what an action means.
        moves: how many a visit has.
    """

    def __init__(self, action: MoveAction, moves: int) -> None:
        self.space = action.space
        self._action, self._moves = action, moves
        self._left = moves

    def begin(self, world: World) -> None:
        """The hand comes into view."""
        self._left = self._moves
        world.begin_visit()

    def act(self, action: Any, view: TableView, world: World, budget: Budget) -> Outcome:
        """Carry out the moves, one after the other; what is out of view when its turn comes stays."""
        moves, total, seen = self.asked(action, view, budget), Motion(), view.in_view
        for asked in moves or []:
            # What was pushed meanwhile may be out of view, and may have cost what was meant for this one.
            (move,) = budget.fitted([asked])
            if seen[move.index] and (np.any(move.displacement) or move.turn):
                motion = world.move(move.index, move.displacement, move.turn)
                budget.spend(motion)
                total, seen = total + motion, visible(world.truth, world.camera)
        self._left -= 1
        return Outcome(total, moves is None or self._left == 0)

    def asked(self, action: Any, view: TableView, budget: Budget) -> list[Move] | None:
        """The moves of what is in view, as far as the budget reaches; None for leaving the view."""
        moves = self._action.moves(action, view)
        return None if moves is None else budget.fitted([m for m in moves if view.in_view[m.index]])

    @property
    def moves_left(self) -> int:
        """How many moves the visit has left."""
        return self._left

    @property
    def left(self) -> float:
        """Share of the visit's moves that is left."""
        return self._left / self._moves

    def mask(self, view: TableView) -> BoolArray | None:
        """Which choices make sense now; None where nothing can be masked."""
        return self._action.mask(view)

    def hand(self, world: World) -> None:
        """There is none to steer."""
        return


class HandControl:
    """The hand, steered: velocity x, z (1 is 1.5 m/s), twist (1 is pi rad/s), grip when positive.

    Args:
        seconds: how long a visit may take, the way to the table included; then the hand is withdrawn.
    """

    def __init__(self, seconds: float) -> None:
        self.space: spaces.Space[Any] = spaces.Box(-1.0, 1.0, (4,), np.float32)
        self._ticks = max(1, round(seconds / TICK))
        self._left = self._ticks

    def begin(self, world: World) -> None:
        """The hand waits at the player's side, out of view."""
        self._left = self._ticks
        _game(world).bring_hand()

    def act(self, action: Any, view: TableView, world: World, budget: Budget) -> Outcome:
        """Steer for a tenth of a second. With nothing left of the budget the hand touches nothing."""
        values = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        velocity, twist = MAX_HAND_SPEED * values[:2], MAX_TWIST * float(values[2])
        closed = bool(values[3] > 0)
        game, total = _game(world), Motion()
        for _ in range(min(TICKS_PER_STEP, self._left)):
            if budget.spent:
                game.tabletop.raise_hand()
            motion, sighting = game.tick(velocity, twist, closed and not budget.spent)
            total += motion
            budget.spend(motion)
            self._left -= 1
            if sighting is not None:
                return Outcome(total, True, sighting)
        if self._left > 0:
            return Outcome(total, False)
        motion, sighting = game.withdraw_hand()
        budget.spend(motion)
        return Outcome(total + motion, True, sighting)

    @property
    def left(self) -> float:
        """Share of the visit's time that is left."""
        return self._left / self._ticks

    def mask(self, view: TableView) -> None:
        """Nothing can be masked."""
        return

    def hand(self, world: World) -> FloatArray | None:
        """(8,) the hand: x, z, sin and cos of its yaw, velocity over its limit, grip, visible, or None."""
        game = _game(world)
        state = game.tabletop.hand
        if state is None:
            return None
        return np.array(
            [
                *state.position,
                np.sin(state.yaw),
                np.cos(state.yaw),
                *(state.velocity / MAX_HAND_SPEED),
                float(state.gripped is not None),
                float(game.phase is Phase.HAND),
            ]
        )


def _game(world: World) -> FarmGame:
    assert isinstance(world, FarmGame)
    return world
