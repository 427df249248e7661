"""Declarations of documents: lists, objects and whole files of kinds of values, and their JSON Schemas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

from farm_ar.errors import InputError
from farm_ar.scenes.kinds import NEEDED, Kind, MismatchError

NOTES = ("$schema", "description")
"""Fields that the top of any file may have, and that are ignored."""


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
