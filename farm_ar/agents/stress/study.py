"""Running a stress test as sweeps: interrupted, it goes on where it stopped."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from farm_ar.agents.attacks import Learned, attack_named
from farm_ar.agents.stress.options import StressOptions
from farm_ar.agents.stress.rules import RULES
from farm_ar.agents.stress.units import attack_case, describe_case
from farm_ar.sweeps import Executor, Row, Store, Sweep, Watcher, grid, run_sweep
from farm_ar.sweeps.versions import code_version


@dataclass(frozen=True, eq=False)
class Study:
    """What a stress test found.

    Args:
        options: what was asked for.
        known: a row per case and re-identifier, as `describe_case` gives it.
        attacked: a row per case, re-identifier and attack, as `attack_case` gives it.
        measured: seconds of each attack, of the processor.
    """

    options: StressOptions
    known: Sequence[Row]
    attacked: Sequence[Row]
    measured: Sequence[Row]


def run_stress(
    options: StressOptions,
    store: Store | str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    watch: Watcher = lambda standing: None,
) -> Study:
    """Run a stress test.

    Args:
        options: what is asked for.
        store: where finished units are kept; None keeps them in memory.
        executor: where units run; by default in this process.
        watch: is told how far it is.

    Raises:
        UnfinishedSweepError: a unit failed; what the others gave is kept.
        StoreError: the store cannot be used.
    """
    shared: dict[str, Any] = {"scene": [options.scene], "jitter": [options.jitter]}
    shared |= {"case": range(options.cases), "reid": options.reids}
    looks = grid(**shared, draws=[options.noise_draws])
    for call in looks:
        call["code"] = _code_of([call["reid"]])
    known = Sweep(f"stress-cases-{options.scene}", describe_case, looks, [options.seed])
    calls = grid(**shared, attack=options.attacks, queries=[options.queries], budget=[options.budget])
    for call in calls:
        call["transfer"] = list(options.reids)
        call["code"] = _code_of(options.reids, call["attack"])
    attacks = Sweep(f"stress-attacks-{options.scene}", attack_case, calls, [options.seed])
    with Store(store) if not isinstance(store, Store) else _kept_open(store) as opened:
        facts = run_sweep(known, opened, executor, watch=watch)
        found = run_sweep(attacks, opened, executor, watch=watch)
    measured = [row for outcome in found.outcomes() for row in outcome.measured]
    return Study(options, facts.rows(), found.rows(), measured)


def _code_of(reids: Sequence[str], attack: str | None = None) -> str:
    """The version of what a unit runs that is not farm-ar's: somebody's own rules, trained players."""
    parts = [code_version(reid) for reid in reids if reid not in RULES]
    found = None if attack is None else attack_named(attack)
    return " ".join([*parts, found.fingerprint] if isinstance(found, Learned) else parts)


class _kept_open:  # noqa: N801  # reads like a function
    """Lends a store that is open, and leaves it open."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def __enter__(self) -> Store:
        return self._store

    def __exit__(self, *ended: object) -> None:
        return
