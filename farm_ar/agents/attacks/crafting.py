"""The cheapest displacement that makes one given error the better answer to the paper's rule."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.agents.attacks.components import Component
from farm_ar.agents.attacks.crafting_kernels import Room, evolve
from farm_ar.agents.attacks.surrogate import Model, stretch_of
from farm_ar.agents.cases import Case
from farm_ar.agents.certificates.regions import view_planes
from farm_ar.arrays import FloatArray, IntArray

HELPERS = 2
"""Objects beside those of the error that may be moved too, because they may stand in the way."""


def room_of(case: Case, model: Model) -> Room:
    """The room of a case for the kernel, with the costs that a re-identifier is taken to have."""
    weights = model.weights
    layout, scene = case.layout, case.scene
    # The far end is checked by distance; the tangents of the polygon would reach beyond it.
    planes = view_planes(case.camera)[:2]
    return Room(
        layout.position,
        layout.yaw,
        layout.size / 2,
        case.keeps_clear,
        case.stays_inside,
        np.array([normal for normal, _ in planes]).reshape(-1, 2),
        np.array([offset for _, offset in planes]),
        case.camera.position,
        case.camera.fov.range_m,
        np.array(scene.size),
        weights.translation / scene.diagonal,
        weights.rotation,
        max(weights.translation, weights.rotation, 1e-12),
        scene.diagonal,
        stretch_of(case, model),
    )


class Crafted(NamedTuple):
    """A perturbation: (N, 2) metres, (N,) radians, and its effort; infinite where none was found."""

    position: FloatArray
    yaw: FloatArray
    effort: float


def craft(
    case: Case, room: Room, component: Component, rng: np.random.Generator, steps: int, restarts: int = 3
) -> Crafted:
    """Search the cheapest displacement after which a component is the better answer.

    An evolution strategy of one parent and one child; its violations cost more than the effort they save.
    Objects that stand in the way may be moved too.

    Args:
        case: the case.
        room: `room_of` it.
        component: the error.
        rng: where the randomness comes from.
        steps: children of each start.
        restarts: how many starts.
    """
    chain = np.array(component.chain, dtype=np.int64)
    goal = np.roll(chain, -1) if component.closed else np.append(chain[1:], component.end)
    unseen = component.end if component.hidden else -1
    movers = _movers(case, chain, component.end)
    best = Crafted(room.home, room.home_yaw, np.inf)
    for restart in range(restarts):
        share = rng.uniform(0.4, 1.0, len(chain)) if restart else np.full(len(chain), 0.55)
        position, yaw = room.home.copy(), room.home_yaw.copy()
        shift = room.home[goal] - room.home[chain]
        sideways = shift[:, ::-1] * [1.0, -1.0] * rng.normal(0.0, 0.3 if restart else 0.0, (len(chain), 1))
        position[chain] += share[:, None] * shift + sideways
        normals = rng.normal(size=(steps, len(movers), 3))
        picks = rng.integers(0, 2 * len(movers), steps)
        effort = evolve(room, chain, goal, movers, unseen, position, yaw, normals, picks)
        if effort < best.effort:
            best = Crafted(position, yaw, effort)
    return best


def _movers(case: Case, chain: IntArray, end: int) -> IntArray:
    """The chain, the object whose label it ends in, and the movable objects nearest to its ways."""
    layout = case.layout
    named = [*chain.tolist(), *([end] if end >= 0 and layout.movable[end] else [])]
    middle = layout.position[chain].mean(axis=0) if end < 0 else layout.position[[*chain, end]].mean(axis=0)
    order = np.argsort(np.linalg.norm(layout.position - middle, axis=1), kind="stable")
    near = [int(i) for i in order if layout.movable[i] and int(i) not in named][:HELPERS]
    return np.array(named + near, dtype=np.int64)
