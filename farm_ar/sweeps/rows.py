"""What a unit gives: rows of JSON values, and beside them what was measured and repeats for no seed."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from farm_ar.errors import OptionError

Row = Mapping[str, Any]
"""Column to JSON value; NumPy's scalars and arrays may stand for numbers and lists."""

EXACT_KINDS = "biufU"
"""Kinds of NumPy values that JSON holds exactly: Booleans, whole numbers, floats, text."""


@dataclass(frozen=True)
class Outcome:
    """What one unit gives.

    Args:
        rows: the results, a function of parameters and seed alone.
        measured: rows of measured times and the like, kept in a table of their own.
    """

    rows: Sequence[Row]
    measured: Sequence[Row] = ()


def as_outcome(result: object) -> Outcome:
    """What a unit's function returned, as an outcome: an `Outcome`, one row, or a list of rows.

    Raises:
        OptionError: it is none of these.
    """
    if isinstance(result, Outcome):
        return result
    if isinstance(result, Mapping):
        return Outcome([result])
    if isinstance(result, list | tuple) and all(isinstance(row, Mapping) for row in result):
        return Outcome(result)
    expected = "must be a row, a list of rows or an Outcome; a row is a mapping from column to JSON value"
    raise OptionError("result", expected, result)


def to_text(value: object, field: str) -> str:
    """A value as JSON text, in the order in which it stands; floats exactly, not-a-number among them.

    Raises:
        OptionError: there is something in it that JSON cannot hold exactly; the message says where.
    """
    return json.dumps(plain(value, field), separators=(",", ":"), ensure_ascii=False)


def plain(value: object, field: str) -> Any:
    """A value made of Python's own JSON types, each number exactly what it was.

    Raises:
        OptionError: there is something in it that JSON cannot hold exactly; the message says where.
    """
    if value is None or type(value) in (str, float, int, bool):
        return value
    if isinstance(value, np.ndarray | np.generic):
        if value.dtype.kind in EXACT_KINDS and value.dtype != np.longdouble:
            return value.tolist()
    elif isinstance(value, Mapping):
        for name in value:
            if not isinstance(name, str):
                raise OptionError(field, "must have text for names", name)
        return {str(name): plain(item, f"{field}.{name}") for name, item in value.items()}
    elif isinstance(value, list | tuple):
        return [plain(item, f"{field}[{i}]") for i, item in enumerate(value)]
    raise OptionError(field, "must be a JSON value, or a NumPy one that JSON holds exactly", value)
