"""The table as numbers: the parts of a state observation, and how near a mistake is, in one compiled call."""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs.ordering import Objects, introduce
from farm_ar.game_logic import visibility
from farm_ar.geometry.angles import wrap_angle
from farm_ar.geometry.camera import Eye, sees
from farm_ar.kernels import compiled
from farm_ar.reid import dimension_cost
from farm_ar.reid.assignment import assign, find_margins
from farm_ar.scenes import Camera, Layout, Scene

if TYPE_CHECKING:
    from farm_ar.envs.worlds import World

Float32Array = npt.NDArray[np.float32]

MARGIN_SCALE = 0.3
"""The margin that is observed as 1."""

NO_RIVAL = 2.0
"""In place of a cost, where a kind has fewer objects than the largest one."""


class Parts(NamedTuple):
    """The parts of a state observation, objects in the order in which they are met; `observations` says more.

    Args:
        position: (M, 2).
        heading: (M, 2).
        category: (M, kinds).
        in_view: (M,).
        fixed: (M,).
        camera: (4,).
        budget: (4,).
        believed_position: (M, 2).
        believed_heading: (M, 2).
        difference: (M, 3).
        cost: (M, W), W the most of a kind.
        margin: (M,).
        hand: (8,).
    """

    position: Float32Array
    heading: Float32Array
    category: Float32Array
    in_view: Float32Array
    fixed: Float32Array
    camera: Float32Array
    budget: Float32Array
    believed_position: Float32Array
    believed_heading: Float32Array
    difference: Float32Array
    cost: Float32Array
    margin: Float32Array
    hand: Float32Array


def part_shapes(layout: Layout) -> dict[str, tuple[int, ...]]:
    """The shape of every part, for the objects of a layout."""
    m, widest = len(layout), int(np.bincount(layout.category_code).max())
    sizes: dict[str, tuple[int, ...]] = {
        "category": (m, len(layout.categories)),
        "camera": (4,),
        "budget": (4,),
        "difference": (m, 3),
        "cost": (m, widest),
        "hand": (8,),
    }
    sizes |= dict.fromkeys(["position", "heading", "believed_position", "believed_heading"], (m, 2))
    return {name: sizes.get(name, (m,)) for name in Parts._fields}


@compiled
def parts_of(numbers: Float32Array, m: int, kinds: int, widest: int) -> Parts:
    """Views of all parts, (L,) one after the other, of M objects of some kinds, `widest` of one at most."""
    heading, category, in_view = 2 * m, 4 * m, 4 * m + kinds * m
    fixed, camera = in_view + m, in_view + 2 * m
    budget, position = camera + 4, camera + 8
    believed_heading, difference = position + 2 * m, position + 4 * m
    cost = difference + 3 * m
    margin = cost + widest * m
    hand = margin + m
    return Parts(
        numbers[:heading].reshape(m, 2),
        numbers[heading:category].reshape(m, 2),
        numbers[category:in_view].reshape(m, kinds),
        numbers[in_view:fixed],
        numbers[fixed:camera],
        numbers[camera:budget],
        numbers[budget:position],
        numbers[position:believed_heading].reshape(m, 2),
        numbers[believed_heading:difference].reshape(m, 2),
        numbers[difference:cost].reshape(m, 3),
        numbers[cost:margin].reshape(m, widest),
        numbers[margin:hand],
        numbers[hand:],
    )


class Believed(NamedTuple):
    """Where labels are believed to be: (M, 2) metres and (M,) radians."""

    position: FloatArray
    yaw: FloatArray


class Rule(NamedTuple):
    """What the paper's cost (Eq. 7) is made of, and the room.

    Args:
        width: of the room, metres.
        depth: of the room, metres.
        translation: cost of a metre.
        rotation: cost of the sine of half a turn.
        kinds: how many kinds of objects there are.
        dimension: (M, M) what the sizes of objects and labels cost (Eq. 6), by which the rest is multiplied.
        elevation: (M,) how high objects are, metres.
    """

    width: float
    depth: float
    translation: float
    rotation: float
    kinds: int
    dimension: FloatArray
    elevation: FloatArray


class Found(NamedTuple):
    """What was found last time, of the objects as they are met; NaN where nothing was.

    Margins are found anew only of kinds of which something else is seen, or costs something else.

    Args:
        seen: (M,) 1 where the camera saw it, else 0.
        margin: (M,) of those seen.
        cost: (M, W) to each of the labels of its kind.
    """

    seen: FloatArray
    margin: FloatArray
    cost: FloatArray


class Features:
    """What there is to say of a scene's table, kept until something changes.

    Args:
        scene: the room.

    Attributes:
        numbers: (L,) all parts, flat, one after the other.
        parts: views of them.
        least_margin: the smallest margin of a movable object in view, 1 where none has another choice.
        ambiguity: half the sum over movable objects in view of 1 - margin / 0.3, each from 0 (clear) to 1
            (a tie).
    """

    def __init__(self, scene: Scene) -> None:
        layout, weights = scene.layout, scene.cost_weights
        shapes = part_shapes(layout)
        length = sum(int(np.prod(shape)) for shape in shapes.values())
        m, kinds, widest = len(layout), len(layout.categories), shapes["cost"][1]
        self.numbers: Float32Array = np.zeros(length, dtype=np.float32)
        self.parts = parts_of(self.numbers, m, kinds, widest)
        self.least_margin, self.ambiguity = 1.0, 0.0
        self._objects = Objects.unmet(layout)
        self._rule = Rule(
            *scene.size,
            weights.translation / scene.diagonal,
            weights.rotation,
            kinds,
            dimension_cost(layout.size, layout.size),
            layout.elevation.copy(),
        )
        self._found = Found(np.full(m, np.nan), np.full(m, np.nan), np.full(shapes["cost"], np.nan))
        self._seen_of: tuple[World, float, Layout, Camera] | None = None

    def meet(self, layout: Layout, order: IntArray) -> None:
        """From now on the objects are met in another order, (M,)."""
        introduce(order, layout.category_code, layout.fixed, self._objects)
        self._found.cost[:], self._found.seen[:], self._seen_of = np.nan, np.nan, None

    def read(self, world: World) -> None:
        """Bring all up to date."""
        camera, believed, changes = world.camera, world.tracker.belief.layout, world.changes
        was = self._seen_of
        if (
            was is not None
            and changes == was[1]
            and believed is was[2]
            and camera is was[3]
            and world is was[0]
        ):
            return
        self.least_margin, self.ambiguity = read_table(
            world.places,
            Believed(believed.position, believed.yaw),
            visibility.eye_of(camera),
            self._objects,
            self._rule,
            self._found,
            self.numbers,
        )
        self._seen_of = world, changes, believed, camera


@compiled
def within(value: float, low: float, high: float) -> float:
    """The value, or the limit that it is beyond."""
    return min(max(value, low), high)


@compiled
def read_table(
    places: FloatArray,
    believed: Believed,
    eye: Eye,
    objects: Objects,
    rule: Rule,
    found: Found,
    numbers: Float32Array,
) -> tuple[float, float]:
    """Fill in what there is to say of the table.

    Args:
        places: (M, 3 or more) where objects are: x, z, pymunk's angle.
        believed: where their labels are believed to be.
        eye: the camera, as `visibility.eye_of` has it.
        objects: as they are met.
        rule: what costs are made of.
        found: last time; brought up to date.
        numbers: all parts, flat; filled, but for `budget` and `hand`. (Each array that is passed takes a
            quarter of a microsecond; so the parts are told apart in here.)

    Returns:
        `least_margin` and `ambiguity` of `Features`.
    """
    parts = parts_of(numbers, len(objects.number), rule.kinds, objects.rivals.shape[1])
    kinds = rule.kinds
    anew = np.zeros(kinds, dtype=np.bool_)
    parts.category[:] = 0.0
    for k in range(len(objects.number)):
        i, kind = objects.number[k], objects.kind[k]
        x, z, yaw = places[i, 0], places[i, 1], wrap_angle(-places[i, 2])
        seen = 1.0 if sees(eye, x, rule.elevation[i], z) else 0.0
        if seen != found.seen[k]:
            found.seen[k], anew[kind] = seen, True
        _describe(k, i, x, z, yaw, believed, rule, parts)
        parts.category[k, kind] = 1.0
        parts.in_view[k] = seen
        parts.fixed[k] = 1.0 if objects.fixed[k] else 0.0
        for column in range(objects.rivals.shape[1]):
            j = objects.rivals[k, column]
            cost = NO_RIVAL
            if j >= 0:
                dx, dz = x - believed.position[j, 0], z - believed.position[j, 1]
                turn = abs(sin((yaw - believed.yaw[j]) / 2))
                cost = rule.translation * sqrt(dx * dx + dz * dz) + rule.rotation * turn
                cost *= rule.dimension[i, j]
            if cost != found.cost[k, column]:
                found.cost[k, column], anew[kind] = cost, True
            parts.cost[k, column] = within(cost, 0, NO_RIVAL)
        parts.margin[k] = 1.0
    parts.camera[0] = within(2 * eye.x / rule.width - 1, -4, 4)
    parts.camera[1] = within(2 * eye.z / rule.depth - 1, -4, 4)
    parts.camera[2], parts.camera[3] = eye.sine, eye.cosine
    least, ambiguity = np.inf, 0.0
    for kind in range(kinds):
        if anew[kind]:
            _find_margins(kind, objects, found)
        for k in range(len(objects.number)):
            if objects.kind[k] == kind and found.seen[k] != 0:
                margin = found.margin[k]
                parts.margin[k] = min(margin / MARGIN_SCALE, 1.0)
                if not objects.fixed[k] and margin < np.inf:
                    least = min(least, margin)
                    ambiguity += (1 - within(margin / MARGIN_SCALE, 0, 1)) / 2
    return (least if least < np.inf else 1.0), ambiguity


@compiled
def _describe(
    k: int, i: int, x: float, z: float, yaw: float, believed: Believed, rule: Rule, parts: Parts
) -> None:
    """Fill in where object i, met as the k-th, is and where its label is believed to be."""
    bx, bz, by = believed.position[i, 0], believed.position[i, 1], believed.yaw[i]
    parts.position[k, 0] = within(2 * x / rule.width - 1, -2, 2)
    parts.position[k, 1] = within(2 * z / rule.depth - 1, -2, 2)
    parts.heading[k, 0], parts.heading[k, 1] = sin(yaw), cos(yaw)
    parts.believed_position[k, 0] = within(2 * bx / rule.width - 1, -2, 2)
    parts.believed_position[k, 1] = within(2 * bz / rule.depth - 1, -2, 2)
    parts.believed_heading[k, 0], parts.believed_heading[k, 1] = sin(by), cos(by)
    parts.difference[k, 0] = within(2 * (x - bx) / rule.width, -2, 2)
    parts.difference[k, 1] = within(2 * (z - bz) / rule.depth, -2, 2)
    parts.difference[k, 2] = wrap_angle(yaw - by) / pi


@compiled
def _find_margins(kind: int, objects: Objects, found: Found) -> None:
    """Find the margins of the objects of a kind that are in view."""
    rows, n = np.empty(len(objects.number), dtype=np.int64), 0
    for k in range(len(objects.number)):
        if objects.kind[k] == kind and found.seen[k] != 0:
            rows[n] = k
            n += 1
    if n == 0:
        return
    count = 0
    while count < objects.rivals.shape[1] and objects.rivals[rows[0], count] >= 0:
        count += 1
    block = np.empty((n, count))
    for row in range(n):
        for column in range(count):
            block[row, column] = found.cost[rows[row], column]
    chosen = np.empty(n, dtype=np.int64)
    assign(block, chosen, np.empty(n), np.empty(count))
    margins = find_margins(block, chosen)[0]
    for row in range(n):
        found.margin[rows[row]] = margins[row]
