"""What a certificate is, and what it says: the distance that every attack on a case needs at the least."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from farm_ar.agents.cases import Case
from farm_ar.arrays import FloatArray, Record, read_only
from farm_ar.reid import Reidentifier


@dataclass(frozen=True, eq=False)
class Bound(Record):
    """What no attack on a case can do with less.

    Args:
        total: distance summed over the objects, at the least; infinite where no attack is possible.
        largest: distance of the object that moves most, at the least.
        first: the bound on `total` that T1 alone gives.
        by_object: (N,) total distance after which an object in view has a wrong label, at the least.
        theorem: what proves it; "none" where nothing does, and all numbers are 0.
    """

    total: float
    largest: float
    first: float
    by_object: FloatArray
    theorem: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "by_object", read_only(self.by_object, np.float64))


class Certificate(ABC):
    """A theorem about the distance of every attack, for the re-identifiers that it covers.

    A certificate is a class made without arguments, and is listed in `CERTIFICATES`.
    """

    @abstractmethod
    def covers(self, reid: Reidentifier) -> bool:
        """Whether the theorem holds for a re-identifier."""

    @abstractmethod
    def bound(self, case: Case, reid: Reidentifier) -> Bound:
        """The bound of a case under a re-identifier that is covered and made for `case.scene`."""


ROUNDING = 1e-6
"""Share by which bounds are lowered, so that rounding cannot lift them over what is true."""

NO_BOUND = "none"
"""The theorem where there is none."""
