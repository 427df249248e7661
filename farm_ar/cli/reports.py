"""What is said of scenes and identifications: in words, in values for programs, and in pictures."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.cli.options import writing
from farm_ar.drawing import draw_identification, draw_scene, new_picture, save_picture
from farm_ar.drawing.pictures import in_picture
from farm_ar.drawing.scenes import MOST_LABELS
from farm_ar.reid import Alignment, Assurance, Certificate, Identification, Reidentifier
from farm_ar.scenes import BUILTIN, Camera, Scene, Snapshot, builtin_scene
from farm_ar.scenes.builtin import DESCRIPTIONS
from farm_ar.scenes.files import degrees

MOST_ASSURED = 1000
"""Detections of which margins are worked out."""

SCENE_COLUMNS = ("name", "what it is", "room", "area", "sites", "categories", "objects", "path")
SCENE_NUMBERS = ("room", "area", "sites", "categories", "objects", "path")

DETECTION_COLUMNS = (
    *("detection", "category", "x", "z", "yaw_deg", "label"),
    *("cost", "confidence", "margin", "runner_up"),
)
DETECTION_NUMBERS = ("x", "z", "yaw_deg", "cost", "confidence", "margin")


def scene_rows() -> Iterator[tuple[str, ...]]:
    """A row of `SCENE_COLUMNS` for each built-in scene."""
    for name in BUILTIN:
        scene = builtin_scene(name)
        yield (
            name,
            re.split("[:,.]| with ", DESCRIPTIONS[name])[0],  # the counts beside it say the rest
            _room(scene),
            f"{scene.area:.4g} m²",
            str(len(scene.sites)),
            str(len(scene.layout.categories)),
            str(len(scene.layout)),
            "none" if scene.camera_path is None else f"{scene.camera_path.length:.1f} m",
        )


def describe(scene: Scene) -> str:
    """A scene in a few words: how large it is and what is in it."""
    objects = f"{_count(len(scene.layout), 'object')} of {_count(len(scene.layout.categories), 'category')}"
    if not scene.layout.names_categories:
        objects = f"{_count(len(scene.layout), 'object')} without categories"
    path = "no camera path"
    if scene.camera_path is not None:
        path = f"a camera path of {scene.camera_path.length:.1f} m"
    return f"{_room(scene)}, {objects}, {_count(len(scene.sites), 'site')}, {path}"


def left_out(scene: Scene) -> Iterator[str]:
    """What a picture of a scene does not show, a line each."""
    layout = scene.layout
    strays = np.flatnonzero(~in_picture(layout.position, scene))
    if len(strays):
        places = zip(layout.labels, layout.position.tolist(), strict=True)
        named = [f"{label} ({x:g}, {z:g})" for label, (x, z) in places]
        yield f"Note: too far away for the picture: {some([named[i] for i in strays])}"
    if len(layout) > MOST_LABELS:
        yield f"Note: {len(layout)} labels are too many for the picture, which names none"


def detection_rows(snapshot: Snapshot, found: Identification) -> Iterator[tuple[str, ...]]:
    """A row of `DETECTION_COLUMNS` for each detection."""
    seen = snapshot.detections
    for i, label in enumerate(found.labels):
        x, z = seen.position[i]
        yaw_deg = np.rad2deg(seen.yaw[i])
        yield (
            seen.ids[i],
            seen.category[i] or "not known",
            _known(x, "z.2f"),
            _known(z, "z.2f"),
            _known(yaw_deg, "z.1f"),
            "none" if label is None else label,
            "none" if label is None else f"{found.cost[i]:.4f}",
            _known(found.confidence[i], ".3f"),
            _known(found.margin[i], ".4f"),
            found.runner_up[i] or "none",
        )


class Affordable(Reidentifier):
    """A method that leaves out what takes the cube of the number of detections where they are many."""

    def __init__(self, reid: Reidentifier, scene: Scene) -> None:
        self.reid, self.scene = reid, scene

    def identify(self, snapshot: Snapshot) -> Identification:
        """The answer of the method."""
        found = self.reid.identify(snapshot)
        if len(found.labels) <= MOST_ASSURED or not callable(found.assurance):
            return found
        warning = f"margins and certificate are not worked out of more than {MOST_ASSURED} detections"
        return replace(found, assurance=Assurance(warnings=(warning,)))


def summarise(scene: Scene, snapshot: Snapshot, found: Identification) -> Iterator[str]:
    """What the table of detections leaves out, a line each."""
    number = sum(label is not None for label in found.labels)
    yield f"Identified: {number} of {_count(len(found.labels), 'detection')}, total cost {found.total:.4f}"
    considered = f"Candidates: {len(found.candidates)} of {_count(len(scene.layout), 'label')}"
    if not found.sites:
        yield f"{considered}, nothing pruned"
    else:
        near = f"{len(found.sites)} of {_count(len(scene.sites), 'site')} ({', '.join(found.sites)})"
        yield f"{considered}, from {near}"
    for name, reason in zip(snapshot.detections.ids, found.reason, strict=True):
        if reason is not None:
            yield f"No label for {name}: {reason}"
    if found.certified is not None:
        yield f"Certified: right if every object moved less than {_limits(found.certified)}"
    if found.widened:
        yield "Widened: the threshold left fewer labels than detections, so further sites were added"


def _limits(certified: Certificate) -> str:
    shift, turn = f"{certified.metres:.2f} m", f"{certified.degrees:.0f}°"
    if not np.isfinite(certified.metres):
        return turn
    return shift if certified.degrees >= 180 else f"{shift}, or turned less than {turn}, or in between"


def as_values(snapshot: Snapshot, found: Identification) -> dict[str, Any]:
    """An identification as JSON values; null where a detection stays unidentified."""
    return {
        "ids": list(snapshot.detections.ids),
        "labels": list(found.labels),
        "reasons": list(found.reason),
        "costs": _values(found.cost),
        "confidence": _values(found.confidence),
        "margins": _values(found.margin),
        "runners_up": list(found.runner_up),
        "certified": None if found.certified is None else _certificate(found.certified),
        "total": found.total,
        "candidates": list(found.candidates),
        "sites": list(found.sites),
        "widened": bool(found.widened),
        "solve_time_s": float(found.solve_time),
        "warnings": list(found.warnings),
    }


def frame_values(alignment: Alignment) -> dict[str, Any]:
    """A frame that was found as JSON values: the pose of its origin in the map, and how sure that is."""
    start = alignment.motion.about(np.zeros(2))
    x, z = start.shift.tolist()
    pose = {"x": x, "z": z, "yaw_deg": degrees(start.turn)}
    sure = {"confidence": alignment.confidence, "ambiguous": alignment.ambiguous}
    return {"frame": {**pose, **sure, "reason": alignment.reason or None}}


def frame_line(alignment: Alignment) -> str:
    """The same in a line."""
    of = frame_values(alignment)["frame"]
    where = f"its origin at ({of['x']:z.2f}, {of['z']:z.2f}), turned by {of['yaw_deg']:z.1f}°"
    return f"Frame: {where}, with a probability of {of['confidence']:.3f}; poses here are the map's"


def _certificate(certified: Certificate) -> dict[str, Any]:
    metres = certified.metres if np.isfinite(certified.metres) else None
    return {"radius": certified.radius, "metres": metres, "degrees": certified.degrees}


def _known(value: float, form: str) -> str:
    """A number, or a dash where it is not known."""
    return "-" if np.isnan(value) else f"{value:{form}}"


def _values(numbers: FloatArray) -> list[float | None]:
    """Numbers for JSON: null where not known or infinite."""
    return [value if np.isfinite(value) else None for value in numbers.tolist()]


def _room(scene: Scene) -> str:
    if scene.room is not None:
        return f"{scene.room[0]:g}x{scene.room[1]:g} m"
    if scene.bounds is None:
        return "no bounds"
    return f"bounds of {len(scene.bounds.corners)} corners, {scene.area:.4g} m²"


def some(names: list[str], most: int = 20) -> str:
    """Names with commas between them, the first of many."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def _count(number: int, noun: str) -> str:
    plural = f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"
    return f"{number} {noun if number == 1 else plural}"


def picture_of_scene(scene: Scene, camera: Camera | None, path: Path) -> None:
    """Draw a scene, and a camera in it if there is one.

    Raises:
        OptionError: the file cannot be written.
    """
    figure, axes = new_picture(scene)
    draw_scene(axes, scene, camera=camera)
    with writing("--out", path):
        save_picture(figure, path)


def picture_of_identification(
    scene: Scene,
    snapshot: Snapshot,
    found: Identification,
    path: Path,
    truth: Sequence[str | None] | None = None,
) -> None:
    """Draw which detection is which label, and which it really is where that is known.

    Raises:
        OptionError: the file cannot be written.
    """
    figure, axes = new_picture(scene)
    draw_identification(axes, scene, snapshot, found, truth)
    with writing("--plot", path):
        save_picture(figure, path)
