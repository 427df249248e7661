"""A snapshot and a map without units and origins, and the motions that may take the one to the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import logsumexp

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.errors import SnapshotError
from farm_ar.reid.alignment.kernels import (
    REACH,
    Grid,
    Pairs,
    Things,
    choose,
    count_pairs,
    propose,
    score,
)
from farm_ar.reid.registration import RigidMotion, turned
from farm_ar.scenes import Scene, Snapshot

Pose = tuple[float, float, float]
"""x and z, metres, and yaw, radians."""

USUAL, FALSE = 0.65, 0.1
"""Share of the objects in view that stayed, where motions are compared; false detections of each look."""

SIZE_SD, ODD_SIZE = 0.15, -12.0
"""Error of the logarithm of a measured side; the least that sizes say, in logarithms."""

TOLERANCE = 0.08
"""By how much two pairs' distances may differ, by the spacing."""

SHORTEST, LONGEST = 0.3, 12.0
"""How far apart pairs stand at least and, where there are very many, at most, by the spacing."""

MOST_PAIRS, MOST_MOTIONS, MOST_USES = 5000, 20_000, 8
"""Pairs of detections, motions that are compared, and pairs with any one detection."""

MOST_REFINED, MOST_REFINING = 60, 20_000_000
"""Motions that are refined, and these times detections and labels."""

POSE_TURN, ALIKE_TURN = float(np.deg2rad(3)), float(np.deg2rad(4))
"""SD of the turn that follows from a single heading; by how much motions that are refined differ; radians."""

MOST_TURNS = 12
"""Headings that are tried of an object that looks alike after a small turn."""


class Problem(NamedTuple):
    """A snapshot and a map, each about its middle, with the map's spacing as the unit of length.

    Args:
        scene: the map.
        snapshot: as it came.
        spacing: metres.
        middle: (2,) of the detections, metres.
        centre: (2,) of the labels, metres.
        seen: the N detections.
        known: the M labels.
        fit: (N, M) log likelihood of the looks; minus infinity for another category.
        like: (N,) how many labels each detection may be.
        area: over which objects are strewn.
    """

    scene: Scene
    snapshot: Snapshot
    spacing: float
    middle: FloatArray
    centre: FloatArray
    seen: Things
    known: Things
    fit: FloatArray
    like: FloatArray
    area: float

    def elsewhere(self, stayed: float) -> FloatArray:
        """(N,) how many objects like each detection stand anywhere, a unit of area, if a share stayed."""
        return (self.like * (1 - stayed) + FALSE) / self.area

    @property
    def floor(self) -> FloatArray:
        """(N,) the same by the share that stayed, where motions are compared."""
        return self.elsewhere(USUAL) / USUAL

    def scaled(self, motion: RigidMotion) -> FloatArray:
        """(1, 6) a motion in metres as a proposal."""
        place = (motion.position(self.middle[None])[0] - self.centre) / self.spacing
        return np.array([[float(motion.turn), *place, 0.0, 0.0, 0.0]])

    def rigid(self, motion: FloatArray) -> RigidMotion:
        """A motion (3,) of turn, x and z in metres."""
        shift = self.centre + self.spacing * motion[1:3] - self.middle
        turn = np.arctan2(np.sin(motion[0]), np.cos(motion[0]))
        return RigidMotion(self.middle, shift, np.array(turn))


def problem_of(scene: Scene, snapshot: Snapshot) -> Problem:
    """The problem that a map and a snapshot pose."""
    layout, found = scene.layout, snapshot.detections
    spacing = spacing_of(layout.position, layout.size)
    whole = np.asarray(np.isfinite(found.position).all(axis=1))
    middle = found.position[whole].mean(axis=0) if whole.any() else snapshot.camera.position
    centre = np.median(layout.position, axis=0) if len(layout) else np.zeros(2)
    period = np.array([scene.symmetry.get(name, 2 * np.pi) for name in layout.category], dtype=np.float64)
    known = Things((layout.position - centre) / spacing, np.array(layout.yaw), period)
    place = np.where(whole[:, None], found.position - middle, 0.0) / spacing
    seen = Things(place, np.array(found.yaw), np.zeros(len(found)))
    fit = _looks(scene, snapshot)
    fit[~whole] = -np.inf  # a broken pose is that of no label
    reach = np.quantile(np.linalg.norm(known.position, axis=1), 0.9) if len(layout) else 0.0
    area = max(float(np.pi * (reach + 1) ** 2), float(len(layout)))
    like = (fit > -np.inf).sum(axis=1).astype(np.float64)
    return Problem(scene, snapshot, spacing, middle, centre, seen, known, fit, like, area)


def spacing_of(position: FloatArray, size: FloatArray) -> float:
    """Usual distance of an object to the nearest other one, metres; if there is none, an object's own size.

    Args:
        position: (M, 2) metres.
        size: (M, 3) metres; NaN where it is not known.
    """
    places: FloatArray = np.unique(position, axis=0)
    if len(places) > 1:
        apart: FloatArray = cKDTree(places).query(places, 2)[0]  # type: ignore[assignment]
        return float(np.median(apart[:, 1]))
    known = size[np.isfinite(size)]
    return float(np.median(known)) if known.size else 1.0


def motion_between(before: Pose, after: Pose) -> RigidMotion:
    """The motion that takes one pose to another.

    Raises:
        SnapshotError: they are not three finite numbers each.
    """
    poses = [np.asarray(pose, dtype=np.float64) for pose in (before, after)]
    if any(pose.shape != (3,) or not np.isfinite(pose).all() for pose in poses):
        expected = "must be a pose (x, z, yaw) in the snapshot's frame and the same pose in the map's"
        raise SnapshotError("anchor", expected, (before, after))
    shift = poses[1] - poses[0]
    return RigidMotion(poses[0][:2], shift[:2], np.array(shift[2]))


def proposals(problem: Problem) -> FloatArray:
    """(K, 6) the most promising motions, as `propose` writes them."""
    every = np.vstack([_by_pairs(problem), _by_poses(problem)])
    if not len(every):
        return every
    seen, known, fit = problem.seen, problem.known, problem.fit
    order = np.argsort(-score(every, seen, known, _grid(known.position), fit, problem.floor), kind="stable")
    most = min(MOST_REFINED, max(8, MOST_REFINING // fit.size))
    return every[choose(every, order, most, REACH / 2, ALIKE_TURN)]


def _by_pairs(problem: Problem) -> FloatArray:
    """(H, 6) motions that take two detections to two labels as far apart."""
    first, apart = _apart(problem.seen.position)
    second, known_apart = _apart(problem.known.position)
    if not len(first) or not len(second):
        return np.empty((0, 6))
    if len(first) > MOST_PAIRS:
        some = np.linspace(0, len(first) - 1, MOST_PAIRS).astype(np.int64)
        first, apart = first[some], apart[some]
    order = np.argsort(known_apart, kind="stable")
    second, known_apart = second[order], known_apart[order]
    low = np.searchsorted(known_apart, apart - TOLERANCE)
    high = np.searchsorted(known_apart, apart + TOLERANCE)
    count = count_pairs(Pairs(first, low, high, second), problem.fit)
    kept = _telling(first, count)
    pairs = Pairs(first[kept], low[kept], high[kept], second)
    motions = np.empty((min(int(count[kept].sum()), 2 * MOST_MOTIONS), 6))
    return motions[: propose(pairs, problem.fit, problem.seen, problem.known, motions)]


def _by_poses(problem: Problem) -> FloatArray:
    """(H, 6) motions that take one detection to one label, heading and all."""
    known, seen = problem.known, problem.seen
    use = (problem.fit > -np.inf) & np.isfinite(seen.yaw)[:, None] & np.isfinite(known.yaw)
    i, j = np.nonzero(use & (known.period > 0))
    if len(i) > MOST_MOTIONS:
        fixed = problem.scene.layout.fixed[j]
        i, j = i[fixed][:MOST_MOTIONS], j[fixed][:MOST_MOTIONS]
    times = np.clip(np.round(2 * np.pi / known.period[j]), 1, MOST_TURNS).astype(np.int64)
    i, j, step = np.repeat(i, times), np.repeat(j, times), np.concatenate([np.arange(t) for t in (0, *times)])
    turn = known.yaw[j] - seen.yaw[i] + step * known.period[j]
    place = seen.position[i]
    return np.column_stack(
        [turn, known.position[j] - turned(place, turn), place, np.full(len(turn), POSE_TURN)]
    )


def _looks(scene: Scene, snapshot: Snapshot) -> FloatArray:
    """(N, M) log likelihood of each detection's looks if it is each label, by the mean over its category."""
    layout, found = scene.layout, snapshot.detections
    if not len(found) or not len(layout):
        return np.empty((len(found), len(layout)))
    names = np.array([*layout.category, *found.category], dtype=object)
    same = names[len(layout) :, None] == names[: len(layout)]
    same[[name is None or not layout.names_categories for name in found.category]] = True
    ratio = np.log(found.size)[:, None] - np.log(layout.size)
    size = -0.5 * np.where(np.isfinite(ratio), (ratio / SIZE_SD) ** 2, 0.0).sum(axis=-1)
    size = np.where(same, np.maximum(size, ODD_SIZE), -np.inf)
    some = same.any(axis=1)
    usual = logsumexp(size[some], axis=1) - np.log(same[some].sum(axis=1))
    size[some] -= usual[:, None]
    return size


def _apart(position: FloatArray) -> tuple[IntArray, FloatArray]:
    """Pairs (P, 2) of objects that determine a turn, and how far apart they are (P,)."""
    n = len(position)
    if n <= 200:
        pairs = np.column_stack(np.triu_indices(n, 1))
    else:
        reach = LONGEST * min(1.0, float(np.sqrt(1000 / n)))
        pairs = cKDTree(position).query_pairs(reach, output_type="ndarray").reshape(-1, 2)
        pairs = pairs[np.lexsort(pairs.T[::-1])]
    apart = np.linalg.norm(position[pairs[:, 0]] - position[pairs[:, 1]], axis=1)
    far = apart > SHORTEST
    return pairs[far].astype(np.int64), apart[far]


def _telling(pairs: IntArray, count: IntArray) -> IntArray:
    """Indices of the pairs that propose least, of every detection some, until there are enough motions."""
    order = np.argsort(count, kind="stable")
    order = order[count[order] > 0]
    if count[order].sum() <= MOST_MOTIONS:
        return order
    uses, kept, total = np.zeros(int(pairs.max()) + 1, dtype=np.int64), [], 0
    for p in order.tolist():
        if uses[pairs[p]].max() < MOST_USES:
            uses[pairs[p]] += 1
            kept.append(p)
            total += int(count[p])
            if total >= MOST_MOTIONS:
                break
    return np.array(kept, dtype=np.int64)


def _grid(position: FloatArray) -> Grid:
    """Labels by cells, which are larger where few labels stand far apart."""
    corner, extent, most = position.min(axis=0), np.ptp(position, axis=0), 16 * len(position) + 64
    cell = max(REACH, float(np.sqrt(extent[0] * extent[1] / most)), float(extent.max()) / most)
    shape = np.floor(extent / cell).astype(np.int64) + 1
    column, row = np.minimum(np.floor((position - corner) / cell).astype(np.int64), shape - 1).T
    number = column * shape[1] + row
    start = np.concatenate([[0], np.cumsum(np.bincount(number, minlength=int(shape.prod())))])
    return Grid(corner, cell, shape, start.astype(np.int64), np.argsort(number, kind="stable"))
