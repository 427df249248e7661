"""Which labels may have moved as one, before anything has been seen."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.reid.relational.options import RelationalOptions
from farm_ar.reid.relational.records import Groups
from farm_ar.scenes import Scene

MEMBER = 0.7
"""Probability that the label that a group is around has moved with it."""

LEAST_MEMBER = 0.02
"""Probability below which a label is not of a group."""

REACH = 1.8
"""How far a group reaches, as SD, by the labels' usual distance."""

LEAST_SPACING = 1e-3
"""Usual distance of labels, by the room's diagonal, that is taken for them at least."""


def usual_distance(scene: Scene) -> float:
    """Median distance of a label to the nearest other one, metres; a fixed share of a room with one label."""
    place = scene.layout.position
    apart = np.linalg.norm(place[:, None] - place, axis=-1) + np.diag(np.full(len(place), np.inf))
    usual = float(np.median(apart.min(axis=1))) if len(place) > 1 else scene.diagonal / 4
    return max(usual, LEAST_SPACING * scene.diagonal)


def groups_of(scene: Scene, options: RelationalOptions) -> Groups:
    """A group around each label that can move: others are of it the less probably the farther they stood."""
    place, movable = scene.layout.position, scene.layout.movable
    reach = REACH * usual_distance(scene) if options.reach_m is None else options.reach_m
    apart = np.linalg.norm(place[:, None] - place, axis=-1)
    member = np.where(movable[:, None] & movable, MEMBER * np.exp(-0.5 * (apart / reach) ** 2), 0.0)
    shift_m = scene.diagonal / 8 if options.group_m is None else options.group_m
    return _groups(np.flatnonzero(movable), member, member > LEAST_MEMBER, shift_m, options.group_deg)


def anchors_of(scene: Scene, options: RelationalOptions) -> Groups:
    """All labels as a group, once around each that is fixed: what moves with the frame."""
    everyone = np.ones((len(scene.layout),) * 2)
    fixed = np.flatnonzero(scene.layout.fixed)
    return _groups(fixed, everyone, everyone > 0, scene.diagonal, options.drift_deg)


def _groups(
    around: IntArray, member: FloatArray, of_it: BoolArray, shift_sd: float, turn_deg: float
) -> Groups:
    """Groups around labels; the label itself comes first."""
    size = of_it[around].sum(axis=1)
    # The label itself, then the other members, then the rest, which is cut off.
    rank = np.where(np.arange(len(of_it)) == around[:, None], -1, np.where(of_it[around], 0, 1))
    label = np.argsort(rank, axis=1, kind="stable")[:, : int(size.max(initial=0))]
    return Groups(
        size=size.astype(np.int64),
        label=np.ascontiguousarray(label),
        member=np.take_along_axis(member[around], label, axis=1),
        shift_precision=np.full(len(around), shift_sd**-2),
        turn_concentration=np.full(len(around), np.deg2rad(turn_deg) ** -2),
    )
