"""What follows from a scene or a layout alone is worked out once."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar
from weakref import WeakKeyDictionary

Known = TypeVar("Known")
Result = TypeVar("Result")


def kept(function: Callable[[Known], Result]) -> Callable[[Known], Result]:
    """The function of one frozen record, which keeps each result as long as the record is there."""
    results: WeakKeyDictionary[Known, Result] = WeakKeyDictionary()

    def found(known: Known) -> Result:
        result = results.get(known)
        if result is None:
            result = results[known] = function(known)
        return result

    found.__doc__ = function.__doc__
    return found
