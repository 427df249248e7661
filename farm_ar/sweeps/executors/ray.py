"""The executor that runs units on the machines of a Ray cluster, which may come, go, and be killed."""

from __future__ import annotations

import logging
import os
import signal
import socket
import sys
import time
import warnings
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from farm_ar.errors import MissingPackageError, OptionError
from farm_ar.sweeps.executors.base import Attempt, Stoppable, attempt, mean_seconds
from farm_ar.sweeps.executors.process import (
    checked_limit,
    pack_attempt,
    pack_unit,
    prepare,
    unpack_attempt,
    unpack_unit,
)
from farm_ar.sweeps.unit import Unit

TASK_S, MOST_IN_A_TASK = 0.3, 256
"""Work that goes to a machine at once, so that asking for it costs little: seconds, units."""

AHEAD = 2
"""Tasks for each core, so that none waits for the next."""

LOOK_S = 1.0
"""How often the number of cores is asked for."""

MOST_LOST = 3
"""So many machines that were lost with a unit count against it from there on."""

CONNECT_S = 5.0
"""How long a cluster may take to answer."""

CLUSTER = "must be of a Ray cluster that runs, HOST:PORT as `ray start --head` prints it"

_LOG = logging.getLogger(__name__)


class RayExecutor(Stoppable):
    """Runs units on a Ray cluster, one for each core. The store stays here: workers send rows.

    A unit whose machine is lost is run again on another. One that kills its worker comes back as killed.

    Args:
        address: of the cluster's head, "HOST:PORT"; "auto" for the one that runs on this machine.
        time_limit: seconds that one unit may take; loading its function has as much for itself.

    Raises:
        MissingPackageError: Ray is not installed.
        OptionError: no cluster answers there, or the limit is not a positive number.
    """

    def __init__(self, address: str = "auto", time_limit: float | None = None) -> None:
        self._address, self._time_limit = address, checked_limit(time_limit)
        self._waiting: deque[Unit] = deque()
        self._tasks: dict[Any, _Task] = {}
        self._alone: set[str] = set()
        self._lost: dict[str, int] = {}
        self._mean_seconds: float | None = None
        self._cores, self._looked = 1, -LOOK_S
        self._ray = _library()
        self._own = not self._ray.is_initialized()
        task = self._ray.remote(num_cpus=1, max_retries=0, scheduling_strategy="SPREAD")
        self._run = task(run_units)
        self._connect()

    @property
    def capacity(self) -> int:
        """Units for each core of the cluster as it is now, with those ahead."""
        self._connect()
        return self._places() * self._in_a_task()

    def submit(self, unit: Unit) -> None:
        """Take a unit."""
        self._connect()
        self._waiting.append(unit)

    def collect(self, seconds: float) -> Sequence[Attempt]:
        """The attempts that ended; waits for the first."""
        self._hand_out()
        if not self._tasks:
            return []
        ready, _ = self._ray.wait([*self._tasks], num_returns=1, timeout=seconds)
        if ready:
            ready, _ = self._ray.wait([*self._tasks], num_returns=len(self._tasks), timeout=0)
        ended = [done for one in ready for done in self._ended(one, self._tasks.pop(one))]
        self._mean_seconds = mean_seconds(self._mean_seconds, ended)
        self._hand_out()
        return ended

    def stop(self) -> None:
        """Drop what was submitted, end its workers, and leave the cluster."""
        self._waiting.clear()
        for one in self._tasks:
            with suppress(Exception):  # of a cluster that is no more
                self._ray.cancel(one, force=True)
        self._tasks.clear()
        if self._own:
            self._ray.shutdown()

    def _connect(self) -> None:
        if self._ray.is_initialized():
            return
        self._see_that_it_answers()
        options = {"log_to_driver": False, "configure_logging": False, "logging_level": logging.CRITICAL}
        try:
            with _quiet():
                self._ray.init(address=self._address, **options)
        except (ConnectionError, ValueError, RuntimeError, AssertionError):
            raise OptionError("address", CLUSTER, self._address) from None
        # It prints on standard output, where results go, what befalls its machines; we say that ourselves.
        import_module("ray._private.worker").print_to_stdstream = lambda *given, **named: None  # type: ignore[attr-defined]

    def _see_that_it_answers(self) -> None:
        """Ray itself would ask for minutes."""
        host, _, port = self._address.rpartition(":")
        if self._address == "auto":
            return
        try:
            with socket.create_connection((host, int(port)), CONNECT_S):
                return
        except (OSError, ValueError, OverflowError):
            raise OptionError("address", CLUSTER, self._address) from None

    def _places(self) -> int:
        """How many tasks there may be."""
        if time.monotonic() - self._looked > LOOK_S:
            self._looked = time.monotonic()
            self._cores = max(1, int(self._ray.cluster_resources().get("CPU", 0)))
        return AHEAD * self._cores

    def _in_a_task(self) -> int:
        if self._mean_seconds is None:
            return 1
        return max(1, min(MOST_IN_A_TASK, int(TASK_S / max(self._mean_seconds, 1e-6))))

    def _hand_out(self) -> None:
        """Give waiting units to the cores, in equal parts."""
        free = self._places() - len(self._tasks)
        most = min(self._in_a_task(), -(-len(self._waiting) // max(free, 1)))
        path = [folder or str(Path.cwd()) for folder in sys.path]
        while self._waiting and free > 0:
            units = [self._waiting.popleft()]
            while (
                self._waiting
                and len(units) < most
                and self._alone.isdisjoint((units[0].key, self._waiting[0].key))
            ):
                units.append(self._waiting.popleft())
            task = self._run.remote([pack_unit(unit) for unit in units], path, self._time_limit)
            self._tasks[task] = _Task(units, time.monotonic())
            free -= 1

    def _ended(self, one: Any, task: _Task) -> list[Attempt]:
        """What a task came to; units that can be run again wait again."""
        failures = self._ray.exceptions
        try:
            answers = self._ray.get(one)
        except (failures.NodeDiedError, failures.ObjectLostError, failures.OwnerDiedError):
            return self._on_a_lost_machine(task)
        except (
            failures.WorkerCrashedError,
            failures.OutOfMemoryError,
            failures.LocalRayletDiedError,
        ) as problem:
            if len(task.units) > 1:  # whose fault it was is seen when each runs alone
                self._alone |= {unit.key for unit in task.units}
                self._waiting.extendleft(reversed(task.units))
                return []
            return [self._killed(task, type(problem).__name__)]
        except failures.RayError as problem:  # the machine could not even begin: it lacks the package, say
            return [Attempt(unit, problem=str(problem)) for unit in task.units]
        return [unpack_attempt(unit, data) for unit, data in zip(task.units, answers, strict=True)]

    def _on_a_lost_machine(self, task: _Task) -> list[Attempt]:
        _LOG.warning("a machine of the cluster was lost: %d units are run elsewhere", len(task.units))
        ended, again = list[Attempt](), list[Unit]()
        for unit in task.units:
            self._lost[unit.key] = self._lost.get(unit.key, 0) + 1
            if self._lost[unit.key] > MOST_LOST:
                problem = f"{self._lost[unit.key]} machines were lost on which it ran"
                ended.append(Attempt(unit, problem=problem, killed=True))
            else:
                again.append(unit)
        self._waiting.extendleft(reversed(again))
        return ended

    def _killed(self, task: _Task, what: str) -> Attempt:
        seconds, limit = time.monotonic() - task.since, self._time_limit
        problem = f"its worker died ({what})"
        if limit is not None and seconds >= limit:
            problem += f", or was ended after the time limit of {limit} s"
        return Attempt(task.units[0], seconds=seconds, problem=problem, killed=True)


class _Task:
    """Units that one core was given, and when."""

    def __init__(self, units: Sequence[Unit], since: float) -> None:
        self.units, self.since = units, since


_READY: set[tuple[str, str]] = set()
"""Functions that this worker has loaded, with the version that was checked."""


def run_units(units: Sequence[bytes], path: Sequence[str], time_limit: float | None) -> list[bytes]:
    """Run units on a machine of the cluster.

    Args:
        units: as `pack_unit` gives them.
        path: where the one who asks looks for modules; folders that are not here are passed over.
        time_limit: seconds for each; a worker that overruns it ends.

    Returns:
        The attempts, as `pack_attempt` gives them.
    """
    sys.path[:] = dict.fromkeys([*path, *sys.path])
    answers = []
    for data in units:
        unit = unpack_unit(data)
        problem = None
        if (unit.function, unit.version) not in _READY:
            with _ended_after(time_limit):
                problem = prepare(unit)
            if problem is None:
                _READY.add((unit.function, unit.version))
        with _ended_after(time_limit):
            answers.append(pack_attempt(problem or attempt(unit)))
    return answers


@contextmanager
def _ended_after(seconds: float | None) -> Iterator[None]:
    """The system ends this process if what is inside takes longer, whatever it does."""
    if seconds is None:
        yield
        return
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def _library() -> Any:
    """Ray.

    Raises:
        MissingPackageError: it is not installed.
    """
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        with _quiet():
            return import_module("ray")
    except ImportError:
        raise MissingPackageError("the executor ray needs ray: pip install 'farm-ar[distributed]'") from None


@contextmanager
def _quiet() -> Iterator[None]:
    """Without Ray's warnings about itself."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
