"""Executors, by name."""

from __future__ import annotations

from farm_ar.errors import OptionError, known_name
from farm_ar.sweeps.executors.base import SerialExecutor
from farm_ar.sweeps.executors.process import ProcessExecutor
from farm_ar.sweeps.executors.ray import RayExecutor

EXECUTORS = ("process", "ray", "serial")


def make_executor(
    name: str = "process", workers: int = 2, time_limit: float | None = None, address: str = "auto"
) -> SerialExecutor | ProcessExecutor | RayExecutor:
    """The executor of a name.

    Args:
        name: one of `EXECUTORS`.
        workers: processes; serial has one, ray as many as the cluster has cores.
        time_limit: seconds that one unit may take; serial knows no limit.
        address: of the cluster, for ray.

    Raises:
        OptionError: a value is none of those allowed.
        MissingPackageError: the executor needs a package that is not installed.
    """
    if known_name("executor", name, EXECUTORS) == "process":
        return ProcessExecutor(workers, time_limit)
    if name == "ray":
        return RayExecutor(address, time_limit)
    if time_limit is not None:
        raise OptionError("time_limit", "must be None with the executor serial; process has one", time_limit)
    return SerialExecutor()
