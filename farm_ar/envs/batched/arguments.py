"""What a vector environment is given: checked, and brought into one form."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode

from farm_ar.arrays import BoolArray
from farm_ar.errors import OptionError


def processors() -> int:
    """How many this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def mode_of(mode: AutoresetMode | str) -> AutoresetMode:
    """An autoreset mode from itself or its value.

    Raises:
        OptionError: there is no such mode.
    """
    try:
        return AutoresetMode(mode)
    except ValueError:
        known = ", ".join(str(one.value) for one in AutoresetMode)
        raise OptionError("autoreset_mode", f"must be one of {known}", mode) from None


def whole(name: str, value: Any, most: int | None = None) -> int:
    """A whole number of at least 1.

    Raises:
        OptionError: it is none, or more than `most`.
    """
    right = isinstance(value, int | np.integer) and not isinstance(value, bool) and value >= 1
    if not right or (most is not None and value > most):
        limits = "not below 1" if most is None else f"from 1 to {most}"
        raise OptionError(name, f"must be a whole number {limits}", value)
    return int(value)


def array_of(given: Any) -> npt.NDArray[Any]:
    """As an array; of objects where rows are not of one length."""
    try:
        return np.asarray(given)
    except ValueError:
        return np.array(None)


def reset_mask(given: Any, count: int) -> BoolArray:
    """(B,) which environments are to begin."""
    if given is None:
        return np.ones(count, dtype=bool)
    mask = array_of(given)
    if mask.shape != (count,) or mask.dtype != np.bool_ or not mask.any():
        raise OptionError("options.reset_mask", f"must be ({count},) booleans, at least one true", given)
    return mask


def seeds_of(seed: Any, count: int) -> list[int | None]:
    """The seed of each environment."""
    if seed is None:
        return [None] * count
    if isinstance(seed, int | np.integer):
        return [_seed("seed", seed) + k for k in range(count)]
    listed = seed.ndim == 1 if isinstance(seed, np.ndarray) else isinstance(seed, Sequence)
    if not listed or isinstance(seed, str | bytes):
        raise OptionError("seed", f"must be a whole number, or a sequence of {count}", seed)
    if len(seed) != count:
        raise OptionError("seed", f"must be one for each of {count} environments", len(seed))
    return [None if one is None else _seed(f"seed[{b}]", one) for b, one in enumerate(seed)]


def _seed(name: str, seed: Any) -> int:
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise OptionError(name, "must be a whole number not below 0", seed)
    return int(seed)
