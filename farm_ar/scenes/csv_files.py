"""Layouts and detections as CSV tables: id, category, x, z, yaw_deg, w, h, d, and some columns more."""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from farm_ar.arrays import ANGLE, FINITE, POSITION, SHARE, SIDE, Limits, number_in
from farm_ar.errors import InputError, SceneError, SnapshotError
from farm_ar.scenes.camera import Camera
from farm_ar.scenes.files import read_text
from farm_ar.scenes.json_files import scene_from_dict, snapshot_from_dict
from farm_ar.scenes.kinds import DEGREES, written
from farm_ar.scenes.layout import Layout
from farm_ar.scenes.scene import Scene
from farm_ar.scenes.snapshot import Snapshot

COLUMNS = ("id", "category", "x", "z", "yaw_deg", "w", "h", "d")
"""The usual columns of a table, in any order."""

QUATERNION = ("qx", "qy", "qz", "qw")
MORE_COLUMNS = ("y", "yaw_rad", *QUATERNION, "fixed", "confidence", "track_id", "frame", "units")
"""Columns that may be added; the last two are the same in each row."""

_NUMBERS = {
    **dict.fromkeys("xyz", POSITION),
    **dict.fromkeys("whd", SIDE),
    **dict.fromkeys(QUATERNION, FINITE),
    "yaw_deg": DEGREES,
    "yaw_rad": ANGLE,
    "confidence": SHARE,
}
_TOGETHER = {"size_whd": ("w", "h", "d"), "quaternion": QUATERNION}
_FLAGS = {"": False, "0": False, "false": False, "no": False, "1": True, "true": True, "yes": True}

_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+", re.ASCII)
_FIELD = re.compile(r"(?:objects|detections)\[(\d+)\]\.(\w+)")

_Read = TypeVar("_Read")


def load_layout_csv(path: str | os.PathLike[str]) -> Layout:
    """A layout from a table; `id` is the label.

    Raises:
        SceneError: it cannot be read, or a value in it cannot be used; names the file, the line and the
            column.
    """
    return load_scene_csv(path).layout


def load_scene_csv(path: str | os.PathLike[str], room_size: tuple[float, float] | None = None) -> Scene:
    """A scene without sites from a table of labelled objects and the room's width and depth, metres.

    Without a room its bounds are not known.

    Raises:
        SceneError: as `load_layout_csv`; or a side of the room is not positive.
    """
    table = _Table(path, SceneError, ("fixed",))
    scene = table.read(scene_from_dict, {"objects": table.entries("label")})
    return Scene(Path(path).stem, room_size, scene.layout, world=scene.world)


def load_snapshot_csv(path: str | os.PathLike[str], camera: Camera) -> Snapshot:
    """A snapshot from a table of detections; what is empty is not known.

    Raises:
        SnapshotError: it cannot be read, or a value in it cannot be used; names the file, the line and the
            column.
    """
    table = _Table(path, SnapshotError, ("confidence", "track_id"))
    view = {"x": 0.0, "y" if table.world.get("frame") == "ros" else "z": 0.0, "yaw_deg": 0.0}
    snapshot = table.read(snapshot_from_dict, {"camera": view, "detections": table.entries("id")})
    return replace(snapshot, camera=camera)


class _Row:
    """One line of a table, by column."""

    def __init__(self, values: dict[str, str], line: int, error: type[InputError], source: str) -> None:
        self.values, self.line, self._error, self._source = values, line, error, source

    def fail(self, column: str, expected: str) -> InputError:
        return self._error(f"line {self.line}, {column}", expected, self.values[column], self._source)

    def text(self, column: str) -> str:
        if not self.values[column]:
            raise self.fail(column, "must not be empty")
        return self.values[column]

    def number(self, column: str, limits: Limits) -> float:
        text = self.values[column]
        number = number_in(text)
        if number is None or not limits.low <= number <= limits.high:
            expected = "must be a positive number in metres" if limits is SIDE else "must be a finite number"
            if _DECIMAL_COMMA.fullmatch(text):
                expected += " with a decimal point, not a comma"
            elif number is not None and np.isfinite(number) and (number > 0 or limits is not SIDE):
                expected += f", from {written(limits.low)} to {written(limits.high)}"
            raise self.fail(column, expected)
        return number

    def entry(self, name: str, metres: bool) -> dict[str, Any]:
        """The row as an entry of a JSON file, in which `id` is called by a name; empty cells are left out."""
        found: dict[str, Any] = {name: self.text("id")}
        groups = {column: field for field, columns in _TOGETHER.items() for column in columns}
        for column, text in self.values.items():
            if column in _NUMBERS and (text or column in "xyz" or self._partly(groups.get(column))):
                limits = _NUMBERS[column]
                if not metres and column in "xyzwhd":
                    limits = FINITE if column in "xyz" else Limits(1e-9, 1e9, SIDE.expected)
                number = self.number(column, limits)
                if column in groups:
                    found.setdefault(groups[column], {})[column] = number
                else:
                    found[column] = number
            elif column == "fixed":
                if text.lower() not in _FLAGS:
                    raise self.fail(column, "must be true or false")
                found[column] = _FLAGS[text.lower()]
            elif column in ("category", "track_id") and text:
                found[column] = text
        for field, columns in _TOGETHER.items():
            if field in found:
                found[field] = [found[field][column] for column in columns]
        return found

    def _partly(self, field: str | None) -> bool:
        """Whether any of the columns that stand for one field is not empty."""
        return field is not None and any(self.values[column] for column in _TOGETHER[field])


class _Table:
    """A table read as text; blank lines, space around a cell and a first line `sep=,` mean nothing.

    Between semicolons numbers may have a decimal comma, as spreadsheets of many countries write them.

    Args:
        path: the file.
        error: the class of the errors to raise.
        own: which columns of only some tables this one may have.
    """

    def __init__(self, path: str | os.PathLike[str], error: type[InputError], own: tuple[str, ...]) -> None:
        self.source, self._error = Path(path).name, error
        self.rows: list[_Row] = []
        more = [column for column in MORE_COLUMNS if column in own or column not in _OF_SOME]
        text = read_text(path, error, "a CSV table")
        begin = text.split("\n", 1)[0]
        semicolons = begin.count(";") > begin.count(",")
        try:
            lines = csv.reader(
                io.StringIO(text, newline=""), delimiter=";" if semicolons else ",", skipinitialspace=True
            )
            header = [column.strip() for column in next(lines, [])]
            if header == ["sep=", ""]:
                header = [column.strip() for column in next(lines, [])]
            self._check_header(header, more)
            for cells in lines:
                values = [cell.strip() for cell in cells]
                if not any(values):
                    continue
                if len(values) != len(header):
                    raise error(
                        f"line {lines.line_num}", f"must have {len(header)} cells", len(values), self.source
                    )
                row = dict(zip(header, values, strict=True))
                if semicolons:
                    row |= {
                        column: cell.replace(",", ".")
                        for column, cell in row.items()
                        if column in _NUMBERS and _DECIMAL_COMMA.fullmatch(cell)
                    }
                self.rows.append(_Row(row, lines.line_num, error, self.source))
        except csv.Error as problem:
            raise error("file", "must be a CSV table", str(problem), self.source) from None
        self.world = self._world()

    def _check_header(self, header: list[str], more: list[str]) -> None:
        there = set(header)
        known = there <= {*COLUMNS, *more} and len(there) == len(header)
        placed = {"id", "x"} <= there and there & {"y", "z"}
        whole = all(there.isdisjoint(columns) or there.issuperset(columns) for columns in _TOGETHER.values())
        if known and placed and whole:
            return
        between = ", with commas (or semicolons) between them, not tabs," if "\t" in "".join(header) else ""
        expected = f"must be {','.join(COLUMNS)}{between} in any order (all but id, x and z may be left out; "
        expected += f"{', '.join(more)} may be added)"
        raise self._error("header", expected, ",".join(header), self.source)

    def _world(self) -> dict[str, str]:
        """The frame and the units, which all rows have in common."""
        world: dict[str, str] = {}
        for column in ("frame", "units"):
            for row in self.rows:
                if column in row.values:
                    text = row.text(column)
                    if world.setdefault(column, text) != text:
                        raise row.fail(column, f"must be {world[column]}, as in the rows before")
        return world

    def entries(self, name: str) -> list[dict[str, Any]]:
        """The rows as entries of a JSON file."""
        names: set[str] = set()
        metres = self.world.get("units", "m") == "m"
        found = [row.entry(name, metres) for row in self.rows]
        for row, entry in zip(self.rows, found, strict=True):
            if entry[name] in names:
                raise row.fail("id", "must not repeat an earlier id")
            names.add(entry[name])
        return found

    def read(self, read: Callable[[dict[str, Any]], _Read], file: dict[str, Any]) -> _Read:
        """What a JSON file of that contents would be; errors name the line and the column."""
        try:
            return read(self.world | file)
        except InputError as problem:
            field = problem.field
            if match := _FIELD.fullmatch(field):
                columns = ",".join(_TOGETHER.get(match[2], (match[2],)))
                field = f"line {self.rows[int(match[1])].line}, {columns}"
            raise self._error(field, problem.expected, problem.got, self.source) from None


_OF_SOME = ("fixed", "confidence", "track_id")
"""Columns of only layouts or only detections."""
