"""What pages receive of the game, as JSON values: metres and radians, rounded to what can be seen."""

from __future__ import annotations

from typing import Any

import numpy as np

from farm_ar.game_logic.belief import Sighting
from farm_ar.game_logic.render_state import RenderState
from farm_ar.scenes import Layout, Scene

Json = dict[str, Any]

FRAMES_PER_SECOND = 10
"""Of a recording; the page fills in what is between."""


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


def told_moment(moment: RenderState) -> Json:
    """What may change from one moment to the next."""
    camera, hand = moment.camera, moment.hand
    animals = np.column_stack([moment.animal, moment.animal_heading, moment.animal_goal])
    return {
        "phase": moment.phase,
        "caption": moment.caption,
        "objects": _poses(moment.truth),
        "believed": _poses(moment.believed),
        "wrong": np.flatnonzero(moment.wrong).tolist(),
        "counts": [] if moment.counts is None else moment.counts.tolist(),
        "misplaced": [] if moment.misplaced is None else moment.misplaced.tolist(),
        "hand": None
        if hand is None
        else [*hand.position.round(4).tolist(), round(hand.yaw, 4), hand.gripped],
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


def told_answers(sighting: Sighting, names: tuple[str, ...], number: int) -> Json:
    """What a snapshot said.

    Args:
        sighting: the snapshot and its identification.
        names: of the objects.
        number: of the snapshot in the game, from 1.
    """
    found = sighting.identification
    return {
        "kind": "snapshot",
        "number": number,
        "accuracy": sighting.accuracy,
        "detections": [
            {
                "object": int(source),
                "label": label,
                "confidence": None if not np.isfinite(sure) else round(float(sure), 3),
                "right": label == (None if source < 0 else names[source]),
            }
            for source, label, sure in zip(sighting.source, found.labels, found.confidence, strict=True)
        ],
    }


def _poses(layout: Layout) -> list[list[float]]:
    poses: list[list[float]] = np.column_stack([layout.position, layout.yaw]).round(4).tolist()
    return poses
