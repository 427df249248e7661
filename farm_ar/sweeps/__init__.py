"""Sweeps that lose nothing: thousands of small runs, on machines that get killed, reused and shared."""

from farm_ar.sweeps.errors import StoreError, UnfinishedSweepError
from farm_ar.sweeps.executors import EXECUTORS, make_executor
from farm_ar.sweeps.executors.base import Executor, SerialExecutor
from farm_ar.sweeps.executors.process import ProcessExecutor
from farm_ar.sweeps.executors.ray import RayExecutor
from farm_ar.sweeps.results import Failure, Results
from farm_ar.sweeps.run import Standing, Watcher, run_sweep
from farm_ar.sweeps.store import Store
from farm_ar.sweeps.unit import Outcome, Row, Sweep, Unit, grid

__all__ = [
    "EXECUTORS",
    "Executor",
    "Failure",
    "Outcome",
    "ProcessExecutor",
    "RayExecutor",
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
