"""Displacements that attacks draw or search: of which objects, on what scale."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.attacks.base import QueryOracle
from farm_ar.arrays import FloatArray, IntArray

BATCH = 64
"""Displacements that are drawn at once."""

MOST_OBJECTS = 12
"""Objects that a search displaces at the most: those in view that stand nearest to others of their kind."""

NOT_ALLOWED = 10.0
"""The value of a displacement that is not allowed; everything that is allowed has a lower one."""


def query_scaled(oracle: QueryOracle, shift: FloatArray, turn: FloatArray, share: FloatArray) -> bool:
    """Query displacements scaled to a share of the least D so far; False if none was allowed."""
    layout = oracle.case.layout
    shift = np.where(layout.fixed[:, None], 0.0, shift)
    turn = np.where(layout.fixed, 0.0, turn)
    distance = oracle.distance(layout.position + shift, layout.yaw + turn)
    scale = np.minimum(1.0, share * oracle.least / np.maximum(distance, 1e-12))
    before = oracle.asked
    oracle.query(layout.position + scale[:, None, None] * shift, layout.yaw + scale[:, None] * turn)
    return oracle.asked > before or oracle.least > 1e-3


def search_objects(oracle: QueryOracle) -> IntArray:
    """(M,) the movable objects in view, at most `MOST_OBJECTS`: those nearest to others of their kind."""
    case, layout = oracle.case, oracle.case.layout
    code = layout.category_code
    apart = np.linalg.norm(layout.position[:, None] - layout.position, axis=-1)
    apart[(code[:, None] != code) | np.eye(len(code), dtype=bool)] = np.inf
    nearest = apart.min(axis=1, initial=np.inf)
    seen = np.flatnonzero(case.in_view & layout.movable)
    chosen: IntArray = seen[np.argsort(nearest[seen], kind="stable")[:MOST_OBJECTS]]
    return chosen


def displaced(oracle: QueryOracle, movers: IntArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Poses from what a search says: (B, 3 M) shifts in twentieths of the diagonal and turns in sixths of pi.

    Small values are none: so that most objects stay where they are.
    """
    layout, scene = oracle.case.layout, oracle.case.scene
    values = np.sign(points) * np.maximum(np.abs(points) - 0.5, 0.0)
    steps = values.reshape(len(points), len(movers), 3)
    position = np.repeat(layout.position[None], len(points), axis=0)
    yaw = np.repeat(layout.yaw[None], len(points), axis=0)
    position[:, movers] += scene.diagonal / 20 * steps[..., :2]
    yaw[:, movers] += np.pi / 6 * steps[..., 2]
    return position, yaw
