"""The errors a user meets: one line each, with the field, what would be right, and the value that came."""

from collections.abc import Iterable
from importlib import import_module
from types import ModuleType

LONGEST_VALUE = 120
"""How much of a value an error shows, in characters."""

LONGEST_WORDS = 1000
"""How much it says of what would be right, in characters: there may be thousands of labels."""


class InputError(ValueError):
    """A value from outside that cannot be used.

    Args:
        field: path of the field, as in `objects[3].size_whd`.
        expected: what would be right, a phrase that begins with "must" or the like.
        got: the value that came.
        source: file or argument that held the field, if there is one.
    """

    def __init__(self, field: str, expected: str, got: object, source: str | None = None) -> None:
        super().__init__(field, expected, got, source)
        self.field, self.expected, self.got, self.source = field, expected, got, source

    def __str__(self) -> str:
        where = f"{self.source}: {self.field}" if self.source else self.field
        got = self._value()
        shown = got if len(got) <= LONGEST_VALUE else f"{got[:LONGEST_VALUE]} ..."
        expected = self.expected
        if len(expected) > LONGEST_WORDS:
            expected = f"{expected[:LONGEST_WORDS]} ..."
        return escaped(f"{where}: {expected}, got {shown}")

    def _value(self) -> str:
        return repr(self.got)


class SceneError(InputError):
    """A scene or a layout that cannot be used."""


class SnapshotError(InputError):
    """A snapshot, its camera or its detections that cannot be used."""


class SessionError(InputError):
    """A session's file that cannot be used, or a step that a session cannot take."""


class OptionError(InputError):
    """An option with a value outside what it allows; None is an option that was not given."""

    def _value(self) -> str:
        return "nothing" if self.got is None else super()._value()


class UnfinishedError(RuntimeError):
    """Some of the work gave no result; all that did is kept."""


class MissingPackageError(ImportError):
    """A package is needed that this installation does not have; says what to install."""


def import_extra(name: str, extra: str, what: str = "this") -> ModuleType:
    """A package of an extra, or a module of one.

    Args:
        name: of the module.
        extra: that brings it.
        what: needs it, for the error.

    Raises:
        MissingPackageError: it is not installed; says how to.
    """
    try:
        return import_module(name)
    except ImportError as problem:
        way = f"install the extra {extra} (in the project's folder: pip install '.[{extra}]')"
        raise MissingPackageError(f"{what} needs {name.partition('.')[0]}: {way}") from problem


def escaped(text: str) -> str:
    """The text with whatever would steer a terminal written out as a code: names come from any file."""
    return text if text.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def known_name(field: str, name: str, names: Iterable[str]) -> str:
    """Return `name` if it is one of `names`.

    Raises:
        OptionError: it is not; the message lists those known.
    """
    known = sorted(names)
    if name not in known:
        raise OptionError(field, f"must be one of {', '.join(known)}", name)
    return name
