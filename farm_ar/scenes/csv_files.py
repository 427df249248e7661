"""Layouts and detections as CSV tables: id, category, x, z, yaw_deg, w, h, d."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import InputError, SceneError, SnapshotError
from farm_ar.scenes.camera import Camera
from farm_ar.scenes.layout import Layout
from farm_ar.scenes.scene import Scene
from farm_ar.scenes.snapshot import Detections, Snapshot

COLUMNS = ("id", "category", "x", "z", "yaw_deg", "w", "h", "d")
"""The columns of a table, in any order; `y`, in metres, may be added."""


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

    def number(self, column: str, positive: bool) -> float:
        try:
            number = float(self.values[column])
        except ValueError:
            number = np.nan
        if not np.isfinite(number) or (positive and number <= 0):
            expected = "must be a positive number in metres" if positive else "must be a finite number"
            raise self.fail(column, expected)
        return number


class _Table:
    """A table read as text; blank lines and the space around a cell mean nothing."""

    def __init__(self, path: str | os.PathLike[str], error: type[InputError]) -> None:
        source = Path(path).name
        self.rows: list[_Row] = []
        try:
            # A BOM, as spreadsheets write it, is left out.
            with Path(path).open(newline="", encoding="utf-8-sig") as file:
                lines = csv.reader(file, skipinitialspace=True)
                header = [column.strip() for column in next(lines, [])]
                if sorted(set(header) | {"y"}) != sorted({*COLUMNS, "y"}) or len(set(header)) != len(header):
                    expected = f"must be {','.join(COLUMNS)} in any order (y may be added)"
                    raise error("header", expected, ",".join(header), source)
                for cells in lines:
                    values = [cell.strip() for cell in cells]
                    if not any(values):
                        continue
                    if len(values) != len(header):
                        expected = f"must have {len(header)} cells"
                        raise error(f"line {lines.line_num}", expected, len(values), source)
                    row = dict(zip(header, values, strict=True))
                    self.rows.append(_Row(row, lines.line_num, error, source))
        except OSError as problem:
            reason = problem.strerror or str(problem)
            raise error("file", "must be a readable file", reason, os.fspath(path)) from None
        except (UnicodeDecodeError, csv.Error) as problem:
            raise error("file", "must be a CSV table in UTF-8", str(problem), source) from None

    def ids(self) -> tuple[str, ...]:
        ids: list[str] = []
        for row in self.rows:
            name = row.text("id")
            if name in ids:
                raise row.fail("id", "must not repeat an earlier id")
            ids.append(name)
        return tuple(ids)

    def poses(self) -> _Poses:
        def column(*names: str, positive: bool = False) -> FloatArray:
            values = [[row.number(name, positive) for name in names] for row in self.rows]
            return np.reshape(np.array(values, dtype=np.float64), (-1, len(names)))

        has_elevation = bool(self.rows) and "y" in self.rows[0].values
        return _Poses(
            position=column("x", "z"),
            yaw=np.deg2rad(column("yaw_deg")[:, 0]),
            size=column("w", "h", "d", positive=True),
            elevation=column("y")[:, 0] if has_elevation else np.zeros(len(self.rows)),
        )
