"""A sweep's rows as one table, in the order of its units, for any other program."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from typing import Any

from farm_ar.scenes.files import csv_table
from farm_ar.sweeps.results import Results


def as_csv(results: Results, measured: bool = False) -> str:
    """The rows of all finished units as CSV, each behind the parameters and the seed of its unit.

    A column of the rows that is called like a parameter gets `result.` before its name. Numbers keep every
    digit; lists are JSON; null and not-a-number are empty.

    Args:
        results: of the sweep.
        measured: the measured rows in place of the results; then with `unit_seconds`, how long the unit took.
    """
    rows = []
    for unit, outcome in results.finished():
        given = {**unit.parameters, "seed": unit.seed}
        extra: Iterable[Mapping[str, Any]] = outcome.rows
        if measured:
            seconds = {"unit_seconds": results.seconds[unit.key]}
            extra = [seconds | dict(row) for row in outcome.measured] or [seconds]
        rows += [
            given | {f"result.{name}" if name in given else name: value for name, value in row.items()}
            for row in extra
        ]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    return csv_table(columns, ({name: _cell(value) for name, value in row.items()} for row in rows))


def _cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
