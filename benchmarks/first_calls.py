"""Processor seconds of first calls with nothing compiled, each in a process of its own.

    python benchmarks/first_calls.py [--kernels N] [NAME ...]

The names of re-identifiers (`spatial`) and environments (`FarmToTable-v0`); all by default. `--kernels`
lists the N kernels of each that cost most, without what they call. The exit code is 1 where one takes more
than `LIMIT_S`.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from typing import Any

LIMIT_S = 15.0
"""What a first call may take, seconds of processor, with the start of the process."""

ENVIRONMENTS = ("FarmToTable-v0", "FarmToTableHand-v0", "FarmToTableLayout-v0", "SceneLayout-v0")


def first_call(name: str) -> None:
    """One identification with its confidence, or a reset and eight steps of an environment."""
    import gymnasium as gym
    import numpy as np

    from farm_ar.reid.registry import reid_factory
    from farm_ar.scenes import builtin_scene
    from farm_ar.testing.reidentifiers import snapshots_of

    if name in ENVIRONMENTS:
        env = gym.make(f"farm_ar:{name}")
        env.reset(seed=0)
        env.action_space.seed(0)
        for _ in range(8):
            *_, ended, cut, _ = env.step(env.action_space.sample())
            if ended or cut:
                env.reset()
        return
    scene = builtin_scene("farm")
    _, snapshot = next(iter(snapshots_of(scene, np.random.default_rng(0))))
    assert len(reid_factory(name)(scene).identify(snapshot).confidence) == len(snapshot.detections.ids)


def costliest(name: str, count: int) -> None:
    """The same, and the kernels that cost most, in seconds."""
    from numba.core import event

    spent: list[tuple[float, str]] = []
    open_: list[list[float]] = []

    class Listener(event.Listener):  # type: ignore[misc]
        def on_start(self, event: Any) -> None:
            open_.append([time.process_time(), 0.0])

        def on_end(self, event: Any) -> None:
            begin, inner = open_.pop()
            whole = time.process_time() - begin
            if open_:
                open_[-1][1] += whole
            function = event.data["dispatcher"].py_func
            spent.append((whole - inner, f"{function.__module__}.{function.__qualname__}"))

    event.register("numba:compile", Listener())
    first_call(name)
    for seconds, kernel in sorted(spent, reverse=True)[:count]:
        print(f"    {seconds:5.2f} {kernel}", flush=True)


def measure(name: str, kernels: int) -> float:
    """Seconds of processor of a process with an empty cache."""
    with tempfile.TemporaryDirectory() as folder:
        surroundings = os.environ | {"NUMBA_CACHE_DIR": folder, "FARM_AR_QUIET": "1"}
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(
            [sys.executable, __file__, "--inside", name, "--kernels", str(kernels)],
            env=surroundings,
            check=True,
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Measure, and print a line each."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--kernels", type=int, default=0, metavar="N")
    parser.add_argument("--inside", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.inside:
        costliest(given.inside, given.kernels) if given.kernels else first_call(given.inside)
        return
    from farm_ar.reid.registry import REIDENTIFIERS

    seconds = {}
    for name in given.names or [*REIDENTIFIERS, *ENVIRONMENTS]:
        seconds[name] = measure(name, given.kernels)
        print(f"{seconds[name]:6.1f} s  {name}", flush=True)
    sys.exit(max(seconds.values()) > LIMIT_S)


if __name__ == "__main__":
    main()
