"""The executor that runs units in processes of its own, which may die or be killed."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing import parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerContext, SpawnContext
from numbers import Integral, Real

from farm_ar.errors import OptionError
from farm_ar.sweeps.executors.base import Attempt, Stoppable, attempt, check_version, mean_seconds
from farm_ar.sweeps.unit import Unit, load_function

AHEAD_S, MOST_AHEAD, MOST_BYTES_AHEAD = 0.03, 64, 4096
"""Work that a busy worker is given ahead, so that it need not wait for the next unit: seconds, units, bytes.

So few bytes fit into any system's pipe, and sending them never waits for a worker that is itself sending.
"""

STARTS = 3
"""How often in a row a worker may end before it is ready."""


class ProcessExecutor(Stoppable):
    """Runs units in processes. One that dies, or overruns the time limit and is killed, is replaced.

    Args:
        workers: how many processes.
        time_limit: seconds that one unit may take; loading its function has as much for itself.

    Raises:
        OptionError: workers is not a whole number from 1 on, or the time limit not a positive number.
    """

    def __init__(self, workers: int = 2, time_limit: float | None = None) -> None:
        self._number = _checked_number(workers)
        self._time_limit = checked_limit(time_limit)
        self._workers: list[_Worker] = []
        self._waiting: deque[Unit] = deque()
        self._mean_seconds: float | None = None
        self._failed_starts: int = 0

    @property
    def capacity(self) -> int:
        """So many that no worker need wait between short units, and no long unit for another one."""
        return self._number * self._ahead()

    def submit(self, unit: Unit) -> None:
        """Take a unit."""
        self._waiting.append(unit)
        while len(self._workers) < min(self._number, len(self._waiting) + len(self._workers)):
            self._workers.append(_Worker())
        self._hand_out()

    def collect(self, seconds: float) -> Sequence[Attempt]:
        """The attempts that ended; waits for the first.

        Raises:
            RuntimeError: workers end again and again before they are ready.
        """
        ended: list[Attempt] = []
        patience = min(
            [seconds, *(left for worker in self._workers if (left := self._left(worker)) is not None)]
        )
        wait([worker.pipe for worker in self._workers], max(0.0, patience))
        for i, worker in enumerate(self._workers):
            was_ready = worker.ready
            ended += worker.receive()
            if worker.ready and not was_ready:
                self._failed_starts = 0
            overran = (left := self._left(worker)) is not None and left <= 0
            if overran:
                worker.kill()
            if worker.dead:
                self._workers[i] = self._replace(worker, ended, overran)
        self._mean_seconds = mean_seconds(self._mean_seconds, ended)
        self._hand_out()
        return ended

    def stop(self) -> None:
        """Drop what was submitted and end the processes."""
        self._waiting.clear()
        for worker in self._workers:
            worker.kill()
        self._workers.clear()

    def _replace(self, worker: _Worker, ended: list[Attempt], overran: bool) -> _Worker:
        """Blame the unit that ran for the end of its worker, give the others back, start another worker."""
        blamed, *others = worker.units or [None]
        self._waiting.extendleft(reversed([unit for unit in others if unit is not None]))
        if not worker.ready:
            self._failed_starts += 1
            if blamed is not None:
                self._waiting.appendleft(blamed)
            if self._failed_starts >= STARTS:
                raise RuntimeError(f"{STARTS} workers in a row ended before they were ready ({worker.end()})")
        if worker.ready and blamed is not None:
            seconds = time.monotonic() - worker.since
            problem = f"killed after the time limit of {self._time_limit} s" if overran else worker.end()
            ended.append(Attempt(blamed, seconds=seconds, problem=problem, killed=True))
        return _Worker()

    def _left(self, worker: _Worker) -> float | None:
        """Seconds until a worker's unit overruns the limit; None where there is no unit or no limit."""
        if self._time_limit is None or not (worker.units and worker.ready):
            return None
        return worker.since + self._time_limit - time.monotonic()

    def _ahead(self) -> int:
        if self._mean_seconds is None:
            return 1
        return min(MOST_AHEAD, 1 + int(AHEAD_S / max(self._mean_seconds, 1e-6)))

    def _hand_out(self) -> None:
        """Give waiting units to the workers that hold the fewest."""
        ahead = self._ahead()
        while self._waiting and self._workers:
            worker = min(self._workers, key=lambda each: len(each.units))
            if len(worker.units) >= ahead or not worker.send(self._waiting[0]):
                return
            self._waiting.popleft()


def _context() -> ForkServerContext | SpawnContext:
    """How processes are begun: as forks of a server that has done slow imports, or anew where there is none.

    A fork of this very process would copy locks that its threads hold. The server does not import farm-ar: it
    does not know this process's search path, and might find another installation.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["gymnasium"])
    return context


def _checked_number(workers: int) -> int:
    if not isinstance(workers, Integral) or workers < 1:
        raise OptionError("workers", "must be a whole number not below 1", workers)
    return int(workers)


def checked_limit(seconds: float | None) -> float | None:
    """A time limit, seconds; None for none.

    Raises:
        OptionError: it is not a positive number.
    """
    if seconds is not None and (not isinstance(seconds, Real) or not seconds > 0):
        raise OptionError("time_limit", "must be a positive number of seconds", seconds)
    return None if seconds is None else float(seconds)


class _Worker:
    """One process, its pipe, and the units that were sent into it; the first is the one that runs."""

    def __init__(self) -> None:
        self.pipe, other = multiprocessing.Pipe()
        self.process = _context().Process(target=work, args=(other,), daemon=True)
        self.process.start()
        other.close()
        self.units: deque[Unit] = deque()
        self.since = time.monotonic()
        self.ready = self.dead = False
        self._sizes: deque[int] = deque()

    def send(self, unit: Unit) -> bool:
        """Send a unit, unless so much is under way that sending might have to wait."""
        data = pack_unit(unit)
        if self.dead or (self.units and sum(self._sizes) + len(data) > MOST_BYTES_AHEAD):
            return False
        if not self.units:
            self.since = time.monotonic()
        self.units.append(unit)
        self._sizes.append(len(data))
        with suppress(OSError):  # where it died, `receive` finds that out, and what it left behind
            self.pipe.send_bytes(data)
        return True

    def receive(self) -> list[Attempt]:
        """What has come back."""
        ended = []
        try:
            while not self.dead and self.pipe.poll():
                data = self.pipe.recv_bytes()
                self.since = time.monotonic()
                self.ready = True
                if data != BEGUN:
                    self._sizes.popleft()
                    ended.append(unpack_attempt(self.units.popleft(), data))
        except (EOFError, OSError):
            self.process.join(1.0)  # it is about to end by itself, and then its exit code says how
            self.kill()
        return ended

    def kill(self) -> None:
        """End the process, if it has not ended by itself, and close its pipe."""
        if not self.dead:
            self.dead = True
            self.process.kill()
            self.process.join()
            self.pipe.close()

    def end(self) -> str:
        """How the process ended, in words."""
        code = self.process.exitcode
        if code is not None and code < 0:
            return f"its worker was ended by signal {-code} ({signal.Signals(-code).name})"
        return f"its worker ended with exit code {code}"


BEGUN = b""
"""Said when a worker is ready, and whenever it has loaded a function and begins to run it."""


def work(pipe: Connection) -> None:
    """Run the units that come through the pipe until it is closed or the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is interrupted too, and ends its workers
    threading.Thread(target=_end_with_the_parent, daemon=True).start()
    with suppress(EOFError, OSError):  # that is how a pipe without another end shows
        _work(pipe)


def _work(pipe: Connection) -> None:
    pipe.send_bytes(BEGUN)
    ready: set[tuple[str, str]] = set()
    while True:
        unit = unpack_unit(pipe.recv_bytes())
        problem = None
        if (unit.function, unit.version) not in ready:
            problem = prepare(unit)
            if problem is None:
                ready.add((unit.function, unit.version))
                pipe.send_bytes(BEGUN)
        pipe.send_bytes(pack_attempt(problem or attempt(unit)))


def prepare(unit: Unit) -> Attempt | None:
    """Load a unit's function; what went wrong, if anything did."""
    try:
        check_version(unit)
        load_function(unit.function)
    except Exception:
        return Attempt(unit, problem=traceback.format_exc())
    return None


def _end_with_the_parent() -> None:
    """A parent that was killed ends nobody: its workers see it themselves."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def pack_unit(unit: Unit) -> bytes:
    """A unit as bytes."""
    return json.dumps([unit.function, unit.text, unit.seed, unit.version]).encode()


def unpack_unit(data: bytes) -> Unit:
    """The unit of which `pack_unit` made these bytes."""
    return Unit(*json.loads(data))


def pack_attempt(done: Attempt) -> bytes:
    """All of an attempt but its unit as bytes."""
    return json.dumps([done.rows, done.measured, done.seconds, done.problem]).encode()


def unpack_attempt(unit: Unit, data: bytes) -> Attempt:
    """The attempt of which `pack_attempt` made these bytes."""
    return Attempt(unit, *json.loads(data))
