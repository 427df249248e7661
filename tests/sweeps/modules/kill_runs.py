"""Runs a sweep in processes of its own, and kills them: `python kill_runs.py WHAT FOLDER`, prints JSON.

All is imported once, and each run is a fork, so that fifty of them take seconds.
"""

import json
import os
import signal
import sys
import time
import traceback
from pathlib import Path

import numpy as np

from farm_ar.sweeps import ProcessExecutor, SerialExecutor, Sweep, grid, run_sweep

UNITS = 250


def planned(function="slow", **parameters):
    grid_of_all = grid(x=range(UNITS), **{name: [value] for name, value in parameters.items()})
    return Sweep("killed", f"sweep_functions:{function}", grid_of_all)


def run(store, executor=SerialExecutor, **options):
    with executor() as where:
        return run_sweep(planned(**options), store, where, keep_every=0.01)


def begin(*arguments, **parameters):
    """A process that runs the sweep and ends with 0 when it is complete."""
    pid = os.fork()
    if pid == 0:
        complete = False
        try:
            complete = len(run(*arguments, **parameters)) == UNITS
        except Exception:
            traceback.print_exc()
        finally:
            os._exit(0 if complete else 1)
    return pid


def ended_well(pid):
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0


def random_moments(folder, kills, longest, **options):
    """Kill runs at random moments until so many were killed; once a sweep is complete, another begins."""
    rng = np.random.default_rng(0)
    stores, killed = 0, 0
    while killed < kills:
        pid = begin(folder / f"store-{stores}", **options)
        time.sleep(rng.uniform(0, longest))
        os.kill(pid, signal.SIGKILL)
        code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        killed += code != 0
        stores += code == 0
    return {"killed": killed, "well": [ended_well(begin(folder / f"store-{stores}", **options))]}


def together(folder):
    """Two runs on one store at once."""
    options = {"function": "logged", "log": str(folder / "log"), "seconds": 0.002}
    pids = [begin(folder / "store", **options) for _ in range(2)]
    return {"well": [ended_well(pid) for pid in pids]}


def survivor(folder):
    """Two runs on one store at once, of which one is killed in the middle."""
    options = {"function": "logged", "log": str(folder / "log"), "seconds": 0.002}
    first, second = (begin(folder / "store", **options) for _ in range(2))
    while not ((folder / "log").exists() and len((folder / "log").read_text().split()) > 50):
        time.sleep(0.005)
    os.kill(first, signal.SIGKILL)
    return {"well": [ended_well(first), ended_well(second)]}


def full_disk(folder):
    """A run that may write no file beyond 400 kB, and says how it ended."""
    import resource

    resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))
    try:
        run(folder / "store", function="bulky")
    except Exception as problem:
        return {"error": type(problem).__name__, "message": str(problem)}
    return {}


if __name__ == "__main__":
    what, folder = sys.argv[1], Path(sys.argv[2])
    assert planned().units, "the version of the code is found out once, before all forks"
    todo = {
        "serial": lambda: random_moments(folder, kills=42, longest=0.15),
        "process": lambda: random_moments(folder, kills=8, longest=0.9, executor=ProcessExecutor),
        "together": lambda: together(folder),
        "survivor": lambda: survivor(folder),
        "full disk": lambda: full_disk(folder),
    }
    print(json.dumps(todo[what]()))
