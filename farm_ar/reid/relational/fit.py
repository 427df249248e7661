"""Fitting a motion that labels, or their frame, shared: expectation and maximisation over all assignments."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.reid.likelihood.kernels import weigh
from farm_ar.reid.likelihood.records import Known, Reach
from farm_ar.reid.registration import solve_motion, turned, volume
from farm_ar.reid.relational.records import Frame, Group, Outcome, Sight, Work
from farm_ar.reid.relational.weights import assess_models, move_labels, reach_labels, weigh_group

LEAST_MODEL = 1e-2
"""Probability, of the most probable one's, of a model that is looked at in every step."""

HOPELESS = 2.0
"""By how much, in logarithms, a motion that is improved may fall short of one that counts."""

STILL = 1e-3
"""By how much a motion that is found may still change: radians, and metres in a scene of the usual length."""


class Limits(NamedTuple):
    """What a fit may take.

    Args:
        use: (K,) the models to consider.
        steps: most steps of maximisation.
        floor: log evidence below which a model does not matter.
        still_m: by how much a shift that is found may still change, metres.
    """

    use: BoolArray
    steps: int
    floor: float
    still_m: float


def fit_group(
    known: Known, frame: Frame, group: Group, limits: Limits, motion: FloatArray, outcome: Outcome
) -> None:
    """Fit the motion of a group over assignments and models alike.

    Args:
        known: the labels and models.
        frame: the detections, and what is known of labels that move alone.
        group: which labels may have moved as one; none, for the evidence of moving alone.
        limits: what this may take.
        motion: (3,) shift x and z, metres, and turn, radians: where to begin, filled with the end.
        outcome: filled.
    """
    sight = frame.sight
    go = new_reach(known, len(sight.nothing), len(group.label))
    work = _work(frame, len(group.label))

    def place() -> None:
        move_labels(known.labels, group, motion)
        reach_labels(known, group.labels, sight, go)
        weigh_group(known, frame, group, go, work, outcome)

    _climb(limits, _Fit(known, sight, group, go, work), motion, outcome, place)


def fit_frame(
    known: Known,
    raw: Sight,
    group: Group,
    limits: Limits,
    motion: FloatArray,
    frame: Frame,
    outcome: Outcome,
) -> None:
    """`fit_group` of the frame that cameras and detections are in: all labels seem to have moved as one.

    Args:
        known: the labels and models.
        raw: the detections as they came.
        group: all labels.
        limits: what this may take.
        motion: (3,) of the frame: where to begin, filled with the end.
        frame: filled with the detections as they were before the motion.
        outcome: filled.
    """
    work = _work(frame, len(group.label))
    work.together[:] = 1.0

    def place() -> None:
        correct_frame(raw, group.pivot, motion, frame.sight)
        fill_frame(known, frame)
        work.weight[:] = frame.alone.weight
        work.log_unseen[:] = frame.alone.log_unseen
        outcome.unseen[:] = frame.alone.unseen

    _climb(limits, _Fit(known, raw, group, frame.reach, work), motion, outcome, place)


class _Fit(NamedTuple):
    known: Known
    sight: Sight
    group: Group
    go: Reach
    work: Work


def _climb(
    limits: Limits, fit: _Fit, motion: FloatArray, outcome: Outcome, place: Callable[[], None]
) -> None:
    """From step to step the likeliest motion over all models, each as probable as its evidence makes it.

    Args:
        limits: what this may take.
        fit: what is fitted to what.
        motion: (3,) changed.
        outcome: filled.
        place: the labels' weights for a motion.
    """
    prior = fit.group.shift_precision, fit.group.turn_concentration
    fit.work.use[:] = limits.use
    outcome.evidence[:] = -np.inf
    last = limits.steps == 0
    for step in range(limits.steps + 1):
        place()
        fit.work.sums[:] = 0.0
        fit.work.to_row[:] = 1.0
        outcome.evidence[fit.work.use] = -np.inf
        assess_models(*fit, motion[2], limits.floor, outcome)
        assessed = fit.work.use & (outcome.evidence > -np.inf)
        outcome.likely[assessed] = volume(fit.work.sums[assessed], *prior, motion)
        outcome.evidence[assessed] += outcome.likely[assessed]
        highest = outcome.evidence.max()
        if last or not highest > limits.floor - HOPELESS:
            break
        share = np.exp(outcome.evidence - highest)
        counts = share > LEAST_MODEL
        pooled = share[counts] @ fit.work.sums[counts] / share[counts].sum()
        best, _, _ = solve_motion(pooled, *prior)
        change = np.abs(motion - best)
        still = np.hypot(change[0], change[1]) < limits.still_m and change[2] < STILL
        motion[:] = best
        last = still or step + 1 == limits.steps
        fit.work.use[:] = limits.use if last else counts


def _work(frame: Frame, members: int) -> Work:
    """Room for the steps of a fit."""
    k, n, m = frame.alone.weight.shape
    return Work(
        use=np.empty(k, dtype=np.bool_),
        weight=np.empty((k, n, m)),
        together=np.empty((k, n, members)),
        log_unseen=np.empty(k),
        to_row=np.empty((n, m)),
        none=np.empty(n),
        sums=np.empty((k, 7)),
    )


def new_reach(known: Known, detections: int, labels: int) -> Reach:
    """Room for where labels may be found."""
    shifts, turns = len(known.models.translation_sd), len(known.models.heading)
    return Reach(
        np.empty((shifts, detections, labels)),
        np.empty((turns, detections, labels)),
        np.empty((shifts, labels)),
    )


def fill_frame(known: Known, frame: Frame) -> None:
    """Fill in what follows from the detections of a frame if labels moved alone."""
    reach_labels(known, known.labels, frame.sight, frame.reach)
    weigh(known, frame.reach, frame.sight.like, frame.alone)


def correct_frame(raw: Sight, pivot: FloatArray, motion: FloatArray, sight: Sight) -> None:
    """Fill in cameras and detections as they were before a motion of their frame about a pivot."""
    back = pivot + motion[:2]
    sight.eyes.position[:] = pivot + turned(raw.eyes.position - back, -motion[2])
    sight.eyes.yaw[:] = raw.eyes.yaw - motion[2]
    sight.found.position[:] = pivot + turned(raw.found.position - back, -motion[2])
    sight.found.yaw[:] = raw.found.yaw - motion[2]
    sight.found.rival[:] = raw.found.rival - motion[2]
