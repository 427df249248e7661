"""Declarations of documents: each says once what a value must be, reads it, and writes its JSON Schema."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any, TypeVar

import numpy as np

from farm_ar.arrays import ANGLE, FloatArray, Limits
from farm_ar.errors import InputError


class _Nothing:
    """What stands where a field is missing, as an error shows it."""

    def __repr__(self) -> str:
        return "nothing"


NEEDED = _Nothing()
"""The default of a field that has none."""

NOTES = ("$schema", "description")
"""Fields that the top of any file may have, which nobody reads."""

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


@dataclass(frozen=True)
class Listing(Kind):
    """A list of values of one kind.

    Args:
        kind: of each.
        least: how many there must be.
        different: a field of the items that no two of them may share.
        words: what the list must be, for an error.
    """

    kind: Kind
    least: int = 0
    different: str | None = None
    words: str = "a list"

    def check(self, value: object) -> list[Any]:
        """See `Kind`."""
        if not isinstance(value, list) or len(value) < self.least:
            raise MismatchError(f"must be {self.words}", value)
        items = []
        for i, item in enumerate(value):
            try:
                items.append(self.kind.check(item))
            except MismatchError as problem:
                raise problem.inside(i) from None
        if self.different is not None:
            seen: set[object] = set()
            for i, item in enumerate(items):
                name = item[self.different]
                if name in seen:
                    expected = f"must not repeat an earlier {self.different}"
                    raise MismatchError(expected, name, (i, self.different), conflict=True)
                seen.update(() if name is None else (name,))
        return items

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        least = {"minItems": self.least} if self.least else {}
        return {"type": "array", "items": self.kind.schema(), **least}


@dataclass(frozen=True)
class Named(Kind):
    """An object whose fields may have any name, each of one kind."""

    kind: Kind

    def check(self, value: object) -> dict[str, Any]:
        """See `Kind`."""
        if not isinstance(value, dict):
            raise MismatchError("must be a JSON object", value)
        found = {}
        for name, item in value.items():
            try:
                found[name] = self.kind.check(item)
            except MismatchError as problem:
                raise problem.inside(name) from None
        return found

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        return {"type": "object", "additionalProperties": self.kind.schema()}


@dataclass(frozen=True)
class Object(Kind):
    """An object with fields of its own; one that is not known is refused, as a misspelt name would be.

    Args:
        fields: the kind of each, by name.
        together: fields of which, where there is one, there are all.
        exclusive: groups of fields of which at most one may be there.
        either: groups of fields of which at least one must be there whole.
        notes: whether it is the top of a file, where `NOTES` may stand.
        open: whether other fields may be there; they are not read.
    """

    fields: Mapping[str, Kind]
    together: tuple[str, ...] = ()
    exclusive: tuple[tuple[str, ...], ...] = ()
    either: tuple[tuple[str, ...], ...] = ()
    notes: bool = False
    open: bool = False

    def check(self, value: object) -> dict[str, Any]:
        """See `Kind`: the values by name, defaults among them."""
        if not isinstance(value, dict):
            raise MismatchError("must be a JSON object", value)
        found = {}
        for name, kind in self.fields.items():
            if name not in value:
                if kind.default is NEEDED or (
                    name in self.together and not value.keys().isdisjoint(self.together)
                ):
                    raise self._missing(kind).inside(name)
                found[name] = kind.default
                continue
            try:
                found[name] = kind.check(value[name])
            except MismatchError as problem:
                raise problem.inside(name) from None
        if not self.open:
            for name, item in value.items():
                if name not in self.fields and not (self.notes and name in NOTES):
                    known = ", ".join(sorted(self.fields))
                    raise MismatchError(f"must not be there (known fields: {known})", item, (name,))
        self._check_groups(value)
        return found

    def _check_groups(self, value: Mapping[str, object]) -> None:
        for group in self.exclusive:
            there = [name for name in group if name in value]
            if len(there) > 1:
                raise MismatchError(f"must not be there beside {there[0]}", value[there[1]], (there[1],))
        if self.either and not any(value.keys() >= set(group) for group in self.either):
            usual = self.either[0]
            missing = next(name for name in usual if name not in value)
            problem = self._missing(self.fields[missing])
            others = self._in_place_of(missing, value)
            said = [f"{' or '.join(others)} in its place"] if others else []
            said += [
                f"{name} in place of the pose" for name in self._alone() if name not in (missing, *others)
            ]
            if said:
                problem.expected += f" (or give {', or '.join(said)})"
            raise problem.inside(missing)

    def _alone(self) -> list[str]:
        """Fields that would do without any of the others."""
        return [group[0] for group in self.either if len(group) == 1]

    def _in_place_of(self, missing: str, value: Mapping[str, object]) -> list[str]:
        """Fields that would do in place of a missing one, with nothing else."""
        same = {name for group in self.exclusive if missing in group for name in group} - {missing}
        return [name for name in self.fields if name in same and self._would_do(name, value)]

    def _would_do(self, name: str, value: Mapping[str, object]) -> bool:
        there = value.keys() | {name}
        return any(there >= set(group) for group in self.either) and not any(
            name in group and there & set(group) - {name} for group in self.exclusive
        )

    @staticmethod
    def _missing(kind: Kind) -> MismatchError:
        try:
            kind.check(NEEDED)
        except MismatchError as problem:
            return problem
        return MismatchError("must be there", NEEDED)

    def rule(self) -> dict[str, Any]:
        """See `Kind`."""
        properties = {note: {"description": "For people; not read."} for note in NOTES} if self.notes else {}
        properties |= {name: kind.schema() for name, kind in self.fields.items()}
        needed = [name for name, kind in self.fields.items() if kind.default is NEEDED]
        rule: dict[str, Any] = {"type": "object", "required": needed, "properties": properties}
        if not self.open:
            rule["additionalProperties"] = False
        if self.exclusive:
            pairs = [pair for group in self.exclusive for pair in combinations(group, 2)]
            rule["allOf"] = [{"not": {"required": list(pair)}} for pair in pairs]
        if self.either:
            rule["anyOf"] = [{"required": list(group)} for group in self.either]
        if self.together:
            others = {name: [other for other in self.together if other != name] for name in self.together}
            rule["dependentRequired"] = others
        return rule


@dataclass(frozen=True)
class Document:
    """A kind of file.

    Args:
        title: what it is called.
        top: its declaration.
        error: the class of the errors to raise.
    """

    title: str
    top: Kind
    error: type[InputError] = field(default=InputError)

    def read(self, value: object, source: str | None = None) -> Any:
        """The contents of a file, checked, with defaults filled in.

        Args:
            value: what the file holds.
            source: its name, for errors.

        Raises:
            InputError: of the document's class; names the field.
        """
        try:
            return self.top.check(value)
        except MismatchError as problem:
            raise self.error(
                path_text(problem.path) or "file", problem.expected, problem.got, source
            ) from None

    def fail(self, path: Sequence[str | int], expected: str, got: object, source: str | None) -> InputError:
        """The error for one field."""
        return self.error(path_text(path), expected, got, source)

    def schema(self) -> dict[str, Any]:
        """The JSON Schema (draft 2020-12) of such files."""
        return {
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "title": f"farm-ar {self.title}",
            **self.top.schema(),
        }


def path_text(path: Sequence[str | int]) -> str:
    """Where in a file a value stands, as in `objects[3].label`."""
    text = ""
    for step in path:
        if isinstance(step, int):
            text += f"[{step}]"
        else:
            shown = step if step.isprintable() else repr(step)
            text += f".{shown}" if text else shown
    return text


def written(number: float) -> str:
    """A limit as an error shows it: 1e6, 0.5, 180."""
    return f"{number:g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")


def is_text(value: object) -> bool:
    """Whether a value is a non-empty string that UTF-8 can hold, as half of a surrogate pair cannot be."""
    return isinstance(value, str) and bool(value) and (value.isascii() or not _SURROGATE.search(value))


def radians(angle_deg: float) -> float:
    """An angle in radians, from degrees as files have them."""
    return float(np.deg2rad(angle_deg))
