"""Executors, by name."""

from __future__ import annotations

from farm_ar.errors import OptionError, known_name
from farm_ar.sweeps.executors.base import SerialExecutor
from farm_ar.sweeps.executors.process import ProcessExecutor

EXECUTORS = ("process", "serial")


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
    if known_name("executor", name, EXECUTORS) == "process":
        return ProcessExecutor(workers, time_limit)
    if time_limit is not None:
        raise OptionError("time_limit", "must be None with the executor serial; process has one", time_limit)
    return SerialExecutor()
