"""The answer to a snapshot, or to many: which label each detection is, with its confidence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray, Record, read_only
from farm_ar.errors import SnapshotError
from farm_ar.scenes import UNKNOWN


@dataclass(frozen=True)
class Certificate:
    """The answer is right if every detection is of a label whose object has moved less than this.

    That is: since the reference layout was known.

    Distances are those of D = w_t |shift| / l + w_r |sin(turn / 2)|, by which the paper compares poses.

    Args:
        radius: how far in D; positive.
        metres: how far for objects that shifted without turning; infinite where no shift counts.
        degrees: how far for objects that turned where they stood; 180 where no turn is too much.
        detections: the detections whose labels are certified.
        theorem: what proves it.
    """

    radius: float
    metres: float
    degrees: float
    detections: tuple[int, ...]
    theorem: str = "T1"


@dataclass(frozen=True, eq=False)
class Assurance(Record):
    """Margins and confidence of an answer for N detections and C candidates; None where a method gives none.

    Args:
        margin: (N,) rise of the total cost if the detection must give up its label (T4); NaN without one.
        runner_up: N labels, what each detection is in the best answer without the label it was given.
        confidence: (N,) probability of each answer, where the label is None that of "none of these".
        probability: (N, C + 1) probability of each candidate and, last, of none of these.
        gone: (C,) probability that the candidate's object is gone.
        certified: how far things may have moved for the answer to be proven right, or what works that out.
        warnings: what makes these less than reliable.

    Raises:
        SnapshotError: an array has not one entry per detection.
    """

    margin: FloatArray = None  # type: ignore[assignment]  # filled in when it becomes part of an answer
    runner_up: tuple[str | None, ...] = None  # type: ignore[assignment]
    confidence: FloatArray = None  # type: ignore[assignment]
    probability: FloatArray | None = None
    gone: FloatArray | None = None
    certified: Certificate | Callable[[], Certificate | None] | None = None
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("margin", "confidence", "probability", "gone"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, read_only(getattr(self, name), np.float64))
        object.__setattr__(self, "warnings", tuple(self.warnings))

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        kind, values = super().__reduce__()
        return kind, (*values[:-2], self.proven(), self.warnings)

    def proven(self) -> Certificate | None:
        """How far things may have moved for the answer to be proven right."""
        return self.certified() if callable(self.certified) else self.certified

    def filled(self, detections: int) -> Assurance:
        """The same with NaN, or None, per detection for what is not known."""
        nothing = {"margin": np.nan, "runner_up": None, "confidence": np.nan}
        values = dict[str, Any]()
        for name, unknown in nothing.items():
            value = getattr(self, name)
            if value is None:
                value = (None,) * detections if unknown is None else np.full(detections, unknown)
            if len(value) != detections:
                raise SnapshotError(
                    name, f"must have an entry for each of {detections} detections", len(value)
                )
            values[name] = value
        values["runner_up"] = tuple(values["runner_up"])
        return Assurance.trusted(**vars(self) | values)


@dataclass(frozen=True, eq=False)
class Identification(Record):
    """Which label each of N detections is, with its confidence.

    Args:
        labels: N labels, None where a detection stays unidentified.
        cost: (N,) cost of each label given, NaN where there is none.
        candidates: the labels that were considered.
        sites: names of the sites whose labels were considered; none where nothing was pruned.
        widened: whether the threshold left fewer candidates than detections, so that sites were added.
        solve_time: seconds spent in the solver; with `lsap` on the costs, too, found in the same call.
        assurance: the confidence of the answer, or what works it out when it is first asked for.
        reason: N short reasons why a detection has no label; None where it has one, or where none is given.

    Raises:
        SnapshotError: there is not one cost, or one reason, per label.
    """

    labels: tuple[str | None, ...]
    cost: FloatArray = None  # type: ignore[assignment]  # NaN by default, filled in below
    candidates: tuple[str, ...] = ()
    sites: tuple[str, ...] = ()
    widened: bool = False
    solve_time: float = 0.0
    assurance: Assurance | Callable[[], Assurance] | None = field(default=None, repr=False)
    reason: tuple[str | None, ...] = None  # type: ignore[assignment]  # None for each by default

    def __post_init__(self) -> None:
        object.__setattr__(self, "labels", tuple(self.labels))
        cost = np.full(len(self.labels), np.nan) if self.cost is None else self.cost
        object.__setattr__(self, "cost", read_only(cost, np.float64))
        if self.cost.shape != (len(self.labels),):
            raise SnapshotError("cost", f"must have shape ({len(self.labels)},)", self.cost.shape)
        reason = (None,) * len(self.labels) if self.reason is None else tuple(self.reason)
        if len(reason) != len(self.labels):
            raise SnapshotError(
                "reason", f"must have an entry for each of {len(self.labels)} detections", reason
            )
        why = zip(self.labels, reason, strict=True)
        object.__setattr__(self, "reason", tuple(one if label is None else None for label, one in why))

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        # What works the assurance out holds the re-identifier; a copy needs only what comes out.
        kind, values = super().__reduce__()
        return kind, (*values[:-2], self._assured, self.reason)

    @cached_property
    def _assured(self) -> Assurance:
        """The assurance, worked out, with every array that is per detection filled in."""
        given = self.assurance() if callable(self.assurance) else self.assurance
        return (given or Assurance()).filled(len(self.labels))

    @property
    def total(self) -> float:
        """Sum of the costs of the labels given: the objective of Eq. 8."""
        return float(np.nansum(self.cost))

    @property
    def margin(self) -> FloatArray:
        """(N,) rise of the total cost if the detection must give up its label (T4); NaN where not known."""
        return self._assured.margin

    @property
    def runner_up(self) -> tuple[str | None, ...]:
        """The label that each detection has in the best answer without the one it was given, or None."""
        return self._assured.runner_up

    @property
    def confidence(self) -> FloatArray:
        """(N,) probability that each answer is right, a label or None; NaN where not known."""
        return self._assured.confidence

    @property
    def probability(self) -> FloatArray | None:
        """(N, C + 1) probability of each of the C candidates and, last, of none of these; or None."""
        return self._assured.probability

    @property
    def gone(self) -> FloatArray | None:
        """(C,) probability that each candidate's object is gone; or None."""
        return self._assured.gone

    @cached_property
    def certified(self) -> Certificate | None:
        """How far things may have moved for the answer to be proven right; None where no theorem applies."""
        return self._assured.proven()

    @property
    def warnings(self) -> tuple[str, ...]:
        """What makes the confidence less than reliable."""
        return self._assured.warnings


def expected_errors(
    probability: FloatArray | None, labels: tuple[str, ...]
) -> tuple[FloatArray, tuple[str | None, ...]]:
    """The costs whose cheapest assignment has most right labels on average: 1 less each probability.

    Args:
        probability: (N, M + 1) of each label and, last, of none of them.
        labels: the M labels.

    Returns:
        (N, M + N) costs of each label and of each detection's being none; the label of each column, or None.
    """
    assert probability is not None
    n = len(probability)
    none = np.where(np.eye(n, dtype=bool), 1 - probability[:, -1], np.inf)
    return np.hstack([1 - probability[:, :-1], none]), (*labels, *[None] * n)


@dataclass(frozen=True, eq=False)
class IdentificationBatch(Record):
    """Which label each detection of B snapshots is; rows padded like the snapshots' own.

    Args:
        labels: the labels that `label` indexes.
        label: (B, K) index of the label of each detection, `UNKNOWN` where there is none.
        cost: (B, K) cost of each label given, NaN where there is none.
        candidates: (B,) how many labels were considered.
        widened: (B,) whether sites were added because the threshold left too few candidates.
        margin: (B, K) as in `Identification`, NaN by default.
        runner_up: (B, K) index of the label, `UNKNOWN` for none and by default.
        given_confidence: (B, K) as in `Identification`, or what computes it when it is asked for; NaN by
            default.
    """

    labels: tuple[str, ...]
    label: IntArray
    cost: FloatArray
    candidates: IntArray
    widened: BoolArray
    margin: FloatArray = None  # type: ignore[assignment]  # filled in below
    runner_up: IntArray = None  # type: ignore[assignment]
    given_confidence: FloatArray | Callable[[], FloatArray] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        types = {"label": np.int64, "cost": np.float64, "candidates": np.int64, "widened": np.bool_}
        types |= {"margin": np.float64, "runner_up": np.int64}
        for name, nothing in (("margin", np.nan), ("runner_up", UNKNOWN)):
            if getattr(self, name) is None:
                object.__setattr__(self, name, np.full(np.shape(self.label), nothing))
        for name, dtype in types.items():
            object.__setattr__(self, name, read_only(getattr(self, name), dtype))

    def __len__(self) -> int:
        return len(self.label)

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        kind, values = super().__reduce__()
        return kind, (*values[:-1], self.confidence)

    @cached_property
    def confidence(self) -> FloatArray:
        """(B, K) probability that each answer is right; NaN where not known."""
        given = self.given_confidence
        values = given() if callable(given) else given
        if values is None:
            values = np.full(self.label.shape, np.nan)
        return read_only(values, np.float64)

    def names(self, index: int, count: int) -> tuple[str | None, ...]:
        """The labels given to the first `count` detections of one snapshot."""
        return tuple(None if i == UNKNOWN else self.labels[i] for i in self.label[index, :count])
