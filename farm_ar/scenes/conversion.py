"""Values of files, in whatever frame, units and form of pose, read into ours; errors name the field."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from farm_ar.arrays import ANGLE, POSITION, SIDE, FloatArray, Limits, first_wrong
from farm_ar.errors import InputError
from farm_ar.scenes.bounds import Bounds
from farm_ar.scenes.declarations import IN_METRES
from farm_ar.scenes.documents import Document
from farm_ar.scenes.kinds import NEEDED, radians, written
from farm_ar.scenes.worlds import Poses, World, rigid, rotation_of

Values = Mapping[str, Any]
Place = tuple[str | int, ...]


class Reader:
    """Reads the values of one file, which its declaration has checked one by one.

    Args:
        document: the kind of file.
        raw: what the file holds.
        source: its name, for errors.

    Raises:
        InputError: a value cannot be used; of the document's class; names the field.
    """

    def __init__(self, document: Document, raw: object, source: str | None) -> None:
        self.document, self.source, self._raw = document, source, raw
        self.values: Values = document.read(raw, source)
        origin = self.values["origin"]
        heading = 0.0
        world = World(self.values["frame"], self.values["units"])
        if isinstance(origin, dict):
            heading = origin["yaw_rad"] if origin["yaw_rad"] is not None else radians(origin["yaw_deg"])
            place = (origin["x"], origin["y"], origin["z"])
        else:
            place = (0.0, 0.0, 0.0)
            if origin is not None:
                full = np.zeros(3)
                full[list(world.plane) if len(origin) == 2 else slice(None)] = origin
                place = (float(full[0]), float(full[1]), float(full[2]))
        self.world = World(world.frame, world.units, place, heading)
        if self.world.units != "m":
            self._refuse_metres(raw)

    def fail(self, path: Place, expected: str, got: object) -> InputError:
        """The error for one field."""
        return self.document.fail(path, expected, got, self.source)

    def left_out(self, part: str, *fields: tuple[str, ...]) -> tuple[str, ...]:
        """The first name of each of some fields of a part that the file gives under none of its names."""
        given = self._raw.get(part, {}) if isinstance(self._raw, dict) else {}
        return tuple(names[0] for names in fields if given.keys().isdisjoint(names))

    def poses(self, path: Place, entries: Sequence[Values]) -> Poses:
        """Poses of N entries of a list at `path`; the heading is NaN where it is not given."""
        poses = self._poses([(*path, i) for i in range(len(entries))], entries)
        for right, limits, name in (
            (POSITION.allow(np.column_stack([poses.position, poses.elevation])), POSITION, "x"),
            (ANGLE.allow(poses.yaw) | np.isnan(poses.yaw), ANGLE, "yaw_deg"),
        ):
            where = first_wrong(right)
            if where is not None:
                i, entry = where[0], entries[where[0]]
                field = "matrix" if entry["matrix"] is not None else name
                got = poses.yaw[i] if limits is ANGLE else [*poses.position[i], poses.elevation[i]]
                raise self.fail((*path, i, field), limits.expected, np.asarray(got).tolist())
        return poses

    def pose(self, path: Place, entry: Values) -> Poses:
        """The pose of one entry at `path`, as arrays of shape ()."""
        one = self._poses([path], [entry])
        return Poses(*(values[0] for values in one))

    def height_known(self, entry: Values) -> bool:
        """Whether an entry says how high it is."""
        return entry["matrix"] is not None or entry["xyz"[self.world.up]] is not None

    def floor(self, path: Place, points: Sequence[Sequence[float]]) -> FloatArray:
        """(P, 2) points on the floor of a list at `path`, metres."""
        read = self.world.floor(np.reshape(np.array(points, dtype=np.float64), (-1, 2)))
        where = first_wrong(POSITION.allow(read))
        if where is not None:
            raise self.fail((*path, where[0]), POSITION.expected, read[where[0]].tolist())
        return read

    def spot(self, path: Place, entry: Values) -> FloatArray:
        """(2,) where an entry at `path` stands on the floor, metres."""
        point = self._point(path, entry)
        if entry["xyz"[self.world.up]] is not None:
            axis = "xyz"[self.world.up]
            expected = f"must not be there: in frame {self.world.frame} it is a height"
            raise self.fail((*path, axis), expected, entry[axis])
        place: FloatArray = self.floor(path, [[point[k] for k in self.world.plane]])[0]
        return place

    def length(self, path: Place, value: float, limits: Limits) -> float:
        """A length that is not in metres by name, in metres."""
        read = float(self.world.lengths(value))
        if not limits.allow(read):
            raise self.fail(path, limits.expected, value)
        return read

    def sizes(self, path: Place, entries: Sequence[Values]) -> FloatArray:
        """(N, 3) sizes of the entries of a list at `path`, metres; NaN where not given."""
        unknown = (np.nan, np.nan, np.nan)
        given = [unknown if one["size_whd"] is None else one["size_whd"] for one in entries]
        read = self.world.lengths(np.reshape(np.array(given, dtype=np.float64), (-1, 3)))
        where = first_wrong(SIDE.allow(read) | np.isnan(read))
        if where is not None:
            expected = "must be 3 positive numbers in metres, from 1e-6 to 1e6"
            raise self.fail((*path, where[0], "size_whd"), expected, read[where[0]].tolist())
        return read

    def bounds(self) -> Bounds | None:
        """The bounds of a scene: from its room or its bounds; None where it has neither."""
        values = self.values
        given = values["bounds"]
        if values["size_m"] is not None or values["size"] is not None:
            given, path = {**_AT_THE_ORIGIN, "size_m": values["size_m"], "size": values["size"]}, ()
        else:
            path = ("bounds",)  # type: ignore[assignment]
        if given is None:
            return None
        if isinstance(given, list):
            corners = self.floor(path, given)
        else:
            corners = self._rectangle(path, given)
        return Bounds(corners)

    def _rectangle(self, path: Place, given: Values) -> FloatArray:
        """The corners of a rectangle: behind on its left, behind on its right, and on around."""
        if given["size_m"] is not None:
            width, depth = given["size_m"]
        else:
            width, depth = (self.length((*path, "size"), side, SIDE) for side in given["size"])
        corner = self.floor((*path, "origin"), [given["origin"]])[0]
        yaw = float(self.world.yaws(radians(given["yaw_deg"])))
        return Bounds.rectangle(width, depth, corner, yaw).corners

    def _poses(self, paths: Sequence[Place], entries: Sequence[Values]) -> Poses:
        n = len(entries)
        points, yaw = np.zeros((n, 3)), np.full(n, np.nan)
        rotation = None
        for i, entry in enumerate(entries):
            if entry["matrix"] is None and entry["quaternion"] is None:
                points[i] = self._point(paths[i], entry)
                if entry["yaw_rad"] is not None:
                    yaw[i] = entry["yaw_rad"]
                elif entry["yaw_deg"] is not None:
                    yaw[i] = np.deg2rad(entry["yaw_deg"])
                continue
            if rotation is None:
                rotation = np.full((n, 3, 3), np.nan)
            name = "matrix" if entry["matrix"] is not None else "quaternion"
            try:
                if name == "matrix":
                    points[i], rotation[i] = rigid(entry["matrix"])
                else:
                    points[i], rotation[i] = self._point(paths[i], entry), rotation_of(entry["quaternion"])
            except InputError:
                raise
            except ValueError as problem:
                got = entry[name] if name == "quaternion" else entry[name].tolist()
                raise self.fail((*paths[i], name), str(problem), got) from None
        return self.world.poses(points, yaw, rotation)

    def _point(self, path: Place, entry: Values) -> FloatArray:
        """(3,) the coordinates of an entry, the height 0 where it is not given."""
        point = np.zeros(3)
        for axis, name in enumerate("xyz"):
            if entry[name] is not None:
                point[axis] = entry[name]
            elif axis != self.world.up:
                limit = written(POSITION.high)
                raise self.fail((*path, name), f"must be a number from -{limit} to {limit}", NEEDED)
        return point

    def _refuse_metres(self, raw: object) -> None:
        for path in IN_METRES:
            value = raw
            for step in path:
                value = value.get(step) if isinstance(value, dict) else None
            if value is not None:
                expected = f"must not be there beside units {self.world.units}: write it in them, as "
                raise self.fail(path, expected + path[-1].split("_m")[0], value)


_AT_THE_ORIGIN = {"origin": (0.0, 0.0), "yaw_deg": 0.0}
