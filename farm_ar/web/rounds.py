"""What is played: shown first, freely, guessing first, against an adversary, or tidying up."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from farm_ar.errors import OptionError
from farm_ar.game_logic.belief import Sighting
from farm_ar.scenes import visible
from farm_ar.scenes.builtin.farm import TABLE
from farm_ar.web.adversary import Rearrangement, adversary_plan, exchange_plan, hand_carries, mess_plan
from farm_ar.web.messages import Json
from farm_ar.web.pointer import STEPS_PER_SECOND, Pointer

if TYPE_CHECKING:
    from farm_ar.web.game import Game

FREE, SHOW, GUESS, DUEL, TIDY = "free", "show", "guess", "duel", "tidy"

MODES = (FREE, SHOW, GUESS, DUEL, TIDY)
"""What can be played."""

FAST = 10
"""Steps at once while an adversary rearranges the table."""

SHOWN_M_S = 0.5
"""How fast a hand goes that is to be watched, on the farm; elsewhere in proportion."""

_LOG = logging.getLogger(__name__)

_PLANNER = ThreadPoolExecutor(1, thread_name_prefix="farm-ar-adversary")


class Round:
    """Free play: the hand does what the pointer does. Other modes differ in what is here.

    Args:
        game: that is played.

    Attributes:
        stage: how far the round is.
        facts: what pages are sent of it beside.
    """

    mode = FREE

    def __init__(self, game: Game) -> None:
        self.game, self.stage, self.facts = game, FREE, Json()
        self._hand: Iterator[Pointer] | None = None

    @property
    def unseen(self) -> bool:
        """Whether nobody is to see where things are now."""
        return False

    @property
    def secret(self) -> bool:
        """Whether what is what is to be found out now."""
        return False

    @property
    def pace(self) -> int:
        """Steps at a tick of the clock."""
        return FAST if self.stage == "moving" and self._hand is not None else 1

    def told(self) -> Json:
        """How the round stands, as JSON values."""
        return {"kind": "round", "mode": self.mode, "stage": self.stage, **self.facts}

    def moment(self) -> Json:
        """What changes from step to step, beside what every game has."""
        return {}

    def steer(self, pointer: Pointer) -> Pointer:
        """What the hand does when the player's pointer is somewhere."""
        return pointer

    def obey(self, message: Mapping[str, Any]) -> None:
        """Do what the player's page asks for.

        Raises:
            OptionError: it cannot be done now.
        """
        raise OptionError("do", f"must be something that can be done in stage {self.stage}", message["do"])

    def looked(self, cm: float) -> None:
        """The headset has looked, after a visit of so many centimetres."""

    def _enter(self, stage: str, **facts: Any) -> None:
        self.stage, self.facts = stage, {**self.facts, **facts}
        self.game.tell(self.told())

    def _start_hand(self, plan: Rearrangement, metres: float = np.inf) -> None:
        """Have a plan carried out, at most so many metres in a step."""
        self._hand = hand_carries(self.game.world, plan.carries, self.game.rest, metres)

    def _next(self) -> Pointer | None:
        """What the adversary's hand does next; None when it is done."""
        return None if self._hand is None else next(self._hand, None)

    def _rest(self) -> Pointer:
        """Where the adversary's hand rests in view, so that the headset does not look yet."""
        return Pointer(*self.game.rest.tolist())


class Showing(Round):
    """Two that look alike change places unasked: what the game is about. Who takes hold begins to play.

    Stages: showing, fooled.
    """

    mode = SHOW

    def __init__(self, game: Game) -> None:
        super().__init__(game)
        plan = exchange_plan(game.world.scene.knowing(game.world.truth), game.world.camera)
        labels = game.world.truth.labels
        self.stage, self.facts = "showing", {"pair": sorted({labels[one.thing] for one in plan.carries})}
        size = game.world.scene.diagonal / float(np.hypot(*TABLE))
        self._start_hand(plan, SHOWN_M_S * size / STEPS_PER_SECOND)

    def steer(self, pointer: Pointer) -> Pointer:
        """See `Round`."""
        if pointer.grip:
            self.game.play_freely()
            return pointer
        return self._next() or Pointer()

    def obey(self, message: Mapping[str, Any]) -> None:
        """See `Round`: "play" at any time."""
        if message["do"] != "play":
            super().obey(message)
        self.game.play_freely()

    def looked(self, cm: float) -> None:
        """See `Round`."""
        self._enter("fooled", cm=cm)


class Guessing(Round):
    """An adversary rearranges the table unseen; the player says what is which before the headset does.

    Stages: study, moving, guess, leaving, answered; of a duel then turn and scored, in which the player
    rearranges the same table, and wrong labels for a centimetre are compared.
    """

    mode = GUESS

    def __init__(self, game: Game) -> None:
        super().__init__(game)
        self.stage = "study"
        self._guess: dict[int, str] = {}
        self._plan = self._planning()

    @property
    def unseen(self) -> bool:
        """See `Round`."""
        return self.stage == "moving"

    @property
    def secret(self) -> bool:
        """See `Round`."""
        return self.stage in ("moving", "guess", "leaving")

    def steer(self, pointer: Pointer) -> Pointer:
        """See `Round`."""
        if self.stage == "moving" and self._hand is None and self._plan.done():
            if (problem := self._plan.exception()) is not None:
                self._give_up(problem)
                return Pointer()
            self.facts["by"] = self._plan.result().by
            self._start_hand(self._plan.result())
        elif self.stage == "moving" and self._hand is not None:
            if (further := self._next()) is not None:
                return further
            handles = self.game.handles
            handles.draw()  # who has watched the old ones knows no more than who has not
            self._enter("guess", in_view=handles.handle_of[self._in_view()].tolist())
        if self.stage == "guess":
            return self._rest()
        return pointer if self.stage == "turn" else Pointer()

    def obey(self, message: Mapping[str, Any]) -> None:
        """See `Round`: "rearrange" in study, "guess" with labels in guess, "turn" in answered of a duel."""
        asked = message["do"]
        if (asked, self.stage) == ("rearrange", "study"):
            self._enter("moving")
        elif (asked, self.stage) == ("guess", "guess"):
            self._guess = self._read(message.get("labels"))
            self._enter("leaving")
        elif (asked, self.stage, self.mode) == ("turn", "answered", DUEL):
            self.game.restart()
            self._enter("turn")
        else:
            super().obey(message)

    def looked(self, cm: float) -> None:
        """See `Round`."""
        world = self.game.world
        result = {"wrong": world.tracker.belief.wrong_labels, "cm": cm}
        if self.stage == "turn":
            self._enter("scored", player=result)
            return
        names, seen = world.truth.labels, self._in_view()
        yours = sum(self._guess.get(i) == names[i] for i in seen)
        its = _right(world.sightings[-1], names, seen)
        guess = {str(self.game.handles.handle_of[i]): label for i, label in self._guess.items()}
        self._enter("answered", guess=guess, yours=yours, its=its, of=len(seen), adversary=result)

    def _planning(self) -> Future[Rearrangement]:
        game = self.game
        layout, camera = game.world.truth, game.world.camera
        return _PLANNER.submit(adversary_plan, layout, camera, game.reid, game.seed, game.scene)

    def _give_up(self, problem: BaseException) -> None:
        """The adversary could not plan: say so, and let it try again."""
        _LOG.error("the adversary could not plan", exc_info=problem)
        self._plan = self._planning()
        self._enter("study")
        reason = f"The adversary could not plan ({type(problem).__name__}: {problem}). Try again."
        self.game.tell({"kind": "refused", "reason": reason})

    def _in_view(self) -> list[int]:
        """Movable objects that the headset sees, from left to right as it sees them."""
        world = self.game.world
        layout, camera = world.truth, world.camera
        seen = np.flatnonzero(visible(layout, camera) & layout.movable)
        way = layout.position[seen] - camera.position
        bearing = np.arctan2(way[:, 0], way[:, 1])
        return [int(i) for i in seen[np.argsort(bearing, kind="stable")]]

    def _read(self, labels: Any) -> dict[int, str]:
        layout, handle_of = self.game.world.truth, self.game.handles.handle_of
        asked = {str(handle_of[i]): i for i in self._in_view()}
        if not isinstance(labels, dict) or not labels or not labels.keys() <= asked.keys():
            raise OptionError("labels", "must be a label for one object in view or more, by number", labels)
        for given in labels.values():
            if given not in layout.labels:
                raise OptionError("labels", "must be labels of the table", given)
        return {asked[name]: str(given) for name, given in labels.items()}


class Duel(Guessing):
    """Guessing, then the reverse."""

    mode = DUEL


class Tidying(Round):
    """Things are moved out of place; the player puts them back.

    Stages: moving, tidy, tidied after each look of the headset.
    """

    mode = TIDY

    def __init__(self, game: Game) -> None:
        super().__init__(game)
        self.stage, self._home = "moving", game.world.truth
        self._began, self._start_cm, self._taken = 0, 0.0, False
        scene = game.world.scene.knowing(self._home)
        rng = np.random.default_rng(np.random.SeedSequence(game.seed, spawn_key=(1,)))
        self._start_hand(mess_plan(scene, game.world.camera, rng))
        home = np.column_stack([self._home.position, self._home.yaw])
        self.facts = {"home": home.round(4).tolist()}

    def moment(self) -> Json:
        """See `Round`."""
        return {"left_cm": round(self.game.way_cm(self._home), 1)}

    def steer(self, pointer: Pointer) -> Pointer:
        """See `Round`: the hand rests in view until the player takes it."""
        if self.stage == "moving":
            if (further := self._next()) is not None:
                return further
            self.game.forget_effort()
            self._began, self._start_cm = self.game.steps, self.game.way_cm(self._home)
            self._enter("tidy", start_cm=round(self._start_cm, 1))
        self._taken |= not pointer.away
        return pointer if self._taken else self._rest()

    def looked(self, cm: float) -> None:
        """See `Round`."""
        sighting = self.game.world.sightings[-1]
        seen = [int(i) for i in sighting.source if not self._home.fixed[i]]
        left = self.game.way_cm(self._home)
        seconds = (self.game.steps - self._began) / STEPS_PER_SECOND
        self._enter(
            "tidied",
            left_cm=round(left, 1),
            seconds=round(seconds, 1),
            cm=cm,
            right=_right(sighting, self._home.labels, seen),
            of=len(seen),
        )


def _right(sighting: Sighting, names: tuple[str, ...], objects: list[int]) -> int:
    """How many of some objects a snapshot gave their own label."""
    given = dict(zip(sighting.source.tolist(), sighting.identification.labels, strict=True))
    return sum(given.get(i) == names[i] for i in objects)


def new_round(mode: str, game: Game) -> Round:
    """A round of a mode; where no two that look alike can be exchanged to show it, free play."""
    if mode == SHOW:
        with suppress(OptionError):
            return Showing(game)
        mode = FREE
    return {FREE: Round, GUESS: Guessing, DUEL: Duel, TIDY: Tidying}[mode](game)
