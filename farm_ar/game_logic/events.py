"""Real things as characters: what the player changes of them makes something happen in the game (paper, 5.2).

A detector says how the parts of real things stand; what has changed since it last looked is an event; each
kind of event has an effect.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from farm_ar.game_logic.farm_game import ANIMALS_A_SECOND, FarmGame
from farm_ar.game_logic.render_state import RenderState

GATE, STAIRS = "gate", "stairs"

OPEN = 0.5
"""How far open a gate must be to count as open, as a share."""


@dataclass(frozen=True)
class Parts:
    """How the parts of real things stand.

    Args:
        open_gates: how far the gates of objects are open, by index, 0 to 1.
        missing: names of parts that have been taken off objects, by index.
    """

    open_gates: Mapping[int, float] = field(default_factory=dict)
    missing: Mapping[int, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def of(cls, state: RenderState) -> Parts:
        """As they truly are."""
        return cls(dict(state.open_gates), dict(state.missing))

    def gate_is_open(self, index: int) -> bool:
        """Whether an object's gate is open."""
        return self.open_gates.get(index, 0.0) >= OPEN

    def without_stairs(self, index: int) -> bool:
        """Whether an object's stairs have been taken off."""
        return STAIRS in self.missing.get(index, ())

    def with_gate(self, index: int, share: float) -> Parts:
        """The same with an object's gate open so far."""
        return Parts({**self.open_gates, index: share}, self.missing)

    def with_stairs(self, index: int, there: bool) -> Parts:
        """The same with an object's stairs there, or taken off."""
        others = tuple(part for part in self.missing.get(index, ()) if part != STAIRS)
        return Parts(self.open_gates, {**self.missing, index: others if there else (*others, STAIRS)})


@dataclass(frozen=True)
class Event:
    """A physical change.

    Args:
        kind: one of `EFFECTS`.
        index: of the object.
    """

    kind: str
    index: int


@runtime_checkable
class PartsDetector(Protocol):
    """Anything that says how the parts of real things stand."""

    def detect(self, state: RenderState, known: Parts) -> Parts:
        """How they stand now.

        Args:
            state: the moment, the truth included, for oracles; others look at a picture of it.
            known: what was found before, which stays where nothing can be seen.
        """
        ...


class OracleParts:
    """Knows how the parts stand of what is in view."""

    def detect(self, state: RenderState, known: Parts) -> Parts:
        """How they truly stand."""
        return Parts.of(state)


def events_between(before: Parts, after: Parts) -> list[Event]:
    """What has changed, by index and kind."""
    found = []
    for i in sorted({*before.open_gates, *after.open_gates}):
        if before.gate_is_open(i) != after.gate_is_open(i):
            found.append(Event("gate opened" if after.gate_is_open(i) else "gate closed", i))
    for i in sorted({*before.missing, *after.missing}):
        if before.without_stairs(i) != after.without_stairs(i):
            found.append(Event("stairs removed" if after.without_stairs(i) else "stairs put back", i))
    return found


Effect = Callable[[FarmGame, int], None]


def let_out(game: FarmGame, index: int) -> None:
    """Animals come out of the shed."""
    game.send(ANIMALS_A_SECOND)


def keep_in(game: FarmGame, index: int) -> None:
    """No more animals come out of the shed."""
    game.send(0.0)


def relocate(game: FarmGame, index: int) -> None:
    """The animals of a building go to the nearest other one of its kind that still has its stairs."""
    layout, believed = game.scene.layout, game.believed
    others = [
        i
        for i in range(len(layout))
        if i != index and layout.movable[i] and layout.category[i] == layout.category[index]
    ]
    others = [i for i in others if not Parts(missing=game.missing).without_stairs(i)]
    if others:
        away = np.linalg.norm(believed.position[others] - believed.position[index], axis=1)
        game.house(index, others[int(away.argmin())])


def come_home(game: FarmGame, index: int) -> None:
    """The animals of a building go to it again."""
    game.house(index, index)


EFFECTS: dict[str, Effect] = {
    "gate opened": let_out,
    "gate closed": keep_in,
    "stairs removed": relocate,
    "stairs put back": come_home,
}
"""What each kind of event does."""


class EventLayer:
    """Looks at real objects now and then, and lets what has changed have its effect.

    Args:
        game: on which it has it.
        detector: says how parts stand; by default an oracle.
        effects: by kind of event; a kind without one does nothing.

    Attributes:
        known: how parts were found to stand.
        happened: the events so far, each with the seconds played when it was found.
    """

    def __init__(
        self,
        game: FarmGame,
        detector: PartsDetector | None = None,
        effects: Mapping[str, Effect] = EFFECTS,
    ) -> None:
        self._game, self._detector, self._effects = game, detector or OracleParts(), effects
        self.known = Parts.of(game.render_state())
        self.happened: list[tuple[float, Event]] = []

    def look(self) -> list[Event]:
        """Look once, and let the effects of what has changed happen; returns the events."""
        found = self._detector.detect(self._game.render_state(), self.known)
        events = events_between(self.known, found)
        self.known = found
        for event in events:
            self.happened.append((self._game.clock, event))
            if event.kind in self._effects:
                self._effects[event.kind](self._game, event.index)
        return events
