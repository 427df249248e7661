"""How near the paper's method is to an error: a number that falls before anything is wrong; for searches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.agents.attacks.base import QueryOracle
from farm_ar.agents.cases import Case
from farm_ar.arrays import FloatArray
from farm_ar.envs.features import MARGIN_SCALE
from farm_ar.reid import LastKnownReid, NearestReid, SpatialReid, dimension_cost
from farm_ar.reid.assignment import CostModel, assess, known_at, seen_at
from farm_ar.scenes import Weights, visible


class Model(NamedTuple):
    """What an attack takes a re-identifier for.

    Args:
        weights: of the costs.
        categories_apart: whether labels keep to detections of their category.
        labels_shared: whether one label may be given to several detections.
        sizes_count: whether a label of another size costs more.
    """

    weights: Weights
    categories_apart: bool
    labels_shared: bool
    sizes_count: bool = False


def model_of(oracle: QueryOracle) -> Model:
    """What the re-identifier is, if it is known; the paper's method as its game uses it otherwise."""
    reid = oracle.reid
    if isinstance(reid, NearestReid | LastKnownReid):
        apart = isinstance(reid, NearestReid) and reid.gate_categories
        return Model(Weights(1.0, 0.0), apart, True)
    if isinstance(reid, SpatialReid):
        used = Weights(reid.costs.translation_weight, reid.costs.rotation_weight)
        return Model(used, reid.options.gate_categories, False, "dimension" in reid.options.terms)
    return Model(oracle.case.scene.cost_weights, True, False)


def stretch_of(case: Case, model: Model) -> FloatArray:
    """(N, N) C_d of the objects' sizes (Eq. 6), 1 where sizes do not count."""
    size = case.layout.size
    return dimension_cost(size, size) if model.sizes_count else np.ones((len(size), len(size)))


def least_margins(oracle: QueryOracle, position: FloatArray, yaw: FloatArray) -> FloatArray:
    """(B,) the least by which giving a detection its own label beats giving it another; 0 when it does not.

    By the paper's cost, kind by kind, which is arithmetic and no query: white-box for the paper's method, and
    a guess for any other.

    Args:
        oracle: whose case and re-identifier.
        position: (B, N, 2) metres.
        yaw: (B, N) radians.
    """
    return _looked_at(oracle, position, yaw)[0]


def worth_of(oracle: QueryOracle, position: FloatArray, yaw: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(B,) wrong labels, and (B,) how near the right ones are to being wrong, as `least_margins` sees it.

    The latter is the sum of 1 - margin / 0.3 over the detections, from 0 to 1 each.
    """
    _, wrong, ambiguity = _looked_at(oracle, position, yaw)
    return wrong, ambiguity


def _looked_at(
    oracle: QueryOracle, position: FloatArray, yaw: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(B,) least margins, (B,) wrong labels, (B,) ambiguities."""
    case, layout, weights = oracle.case, oracle.case.layout, model_of(oracle).weights
    seen, code = visible(layout.with_poses(position, yaw), case.camera), layout.category_code
    found = assess(
        seen_at(position, yaw, code, seen),
        known_at(layout.position, layout.yaw, code),
        CostModel(weights.translation / case.scene.diagonal, float(weights.rotation)),
        margins=True,
    )
    right = found.label == np.arange(len(layout))
    sure = np.where(seen & right, found.margin, np.where(seen, 0.0, np.inf))
    least = np.minimum(sure.min(axis=1, initial=np.inf), 1.0)
    ambiguity = np.maximum(1.0 - sure / MARGIN_SCALE, 0.0).sum(axis=1)
    return least, (seen & ~right).sum(axis=1).astype(np.float64), ambiguity
