"""Kinds of values in files: each says once what a value must be, reads it, and writes its JSON Schema."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from farm_ar.arrays import ANGLE, FloatArray, Limits


class _Nothing:
    """What stands where a field is missing, as an error shows it."""

    def __repr__(self) -> str:
        return "nothing"


NEEDED = _Nothing()
"""The default of a field that has none."""

DEGREES = Limits(-3.6e8, 3.6e8, ANGLE.expected)
RADIANS = ANGLE

Path = tuple[str | int, ...]

_SURROGATE = re.compile("[\ud800-\udfff]")


class MismatchError(Exception):
    """A value is not what its declaration says.

    Args:
        expected: what would be right.
        got: the value.
        path: where it stands, from the outside in.
        conflict: whether it is right in itself but not beside others, which no JSON Schema says.
    """

    def __init__(self, expected: str, got: object, path: Path = (), conflict: bool = False) -> None:
        super().__init__(expected, got, path, conflict)
        self.expected, self.got, self.path, self.conflict = expected, got, path, conflict

    def inside(self, *place: str | int) -> MismatchError:
        """The same, seen from further outside."""
        return MismatchError(self.expected, self.got, (*place, *self.path), self.conflict)


@dataclass(frozen=True, kw_only=True)
class Kind(ABC):
    """What a value must be.

    Args:
        default: what is taken where a field of this kind is missing; a field without one is needed. What is
            there has a value: null is never taken for a missing one.
        about: a description, for the schema.
    """

    default: Any = NEEDED
    about: str = ""

    @abstractmethod
    def check(self, value: object) -> Any:
        """The value as the program has it.

        Raises:
            MismatchError: it is not of this kind.
        """

    @abstractmethod
    def rule(self) -> dict[str, Any]:
        """The JSON Schema of the kind, without default and description."""

    def schema(self) -> dict[str, Any]:
        """The JSON Schema of the kind."""
        words = {"description": self.about} if self.about else {}
        default = list(self.default) if isinstance(self.default, tuple) else self.default
        usual = {} if default is NEEDED or default is None else {"default": default}
        return {**self.rule(), **usual, **words}


_OfKind = TypeVar("_OfKind", bound=Kind)


@dataclass(frozen=True)
class Number(Kind):
    """A finite number within limits, read as a float; never true or false."""

    limits: Limits

    def check(self, value: object) -> float:
        """See `Kind`."""
        if not self._allows(value):
            raise MismatchError(f"must be {self.words}", value)
        return float(value)  # type: ignore[arg-type]

    def _allows(self, value: object) -> bool:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        return number and self.limits.low <= value <= self.limits.high  # type: ignore[operator]

    @property
    def words(self) -> str:
        """What is right, for an error."""
        low, high = written(self.limits.low), written(self.limits.high)
        return f"a {'positive ' if self.limits.low > 0 else ''}number from {low} to {high}"

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        return {"type": "number", "minimum": self.limits.low, "maximum": self.limits.high}


@dataclass(frozen=True)
class Whole(Kind):
    """A whole number within limits; 2.0 is one."""

    low: int
    high: int

    def check(self, value: object) -> int:
        """See `Kind`."""
        right = isinstance(value, int | float) and not isinstance(value, bool)
        if not (right and self.low <= value <= self.high and value == int(value)):  # type: ignore[operator, call-overload]
            raise MismatchError(f"must be a whole number from {self.low} to {self.high}", value)
        return int(value)  # type: ignore[call-overload, no-any-return]

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        return {"type": "integer", "minimum": self.low, "maximum": self.high}


@dataclass(frozen=True)
class Text(Kind):
    """A non-empty string of Unicode; one of the choices where there are any.

    Args:
        choices: the strings.
        hint: what is said of another string, in place of the choices; None where nothing is.
    """

    choices: tuple[str, ...] = ()
    hint: Callable[[str], str | None] | None = None

    def check(self, value: object) -> str:
        """See `Kind`."""
        if not isinstance(value, str) or not value:
            raise MismatchError("must be a non-empty string", value)
        if self.choices and value not in self.choices:
            hint = self.hint and self.hint(value)
            raise MismatchError(hint or f"must be one of {', '.join(self.choices)}", value)
        if not is_text(value):
            raise MismatchError("must be Unicode text, without half of a surrogate pair", value)
        return value

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        return {"enum": list(self.choices)} if self.choices else {"type": "string", "minLength": 1}


@dataclass(frozen=True)
class Flag(Kind):
    """True or false."""

    def check(self, value: object) -> bool:
        """See `Kind`."""
        if not isinstance(value, bool):
            raise MismatchError("must be true or false", value)
        return value

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        return {"type": "boolean"}


@dataclass(frozen=True)
class Anything(Kind):
    """Any value, left as it is."""

    def check(self, value: object) -> Any:
        """See `Kind`."""
        return value

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        return {}


@dataclass(frozen=True)
class OrNull(Kind):
    """A value of a kind, or null, read as None."""

    kind: Kind
    words: str

    def check(self, value: object) -> Any:
        """See `Kind`."""
        try:
            return None if value is None else self.kind.check(value)
        except MismatchError as problem:
            if problem.path:
                raise
            raise MismatchError(f"must be {self.words} or null", problem.got) from None

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        return {"anyOf": [{"type": "null"}, self.kind.schema()]}


@dataclass(frozen=True)
class Either(Kind):
    """A value of the first of several kinds that fits."""

    kinds: tuple[Kind, ...]
    words: str

    def check(self, value: object) -> Any:
        """See `Kind`."""
        for kind in self.kinds:
            try:
                return kind.check(value)
            except MismatchError:
                continue
        raise MismatchError(f"must be {self.words}", value)

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        return {"anyOf": [kind.schema() for kind in self.kinds]}


@dataclass(frozen=True)
class Numbers(Kind):
    """A list of so many numbers within the same limits, read as a tuple of floats; wrong as a whole."""

    count: int
    limits: Limits
    words: str

    def check(self, value: object) -> tuple[float, ...]:
        """See `Kind`."""
        each = Number(self.limits)
        if not (isinstance(value, list) and len(value) == self.count and all(map(each._allows, value))):
            raise MismatchError(f"must be {self.words}", value)
        return tuple(map(float, value))

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        one = Number(self.limits).schema()
        return {"type": "array", "items": one, "minItems": self.count, "maxItems": self.count}


@dataclass(frozen=True)
class Rows(Kind):
    """A table of numbers: so many rows of so many, read as an array; wrong as a whole."""

    shape: tuple[int, int]
    limits: Limits
    words: str

    def check(self, value: object) -> FloatArray:
        """See `Kind`."""
        row = Numbers(self.shape[1], self.limits, self.words)
        if not isinstance(value, list) or len(value) != self.shape[0]:
            raise MismatchError(f"must be {self.words}", value)
        try:
            return np.array([row.check(one) for one in value])
        except MismatchError:
            raise MismatchError(f"must be {self.words}", value) from None

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        row = Numbers(self.shape[1], self.limits, self.words).schema()
        return {"type": "array", "items": row, "minItems": self.shape[0], "maxItems": self.shape[0]}


def written(number: float) -> str:
    """A limit as an error shows it: 1e6, 0.5, 180."""
    return f"{number:g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")


def is_text(value: object) -> bool:
    """Whether a value is a non-empty string that UTF-8 can hold, as half of a surrogate pair cannot be."""
    return isinstance(value, str) and bool(value) and (value.isascii() or not _SURROGATE.search(value))


def radians(angle_deg: float) -> float:
    """An angle in radians, from degrees as files have them."""
    return float(np.deg2rad(angle_deg))
