"""The ways to play a visit: by whole moves, or by velocity control of the hand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from gymnasium import spaces

from farm_ar.arrays import BoolArray
from farm_ar.envs.actions import (
    HAND_ACTIONS,
    LAYOUT_ACTIONS,
    MOVE_ACTIONS,
    HandAction,
    Move,
    MoveAction,
)
from farm_ar.envs.budget import Budget
from farm_ar.envs.config import EnvConfig
from farm_ar.envs.generator import unit_of
from farm_ar.envs.table import TableView
from farm_ar.envs.worlds import World
from farm_ar.game_logic.belief import Sighting
from farm_ar.game_logic.farm_game import UNMOVED, FarmGame
from farm_ar.game_logic.physics.limits import Motion
from farm_ar.game_logic.physics.state import TICK
from farm_ar.scenes import Scene

Look = Callable[[], TableView]
"""Gives the table as it stands."""


class Outcome(NamedTuple):
    """What an action did.

    Args:
        motion: of all objects.
        over: whether the visit is over.
        sighting: the snapshot that ended it, where the game has taken it already.
    """

    motion: Motion
    over: bool
    sighting: Sighting | None = None


NOTHING = Outcome(UNMOVED, over=False)
"""The outcome of an action that changed nothing but the time that is left, and where the hand is."""


class Control(Protocol):
    """A way to play a visit."""

    space: spaces.Space[Any]

    def begin(self, world: World, budget: Budget) -> None:
        """A visit begins."""
        ...

    def act(self, action: Any, look: Look, world: World, budget: Budget) -> Outcome:
        """Carry out an action."""
        ...

    @property
    def left(self) -> float:
        """Share of the visit's moves, or of its time, that is left."""
        ...

    def mask(self, view: TableView) -> BoolArray | None:
        """Which choices make sense now; None where nothing can be masked."""
        ...


class MoveControl:
    """Whole moves, each executed by the hand before the next is requested.

    Args:
        action: what an action means.
        moves: how many a visit has.
    """

    def __init__(self, action: MoveAction, moves: int) -> None:
        self.space = action.space
        self.action, self._moves = action, moves
        self._left = moves

    def begin(self, world: World, budget: Budget) -> None:
        """The hand comes into view."""
        self._left = self._moves
        world.begin_visit()

    def act(self, action: Any, look: Look, world: World, budget: Budget) -> Outcome:
        """Carry out the moves, one after the other; what is out of view when its turn comes stays."""
        view = look()
        moves, total, stale = self.asked(action, view, budget), Motion(), False
        for asked in moves or []:
            if stale:
                view, stale = look(), False
            seen = view.in_view
            # What was pushed meanwhile may be out of view, and may have cost what was meant for this one.
            (move,) = budget.fitted([asked])
            if seen[move.index] and (np.any(move.displacement) or move.turn):
                motion = world.move(move.index, move.displacement, move.turn, most=budget.most)
                budget.spend(motion)
                total, stale = total + motion, True
        self._left -= 1
        return Outcome(total, moves is None or self._left == 0)

    def asked(self, action: Any, view: TableView, budget: Budget) -> list[Move] | None:
        """The moves of what is in view, as far as the budget reaches; None to end the turn."""
        moves = self.action.decode(action, view)
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
        return self.action.mask(view)


class HandControl:
    """Velocity control of the hand.

    Args:
        action: what an action means.
        seconds: how long a visit may take, the way to the table included; then the hand is withdrawn.
        steps_per_second: how often it is steered, a divisor of the ticks in a second.
    """

    def __init__(self, action: HandAction, seconds: float, steps_per_second: int) -> None:
        self._action, self.space = action, action.space
        self._ticks = max(1, round(seconds / TICK))
        self._step = round(1 / TICK / steps_per_second)
        self._left = self._ticks

    def begin(self, world: World, budget: Budget) -> None:
        """The hand waits at the player's side, out of view."""
        assert isinstance(world, FarmGame)
        self._left, self._game = self._ticks, world
        world.bring_hand()
        world.allow(budget.most)

    def act(self, action: Any, look: Look, world: World, budget: Budget) -> Outcome:
        """Steer for a step. The hand stops before the budget is exceeded, and is then raised."""
        game, ticks = self._game, self._left
        vx, vz, twist, closed = self._action.decode(action)
        motion, passed, sighting = game.steer(
            vx, vz, twist, closed, self._step if ticks > self._step else ticks
        )
        self._left = ticks = ticks - passed
        if motion is UNMOVED and sighting is None and ticks > 0:
            return NOTHING
        if sighting is None and ticks == 0:
            last, sighting = game.withdraw_hand()
            motion += last
        budget.spend(motion)
        return Outcome(motion, sighting is not None or ticks == 0, sighting)

    @property
    def left(self) -> float:
        """Share of the visit's time that is left."""
        return self._left / self._ticks

    def mask(self, view: TableView) -> BoolArray | None:
        """Which choices make sense now; None where nothing can be masked."""
        hand = self._game.tabletop.hand
        return self._action.mask(hand is not None and hand.gripped is not None)


def control_of(config: EnvConfig, scene: Scene) -> Control:
    """The control that a configuration asks for."""
    if config.control == "hand":
        steering = HAND_ACTIONS[str(config.action)]()
        return HandControl(steering, config.hand_seconds, config.steps_per_second)
    kinds = np.bincount(scene.layout.category_code[scene.layout.movable])
    known = MOVE_ACTIONS if config.control == "move" else LAYOUT_ACTIONS
    action = known[str(config.action)](int(kinds.sum()), int(kinds.max()), unit_of(scene))
    return MoveControl(action, config.moves if config.control == "move" else 1)
