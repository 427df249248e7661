"""Functions for sweeps, importable by name in any process."""

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np

from farm_ar.sweeps import Outcome, ProcessExecutor, Sweep, grid, run_sweep


def double(seed, x):
    return {"double": 2 * x, "drawn": np.random.default_rng([seed, x]).random()}


def logged(seed, x, log, seconds=0.0):
    """Leaves a line in a file for every time that it is called."""
    time.sleep(seconds)
    with Path(log).open("a") as file:
        file.write(f"{x}\n")
    return double(seed, x)


def of_numpy(seed, values):
    exact = {"float": np.float64(0.1), "small": np.float32(0.1), "whole": np.int64(2**62)}
    return [
        exact | {"flag": np.bool_(True), "pair": (1, None), "none": None},
        {"list": np.array(values) / 3, "nan": np.nan, "infinite": -np.inf},
    ]


def timed(seed, x):
    return Outcome([{"x": x}], measured=[{"clock": time.perf_counter()}])


def fails(seed, x):
    if x % 3 == 1:
        raise ZeroDivisionError(f"no {x}")
    return {"x": x}


def dies(seed, x, deadly, how, log):
    """Takes its worker along for some x."""
    with Path(log).open("a") as file:
        file.write(f"{x}\n")
    if x in deadly:
        if how == "signal":
            os.kill(os.getpid(), signal.SIGKILL)
        elif how == "exit":
            os._exit(7)
        else:
            time.sleep(60)
    return double(seed, x)


def returns(seed, what):
    return {"text": "a", "number": 1, "complex": {"z": 1j}}[what]


def interrupted(seed, x):
    if x == 2:
        raise KeyboardInterrupt
    return {"x": x}


def ends_at_once(pipe):
    """A worker that never gets ready."""
    os._exit(5)


def slow(seed, x):
    time.sleep(0.002)
    return double(seed, x)


def sleeps(seed, seconds):
    time.sleep(seconds)
    return {"pid": os.getpid()}


def bulky(seed, x):
    return {"values": np.random.default_rng([seed, x]).random(500)}


def echo(seed, text):
    return {"text": text}


def sleeps_once(seed, file):
    """Says in a file who runs it and sleeps for long; where somebody said so before, is done at once."""
    if not Path(file).exists():
        Path(f"{file}.part").write_text(str(os.getpid()))
        Path(f"{file}.part").rename(file)
        time.sleep(60)
    return {"pid": os.getpid()}


def run_and_tell(file):
    """A parent of a worker that is at work."""
    with ProcessExecutor(1) as executor:
        run_sweep(Sweep("sleeps", sleeps_once, grid(file=[str(file)])), executor=executor)


def where(seed, x):
    """A row, and on which machine of a cluster it was made."""
    time.sleep(0.02)
    node = sys.modules["ray"].get_runtime_context().get_node_id() if "ray" in sys.modules else ""
    return Outcome([double(seed, x) | {"third": x / 3}], measured=[{"node": node}])


def endless(seed, how):
    """Never ends; "compute": in compiled code, which holds Python's lock."""
    if how == "sleep":
        time.sleep(60)
    return {"sum": sum(range(10**12))}
