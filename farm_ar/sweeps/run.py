"""Running a sweep: what is finished is left alone, everything else is claimed, run, retried and kept."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from farm_ar.sweeps.errors import StoreError, of_the_store
from farm_ar.sweeps.executors.base import Attempt, Executor, SerialExecutor
from farm_ar.sweeps.leases import Presence
from farm_ar.sweeps.results import KILLS, Failure, Results
from farm_ar.sweeps.store import Store
from farm_ar.sweeps.unit import Sweep, Unit

AT_ONCE = 500
"""Units among which a run looks for some to claim."""

POLL_S = 0.1
"""How often a run that waits looks about, seconds."""


@dataclass(frozen=True)
class Standing:
    """How far a run is.

    Args:
        sweep: its name.
        total: units of the sweep.
        before: units that were finished when the run began.
        done: units finished since, by this run or another.
        failures: units given up.
        seconds: since the run began.
    """

    sweep: str
    total: int
    before: int
    done: int
    failures: int
    seconds: float

    @property
    def rate(self) -> float:
        """Units a second in this run."""
        return self.done / self.seconds if self.seconds > 0 else 0.0

    @property
    def left(self) -> int:
        """Units that have not ended."""
        return self.total - self.before - self.done - self.failures


Watcher = Callable[[Standing], None]
"""Is called at every step of a run; has to be quick."""


def run_sweep(
    sweep: Sweep,
    store: Store | str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    *,
    fresh: bool = False,
    retry: bool = False,
    watch: Watcher = lambda standing: None,
    keep_every: float = 0.5,
) -> Results:
    """Run what is not finished of a sweep, and give all its results.

    The results are the same whatever the executor, however often the run was killed and begun again, and
    however many runs shared the store. An exception in a unit's function ends that unit, not the run.

    Args:
        sweep: what to run.
        store: where results are kept, an open one or its file; None keeps them in memory.
        executor: where units are run; by default in this process. It stays open.
        fresh: forget all results of the sweep, and start over.
        retry: try quarantined units again.
        watch: is called with the progress.
        keep_every: seconds between two commits to the store: what a kill can lose, to be computed again.

    Raises:
        StoreError: the store cannot be opened, read or written; what was in it is still in it.
    """
    with _opened(store) as opened:
        opened.plan(sweep.name, sweep.units, fresh)
        if retry:
            opened.retry([unit.key for unit in sweep.units])
        _Run(sweep, opened, executor or SerialExecutor(), watch, keep_every).run()
        return opened.results(sweep.name)


@contextmanager
def _opened(store: Store | str | os.PathLike[str] | None) -> Iterator[Store]:
    if isinstance(store, Store):
        yield store
    else:
        with Store(store) as opened:
            yield opened


class _Run:
    """One run of a sweep; its units go from `todo` to `held` (claimed), `running`, and out."""

    def __init__(
        self, sweep: Sweep, store: Store, executor: Executor, watch: Watcher, keep_every: float
    ) -> None:
        self._sweep, self._store, self._executor = sweep, store, executor
        self._watch, self._keep_every = watch, keep_every
        keys = [unit.key for unit in sweep.units]
        finished = store.finished(keys)
        given_up = store.given_up(keys, since=float("inf"))
        self._kills = store.kills(keys)
        self._todo = deque(u for u in sweep.units if u.key not in finished and u.key not in given_up)
        self._held: deque[Unit] = deque()
        self._running: set[str] = set()
        self._finished: list[Attempt] = []
        self._failures: list[Failure] = []
        self._misses = 0
        self._before, self._done, self._lost = len(finished), 0, len(given_up)
        self._began_at, self._began = time.time(), time.perf_counter()
        self._kept = self._ask_at = self._began

    def run(self) -> None:
        """Run until every unit has ended, here or in another run on the store."""
        with of_the_store(self._store.path):
            presence = Presence(self._store.path)
        try:
            self._tell()
            while self._todo or self._held or self._running:
                self._step(presence.token)
            self._keep()
        except StoreError:
            self._executor.stop()
            raise
        except BaseException:
            self._executor.stop()
            self._keep()
            raise
        finally:
            presence.end()

    def _step(self, owner: str) -> None:
        room = len(self._running) < self._executor.capacity
        if self._todo and not self._held and room and time.perf_counter() >= self._ask_at:
            self._claim(owner)
        while self._held and len(self._running) < self._executor.capacity:
            unit = self._held.popleft()
            self._running.add(unit.key)
            self._executor.submit(unit)
        if self._running:
            for attempt in self._executor.collect(POLL_S):
                self._settle(attempt)
        elif not self._held and time.perf_counter() < self._ask_at:
            time.sleep(POLL_S)
        if time.perf_counter() - self._kept >= self._keep_every:
            self._keep()
        self._tell()

    def _claim(self, owner: str) -> None:
        """Claim as many units as half a second takes; keep what is finished in the same breath."""
        self._keep()
        rate = self._done / (time.perf_counter() - self._began)
        most = min(AT_ONCE, max(self._executor.capacity, int(rate * self._keep_every)))
        some = [self._todo.popleft() for _ in range(min(AT_ONCE, len(self._todo)))]
        claimed = self._store.claim(owner, [unit.key for unit in some], most, self._began_at)
        self._done += len(claimed.finished)
        self._lost += len(claimed.given_up)
        self._held.extend(unit for unit in some if unit.key in claimed.mine)
        taken = [unit for unit in some if unit.key in claimed.others]
        settled = claimed.mine | claimed.others | claimed.finished | claimed.given_up
        self._todo.extendleft(unit for unit in reversed(some) if unit.key not in settled)
        self._todo.extend(taken)
        self._misses = 0 if claimed.mine else self._misses + len(some)
        if self._misses >= len(self._todo):  # all that is left is another run's
            self._misses, self._ask_at = 0, time.perf_counter() + POLL_S

    def _settle(self, attempt: Attempt) -> None:
        unit = attempt.unit
        self._running.discard(unit.key)
        if not attempt.problem:
            self._done += 1
            self._finished.append(attempt)
            return
        kills = 0
        if attempt.killed:
            kills = self._kills[unit.key] = self._kills.get(unit.key, 0) + 1
        if 0 < kills < KILLS:
            self._held.appendleft(unit)
        else:
            self._lost += 1
        self._failures.append(Failure(unit, attempt.problem, kills))
        self._keep()  # at once: a unit that takes the machine along must be known by then

    def _keep(self) -> None:
        if self._finished or self._failures:
            self._store.save(self._finished, self._failures)
            self._finished, self._failures = [], []
        self._kept = time.perf_counter()

    def _tell(self) -> None:
        total, seconds = len(self._sweep.units), time.perf_counter() - self._began
        self._watch(Standing(self._sweep.name, total, self._before, self._done, self._lost, seconds))
