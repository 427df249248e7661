"""Two virtual characters, the chairs they sit on, and where they sit after a snapshot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs.delivery import Room
from farm_ar.game_logic.headset import look_at
from farm_ar.geometry import wrap
from farm_ar.reid import REIDENTIFIERS
from farm_ar.scenes import (
    Camera,
    Detector,
    FieldOfView,
    Layout,
    LayoutNoise,
    Scene,
    Snapshot,
    builtin_scene,
    observe_many,
)
from farm_ar.vision.measured_noise import MeasuredNoise, disturbed, measured_noise

CHARACTERS = ("1", "2")
"""The labels of their chairs."""

METHODS = ("naive", "spatial", "likelihood", "adaptive")
"""naive leaves them where they sat."""

MOVED = LayoutNoise.of(0.6, 120.0)
"""What somebody who passes does to every chair: SD of its shift along x and z, metres, and turn."""

SEEN = Detector(occlusion=True, size_sd=0.03)
"""What is detected; the poses have the errors that were measured on pictures (`pose_errors`)."""

EYE, LOOKS_AT, EYE_HEIGHT_M, PITCH = (1.9, 0.35), (1.9, 3.0), 1.6, -0.28
"""Where the viewer stands and looks, metres: nothing hides chairs 1 and 2 before they are moved."""

FIELD_OF_VIEW = FieldOfView.symmetric(float(np.deg2rad(64.7)), 5.0)
"""The HoloLens 2's video camera."""

NEAR_M, NEAR_RAD, ERRORS = 0.02, float(np.deg2rad(3.0)), 4.0
"""One who is no farther from a chair's pose sits on it: 2 cm and 3 degrees, beside 4 SDs of the error."""


@dataclass(frozen=True)
class Seat:
    """Where a character is after a snapshot.

    Args:
        place: x and z of where it sits, metres; None where it stands up and waits.
        yaw: where it looks, radians.
        confidence: that this is its chair; NaN where the method does not say.
    """

    place: tuple[float, float] | None
    yaw: float = 0.0
    confidence: float = float("nan")


@dataclass(frozen=True, eq=False)
class Story:
    """The lab before and after somebody moved the chairs, and the one snapshot taken after it.

    Args:
        room: the room, its chairs where they were last known.
        moved: where they are.
        snapshot: what the headset sees.
        source: (K,) which chair each detection is.
    """

    room: Room
    moved: Layout
    snapshot: Snapshot
    source: IntArray

    @classmethod
    def random(cls, rng: np.random.Generator) -> Story:
        """Chairs moved at random, so that the viewer sees both of the characters'."""
        room = lab()
        while True:
            moved = room.rearranged(MOVED, rng)
            furnished = room.furnished(moved)
            exact = observe_many(furnished, viewer(), SEEN, rng)
            batch = disturbed(exact, len(furnished), pose_errors(), rng)
            assert batch.truth is not None
            truth = batch.truth[0, : batch.count[0]]
            chairs = truth < len(moved)
            whole = batch.snapshot(0)
            seen = replace(whole, detections=whole.detections.at(np.flatnonzero(chairs)))
            story = cls(room, moved, seen, truth[chairs])
            if all(moved.index(label) in story.source for label in CHARACTERS):
                return story

    @property
    def scene(self) -> Scene:
        """What was last known."""
        return self.room.scene


def lab() -> Room:
    """The paper's lab, rebuilt."""
    return Room(builtin_scene("lab"))


@lru_cache(maxsize=1)
def pose_errors() -> MeasuredNoise:
    """Errors measured on pictures of the farm, of chairs at the distance at which they look as large."""
    return measured_noise().for_sizes(lab().scene.layout.size)


def viewer() -> Camera:
    """The headset of the person who watches the story."""
    level = look_at(np.array(EYE), np.array(LOOKS_AT), FIELD_OF_VIEW, EYE_HEIGHT_M)
    return replace(level, pitch=np.array(PITCH))


def seats_of(story: Story, method: str, least: float = 0.0) -> tuple[Seat, ...]:
    """Where the characters are after the snapshot.

    Args:
        story: the lab and the snapshot.
        method: one of `METHODS`, or the name of any re-identifier.
        least: confidence below which a character stands up and waits.
    """
    known = story.scene.layout
    if method == "naive":
        rows = [known.index(label) for label in CHARACTERS]
        return tuple(Seat((known.position[i, 0], known.position[i, 1]), float(known.yaw[i])) for i in rows)
    answer = REIDENTIFIERS[method](story.scene).identify(story.snapshot)
    seen = story.snapshot.detections
    seats = []
    for label in CHARACTERS:
        k = answer.labels.index(label) if label in answer.labels else None
        sure = float("nan") if k is None else float(answer.confidence[k])
        if k is None or (least > 0 and not sure >= least):
            seats.append(Seat(None, confidence=sure))
        else:
            x, z = seen.position[k].tolist()
            seats.append(Seat((x, z), float(seen.yaw[k]), sure))
    return tuple(seats)


def outcome_of(story: Story, seats: tuple[Seat, ...]) -> list[str]:
    """Of each character: "own", "other" (it sits on another chair), "air" or "waits"."""
    said = []
    for label, seat in zip(CHARACTERS, seats, strict=True):
        if seat.place is None:
            said.append("waits")
            continue
        away: FloatArray = np.linalg.norm(story.moved.position - seat.place, axis=1)
        nearest = int(away.argmin())
        turn = float(np.abs(wrap(story.moved.yaw[nearest] - seat.yaw)))
        own = story.moved.labels[nearest] == label
        metres, radians = pose_errors().sd(float(np.linalg.norm(story.moved.position[nearest] - EYE)))
        on_it = away[nearest] <= NEAR_M + ERRORS * metres and turn <= NEAR_RAD + ERRORS * radians
        said.append("air" if not on_it else "own" if own else "other")
    return said
