"""Making a failure cheaper by asking: back towards the untouched table, along the border of failing."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.attacks.base import QueryOracle
from farm_ar.arrays import BoolArray, FloatArray, IntArray

BATCH = 32
"""Perturbations in a batch of queries."""

FINEST = 1e-5
"""The spread of the steps, as a share of the failure's own displacement, at which it is given up."""


def refine(oracle: QueryOracle, rng: np.random.Generator) -> None:
    """Make the cheapest failure of a oracle cheaper until no query is left or nothing helps any more.

    First it is drawn straight back, then object by object; after that random steps beside and back are tried,
    wide ones as long as they succeed, narrower ones when they do not.
    """
    if oracle.cheapest is None:
        return
    _undo_objects(oracle)
    _draw_back(oracle)
    spread = 0.3
    while oracle.left > 0 and spread > FINEST:
        before = oracle.least
        oracle.query(*_steps(oracle, spread, rng))
        spread = min(spread * 1.3, 0.5) if oracle.least < before else spread * 0.7


def _undo_objects(oracle: QueryOracle) -> None:
    """Leave out what need not be moved, and turns that need not be made."""
    layout = oracle.case.layout
    improved = True
    while improved and oracle.left > 0:
        assert oracle.cheapest is not None
        found, before = oracle.cheapest, oracle.least
        moved = np.flatnonzero(_moved(oracle, found.position, found.yaw))
        if not moved.size:
            return
        position = np.repeat(found.position[None], 2 * len(moved), axis=0)
        yaw = np.repeat(found.yaw[None], 2 * len(moved), axis=0)
        for k, i in enumerate(moved):
            position[k, i] = layout.position[i]
            yaw[[k, len(moved) + k], i] = layout.yaw[i]
        oracle.query(position, yaw)
        improved = oracle.least < before


def _draw_back(oracle: QueryOracle) -> None:
    """Halve the gap between what fails and what does not, straight towards the untouched table."""
    layout = oracle.case.layout
    low = 0.0
    while oracle.left > 0 and low < 0.999:
        assert oracle.cheapest is not None
        found = oracle.cheapest
        share = np.linspace(low, 1.0, 8, endpoint=False)[1:]
        position = layout.position + share[:, None, None] * (found.position - layout.position)
        wrong = oracle.query(position, layout.yaw + share[:, None] * (found.yaw - layout.yaw))
        right = np.flatnonzero(wrong <= 0)
        if not right.size:
            continue
        first = int(np.argmax(wrong > 0)) if np.any(wrong > 0) else len(share)
        # Everything is now seen from the new failure, at share[first] of the old one.
        whole = share[first] if first < len(share) else 1.0
        low = float(share[first - 1] / whole) if first > 0 else 0.0


def _steps(oracle: QueryOracle, spread: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """A batch of neighbours of the cheapest failure that cost less than it does."""
    case, found = oracle.case, oracle.cheapest
    assert found is not None
    layout = case.layout
    moved: IntArray = np.flatnonzero(_moved(oracle, found.position, found.yaw))
    shift, turn = found.position - layout.position, found.yaw - layout.yaw
    size = max(float(np.linalg.norm(shift[moved], axis=1).max(initial=0.0)), 1e-3 * case.scene.diagonal)
    number = 4 * BATCH
    step = np.zeros((number, len(layout), 2))
    step[:, moved] = spread * size * rng.normal(size=(number, len(moved), 2))
    turned = np.zeros((number, len(layout)))
    turned[:, moved] = spread * size / case.scene.diagonal * 2 * rng.normal(size=(number, len(moved)))
    if len(moved) > 1:  # often one object only
        only = moved[rng.integers(len(moved), size=number)]
        alone = rng.random(number) < 0.5
        others = alone[:, None] & (np.arange(len(layout)) != only[:, None])
        step[others], turned[others] = 0.0, 0.0
    back = 1 - np.abs(rng.normal(0.0, spread, number))
    position = layout.position + back[:, None, None] * shift + step
    yaw = layout.yaw + back[:, None] * turn + turned
    # A turn that is small may as well not be made.
    yaw = np.where(rng.random(yaw.shape) < 0.1, layout.yaw, yaw)
    cheaper = oracle.allowed(position, yaw) & (oracle.distance(position, yaw) < found.distance)
    order = np.argsort(~cheaper, kind="stable")[:BATCH]
    kept = order[cheaper[order]]
    if not kept.size:  # asked about all the same, so that the spread narrows
        kept = order[:0]
    return position[kept], yaw[kept]


def _moved(oracle: QueryOracle, position: FloatArray, yaw: FloatArray) -> BoolArray:
    layout = oracle.case.layout
    moved: BoolArray = np.any(position != layout.position, axis=-1) | (yaw != layout.yaw)
    return moved
