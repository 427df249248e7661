"""What a certificate says: the effort that every attack on a case needs at the least."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import FloatArray, Record, read_only


@dataclass(frozen=True, eq=False)
class Bound(Record):
    """What no attack on a case can do with less.

    Args:
        total: effort summed over the objects, at the least; infinite where no attack is possible.
        largest: effort of the object that moves most, at the least.
        first: the bound on `total` that T1 alone gives.
        by_object: (N,) total effort after which an object in view has a wrong label, at the least.
        theorem: what proves it; "none" where nothing does, and all numbers are 0.
    """

    total: float
    largest: float
    first: float
    by_object: FloatArray
    theorem: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "by_object", read_only(self.by_object, np.float64))


ROUNDING = 1e-6
"""Share by which bounds are lowered, so that rounding cannot lift them over what is true."""

NO_BOUND = "none"
"""The theorem where there is none."""
