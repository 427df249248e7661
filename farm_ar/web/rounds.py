"""What is played: freely, guessing first, against an adversary, or tidying up."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np

from farm_ar.errors import OptionError
from farm_ar.scenes import visible
from farm_ar.web.adversary import Rearrangement, adversary_plan, hand_carries, mess_plan
from farm_ar.web.pointer import STEPS_PER_SECOND, Pointer
from farm_ar.web.telling import Json

if TYPE_CHECKING:
    from farm_ar.web.game import Game

FREE, GUESS, DUEL, TIDY = "free", "guess", "duel", "tidy"

MODES = (FREE, GUESS, DUEL, TIDY)
"""What can be played."""

FAST = 10
"""Steps at once while an adversary rearranges the table."""

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

    def looked(self, news: Json) -> None:
        """The headset has looked."""

    def _enter(self, stage: str, **facts: Any) -> None:
        self.stage, self.facts = stage, {**self.facts, **facts}
        self.game.tell_round()

    def _start_hand(self, plan: Rearrangement) -> None:
        self._hand = hand_carries(self.game.world, plan.carries, self.game.rest)

    def _next(self) -> Pointer | None:
        """What the adversary's hand does next; None when it is done."""
        return None if self._hand is None else next(self._hand, None)

    def _rest(self) -> Pointer:
        """Where the adversary's hand rests in view, so that the headset does not look yet."""
        return Pointer(*self.game.rest.tolist())


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
        self._plan: Future[Rearrangement] = _PLANNER.submit(
            adversary_plan, game.world.truth, game.world.camera, game.reid, game.seed
        )

    def steer(self, pointer: Pointer) -> Pointer:
        """See `Round`."""
        if self.stage == "moving" and self._hand is None and self._plan.done():
            self.facts["by"] = self._plan.result().by
            self._start_hand(self._plan.result())
        elif self.stage == "moving" and self._hand is not None:
            if (further := self._next()) is not None:
                return further
            self._enter("guess", in_view=self._in_view())
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

    def looked(self, news: Json) -> None:
        """See `Round`."""
        if self.stage == "turn":
            mine = {"wrong": news["wrong_labels"], "cm": news["visit_cm"]}
            self._enter("scored", player=mine)
            return
        names = self.game.world.truth.labels
        seen = [one for one in news["detections"] if one["object"] in self._in_view()]
        yours = sum(self._guess.get(one["object"]) == names[one["object"]] for one in seen)
        its = sum(one["right"] for one in seen)
        adversary = {"wrong": news["wrong_labels"], "cm": news["visit_cm"]}
        guess = {str(i): label for i, label in self._guess.items()}
        self._enter("answered", guess=guess, yours=yours, its=its, of=len(seen), adversary=adversary)

    def _in_view(self) -> list[int]:
        """Movable objects that the headset sees, from left to right as it sees them."""
        world = self.game.world
        layout, camera = world.truth, world.camera
        seen = np.flatnonzero(visible(layout, camera) & layout.movable)
        way = layout.position[seen] - camera.position
        bearing = np.arctan2(way[:, 0], way[:, 1])
        return [int(i) for i in seen[np.argsort(bearing, kind="stable")]]

    def _read(self, labels: Any) -> dict[int, str]:
        layout = self.game.world.truth
        asked = {str(i): i for i in self._in_view()}
        if not isinstance(labels, dict) or not labels.keys() <= asked.keys():
            raise OptionError("labels", "must be a label for objects in view, by number", labels)
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

    def looked(self, news: Json) -> None:
        """See `Round`."""
        seen = [one for one in news["detections"] if not self._home.fixed[one["object"]]]
        left = self.game.way_cm(self._home)
        seconds = (self.game.steps - self._began) / STEPS_PER_SECOND
        self._enter(
            "tidied",
            left_cm=round(left, 1),
            seconds=round(seconds, 1),
            cm=news["visit_cm"],
            right=sum(one["right"] for one in seen),
            of=len(seen),
        )


def new_round(mode: str, game: Game) -> Round:
    """A round of a mode."""
    return {FREE: Round, GUESS: Guessing, DUEL: Duel, TIDY: Tidying}[mode](game)
