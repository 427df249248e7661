"""Recording a script, frame by frame, with the identification of every snapshot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from farm_ar.drawing.game.frames import GameFrames
from farm_ar.game_logic.belief import Sighting
from farm_ar.game_logic.counters import label_text
from farm_ar.game_logic.events import EventLayer, Parts, PartsDetector
from farm_ar.game_logic.farm_game import ANIMALS_A_SECOND, HAND_AWAY_S, TICK_S, FarmGame, Phase
from farm_ar.game_logic.headset import HeadMotion, field_of_view, gaze_target, look_at
from farm_ar.game_logic.live import LiveGame, game_class
from farm_ar.game_logic.perception import OraclePerception, Perception
from farm_ar.game_logic.physics.tabletop import Tabletop
from farm_ar.game_logic.render_state import RenderState
from farm_ar.reid import ReidFactory, SpatialReid
from farm_ar.scenes import Camera, Scene
from farm_ar.showcases.script import Script, ScriptedVisit

FPS = 30
HEIGHT = 480
"""Of the frames, pixels."""

TICKS_PER_FRAME = 2
EYE = (0.5, -0.375)
"""Where the player's eyes are, as shares of the table's width and depth."""

PAUSE_S = 1.2
"""How long the result of a snapshot is shown, while the game goes on."""

_CHANGE_S = 1.0
"""How long it takes to change a part."""

_MOVE_S = 1.3
"""How long the hand takes for a move, on average."""

Image = npt.NDArray[np.uint8]
Row = dict[str, Any]


class Pictures(Protocol):
    """What makes the frames."""

    def frame(self, state: RenderState) -> Image:
        """The picture of a state, (H, W, 3) bytes."""


PictureMaker = Callable[[Scene], Pictures]
"""Makes the pictures of one scene."""


def drawn(scene: Scene) -> Pictures:
    """The game as a film shows it: the table from above beside the headset's view."""
    return GameFrames(scene, HEIGHT)


@dataclass
class Film:
    """A recorded film.

    Attributes:
        title: of the script.
        frames: number of frames, 30 a second.
        key_frames: pictures by name: "1-before", "1-hand", "1-after", and so on for each visit.
        detections: a row for each detection of each snapshot.
        counters: a row for each label, after each visit and at the end.
        interrupted: frames in which the animals had to stand still.
        events: a row for each change of a part that was detected.
    """

    title: str
    frames: int = 0
    key_frames: dict[str, Image] = field(default_factory=dict)
    detections: list[Row] = field(default_factory=list)
    counters: list[Row] = field(default_factory=list)
    interrupted: int = 0
    events: list[Row] = field(default_factory=list)

    @property
    def right(self) -> int:
        """Detections that were given their own label."""
        return sum(row["given"] == row["truth"] for row in self.detections)


class ScriptRecorder:
    """Records a script: its frames, one after the other, and the tables of its snapshots and counters.

    Args:
        script: what happens.
        make_reid: makes the re-identifier for the scene as it is believed to be.
        make_pictures: draws the frames; None where only the tables are wanted.
        report: called after each frame with the share of the script that has been played, about, 0 to 1.
        make_perception: makes what takes the snapshots, for the scene; from true poses by default.
        parts: says how the parts of real things stand, where they matter; an oracle by default.

    Attributes:
        film: the film, complete after the last frame.
    """

    def __init__(
        self,
        script: Script,
        make_reid: ReidFactory = SpatialReid,
        make_pictures: PictureMaker | None = drawn,
        report: Callable[[float], None] = lambda share: None,
        make_perception: Callable[[Scene], Perception] = lambda scene: OraclePerception(),
        parts: PartsDetector | None = None,
    ) -> None:
        self.film = Film(script.title)
        self._script, self._report = script, report
        self._pictures = None if make_pictures is None else make_pictures(script.scene)
        self._rng = np.random.default_rng(script.seed)
        self._head, self._seconds, self._ticks = HeadMotion(), 0.0, 0
        self._ready: list[Image] = []
        self._last: Image | None = None
        self._holding: Image | None = None
        self._caption = ""
        self._game: FarmGame = game_class(script.update)(
            script.scene,
            self._camera(),
            self._rng,
            make_reid=make_reid,
            perception=make_perception(script.scene),
            animals_a_second=ANIMALS_A_SECOND if script.gate == "open" else 0.0,
        )
        self._events: EventLayer | None = None
        if script.watches_parts:
            shed = int(np.flatnonzero(script.scene.layout.fixed)[0])
            self._game.open_gates = {shed: float(script.gate == "open")}
            self._events = EventLayer(self._game, parts)

    @property
    def game(self) -> FarmGame:
        """The game, as far as it has been played."""
        return self._game

    @property
    def _share(self) -> float:
        """About which share of the script has been played, 0 to 1; how long the hand takes is a guess."""
        visits = self._script.visits
        seconds = self._script.ending + sum(
            visit.play + _MOVE_S * len(visit.moves) + HAND_AWAY_S + PAUSE_S for visit in visits
        )
        return min(self.film.frames / max(FPS * seconds, 1.0), 1.0)

    def frames(self) -> Iterator[Image]:
        """The frames, (H, W, 3) bytes, 30 a second; none where no pictures are made."""
        for _ in self._scenes():
            yield from self._ready
            self._ready.clear()

    def play(self) -> Film:
        """Play to the end, and let the frames go by."""
        for _ in self.frames():
            pass
        return self.film

    def _scenes(self) -> Iterator[None]:
        """Play a piece at a time, so that no more than its frames are held at once."""
        for number, visit in enumerate(self._script.visits, start=1):
            self._play(visit.play, f"{self._script.title}: the game is on")
            yield
            self._keep(f"{number}-before", self._last)
            yield from self._visit(number, visit)
        self._play(self._script.ending, "The game goes on; only the ends of the paths have moved")
        yield
        self._keep("end", self._last)
        self._count("end")

    def _visit(self, number: int, visit: ScriptedVisit) -> Iterator[None]:
        game, name = self._game, str(number)
        game.begin_visit(self._camera())
        for i, move in enumerate(visit.moves):
            index = game.truth.index(move.building)
            displacement = move.displacement(game.truth)
            self._caption = move.caption
            game.move(index, displacement, move.turn, self._tick)
            if i == len(visit.moves) // 2:
                self._keep(f"{name}-hand", self._holding)
            yield
        for change in visit.changes:
            standing = change.done(Parts(game.open_gates, game.missing), game.truth)
            game.open_gates, game.missing = dict(standing.open_gates), dict(standing.missing)
            self._wait(_CHANGE_S, change.caption)
            yield
        self._wait(HAND_AWAY_S, "The hand is out of view: one snapshot is taken")
        self._detect(number)
        sighting = game.end_visit(game.camera)
        self._note(number, sighting)
        seen = [row for row in self.film.detections if row["visit"] == number]
        right = sum(row["given"] == row["truth"] for row in seen)
        self._play(PAUSE_S, f"Snapshot {name}: {right} of {len(seen)} detections given their own label")
        yield
        self._keep(f"{name}-after", self._last)
        self._count(name)

    def _detect(self, visit: int) -> None:
        """Look how the parts of real things stand; what has changed has its effect."""
        for event in [] if self._events is None else self._events.look():
            label = self._game.truth.labels[event.index]
            self.film.events.append({"visit": visit, "event": event.kind, "of": label})

    def _play(self, seconds: float, caption: str) -> None:
        for _ in range(round(seconds * FPS)):
            self._game.play(1 / FPS)
            self._frame(caption)

    def _wait(self, seconds: float, caption: str) -> None:
        for _ in range(round(seconds * FPS)):
            if isinstance(self._game, LiveGame):
                self._game.wait(TICKS_PER_FRAME)
            self._frame(caption)

    def _tick(self, table: Tabletop) -> None:
        self._ticks += 1
        if self._ticks % TICKS_PER_FRAME == 0:
            self._frame(self._caption)
            hand = table.hand
            if hand is not None and hand.gripped is not None:
                self._holding = self._last

    def _frame(self, caption: str) -> None:
        self._seconds += TICKS_PER_FRAME * TICK_S
        self._head.step(TICKS_PER_FRAME * TICK_S, self._rng)
        self._game.camera = self._camera()
        self.film.frames += 1
        self.film.interrupted += self._game.phase is Phase.HAND and not isinstance(self._game, LiveGame)
        if self._pictures is not None:
            self._last = self._pictures.frame(self._game.render_state(caption))
            self._ready.append(self._last)
        self._report(self._share)

    def _camera(self) -> Camera:
        scene = self._script.scene
        eye = np.array(EYE) * scene.size
        target = gaze_target(scene, self._script.gaze, self._seconds)
        return self._head.applied(look_at(eye, target, field_of_view(self._script.fov)))

    def _keep(self, name: str, image: Image | None) -> None:
        if image is not None:
            self.film.key_frames[name] = image

    def _note(self, number: int, sighting: Sighting) -> None:
        seen, answer = sighting.snapshot.detections, sighting.identification
        labels = self._game.truth.labels
        for k, source in enumerate(sighting.source.tolist()):
            cost = float(answer.cost[k])
            self.film.detections.append(
                {
                    "visit": number,
                    "detection": seen.ids[k],
                    "category": seen.category[k],
                    "x": round(float(seen.position[k, 0]), 4),
                    "z": round(float(seen.position[k, 1]), 4),
                    "yaw_deg": round(float(np.rad2deg(seen.yaw[k])), 1),
                    "given": answer.labels[k],
                    "truth": labels[source] if source >= 0 else None,
                    "cost": round(cost, 4) if np.isfinite(cost) else None,
                }
            )

    def _count(self, when: str) -> None:
        layout, counters = self._game.truth, self._game.counters
        for i in np.flatnonzero(layout.movable):
            counted = int(counters.counted[i])
            self.film.counters.append(
                {
                    "after": when,
                    "label": label_text(layout.labels[i], layout.category[i], counted),
                    "counted": counted,
                    "misplaced": int(counters.misplaced[i]),
                    "stranded": int(counters.stranded[i]),
                }
            )


_NOTHING: Image = np.zeros((1, 1, 3), np.uint8)


class _Last:
    """In place of pictures: the last state."""

    state: RenderState

    def frame(self, state: RenderState) -> Image:
        self.state = state
        return _NOTHING


def outcome(
    script: Script, make_reid: ReidFactory = SpatialReid, to_the_end: bool = False
) -> tuple[Film, RenderState]:
    """Play a script and draw nothing.

    Args:
        script: what happens.
        make_reid: makes the re-identifier for the scene as it is believed to be.
        to_the_end: whether the play after the last visit is played too, and not one frame of it only.

    Returns:
        What was noted, and the last state.
    """
    last = _Last()
    ending = script.ending if to_the_end else 1 / FPS
    film = ScriptRecorder(replace(script, ending=ending), make_reid, lambda scene: last).play()
    return film, last.state
