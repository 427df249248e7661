"""Sweeps that lose nothing: thousands of small runs, on machines that get killed, reused and shared."""

from farm_ar.sweeps.choosing import EXECUTORS, make_executor
from farm_ar.sweeps.errors import StoreError, UnfinishedSweepError
from farm_ar.sweeps.executors import Executor, SerialExecutor
from farm_ar.sweeps.processes import ProcessExecutor
from farm_ar.sweeps.results import Failure, Results
from farm_ar.sweeps.rows import Outcome, Row
from farm_ar.sweeps.running import Standing, Watcher, run_sweep
from farm_ar.sweeps.store import Store
from farm_ar.sweeps.units import Sweep, Unit, grid

__all__ = [
    "EXECUTORS",
    "Executor",
    "Failure",
    "Outcome",
    "ProcessExecutor",
    "Results",
    "Row",
    "SerialExecutor",
    "Standing",
    "Store",
    "StoreError",
    "Sweep",
    "UnfinishedSweepError",
    "Unit",
    "Watcher",
    "grid",
    "make_executor",
    "run_sweep",
]
