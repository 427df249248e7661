"""How probable each of some motions makes a snapshot.

Under a motion an object in view stayed, and is seen where the map has it, or it may be anywhere. How exact
poses are, whether headings are informative, and how much stayed are averaged over; a motion stands for those
about it that do as well (Laplace's approximation).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.special import erf, logsumexp

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry import in_view
from farm_ar.reid.alignment.kernels import choose
from farm_ar.reid.alignment.problem import Problem
from farm_ar.reid.registration import register, turned

Sds = Sequence[tuple[float, float]]

CLOSE, CLOSE_TURN = 0.05, float(np.deg2rad(2))
"""What counts as right: within so much of the spacing, and radians."""

POSITION_SDS = ((0.01, 0.35), (0.03, 0.4), (0.08, 0.25))
"""SDs that positions of objects which stayed may have, by the spacing, and how probable each is."""

LOOSE_SDS = (*POSITION_SDS, (0.2, 0.2), (0.45, 0.1))
"""The same where an anchor says about where to look, so that objects may have moved a little, too."""

NUDGED, NUDGED_SD = 0.5, 0.3
"""Share of the objects near their places that have moved a little, where the others have not; their SD."""

HEADING_SDS = ((float(np.deg2rad(1.5)), 0.4), (float(np.deg2rad(6)), 0.4), (np.inf, 0.2))
"""The same of headings, radians; infinite: headings are uninformative."""

STAYED = (0.9, 0.65, 0.35)
"""Shares of the objects in view that may have stayed where they were and been detected."""

FIXED, FLIPPED = 0.97, 0.07
"""Probability that a fixed thing is found where it was; that the heading of what stayed is any."""

LIKELY = 0.5
"""How probably a detection is at a label's place from where on it counts as there."""

OWN_VIEW = 0.8
"""Share of its own detections that a camera must see for its view to count."""

HEADING_WEIGHT = 0.01
"""Of a heading in the last fit, by that of a position, per radian and unit of length."""

LEAST_TURN = 0.1
"""Information of a turn about which nothing is known, 1 / rad^2."""


class Found(NamedTuple):
    """K motions that differ, the best first.

    Args:
        motions: (K, 3) turn, x, z.
        match: (K, N) the label at whose place each detection is, -1 for none.
        evidence: (K,) its logarithm, with the prior that any motion is as probable.
        close: (K,) probability that the motion is close, if it is the right one.
        exact: (K,) whether it is an anchor's, exactly; its evidence is then that of this motion alone.
    """

    motions: FloatArray
    match: IntArray
    evidence: FloatArray
    close: FloatArray
    exact: BoolArray


class _Seen(NamedTuple):
    """What K motions make of the detections.

    Args:
        square: (K, N) of the distance to the label's place; infinite without one.
        turn: (K, N) from the label's heading, radians.
        told: (K, N) whether the heading is known.
        period: (K, N) of the heading, radians.
        label: (K, N) the label, 0 without one.
        look: (K, N) likelihood of the looks; 0 without a label.
        viewed: (K, N) whether the label's place is in view.
        empty: (K, M) labels in view at whose place nothing is.
    """

    square: FloatArray
    turn: FloatArray
    told: BoolArray
    period: FloatArray
    label: IntArray
    look: FloatArray
    viewed: BoolArray
    empty: BoolArray


def weigh(problem: Problem, motions: FloatArray, match: IntArray, sds: Sds = POSITION_SDS) -> Found:
    """The evidence of motions, each fitted to what it explains.

    Args:
        problem: snapshot and map.
        motions: (K, 3 or more) turn, x, z.
        match: (K, N) the label that each detection is paired with, -1 for none.
        sds: of positions, and how probable each is.
    """
    motions = motions[:, :3]
    for _ in range(2):
        motions = _fitted(problem, motions, match, _evidence(problem, motions, match, sds)[2])
    evidence, close, share = _evidence(problem, motions, match, sds)
    order = np.argsort(-evidence, kind="stable")
    kept = choose(motions, order, len(motions), 2 * CLOSE, 2 * CLOSE_TURN)
    match = np.where(share > LIKELY, match, -1)
    return Found(motions[kept], match[kept], evidence[kept], close[kept], np.zeros(len(kept), dtype=bool))


def weigh_exactly(problem: Problem, motion: FloatArray, match: IntArray) -> Found:
    """The evidence of one motion (1, 3), and of none about it: it is not fitted."""
    evidence, _, share = _evidence(problem, motion, match, LOOSE_SDS, exact=True)
    every = np.ones(1)
    return Found(motion, np.where(share > LIKELY, match, -1), evidence, every, every > 0)


def nothing_stayed(problem: Problem) -> float:
    """Log evidence of a snapshot in which nothing stands where the map has it."""
    return float(np.log(problem.elsewhere(0.0)).sum()) - _strewn(problem, 0.0)


def _fitted(problem: Problem, motions: FloatArray, match: IntArray, share: FloatArray) -> FloatArray:
    """(K, 3) motions fitted to pairs that count by their shares; headings count little."""
    seen = _look(problem, motions, match)
    weight = np.where(match >= 0, share, 0.0)
    use = weight.sum(axis=1) > LIKELY
    fitted = motions.copy()
    if use.any():
        target = problem.known.position[seen.label[use]]
        about = register(
            np.broadcast_to(problem.seen.position, target.shape),
            target,
            weight[use] + 1e-12,
            np.zeros((len(target), 2)),
            (seen.turn + motions[:, :1])[use],
            (np.where(seen.told, weight, 0.0) * HEADING_WEIGHT)[use],
        ).motion
        fitted[use] = np.column_stack([about.turn, about.shift])
    return fitted


def _look(problem: Problem, motions: FloatArray, match: IntArray) -> _Seen:
    """What motions make of the detections."""
    known, paired = problem.known, match >= 0
    label = np.maximum(match, 0)
    place = turned(problem.seen.position, motions[:, :1]) + motions[:, None, 1:3]
    square = ((place - known.position[label]) ** 2).sum(axis=-1)
    period = known.period[label]
    turn = known.yaw[label] - problem.seen.yaw - motions[:, :1]
    told = paired & (period > 0) & np.isfinite(turn)
    turn, period = np.where(told, turn, 0.0), np.where(told, period, 1.0)
    views = _in_view(problem, motions)
    empty = views.copy()
    row, column = np.nonzero(paired)
    empty[row, match[row, column]] = False
    return _Seen(
        np.where(paired, square, np.inf),
        turn - period * np.round(turn / period),
        told,
        period,
        label,
        np.where(paired, np.exp(problem.fit[np.arange(match.shape[1]), label]), 0.0),
        paired & np.take_along_axis(views, label, axis=1),
        empty,
    )


def _evidence(
    problem: Problem, motions: FloatArray, match: IntArray, sds: Sds, exact: bool = False
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Log evidence (K,), probability of being close (K,), and how probably each pair is one (K, N)."""
    seen, parts = _look(problem, motions, match), []
    for (sd, first), (heading, second), stayed in product(sds, HEADING_SDS, STAYED):
        nudged = NUDGED if sds is LOOSE_SDS and sd < NUDGED_SD else 0.0
        log, share = _mixture(problem, seen, sd, heading, stayed, nudged)
        close, volume = _precision(problem, seen, share, sd, heading)
        log = log if exact else log + volume - np.log(2 * np.pi * problem.area)
        parts.append((np.log(first * second / len(STAYED)) + log, close, share))
    logs, closes, shares = (np.array(part) for part in zip(*parts, strict=True))
    evidence = logsumexp(logs, axis=0)
    weight = np.exp(logs - evidence)
    return evidence, (weight * closes).sum(axis=0), (weight[..., None] * shares).sum(axis=0)


def _mixture(
    problem: Problem, seen: _Seen, sd: float, heading: float, stayed: float, nudged: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Log likelihood (K,) of what is seen and what is not, and how probably each pair is one (K, N).

    Pairs that were nudged count as little as they tell.
    """
    present = np.where(problem.scene.layout.fixed, FIXED, stayed)
    near, wide = (np.exp(-0.5 * seen.square / s**2) / (2 * np.pi * s**2) for s in (sd, NUDGED_SD))
    near, wide = (1 - nudged) * near, nudged * wide
    density = (near + wide) * seen.look
    if np.isfinite(heading):
        peak = seen.period / (np.sqrt(2 * np.pi) * heading) * np.exp(-0.5 * (seen.turn / heading) ** 2)
        density = density * np.where(seen.told, FLIPPED + (1 - FLIPPED) * peak, 1.0)
    told = (near + wide * (sd / NUDGED_SD) ** 2) / np.maximum(near + wide, 1e-300)
    here = present[seen.label] * density
    apart = np.where(seen.viewed, 1 - present[seen.label], 1.0) * problem.elsewhere(stayed)
    missing = np.where(seen.empty, np.log(1 - present), 0.0).sum(axis=1)
    return np.log(here + apart).sum(axis=1) + missing - _strewn(problem, stayed), here / (here + apart) * told


def _strewn(problem: Problem, stayed: float) -> float:
    """How many labels' objects are seen anywhere, if a share stayed."""
    n, m = problem.fit.shape
    return float(min(n, m) * (1 - stayed))


def _precision(
    problem: Problem, seen: _Seen, share: FloatArray, sd: float, heading: float
) -> tuple[FloatArray, FloatArray]:
    """(K,) probability of a motion's being close, and log volume of the motions that do as well."""
    total = share.sum(axis=1) + 1e-9
    place = problem.seen.position
    middle = (share[..., None] * place).sum(axis=1) / total[:, None]
    lever = (share * ((place - middle[:, None]) ** 2).sum(axis=-1)).sum(axis=1)
    shift = total / sd**2
    turn = lever / sd**2 + (share * seen.told).sum(axis=1) / heading**2 + LEAST_TURN
    spread = 1 / shift + (middle**2).sum(axis=1) / turn
    close = (1 - np.exp(-0.5 * CLOSE**2 / spread)) * erf(CLOSE_TURN * np.sqrt(turn / 2))
    return close, np.log(2 * np.pi / shift) + 0.5 * np.log(2 * np.pi / turn)


def _in_view(problem: Problem, motions: FloatArray) -> BoolArray:
    """(K, M) labels that the camera would see; none where it does not even see its own detections."""
    camera, found = problem.snapshot.camera, problem.snapshot.detections
    view = camera.fov.left, camera.fov.right, camera.fov.range_m
    own = in_view(found.position, camera.position, camera.yaw, *view)
    own = own[np.isfinite(found.position).all(axis=1)]
    if camera.fov.up is not None or not len(own) or own.mean() < OWN_VIEW:
        return np.zeros((len(motions), problem.fit.shape[1]), dtype=bool)
    back = turned(problem.known.position - motions[:, None, 1:3], -motions[:, :1])
    return in_view(back * problem.spacing + problem.middle, camera.position, camera.yaw, *view)
