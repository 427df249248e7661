"""What is said of scenes and identifications: in words, in values for programs, and in pictures."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.cli.options import writing
from farm_ar.drawing import draw_identification, draw_scene, new_picture, save_picture
from farm_ar.drawing.pictures import in_picture
from farm_ar.drawing.scenes import MOST_LABELS
from farm_ar.reid import Alignment, Assurance, Certificate, Identification, Reidentifier
from farm_ar.scenes import BUILTIN, Camera, Scene, Snapshot, World, builtin_scene
from farm_ar.scenes.builtin import DESCRIPTIONS
from farm_ar.scenes.files import degrees
from farm_ar.scenes.worlds import DECIMALS

MOST_ASSURED = 1000
"""Detections of which margins are worked out."""

SCENE_COLUMNS = ("name", "what it is", "room", "area", "sites", "categories", "objects", "path")
SCENE_NUMBERS = ("room", "area", "sites", "categories", "objects", "path")

_OPTIONS = {
    "use frame='unknown'": "use --frame unknown",
    "anchor=... takes": "--anchor takes",
    "or convert with farm_ar.geometry.convert_pose": "as fields of the two files",
}
"""What warnings say to those who write Python, and to those who type the command."""


class Columns(NamedTuple):
    """The names of a table's columns, and which of them hold numbers."""

    names: tuple[str, ...]
    numbers: tuple[str, ...]


def detection_columns(world: World) -> Columns:
    """The columns of `detection_rows`, whose places are in the axes and units of a world."""
    unit = "" if world.units == "m" else f" ({world.units})"
    places = tuple(f"{'xyz'[axis]}{unit}" for axis in world.plane)
    numbers = (*places, "yaw_deg", "cost", "confidence", "margin")
    names = (
        "detection",
        "category",
        *places,
        "yaw_deg",
        "label",
        "cost",
        "confidence",
        "margin",
        "runner_up",
    )
    return Columns(names, numbers)


def in_options(warning: str) -> str:
    """A warning that names options of the command in place of arguments in Python."""
    for python, option in _OPTIONS.items():
        warning = warning.replace(python, option)
    return warning


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
    """A row of `detection_columns` for each detection."""
    seen, world = snapshot.detections, snapshot.world
    places, yaws, form = world.floor_of(seen.position), world.yaws_of(seen.yaw), f"z.{DECIMALS[world.units]}f"
    for i, label in enumerate(found.labels):
        first, second = places[i]
        yaw_deg = np.rad2deg(yaws[i])
        yield (
            seen.ids[i],
            seen.category[i] or "not known",
            _known(first, form),
            _known(second, form),
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
        yield f"Certified: right if every object moved less than {_limits(found.certified, snapshot.world)}"
    if found.widened:
        yield "Widened: the threshold left fewer labels than detections, so further sites were added"


def _limits(certified: Certificate, world: World) -> str:
    shift, turn = world.length(certified.metres), f"{certified.degrees:.0f}°"
    if not np.isfinite(certified.metres):
        return turn
    return shift if certified.degrees >= 180 else f"{shift}, or turned less than {turn}, or in between"


def as_values(snapshot: Snapshot, found: Identification) -> dict[str, Any]:
    """An identification as JSON values; null where a detection stays unidentified.

    What warnings and explanations say of places and lengths is in the frame and units of `world`.
    """
    return {
        "world": _world(snapshot.world),
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
        "warnings": [in_options(warning) for warning in found.warnings],
    }


def _world(world: World) -> dict[str, str]:
    return {"frame": world.frame, "units": world.units}


def frame_values(scene: Scene, alignment: Alignment) -> dict[str, Any]:
    """A frame that was found as JSON values: the pose of its origin in the map's file, and its probability.

    The origin is that of farm-ar's axes, where the snapshot's file gives its own an `origin`.
    """
    start, world = alignment.motion.about(np.zeros(2)), scene.world
    place = world.floor_of(start.shift).tolist()
    pose = {"xyz"[axis]: value for axis, value in zip(world.plane, place, strict=True)}
    pose["yaw_deg"] = degrees(world.yaws_of(start.turn))
    sure = {"confidence": alignment.confidence, "ambiguous": alignment.ambiguous}
    return {"frame": {**pose, **sure, "reason": alignment.reason or None, "world": _world(world)}}


def frame_line(scene: Scene, alignment: Alignment) -> str:
    """The same in a line."""
    of, world = frame_values(scene, alignment)["frame"], scene.world
    unit = "" if world.units == "m" else f" {world.units}"
    first, second = (f"{of['xyz'[axis]]:z.{DECIMALS[world.units]}f}" for axis in world.plane)
    where = f"its origin at ({first}, {second}){unit}, turned by {of['yaw_deg']:z.1f}°"
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
