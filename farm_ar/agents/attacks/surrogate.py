"""How near the paper's rule is to an error, as a number that falls before anything is wrong; for searches."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from farm_ar.agents.attacks.trial import Trial
from farm_ar.agents.cases import Case
from farm_ar.agents.one_kind import identify_kind
from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.reid import LastKnownReid, NearestReid, SpatialReid, dimension_cost
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


def model_of(trial: Trial) -> Model:
    """What the re-identifier is, if it is known; the paper's rule as its game uses it otherwise."""
    reid = trial.reid
    if isinstance(reid, NearestReid | LastKnownReid):
        return Model(Weights(1.0, 0.0), False, True)
    if isinstance(reid, SpatialReid):
        terms, weights = reid.options.terms, reid.weights
        used = Weights(
            weights.translation if "translation" in terms else 0.0,
            weights.rotation if "rotation" in terms else 0.0,
        )
        return Model(used, reid.options.gate_categories, False, "dimension" in terms)
    return Model(trial.case.scene.cost_weights, True, False)


def stretch_of(case: Case, model: Model) -> FloatArray:
    """(N, N) C_d of the objects' sizes (Eq. 6), 1 where sizes do not count."""
    size = case.layout.size
    return dimension_cost(size, size) if model.sizes_count else np.ones((len(size), len(size)))


def least_margins(trial: Trial, position: FloatArray, yaw: FloatArray) -> FloatArray:
    """(B,) the least by which giving a detection its own label beats giving it another; 0 when it does not.

    By the paper's cost, kind by kind, which is arithmetic and no query: white-box for the paper's rule, and a
    guess for any other.

    Args:
        trial: whose case and re-identifier.
        position: (B, N, 2) metres.
        yaw: (B, N) radians.
    """
    case, layout, weights = trial.case, trial.case.layout, model_of(trial).weights
    result = np.ones(len(yaw))
    _least_margins(
        np.ascontiguousarray(position),
        np.ascontiguousarray(yaw),
        visible(layout.with_poses(position, yaw), case.camera),
        layout.position,
        layout.yaw,
        layout.category_code,
        weights.translation / case.scene.diagonal,
        weights.rotation,
        result,
    )
    return result


@numba.njit(cache=True, nogil=True)
def _least_margins(
    position: FloatArray,
    yaw: FloatArray,
    seen: BoolArray,
    label_position: FloatArray,
    label_yaw: FloatArray,
    category: IntArray,
    way_weight: float,
    turn_weight: float,
    result: FloatArray,
) -> None:
    """Fill in the result, (B,), which holds ones."""
    for b in range(len(yaw)):
        for code in range(category.max() + 1):
            found, label, margin = identify_kind(
                code,
                category,
                seen[b],
                position[b],
                yaw[b],
                label_position,
                label_yaw,
                way_weight,
                turn_weight,
            )
            for x in range(len(found)):
                result[b] = min(result[b], margin[x] if label[x] == found[x] else 0.0)
