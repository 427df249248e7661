"""Layouts and detections as CSV tables: id, category, x, z, yaw_deg, w, h, d."""

from __future__ import annotations

import csv
import io
import os
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import POSITION, SIDE, FloatArray, Limits, number_in
from farm_ar.errors import InputError, SceneError, SnapshotError
from farm_ar.scenes.camera import Camera
from farm_ar.scenes.documents import DEGREES, written
from farm_ar.scenes.files import read_text
from farm_ar.scenes.layout import Layout
from farm_ar.scenes.scene import Scene
from farm_ar.scenes.snapshot import Detections, Snapshot

COLUMNS = ("id", "category", "x", "z", "yaw_deg", "w", "h", "d")
"""The columns of a table, in any order; `y`, in metres, may be added."""

_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+", re.ASCII)


def load_layout_csv(path: str | os.PathLike[str]) -> Layout:
    """A layout from a table; `id` is the label.

    Raises:
        SceneError: it cannot be read, or a value in it cannot be used; names the file, the line and the
            column.
    """
    table = _Table(path, SceneError)
    poses = table.poses()
    return Layout(
        labels=table.ids(),
        category=tuple(row.text("category") for row in table.rows),
        position=poses.position,
        yaw=poses.yaw,
        size=poses.size,
        elevation=poses.elevation,
    )


def load_scene_csv(path: str | os.PathLike[str], room_size: tuple[float, float]) -> Scene:
    """A scene without sites from a table of labelled objects and the room's width and depth, metres.

    Raises:
        SceneError: as `load_layout_csv`; or a side of the room is not positive.
    """
    return Scene(Path(path).stem, room_size, load_layout_csv(path))


def load_snapshot_csv(path: str | os.PathLike[str], camera: Camera) -> Snapshot:
    """A snapshot from a table of detections; an empty category is not known.

    Raises:
        SnapshotError: it cannot be read, or a value in it cannot be used; names the file, the line and the
            column.
    """
    table = _Table(path, SnapshotError)
    poses = table.poses()
    detections = Detections(
        category=tuple(row.values["category"] or None for row in table.rows),
        position=poses.position,
        yaw=poses.yaw,
        size=poses.size,
        elevation=poses.elevation,
        ids=table.ids(),
    )
    return Snapshot(camera, detections)


class _Poses(NamedTuple):
    position: FloatArray
    yaw: FloatArray
    size: FloatArray
    elevation: FloatArray


class _Row:
    """One line of a table, by column."""

    def __init__(self, values: dict[str, str], line: int, error: type[InputError], source: str) -> None:
        self.values, self._line, self._error, self._source = values, line, error, source

    def fail(self, column: str, expected: str) -> InputError:
        return self._error(f"line {self._line}, {column}", expected, self.values[column], self._source)

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


class _Table:
    """A table read as text; blank lines, space around a cell and a first line `sep=,` mean nothing."""

    def __init__(self, path: str | os.PathLike[str], error: type[InputError]) -> None:
        source = Path(path).name
        self.rows: list[_Row] = []
        text = read_text(path, error, "a CSV table")
        try:
            lines = csv.reader(io.StringIO(text, newline=""), skipinitialspace=True)
            header = [column.strip() for column in next(lines, [])]
            if header == ["sep=", ""]:
                header = [column.strip() for column in next(lines, [])]
            if sorted(set(header) | {"y"}) != sorted({*COLUMNS, "y"}) or len(set(header)) != len(header):
                expected = f"must be {','.join(COLUMNS)} in any order (y may be added)"
                for sign, name in ((";", "semicolons"), ("\t", "tabs")):
                    if sign in "".join(header):
                        expected += f", with commas between columns and decimal points, not {name}"
                raise error("header", expected, ",".join(header), source)
            for cells in lines:
                values = [cell.strip() for cell in cells]
                if not any(values):
                    continue
                if len(values) != len(header):
                    raise error(
                        f"line {lines.line_num}", f"must have {len(header)} cells", len(values), source
                    )
                row = dict(zip(header, values, strict=True))
                self.rows.append(_Row(row, lines.line_num, error, source))
        except csv.Error as problem:
            raise error("file", "must be a CSV table", str(problem), source) from None

    def ids(self) -> tuple[str, ...]:
        ids: dict[str, None] = {}
        for row in self.rows:
            name = row.text("id")
            if name in ids:
                raise row.fail("id", "must not repeat an earlier id")
            ids[name] = None
        return tuple(ids)

    def poses(self) -> _Poses:
        def column(*names: str, limits: Limits = POSITION) -> FloatArray:
            values = [[row.number(name, limits) for name in names] for row in self.rows]
            return np.reshape(np.array(values, dtype=np.float64), (-1, len(names)))

        has_elevation = bool(self.rows) and "y" in self.rows[0].values
        return _Poses(
            position=column("x", "z"),
            yaw=np.deg2rad(column("yaw_deg", limits=DEGREES)[:, 0]),
            size=column("w", "h", "d", limits=SIDE),
            elevation=column("y")[:, 0] if has_elevation else np.zeros(len(self.rows)),
        )
