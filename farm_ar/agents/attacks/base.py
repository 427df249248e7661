"""What an attack is, and the query oracle through which it sees a re-identifier."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np

from farm_ar.agents.cases import Case
from farm_ar.agents.distance import distances
from farm_ar.agents.validity import are_valid
from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.reid import Reidentifier, as_reidentifier
from farm_ar.scenes import Scene, observe_many

WRONG_BINS, DISTANCE_BINS = 12, 24
"""Cells of the map of failures: number of wrong labels (the last also more) by share of the budget."""

PATIENCE = 5000
"""Perturbations in a row that are not allowed, after which an attack ends: next to nothing can be moved."""

NOT_ASKED = -1
"""In place of a number of wrong labels: the perturbation is not allowed, or no query was left."""


@dataclass(frozen=True, eq=False)
class Failure:
    """A perturbation after which a detection has a wrong label.

    Args:
        position: (N, 2) metres.
        yaw: (N,) radians.
        distance: D summed over the objects.
        wrong: number of detections with a wrong label.
        query: which query found it, from 1.
    """

    position: FloatArray
    yaw: FloatArray
    distance: float
    wrong: int
    query: int


@dataclass
class QueryOracle:
    """Queries a re-identifier with perturbations of a case, within a number of queries and a budget of D.

    Every perturbation is a displacement of the movable objects that keeps them in the room and out of one
    another. One that is not, or takes more than the budget, is refused and costs no query.

    Args:
        case: the case.
        reid: made for `case.scene`. With a method `identify_many` it is queried in batches.
        queries: snapshots that may be identified.
        budget: D summed over the objects.

    Attributes:
        asked: queries so far.
        cheapest: the failure with the least distance.
        worst: the failure with the most wrong labels; of those with equally many the cheapest.
        cells: (WRONG_BINS, DISTANCE_BINS) failures found, by wrong labels and distance.
        refused: perturbations in a row that were not allowed.
        stuck: whether an attack has ended for that.
    """

    case: Case
    reid: Reidentifier
    queries: int
    budget: float
    asked: int = 0
    cheapest: Failure | None = None
    worst: Failure | None = None
    cells: IntArray = field(default_factory=lambda: np.zeros((WRONG_BINS, DISTANCE_BINS), dtype=np.int64))
    refused: int = 0
    stuck: bool = False

    @property
    def left(self) -> int:
        """Queries left; none once `PATIENCE` perturbations in a row were not allowed."""
        return 0 if self.refused >= PATIENCE else self.queries - self.asked

    @property
    def least(self) -> float:
        """The least distance of a failure so far; the budget where there is none."""
        return self.budget if self.cheapest is None else self.cheapest.distance

    def distance(self, position: FloatArray, yaw: FloatArray) -> FloatArray:
        """(...) D summed over the objects, of positions (..., N, 2) and yaws (..., N)."""
        case = self.case
        total: FloatArray = distances(case.layout, case.scene.diagonal, position, yaw).sum(axis=-1)
        return total

    def allowed(self, position: FloatArray, yaw: FloatArray) -> BoolArray:
        """(B,) which of B perturbations may be queried, by positions (B, N, 2) and yaws (B, N)."""
        poses = np.ascontiguousarray(position), np.ascontiguousarray(yaw)
        valid = are_valid(*poses, self.case.constraints)
        within: BoolArray = valid & (self.distance(position, yaw) <= self.budget)
        return within

    def query(self, position: FloatArray, yaw: FloatArray) -> IntArray:
        """How many wrong labels the snapshots of B perturbations get.

        Args:
            position: (B, N, 2) metres.
            yaw: (B, N) radians.

        Returns:
            (B,) numbers, `NOT_ASKED` where nothing was asked.
        """
        result = np.full(len(yaw), NOT_ASKED, dtype=np.int64)
        chosen = np.flatnonzero(self.allowed(position, yaw))[: self.left]
        if chosen.size:
            result[chosen] = wrong_labels(self.case, self.reid, position[chosen], yaw[chosen])
            self._note(position[chosen], yaw[chosen], result[chosen])
            self.asked += len(chosen)
        self.refused = 0 if chosen.size else self.refused + len(yaw)
        self.stuck |= self.refused >= PATIENCE
        return result

    def _note(self, position: FloatArray, yaw: FloatArray, wrong: IntArray) -> None:
        failed = np.flatnonzero(wrong > 0)
        if not failed.size:
            return
        distance = self.distance(position[failed], yaw[failed])
        column = np.minimum((distance / self.budget * DISTANCE_BINS).astype(np.int64), DISTANCE_BINS - 1)
        np.add.at(self.cells, (np.minimum(wrong[failed], WRONG_BINS) - 1, column), 1)

        def failure(k: int) -> Failure:
            i = failed[k]
            return Failure(
                position[i].copy(), yaw[i].copy(), float(distance[k]), int(wrong[i]), self.asked + int(i) + 1
            )

        k = int(np.argmin(distance))
        if self.cheapest is None or distance[k] < self.cheapest.distance:
            self.cheapest = failure(k)
        k = int(np.lexsort((distance, -wrong[failed]))[0])
        if self.worst is None or (-wrong[failed[k]], distance[k]) < (-self.worst.wrong, self.worst.distance):
            self.worst = failure(k)


class Attack(ABC):
    """Looks for failures of a re-identifier on one case; what it finds, the oracle keeps.

    An attack is a class in a file of its own, made without arguments, and is listed in `ATTACKS`.
    """

    @abstractmethod
    def __call__(self, oracle: QueryOracle, rng: np.random.Generator) -> None:
        """Query until no query is left, or there is nothing more to ask.

        Args:
            oracle: answers, and keeps what was found.
            rng: where all randomness comes from.
        """

    def check(self, scene: Scene) -> None:
        """See that it can attack in a scene; most can in any.

        Raises:
            InputError: it cannot.
        """
        return

    @property
    def fingerprint(self) -> str:
        """A hash of what it works with beside farm-ar's code; results with another hash are not reused."""
        return ""


def wrong_labels(case: Case, reid: Reidentifier, position: FloatArray, yaw: FloatArray) -> IntArray:
    """(B,) detections with a wrong label, or none, in snapshots of B perturbations.

    Args:
        case: whose camera takes the snapshots.
        reid: answers.
        position: (B, N, 2) metres.
        yaw: (B, N) radians.
    """
    layout = case.layout.with_poses(position, yaw)
    batch = observe_many(layout, case.camera)
    truth = batch.truth
    assert truth is not None
    given = as_reidentifier(reid, case.scene).identify_many(batch).label
    exists = np.arange(truth.shape[1]) < batch.count[:, None]
    wrong: IntArray = np.sum((given != truth) & exists, axis=1)
    return wrong
