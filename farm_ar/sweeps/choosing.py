"""Executors by name."""

from __future__ import annotations

from farm_ar.errors import OptionError
from farm_ar.sweeps.executors import SerialExecutor
from farm_ar.sweeps.processes import ProcessExecutor

EXECUTORS = ("serial", "process")


def make_executor(
    name: str = "process", workers: int = 2, time_limit: float | None = None
) -> SerialExecutor | ProcessExecutor:
    """The executor of a name.

    Args:
        name: one of `EXECUTORS`.
        workers: processes; serial has one.
        time_limit: seconds that one unit may take; serial knows no limit.

    Raises:
        OptionError: a value is none of those allowed.
    """
    if name == "process":
        return ProcessExecutor(workers, time_limit)
    if name == "serial":
        if time_limit is not None:
            raise OptionError(
                "time_limit", "must be None with the executor serial; process has one", time_limit
            )
        return SerialExecutor()
    raise OptionError("executor", f"must be one of {', '.join(EXECUTORS)}", name)
