"""Tracks of others, from MOT-challenge text or tables of any columns, as pairs of looks some frames apart."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from farm_ar.arrays import ANGLE, POSITION, FloatArray, IntArray, number_in
from farm_ar.benchmark.suite import SuiteRow, row_of
from farm_ar.benchmark.worlds.base import Example, towards
from farm_ar.errors import OptionError
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot
from farm_ar.scenes.files import read_text

COLUMNS = ("frame", "id", "x", "z", "heading", "category")
"""What a column can be; the last two need not be there. Headings are degrees, clockwise from +z."""

MOT_COLUMNS = (9, 10)
"""Columns of a line of MOT-challenge text: with class and visibility, or with a place in the world."""

USUAL_NAMES = ("gt", "det", "obsmat", "tracks", "annotations")
"""Names of files that say nothing; the folder's name says more."""

_NAMES: dict[str, tuple[str, ...]] = {
    "frame": ("frame", "frame_id", "time", "t", "timestamp"),
    "id": ("id", "track_id", "object_id", "agent_id", "pedestrian_id"),
    "x": ("x", "pos_x"),
    "z": ("z", "y", "pos_z", "pos_y"),
    "heading": ("heading", "heading_deg", "yaw_deg"),
    "category": ("category", "type", "class", "label"),
}
"""Names of columns that are understood by default."""


@dataclass(frozen=True, eq=False)
class Tracks:
    """Where objects were seen: R sightings, ordered by frame.

    Args:
        name: of the file.
        frame: (R,) frame number or time of each.
        identity: R names of the objects.
        position: (R, 2) as (x, z).
        yaw: (R,) radians, NaN where not known.
        category: R categories.
    """

    name: str
    frame: FloatArray
    identity: tuple[str, ...]
    position: FloatArray
    yaw: FloatArray
    category: tuple[str, ...]


def read_tracks(path: str | os.PathLike[str], form: str, columns: Mapping[str, str] | None = None) -> Tracks:
    """Tracks from a file.

    Args:
        path: the file, in UTF-8.
        form: "mot" or "table".
        columns: of a table, the name of each column, or its number from 1 where it has no header.

    Raises:
        OptionError: the file is not of the form; names the line.
    """
    if form == "mot":
        return _mot(path)
    return _table(path, columns or {})


def pairs_of(
    tracks: Tracks, gap: float, every: float, most: int, heading: Literal["given", "motion"]
) -> SuiteRow:
    """Pairs of looks: what is seen in one frame is known, what is seen `gap` later is to be identified.

    Who came in between has no label. Sizes are not known. The camera sees everything.

    Args:
        tracks: the sightings.
        gap: between the two looks, in the unit of the frames.
        every: at least between the first looks of two pairs, likewise.
        most: pairs; the first ones, if there are more.
        heading: "motion" for that from the sighting before, where there is one.

    Raises:
        OptionError: there is no pair of frames so far apart.
    """
    yaw = _headings(tracks) if heading == "motion" else tracks.yaw
    frames, start = np.unique(tracks.frame, return_index=True)
    stop = np.append(start[1:], len(tracks.frame))
    number = {round(float(frame), 6): k for k, frame in enumerate(frames)}
    low, high = tracks.position.min(axis=0), tracks.position.max(axis=0)
    reach = float(np.hypot(*(high - low))) / 2
    camera = Camera((low + high) / 2, np.array(0.0), FieldOfView(np.pi, np.pi, max(1.1 * reach, 1e-3)))
    rng = np.random.default_rng(0)
    examples: list[Example] = []
    last = -np.inf
    for k, frame in enumerate(frames.tolist()):
        later = number.get(round(frame + gap, 6))
        if later is None or frame < last + every - 1e-9 or len(examples) == most:
            continue
        known, now = (np.arange(start[i], stop[i]) for i in (k, later))
        if len(known) > 1:
            examples.append(_pair(tracks, yaw, camera, known, rng.permutation(now)))
            last = frame
    if not examples:
        expected = f"must be a distance between two frames of {tracks.name} with two objects in the first"
        raise OptionError("--gap", expected, gap)
    about = f"tracks of {tracks.name}, {gap:g} frames between looks"
    return row_of(f"{tracks.name}-{gap:g}", about, True, examples)


def _pair(tracks: Tracks, yaw: FloatArray, camera: Camera, known: IntArray, now: IntArray) -> Example:
    """One pair of looks, from the indices of the sightings."""
    names = tuple(tracks.identity[i] for i in known)
    layout = Layout(
        names,
        tuple(tracks.category[i] for i in known),
        tracks.position[known],
        yaw[known],
        np.full((len(known), 3), np.nan),
    )
    detections = Detections(
        tuple(tracks.category[i] for i in now), tracks.position[now], yaw[now], np.full((len(now), 3), np.nan)
    )
    there = set(names)
    truth = tuple(tracks.identity[i] if tracks.identity[i] in there else None for i in now)
    return Example(Scene(tracks.name, layout=layout), Snapshot(camera, detections), truth)


def _headings(tracks: Tracks) -> FloatArray:
    """(R,) directions from each sighting before to this one; NaN for the first, and where nothing moved."""
    yaw = np.full(len(tracks.frame), np.nan)
    before: dict[str, int] = {}
    for i, name in enumerate(tracks.identity):
        if name in before:
            step = tracks.position[i] - tracks.position[before[name]]
            if step.any():
                yaw[i] = towards(step)
        before[name] = i
    return yaw


def _mot(path: str | os.PathLike[str]) -> Tracks:
    """Tracks of MOT-challenge text: feet of boxes, or places in the world where all lines have one.

    Lines whose seventh column is 0 are to be ignored. In pixels z is upwards, so minus the row.
    """
    rows = []
    for line, cells in _lines(path, ","):
        if len(cells) not in MOT_COLUMNS:
            expected = (
                "must be frame, id, left, top, width, height, confidence and x, y, z or class, visibility"
            )
            raise OptionError(f"line {line}", expected, ",".join(cells), Path(path).name)
        values = [_number(cell, line, k, path) for k, cell in enumerate(cells)]
        if values[6] != 0:
            rows.append((line, values))
    world = all(len(values) == 10 and tuple(values[7:]) != (-1, -1, -1) for _, values in rows)
    found = []
    for line, values in rows:
        frame, identity, left, top, width, height = values[:6]
        place = (values[7], values[8]) if world else (left + width / 2, -(top + height))
        category = f"class {values[7]:g}" if len(values) == 9 else "object"
        found.append((line, frame, _name(identity), place, float("nan"), category))
    return _checked(path, found)


def _table(path: str | os.PathLike[str], columns: Mapping[str, str]) -> Tracks:
    """Tracks of a table: separated by commas, semicolons, tabs or blanks, with a header or without."""
    source = Path(path).name
    lines = list(_lines(path, None))
    if not lines:
        raise OptionError("file", "must have lines", "none", source)
    header = [cell.lower() for cell in lines[0][1]]
    headed = any(number_in(cell) is None for cell in header)
    place = _places(header if headed else [], len(header), columns, source)
    found = []
    for line, cells in lines[1:] if headed else lines:
        if len(cells) != len(header):
            raise OptionError(f"line {line}", f"must have {len(header)} cells", len(cells), source)
        value = {name: cells[k] for name, k in place.items()}
        frame, x, z = (_number(value[name], line, place[name], path) for name in ("frame", "x", "z"))
        degrees = value.get("heading", "")
        yaw = np.deg2rad(_number(degrees, line, place["heading"], path)) if degrees else float("nan")
        number = number_in(value["id"])
        name = value["id"] if number is None else _name(number)
        found.append((line, frame, name, (x, z), float(yaw), value.get("category") or "object"))
    return _checked(path, found)


def _places(header: Sequence[str], count: int, columns: Mapping[str, str], source: str) -> dict[str, int]:
    """The index of each column that is used."""
    found: dict[str, int] = {}
    for name in COLUMNS:
        if name in columns:
            asked = columns[name]
            if asked.lower() in header:
                found[name] = header.index(asked.lower())
            elif asked.isdecimal() and 1 <= int(asked) <= count:
                found[name] = int(asked) - 1
            else:
                known = ", ".join(header) or f"a number from 1 to {count}"
                raise OptionError(f"--columns {name}", f"must be one of {known}", asked, source)
        else:
            usual = [usual for usual in _NAMES[name] if usual in header]
            if usual:
                found[name] = header.index(usual[0])
            elif name in COLUMNS[:4]:
                known = ", ".join(header) or f"numbers from 1 to {count}"
                raise OptionError("--columns", f"must say which column is {name} ({known})", None, source)
    return found


_Sighting = tuple[int, float, str, tuple[float, float], float, str]


def _checked(path: str | os.PathLike[str], found: Sequence[_Sighting]) -> Tracks:
    """The tracks of some sightings, if no object is twice in a frame and all are within the limits."""
    source = Path(path).name
    if not found:
        raise OptionError("file", "must have sightings", "none", source)
    seen: set[tuple[float, str]] = set()
    for line, frame, name, place, yaw, _ in found:
        if (frame, name) in seen:
            raise OptionError(f"line {line}", "must not have an object twice in a frame", name, source)
        seen.add((frame, name))
        if not POSITION.allow(place).all():
            raise OptionError(f"line {line}", POSITION.expected, place, source)
        if not (np.isnan(yaw) or ANGLE.allow(yaw)):
            raise OptionError(f"line {line}", ANGLE.expected, yaw, source)
    order = np.argsort([one[1] for one in found], kind="stable")
    rows = [found[i] for i in order]
    return Tracks(
        name_of(path),
        np.array([row[1] for row in rows]),
        tuple(row[2] for row in rows),
        np.array([row[3] for row in rows]),
        np.array([row[4] for row in rows]),
        tuple(row[5] for row in rows),
    )


def name_of(path: str | os.PathLike[str]) -> str:
    """What the tracks of a file are called: its name, or its folder's where that says nothing."""
    file = Path(path).resolve()
    names = [file.stem, *(folder.name for folder in file.parents)]
    name = next((name for name in names if name and name.lower() not in USUAL_NAMES), file.stem)
    return re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-._") or "tracks"


def _lines(path: str | os.PathLike[str], separator: str | None) -> Iterator[tuple[int, list[str]]]:
    """The cells of each line that is not blank, with its number."""
    text = read_text(path, OptionError, "text")
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        sign = separator or next((sign for sign in (",", ";", "\t") if sign in line), None)
        cells = line.split() if sign is None else next(csv.reader([line], delimiter=sign))
        yield number, [cell.strip() for cell in cells]


def _name(number: float) -> str:
    """What an object with a number is called: all digits of it, so that no two are one."""
    return f"{number:.0f}" if number.is_integer() else repr(number)


def _number(text: str, line: int, column: int, path: str | os.PathLike[str]) -> float:
    value = number_in(text)
    if value is None or not np.isfinite(value):
        raise OptionError(f"line {line}, column {column + 1}", "must be a number", text, Path(path).name)
    return value
