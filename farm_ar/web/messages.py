"""Messages to pages about the game, as JSON values: metres and radians, rounded to what can be seen."""

from __future__ import annotations

from typing import Any

import numpy as np

from farm_ar.game_logic.belief import NOBODY, Sighting
from farm_ar.game_logic.render_state import RenderState
from farm_ar.scenes import Layout, Scene

Json = dict[str, Any]

FRAMES_PER_SECOND = 10
"""Of a recording; the page fills in what is between."""


class Handles:
    """What pages call the N objects: numbers from 0 that say nothing of labels, drawn by chance.

    They change within what looks alike: category and size of a number are those of its label and object.

    Args:
        layout: of the objects.
        rng: that draws.

    Attributes:
        object_of: (N,) the object of each handle.
        handle_of: (N,) the handle of each object.
    """

    def __init__(self, layout: Layout, rng: np.random.Generator) -> None:
        looks = [
            (layout.category[i], layout.size[i].tobytes(), bool(layout.fixed[i])) for i in range(len(layout))
        ]
        self._alike = [np.flatnonzero([one == look for one in looks]) for look in dict.fromkeys(looks)]
        self._rng, self.object_of = rng, np.arange(len(layout))
        self.draw()

    def draw(self) -> None:
        """Other handles from now on."""
        for alike in self._alike:
            self.object_of[alike] = self._rng.permutation(alike)
        self.handle_of = np.argsort(self.object_of)


def told_scene(scene: Scene) -> Json:
    """What does not change: the table and what stands on it."""
    layout = scene.layout
    return {
        "width": scene.size[0],
        "depth": scene.size[1],
        "objects": [
            {
                "label": layout.labels[i],
                "category": layout.category[i],
                "size": layout.size[i].tolist(),
                "fixed": bool(layout.fixed[i]),
            }
            for i in range(len(layout))
        ],
    }


def told_moment(moment: RenderState, handles: Handles | None = None) -> Json:
    """What may change from one moment to the next; with handles, without what is really what."""
    camera, hand = moment.camera, moment.hand
    animals = np.column_stack([moment.animal, moment.animal_heading, moment.animal_goal])
    return {
        "phase": moment.phase,
        "caption": moment.caption,
        "objects": _poses(moment.truth, handles),
        "believed": _poses(moment.believed),
        "wrong": [] if handles else np.flatnonzero(moment.wrong).tolist(),
        "arrived": 0 if moment.counts is None else int(moment.counts.sum()),
        "astray": 0 if moment.misplaced is None else int(moment.misplaced.sum()),
        "hand": None
        if hand is None
        else [*hand.position.round(4).tolist(), round(hand.yaw, 4), _told(hand.gripped, handles)],
        "animals": animals.round(3).tolist(),
        "camera": {
            "x": round(float(camera.position[0]), 4),
            "z": round(float(camera.position[1]), 4),
            "height": round(float(camera.height or 0.0), 4),
            "yaw": round(float(camera.yaw), 4),
            "pitch": round(float(camera.pitch), 4),
            "left": round(camera.fov.left, 4),
            "right": round(camera.fov.right, 4),
            "range": camera.fov.range_m,
        },
    }


def told_answers(
    sighting: Sighting, names: tuple[str, ...], number: int, handles: Handles | None = None
) -> Json:
    """What a snapshot said.

    Args:
        sighting: the snapshot and its identification.
        names: of the objects.
        number: of the snapshot in the game, from 1.
        handles: of the objects; with them the answer does not say what is right.
    """
    found = sighting.identification
    detections = [
        {
            "object": _told(int(source), handles),
            "label": label,
            "confidence": None if not np.isfinite(sure) else round(float(sure), 3),
        }
        for source, label, sure in zip(sighting.source, found.labels, found.confidence, strict=True)
    ]
    if handles is None:
        for one, true in zip(detections, true_labels(sighting, names), strict=True):
            one["right"] = one["label"] == true
    return {"kind": "snapshot", "number": number, "detections": detections}


def true_labels(sighting: Sighting, names: tuple[str, ...]) -> list[str | None]:
    """What each detection of a snapshot really is; None for one of nothing."""
    return [None if source == NOBODY else names[source] for source in sighting.source]


def _told(index: int | None, handles: Handles | None) -> int | None:
    return index if index is None or index == NOBODY or handles is None else int(handles.handle_of[index])


def _poses(layout: Layout, handles: Handles | None = None) -> list[list[float]]:
    poses = np.column_stack([layout.position, layout.yaw]).round(4)
    told: list[list[float]] = (poses if handles is None else poses[handles.object_of]).tolist()
    return told
