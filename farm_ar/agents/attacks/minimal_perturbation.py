"""The minimal perturbation that makes one given error the better answer to the paper's method."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.agents.attacks.cost_model import Model, stretch_of
from farm_ar.agents.cases import Case
from farm_ar.agents.certificates.regions import view_planes
from farm_ar.agents.validity import outside_by
from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry.rectangles import overlap_depth
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import pose_cost

HELPERS = 2
"""Objects beside those of the error that may be moved too, because they may stand in the way."""

GAIN = 1e-6
"""By how much the error is to be the better answer, in cost; and how far inside its limits all is to stay."""

STEEPNESS = 4.0
"""What a violation costs beside distance: no violation pays for itself by the distance that it saves."""


class Component(NamedTuple):
    """Objects that are to be taken for one another's labels.

    Args:
        chain: the objects; each is to be given the label of the next.
        closed: whether the last is to be given the first's label; otherwise it is given that of `end`.
        end: the object whose label the last takes; -1 in a cycle.
        hidden: whether that object must not be detected, for its label to be free.
        guess: about how much distance that takes.
    """

    chain: tuple[int, ...]
    closed: bool
    end: int
    hidden: bool
    guess: float


class Room(NamedTuple):
    """What a case says to the kernel.

    Args:
        home: (N, 2) where the objects were, metres.
        home_yaw: (N,) how they were turned.
        half: (N, 3) half sizes, metres.
        keeps_clear: (N, N) pairs that must not stand in each other.
        stays_inside: (N,) objects of which no part may be outside the room.
        normal: (P, 2) of the planes that bound the view.
        offset: (P,) of those planes; in view is normal . q <= offset for all.
        eye: (2,) of the camera.
        reach: how far it sees, metres.
        size: (2,) of the room, metres.
        way_weight: of metres, in cost.
        turn_weight: of sin(turn / 2), in cost.
        rate: the larger weight, in cost per distance.
        diagonal: metres.
        stretch: (N, N) C_d, by which the label of one multiplies the cost of the other; 1 for the own.
    """

    home: FloatArray
    home_yaw: FloatArray
    half: FloatArray
    keeps_clear: BoolArray
    stays_inside: BoolArray
    normal: FloatArray
    offset: FloatArray
    eye: FloatArray
    reach: float
    size: FloatArray
    way_weight: float
    turn_weight: float
    rate: float
    diagonal: float
    stretch: FloatArray


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


class Error(NamedTuple):
    """A component, for the kernel.

    Args:
        chain: (K,) the objects of the error.
        goal: (K,) the object whose label each is to be given.
        movers: (M,) objects that may be moved.
        unseen: the object that is not to be detected, -1 for none.
    """

    chain: IntArray
    goal: IntArray
    movers: IntArray
    unseen: int


class Draws(NamedTuple):
    """What is random in an evolution.

    Args:
        normals: (S, M, 3) normal numbers, for the steps.
        picks: (S,) which mover a step moves: those from M on move all.
    """

    normals: FloatArray
    picks: IntArray


class Perturbation(NamedTuple):
    """A perturbation: (N, 2) metres, (N,) radians, and its distance; infinite where none was found."""

    position: FloatArray
    yaw: FloatArray
    distance: float


def perturb(
    case: Case, room: Room, component: Component, rng: np.random.Generator, steps: int, restarts: int = 3
) -> Perturbation:
    """Search the cheapest displacement after which a component is the better answer.

    An evolution strategy of one parent and one child; its violations cost more than the distance they save.
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
    movers = _movers(case, chain, component.end)
    error = Error(chain, goal, movers, component.end if component.hidden else -1)
    best = Perturbation(room.home, room.home_yaw, np.inf)
    for restart in range(restarts):
        share = rng.uniform(0.4, 1.0, len(chain)) if restart else np.full(len(chain), 0.55)
        position, yaw = room.home.copy(), room.home_yaw.copy()
        shift = room.home[goal] - room.home[chain]
        sideways = shift[:, ::-1] * [1.0, -1.0] * rng.normal(0.0, 0.3 if restart else 0.0, (len(chain), 1))
        position[chain] += share[:, None] * shift + sideways
        normals = rng.normal(size=(steps, len(movers), 3))
        picks = rng.integers(0, 2 * len(movers), steps)
        distance = evolve(room, error, position, yaw, Draws(normals, picks))
        if distance < best.distance:
            best = Perturbation(position, yaw, distance)
    return best


def _movers(case: Case, chain: IntArray, end: int) -> IntArray:
    """The chain, the object whose label it ends in, and the movable objects nearest to its ways."""
    layout = case.layout
    named = [*chain.tolist(), *([end] if end >= 0 and layout.movable[end] else [])]
    middle = layout.position[chain].mean(axis=0) if end < 0 else layout.position[[*chain, end]].mean(axis=0)
    order = np.argsort(np.linalg.norm(layout.position - middle, axis=1), kind="stable")
    near = [int(i) for i in order if layout.movable[i] and int(i) not in named][:HELPERS]
    return np.array(named + near, dtype=np.int64)


@compiled
def cost_of_label(room: Room, x: float, z: float, yaw: float, i: int, j: int) -> float:
    """What object i costs in a pose as the label of object j."""
    moved = pose_cost(x, z, yaw, room.home[j], room.home_yaw[j], room.way_weight, room.turn_weight)
    return float(room.stretch[i, j] * moved)


@compiled
def beyond_view(room: Room, x: float, z: float) -> float:
    """How far a place is out of view, metres; negative in view."""
    beyond = np.hypot(x - room.eye[0], z - room.eye[1]) - room.reach
    for p in range(len(room.offset)):
        beyond = max(beyond, room.normal[p, 0] * x + room.normal[p, 1] * z - room.offset[p])
    return float(beyond)


@compiled
def violation(room: Room, error: Error, position: FloatArray, yaw: FloatArray) -> float:
    """By how much a perturbation misses what it is to be, in distance; 0 where it is all of it."""
    gain = 0.0
    metres = 0.0
    for k in range(len(error.chain)):
        i = error.chain[k]
        x, z = position[i]
        own = cost_of_label(room, x, z, yaw[i], i, i)
        gain += own - cost_of_label(room, x, z, yaw[i], i, error.goal[k])
        metres += max(0.0, beyond_view(room, x, z) + GAIN)
    if error.unseen >= 0:
        metres += max(0.0, GAIN - beyond_view(room, position[error.unseen, 0], position[error.unseen, 1]))
    for i in error.movers:
        x, z = position[i]
        metres += outside_by(x, z, yaw[i], room.half[i], room.size[0], room.size[1], room.stays_inside[i])
        for j in range(len(yaw)):
            if j == i or not room.keeps_clear[i, j]:
                continue
            dx, dz = position[j, 0] - x, position[j, 1] - z
            reach = room.half[i, 0] + room.half[i, 2] + room.half[j, 0] + room.half[j, 2]
            if dx * dx + dz * dz < reach * reach:
                metres += max(0.0, overlap_depth(dx, dz, yaw[i], yaw[j], room.half[i], room.half[j]) + GAIN)
    return max(0.0, GAIN - gain) / room.rate + metres / room.diagonal


@compiled
def distance_in(room: Room, movers: IntArray, position: FloatArray, yaw: FloatArray) -> float:
    """D with weights 1, summed over the movers."""
    total = 0.0
    for i in movers:
        dx, dz = position[i, 0] - room.home[i, 0], position[i, 1] - room.home[i, 1]
        total += np.sqrt(dx * dx + dz * dz) / room.diagonal
        total += abs(np.sin((yaw[i] - room.home_yaw[i]) / 2))
    return total


@compiled
def evolve(room: Room, error: Error, position: FloatArray, yaw: FloatArray, draws: Draws) -> float:
    """Improve a perturbation in place; its distance afterwards, infinite where it still misses something.

    Args:
        room: the room.
        error: what the perturbation is to bring about.
        position: (N, 2) metres; changed.
        yaw: (N,) radians; changed.
        draws: the steps.
    """
    movers, normals, picks = error.movers, draws.normals, draws.picks
    trial_position, trial_yaw = position.copy(), yaw.copy()
    best_position, best_yaw, best = position.copy(), yaw.copy(), np.inf
    spread = 0.05
    missing = violation(room, error, position, yaw)
    value = distance_in(room, movers, position, yaw) + STEEPNESS * missing
    for s in range(len(picks)):
        for m in range(len(movers)):
            i = movers[m]
            trial_position[i] = position[i]
            trial_yaw[i] = yaw[i]
            if picks[s] < len(movers) and picks[s] != m:
                continue
            trial_position[i, 0] += spread * room.diagonal * normals[s, m, 0]
            trial_position[i, 1] += spread * room.diagonal * normals[s, m, 1]
            trial_yaw[i] += 2 * spread * normals[s, m, 2]
            # Not to move, or not to turn, is the best there is, and no small step ever hits it.
            if s % 8 == 0:
                trial_position[i] = room.home[i]
            if s % 8 < 2:
                trial_yaw[i] = room.home_yaw[i]
        missing = violation(room, error, trial_position, trial_yaw)
        distance = distance_in(room, movers, trial_position, trial_yaw)
        if missing == 0 and distance < best:
            best = distance
            best_position[:] = trial_position
            best_yaw[:] = trial_yaw
        if distance + STEEPNESS * missing < value:
            value = distance + STEEPNESS * missing
            for i in movers:
                position[i] = trial_position[i]
                yaw[i] = trial_yaw[i]
            spread = min(spread * 1.5, 0.2)
        else:
            spread = max(spread * 0.93, 1e-5)
    position[:] = best_position
    yaw[:] = best_yaw
    return best
