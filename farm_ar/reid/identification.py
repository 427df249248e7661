"""The answer to a snapshot, and what gives such answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray, Record, read_only
from farm_ar.errors import SnapshotError
from farm_ar.scenes import UNKNOWN, Snapshot


@dataclass(frozen=True, eq=False)
class Identification(Record):
    """Which label each of N detections is.

    Args:
        labels: N labels, None where a detection stays unidentified.
        cost: (N,) cost of each label given, NaN where there is none.
        candidates: the labels that were considered.
        sites: names of the sites whose labels were considered; none where nothing was pruned.
        widened: whether the threshold left fewer candidates than detections, so that sites were added.
        solve_time: seconds spent in the solver.

    Raises:
        SnapshotError: there is not one cost per label.
    """

    labels: tuple[str | None, ...]
    cost: FloatArray = None  # type: ignore[assignment]  # NaN by default, filled in below
    candidates: tuple[str, ...] = ()
    sites: tuple[str, ...] = ()
    widened: bool = False
    solve_time: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "labels", tuple(self.labels))
        cost = np.full(len(self.labels), np.nan) if self.cost is None else self.cost
        object.__setattr__(self, "cost", read_only(cost, np.float64))
        if self.cost.shape != (len(self.labels),):
            raise SnapshotError("cost", f"must have shape ({len(self.labels)},)", self.cost.shape)

    @property
    def total(self) -> float:
        """Sum of the costs of the labels given: the objective of Eq. 8."""
        return float(np.nansum(self.cost))


@dataclass(frozen=True, eq=False)
class IdentificationBatch(Record):
    """Which label each detection of B snapshots is; rows padded like the snapshots' own.

    Args:
        labels: the labels that `label` indexes.
        label: (B, K) index of the label of each detection, `UNKNOWN` where there is none.
        cost: (B, K) cost of each label given, NaN where there is none.
        candidates: (B,) how many labels were considered.
        widened: (B,) whether sites were added because the threshold left too few candidates.
    """

    labels: tuple[str, ...]
    label: IntArray
    cost: FloatArray
    candidates: IntArray
    widened: BoolArray

    def __post_init__(self) -> None:
        types = {"label": np.int64, "cost": np.float64, "candidates": np.int64, "widened": np.bool_}
        for name, dtype in types.items():
            object.__setattr__(self, name, read_only(getattr(self, name), dtype))

    def __len__(self) -> int:
        return len(self.label)

    def names(self, index: int, count: int) -> tuple[str | None, ...]:
        """The labels given to the first `count` detections of one snapshot."""
        return tuple(None if i == UNKNOWN else self.labels[i] for i in self.label[index, :count])


@runtime_checkable
class Reidentifier(Protocol):
    """Anything that says which detection is which label."""

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection of a snapshot."""
        ...
