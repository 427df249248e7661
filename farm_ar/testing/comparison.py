"""What every conformance test needs: to insist on something, and to find where two values differ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np


def require(right: bool, message: str) -> None:
    """Insist on something.

    Raises:
        AssertionError: it is not so; also where Python runs without assertions.
    """
    if not right:
        raise AssertionError(message)


@contextmanager
def attempt(what: str) -> Iterator[None]:
    """Make a failure of whatever is raised within.

    Raises:
        AssertionError: something was raised.
    """
    try:
        yield
    except Exception as problem:
        first = str(problem).partition("\n")[0]
        raise AssertionError(f"{what} raised {type(problem).__name__}: {first}") from problem


def difference(first: Any, second: Any, path: str = "") -> str | None:
    """Where two values first differ, in type or in a single bit; None if nowhere."""
    if type(first) is not type(second):
        return path
    if isinstance(first, np.ndarray):
        same = (first.dtype, first.shape, first.tobytes()) == (second.dtype, second.shape, second.tobytes())
        return None if same else path
    if isinstance(first, Mapping):
        if list(first) != list(second):
            return path
        pairs = [(f"{path}[{key!r}]", first[key], second[key]) for key in first]
    elif isinstance(first, tuple | list):
        if len(first) != len(second):
            return path
        pairs = [(f"{path}[{i}]", a, b) for i, (a, b) in enumerate(zip(first, second, strict=True))]
    else:
        return None if repr(first) == repr(second) else path
    found = (difference(a, b, where) for where, a, b in pairs)
    return next((where for where in found if where is not None), None)


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """The innermost values of mappings, lists and tuples, each with its path."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from leaves(inner, f"{path}[{key!r}]")
    elif isinstance(value, tuple | list):
        for i, inner in enumerate(value):
            yield from leaves(inner, f"{path}[{i}]")
    else:
        yield path, value
