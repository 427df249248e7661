"""Which labels may have moved as one, before anything has been seen."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.reid.likelihood.records import Labels
from farm_ar.reid.place import Lengths, look_alikes
from farm_ar.reid.relational.options import RelationalOptions
from farm_ar.reid.relational.records import Group
from farm_ar.scenes import Scene

MEMBER = 0.7
"""Probability that the label that a group is around has moved with it."""

LEAST_MEMBER = 0.02
"""Probability below which a label is not of a group."""

REACH = 1.8
"""How far a group reaches, as SD, by the labels' usual distance."""

SHIFT, LEAST_SPACING = 1 / 3, 1e-3
"""SD of a group's shift, and least usual distance of labels, by the extent of the look-alikes."""


def usual_distance(scene: Scene, lengths: Lengths) -> float:
    """Median distance of a label to the nearest other one, metres: of those that have look-alikes, if any."""
    place, alike = scene.layout.position, look_alikes(scene)
    apart = np.linalg.norm(place[:, None] - place, axis=-1) + np.diag(np.full(len(place), np.inf))
    nearest = apart.min(axis=1)[alike if alike.any() else slice(None)]
    usual = float(np.median(nearest)) if len(place) > 1 else lengths.spacing
    return max(usual, LEAST_SPACING * lengths.extent)


def groups_of(labels: Labels, lengths: Lengths, spacing: float, options: RelationalOptions) -> list[Group]:
    """A group around each label that can move and is near another one: these are of it the less the farther.

    Args:
        labels: all of them.
        lengths: of the scene.
        spacing: usual distance of a label to the nearest other one, metres.
        options: what is assumed.
    """
    place, movable = labels.position, ~labels.fixed
    reach = REACH * spacing if options.reach_m is None else options.reach_m
    apart = np.linalg.norm(place[:, None] - place, axis=-1)
    member = np.where(movable[:, None] & movable, MEMBER * np.exp(-0.5 * (apart / reach) ** 2), 0.0)
    shift_m = SHIFT * lengths.extent if options.group_m is None else options.group_m
    prior = shift_m, float(np.deg2rad(options.group_deg))
    several = (member > LEAST_MEMBER).sum(axis=1) > 1
    return [_around(labels, j, member[j], prior) for j in np.flatnonzero(several).tolist()]


def anchors_of(labels: Labels, lengths: Lengths, options: RelationalOptions) -> list[Group]:
    """All labels as a group, once around each that is fixed: what moves with the frame."""
    prior = lengths.scene, float(np.deg2rad(options.drift_deg))
    everyone = np.ones(len(labels.yaw))
    return [_around(labels, j, everyone, prior) for j in np.flatnonzero(labels.fixed).tolist()]


def a_group(
    labels: Labels, index: IntArray, member: FloatArray, pivot: FloatArray, prior: tuple[float, float]
) -> Group:
    """Labels that may have moved as one about a pivot.

    Args:
        labels: all of them.
        index: (G,) which.
        member: (G,) probability that each is one of them.
        pivot: (2,) metres.
        prior: SDs of the shift, metres, and of the turn, radians.
    """
    own = {name: values[index] for name, values in labels._asdict().items() if name != "room"}
    return Group(
        index, member, Labels(**own, room=labels.room), np.array(pivot), prior[0] ** -2, prior[1] ** -2
    )


def fresh(group: Group) -> Group:
    """The same group with room of its own for where its labels stand."""
    moved = group.labels._replace(position=group.labels.position.copy(), yaw=group.labels.yaw.copy())
    return group._replace(labels=moved)


def _around(labels: Labels, j: int, member: FloatArray, prior: tuple[float, float]) -> Group:
    """A group around a label, which comes first."""
    others = np.flatnonzero(member > LEAST_MEMBER)
    index = np.array([j, *others[others != j]], dtype=np.int64)
    return a_group(labels, index, member[index], labels.position[j], prior)
