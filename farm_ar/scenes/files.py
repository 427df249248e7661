"""Text files: read where they are plain files, written whole or not at all."""

from __future__ import annotations

import codecs
import csv
import io
import json
import os
import stat
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

from farm_ar.arrays import FloatArray, number_in
from farm_ar.errors import InputError

MOST_BYTES = 64 * 2**20
"""The largest file that is read."""

FORMULA_SIGNS = ("=", "+", "-", "@", "\t", "\r")
"""What text begins with that a spreadsheet takes for a formula."""

_MARKS = {codecs.BOM_UTF32_LE: "UTF-32", codecs.BOM_UTF16_LE: "UTF-16", codecs.BOM_UTF16_BE: "UTF-16"}


def read_text(path: str | os.PathLike[str], error: type[InputError], kind: str) -> str:
    """The text of a file in UTF-8, without a byte order mark.

    Args:
        path: the file.
        error: the class of the errors to raise.
        kind: what the file must be, for errors, as in "JSON".

    Raises:
        InputError: of the class given; it is no plain file (a pipe or a device may never end), is larger than
            `MOST_BYTES`, cannot be read, or is in another encoding.
    """
    data = read_bytes(path, error)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        name = next((name for mark, name in _MARKS.items() if data.startswith(mark)), None)
        got = name or f"Latin-1 or Windows-1252, it seems: byte 0x{data[problem.start]:x} at {problem.start}"
        raise error("file", f"must be {kind} in UTF-8", got, Path(path).name) from None


def read_bytes(path: str | os.PathLike[str], error: type[InputError]) -> bytes:
    """The bytes of a plain file.

    Raises:
        InputError: as `read_text`.
    """
    try:
        mode = Path(path).stat().st_mode
        if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
            raise error("file", "must be a plain file", "a pipe or a device", os.fspath(path))
        with Path(path).open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except InputError:
        raise
    except (OSError, ValueError) as problem:  # ValueError: a NUL in the name
        reason = (isinstance(problem, OSError) and problem.strerror) or str(problem)
        raise error("file", "must be a readable file", reason, os.fspath(path)) from None
    if len(data) > MOST_BYTES:
        expected = f"must be at most {MOST_BYTES >> 20} MiB"
        raise error("file", expected, "a larger file", os.fspath(path))
    return data


def read_json(path: str | os.PathLike[str], error: type[InputError]) -> Any:
    """The contents of a JSON file.

    Raises:
        InputError: of the class given, when the file cannot be read or is not JSON, or an object in it has
            two fields of one name.
    """
    text = read_text(path, error, "JSON")
    try:
        return json_in(text)
    except (ValueError, RecursionError) as problem:
        raise error("file", "must be JSON", str(problem), Path(path).name) from None


def json_in(text: str) -> Any:
    """The contents of JSON text.

    Raises:
        ValueError: it is not JSON, or an object in it has two fields of one name.
        RecursionError: it is nested too deep.
    """
    return json.loads(text, object_pairs_hook=_without_repeats)


@contextmanager
def whole_file(path: str | os.PathLike[str], suffix: str = "") -> Iterator[Path]:
    """A temporary name beside a file's own, under which it is written; it takes its place when all is well.

    Args:
        path: the file; its folder is made if need be.
        suffix: what the temporary name ends in, for programs that look at that.
    """
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = target.with_name(f".{target.name}.{uuid4().hex}{suffix}")
    try:
        yield temporary
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a file whole or not at all."""
    with whole_file(path) as temporary, temporary.open("x", encoding="utf-8", newline="\n") as file:
        file.write(text)


def csv_table(columns: Iterable[str], rows: Iterable[Mapping[str, Any]]) -> str:
    """Rows as CSV; a column that a row has not, or has None in, is empty.

    Text that a spreadsheet would take for a formula gets an apostrophe in front; numbers stay as they are.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = list(columns)
    writer.writerow(map(_no_formula, names))
    writer.writerows([_no_formula(row.get(name)) for name in names] for row in rows)
    return text.getvalue()


def _no_formula(value: Any) -> Any:
    formula = isinstance(value, str) and value.startswith(FORMULA_SIGNS)
    return f"'{value}" if formula and value != "-Infinity" and number_in(value) is None else value


def json_values(value: Any) -> Any:
    """The value with None for numbers that are not finite, which JSON does not have."""
    if isinstance(value, dict):
        return {name: json_values(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [json_values(item) for item in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def degrees(angle: float | FloatArray) -> float:
    """An angle as files have it, from radians.

    Rounded just above the error of turning degrees into radians and back, so that what was read is written
    as it stood.
    """
    return round(float(np.rad2deg(angle)), 12)


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for name, value in pairs:
        if name in values:
            raise ValueError(f"the field {name} twice in one object")
        values[name] = value
    return values
