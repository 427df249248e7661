"""Functions for sweeps, importable by name in any process."""

import os
import signal
import time
from pathlib import Path

import numpy as np

from farm_ar.sweeps import Outcome


def double(seed, x):
    return {"double": 2 * x, "drawn": np.random.default_rng([seed, x]).random()}


def logged(seed, x, log, seconds=0.0):
    """Leaves a line in a file for every time that it is called."""
    time.sleep(seconds)
    with Path(log).open("a") as file:
        file.write(f"{x}\n")
    return double(seed, x)


def of_numpy(seed, values):
    return [
        {"float": np.float64(0.1), "small": np.float32(0.1), "whole": np.int64(2**62)},
        {"flag": np.bool_(True), "pair": (1, None), "none": None},
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
    return {"text": "a", "number": 1, "texts": ["a", "b"], "complex": {"z": 1j}, "keys": {1: 2}}[what]
