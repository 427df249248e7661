"""Which labels may have moved as one, before anything has been seen."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.reid.likelihood.records import Labels
from farm_ar.reid.relational.options import RelationalOptions
from farm_ar.reid.relational.records import Group
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


def groups_of(scene: Scene, labels: Labels, options: RelationalOptions) -> list[Group]:
    """A group around each label that can move: others are of it the less probably the farther they stood."""
    place, movable = scene.layout.position, scene.layout.movable
    reach = REACH * usual_distance(scene) if options.reach_m is None else options.reach_m
    apart = np.linalg.norm(place[:, None] - place, axis=-1)
    member = np.where(movable[:, None] & movable, MEMBER * np.exp(-0.5 * (apart / reach) ** 2), 0.0)
    shift_m = scene.diagonal / 8 if options.group_m is None else options.group_m
    prior = shift_m, float(np.deg2rad(options.group_deg))
    return [_around(labels, j, member[j], prior) for j in np.flatnonzero(movable).tolist()]


def anchors_of(scene: Scene, labels: Labels, options: RelationalOptions) -> list[Group]:
    """All labels as a group, once around each that is fixed: what moves with the frame."""
    prior = scene.diagonal, float(np.deg2rad(options.drift_deg))
    everyone = np.ones(len(scene.layout))
    return [_around(labels, j, everyone, prior) for j in np.flatnonzero(scene.layout.fixed).tolist()]


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
