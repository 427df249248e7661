"""Reading values out of JSON: each is checked once, and an error names the field and the value."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import InputError


class _Nothing:
    """What stands where a field is missing, as an error shows it."""

    def __repr__(self) -> str:
        return "nothing"


NOTHING = _Nothing()

NOTES = ("$schema", "description")
"""Fields that the top of any file may have, which nobody reads."""


class Fields:
    """One JSON object being read.

    Every field is asked for by name; `finish` then refuses those that nobody asked for, so that a
    misspelt name is not silently dropped. A field that is there has a value: null is never taken for a
    missing one.

    Args:
        value: what the file holds at this place.
        error: the class of the errors to raise.
        source: the file's name, for the errors.
        path: where in the file this object stands; "" at its top.
    """

    def __init__(self, value: object, error: type[InputError], source: str | None, path: str = "") -> None:
        self._error, self._source, self._path = error, source, path
        if not isinstance(value, dict):
            raise error(path or "file", "must be a JSON object", value, source)
        self._values = value
        self._asked: set[str] = set()

    def has(self, name: str) -> bool:
        """Whether the field is there."""
        self._asked.add(name)
        return name in self._values

    def fail(self, name: str, expected: str, got: object) -> InputError:
        """The error for one field."""
        return self._error(self.path(name), expected, got, self._source)

    def path(self, name: str) -> str:
        """Where in the file a field stands."""
        shown = name if name.isprintable() else repr(name)
        return f"{self._path}.{shown}" if self._path else shown

    def raw(self, name: str, default: object = NOTHING) -> Any:
        """The field as it is; the default where it is missing."""
        self._asked.add(name)
        return self._values.get(name, default)

    def text(self, name: str, default: object = NOTHING) -> str:
        """A non-empty string."""
        value = self.raw(name, default)
        if not isinstance(value, str) or not value:
            raise self.fail(name, "must be a non-empty string", value)
        return value

    def flag(self, name: str) -> bool:
        """True or false; false where it is missing."""
        value = self.raw(name, False)
        if not isinstance(value, bool):
            raise self.fail(name, "must be true or false", value)
        return value

    def number(
        self, name: str, default: object = NOTHING, limits: tuple[float, float] | None = None
    ) -> float:
        """A finite number, within the limits if there are any."""
        value = self.raw(name, default)
        if limits is None:
            right, expected = _is_number(value), "must be a finite number"
        else:
            right = _is_number(value) and limits[0] <= value <= limits[1]
            expected = f"must be a number from {limits[0]} to {limits[1]}"
        if not right:
            raise self.fail(name, expected, value)
        return float(value)

    def positive(self, name: str, default: object = NOTHING) -> float:
        """A positive number."""
        value = self.raw(name, default)
        if not (_is_number(value) and value > 0):
            raise self.fail(name, "must be a positive number", value)
        return float(value)

    def sides(self, name: str, count: int) -> tuple[float, ...]:
        """As many positive numbers as asked for, in metres."""
        value = self.raw(name)
        right = isinstance(value, list) and len(value) == count
        if not (right and all(_is_number(side) and side > 0 for side in value)):
            raise self.fail(name, f"must be {count} positive numbers in metres", value)
        return tuple(float(side) for side in value)

    def points(self, name: str) -> list[tuple[float, float]]:
        """A list of [x, z] in metres."""
        value = self.raw(name)
        if not isinstance(value, list):
            raise self.fail(name, "must be a list of [x, z] in metres", value)
        for i, point in enumerate(value):
            if not (isinstance(point, list) and len(point) == 2 and all(map(_is_number, point))):
                raise self.fail(f"{name}[{i}]", "must be [x, z] in metres", point)
        return [(float(x), float(z)) for x, z in value]

    def child(self, name: str) -> Fields:
        """An object inside this one."""
        return Fields(self.raw(name), self._error, self._source, self.path(name))

    def children(self, name: str, default: object = NOTHING) -> Iterator[Fields]:
        """The objects of a list inside this one."""
        value = self.raw(name, default)
        if not isinstance(value, list):
            raise self.fail(name, "must be a list", value)
        for i, item in enumerate(value):
            yield Fields(item, self._error, self._source, self.path(f"{name}[{i}]"))

    def names(self) -> list[str]:
        """The names of all fields that are there."""
        return list(self._values)

    def finish(self) -> None:
        """Refuse fields that nobody asked for."""
        for name, value in self._values.items():
            if name not in self._asked and (self._path or name not in NOTES):
                known = ", ".join(sorted(self._asked))
                raise self.fail(name, f"must not be there (known fields: {known})", value)


def degrees(angle: float | FloatArray) -> float:
    """An angle as files have it, from radians.

    Rounded just above the error of turning degrees into radians and back, so that what was read is written
    as it stood.
    """
    return round(float(np.rad2deg(angle)), 12)


def read_json(path: str | os.PathLike[str], error: type[InputError]) -> Any:
    """The contents of a JSON file.

    Raises:
        InputError: of the class given, when the file cannot be read or is not JSON, or an object in it has
            two fields of one name.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
        return json.loads(text, object_pairs_hook=_without_repeats)
    except OSError as problem:
        reason = problem.strerror or str(problem)
        raise error("file", "must be a readable file", reason, os.fspath(path)) from None
    except (ValueError, RecursionError) as problem:
        raise error("file", "must be JSON", str(problem), Path(path).name) from None


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a file whole or not at all: under a temporary name beside it, then renamed."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = target.with_name(f".{target.name}.{uuid4().hex}")
    try:
        with temporary.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for name, value in pairs:
        if name in values:
            raise ValueError(f"the field {name} twice in one object")
        values[name] = value
    return values


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number too large for a float
        return False
