"""Running one unit, and what came of it: all that an executor carries to and fro."""

from __future__ import annotations

import time
import traceback
from dataclasses import dataclass

from farm_ar.sweeps.functions import load_function
from farm_ar.sweeps.rows import as_outcome, to_text
from farm_ar.sweeps.units import Unit
from farm_ar.sweeps.versions import BY_HAND, code_version


@dataclass(frozen=True)
class Attempt:
    """How one attempt at a unit ended.

    Args:
        unit: what was tried.
        rows: JSON text of the list of rows; None where there are none.
        measured: JSON text of the list of measured rows.
        seconds: how long it took.
        problem: what went wrong; "" where nothing did.
        killed: whether it took its worker along, so that another attempt may do better.
    """

    unit: Unit
    rows: str | None = None
    measured: str = "[]"
    seconds: float = 0.0
    problem: str = ""
    killed: bool = False


def attempt(unit: Unit) -> Attempt:
    """Run a unit here and now. An exception is an outcome too; only an interruption comes out."""
    begin = time.perf_counter()
    try:
        function = load_function(unit.function)
        outcome = as_outcome(function(seed=unit.seed, **unit.parameters))
        rows, measured = to_text(outcome.rows, "rows"), to_text(outcome.measured, "measured")
    except Exception:
        return Attempt(unit, seconds=time.perf_counter() - begin, problem=traceback.format_exc())
    return Attempt(unit, rows, measured, time.perf_counter() - begin)


def check_version(unit: Unit) -> None:
    """See that the code here is that which the unit was planned with.

    Raises:
        RuntimeError: it is not.
    """
    if not unit.version.startswith(BY_HAND) and code_version(unit.function) != unit.version:
        raise RuntimeError(
            f"the code of {unit.function} is not that which the sweep began with ({unit.version}): "
            "it was changed meanwhile, or this worker has another installation"
        )
