"""What a sweep costs beyond a bare loop over the same units, and what a second worker brings.

    python benchmarks/sweeps.py [units in a round]

A unit is a fixed piece of work of about 1 ms. All ways take turns in one run, each with a new store; workers
have been started before. Ratios are of wall-clock time, medians over the rounds: on a machine that has other
work to do they say little.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from farm_ar.sweeps import Executor, ProcessExecutor, SerialExecutor, Sweep, grid, run_sweep

ROUNDS = 5
UNIT_S = 1e-3


def piece(seed: int, unit: int, turns: int) -> dict[str, int]:
    """A unit: so many turns of arithmetic, with no array and no wait."""
    value = unit + seed
    for _ in range(turns):
        value = (value * 1_103_515_245 + 12_345) % 2_147_483_648
    return {"value": value}


def turns_of_a_unit() -> int:
    """How many turns take a millisecond here, at the machine's best."""
    turns, spent = 2000, []
    for _ in range(300):
        begin = time.process_time()
        piece(0, 0, turns)
        spent.append(time.process_time() - begin)
    return int(turns * UNIT_S / min(spent))


def bare(units: int, turns: int) -> float:
    """Seconds of a bare loop."""
    begin = time.perf_counter()
    rows = [piece(0, unit, turns) for unit in range(units)]
    assert len(rows) == units
    return time.perf_counter() - begin


def swept(executor: Executor, units: int, turns: int) -> float:
    """Seconds of a sweep, from its parameters to its rows, with a new store."""
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        sweep = Sweep("benchmark", piece, grid(unit=range(units), turns=[turns]))
        rows = run_sweep(sweep, Path(folder) / "store", executor).rows()
        spent = time.perf_counter() - begin
    assert len(rows) == units
    return spent


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("units", nargs="?", type=int, default=1000)
    units = parser.parse_args().units
    turns = turns_of_a_unit()
    executors = {
        "serial": SerialExecutor(),
        "1 process": ProcessExecutor(1),
        "2 processes": ProcessExecutor(2),
    }
    ways: dict[str, Callable[[], float]] = {"bare loop": lambda: bare(units, turns)}
    for name, executor in executors.items():
        swept(executor, 50, turns)
        ways[name] = lambda executor=executor: swept(executor, units, turns)  # type: ignore[misc]
    spent: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(ROUNDS):
        for name, way in ways.items():
            spent[name].append(way())
    for executor in executors.values():
        executor.stop()
    load = f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    print(f"{units} units, {ROUNDS} rounds; {load}")
    print(f"{'':20}{'ms a unit':>10}{'by bare loop':>14}")
    for name, seconds in spent.items():
        ratio = np.median(np.divide(seconds, spent["bare loop"]))
        print(f"{name:20}{1e3 * np.median(seconds) / units:10.3f}{ratio:14.2f}")
    scaling = np.median(np.divide(spent["1 process"], spent["2 processes"]))
    print(f"2 processes do {scaling:.2f} times what 1 does")


if __name__ == "__main__":
    main()
