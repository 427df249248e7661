"""The table as numbers: the parts of a state observation, and how near a mistake is, in one compiled call."""

from __future__ import annotations

from math import cos, pi, sin
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs.table import Objects, introduce
from farm_ar.game_logic import visibility
from farm_ar.geometry.angles import wrap_angle
from farm_ar.geometry.camera import Eye, sees
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import CostModel, Workspace, workspace_for
from farm_ar.reid.assignment.assessment import cost_of_moving, size_factor
from farm_ar.reid.assignment.optimum import assign_most_in, find_margins_in
from farm_ar.reid.costs import sorted_log_sides
from farm_ar.scenes import Camera, Layout, Scene
from farm_ar.structs import Structs

if TYPE_CHECKING:
    from farm_ar.envs.worlds import World

Float32Array = npt.NDArray[np.float32]

MARGIN_SCALE = 0.3
"""The margin that is observed as 1."""

NO_RIVAL = 2.0
"""In place of a cost, where a kind has fewer objects than the largest one."""


class Parts(NamedTuple):
    """The parts of a state observation, objects in the agent's order; `observations` says more.

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


class Room(NamedTuple):
    """What does not change while a scene is played on.

    Args:
        width: of the room, metres.
        depth: of the room, metres.
        kinds: how many kinds of objects there are.
        elevation: (M,) how high objects are, metres.
        size: (M,) which of the sizes each has.
        sides: (U, 3) sorted logarithms of the sides of each size.
        model: the paper's, by which costs and margins are found.
    """

    width: float
    depth: float
    kinds: int
    elevation: FloatArray
    size: IntArray
    sides: FloatArray
    model: CostModel


class Found(NamedTuple):
    """What was found last time.

    What is said of an object is found anew only where it does not stand as it did, and costs and margins of
    its kind with it. Whoever changes a belief sets the pose of the label's object to NaN, and all of them
    where the camera or the order in which objects are met changes.

    Args:
        pose: (M, 4) x, z, yaw, and 1 where the camera saw it, else 0, of each object as the layout has them;
            NaN where all is to be found anew.
        margin: (M,) of those seen.
        right: (M,) whether those seen would get their own label.
        cost: (M, M) of every label for every object.
    """

    pose: FloatArray
    margin: FloatArray
    right: BoolArray
    cost: FloatArray


class Features:
    """Features of a scene's table, kept until something changes.

    Args:
        scene: the room.

    Attributes:
        numbers: (L,) all parts, flat, one after the other.
        parts: views of them.
        room: what does not change.
        least_margin: the smallest margin of a movable object in view, 1 where none has another choice.
        ambiguity: half the sum over movable objects in view of 1 - margin / 0.3, each from 0 (clear) to 1
            (a tie).
        expected_wrong: the sum over movable objects in view of (1 - signed margin / 0.3) / 2, each from 0
            (clearly right) to 1 (clearly wrong); the sign is that of being right.
    """

    def __init__(self, scene: Scene) -> None:
        layout, weights = scene.layout, scene.cost_weights
        shapes = part_shapes(layout)
        length = sum(int(np.prod(shape)) for shape in shapes.values())
        m, kinds, widest = len(layout), len(layout.categories), shapes["cost"][1]
        self.numbers: Float32Array = np.zeros(length, dtype=np.float32)
        self.parts = parts_of(self.numbers, m, kinds, widest)
        self.least_margin, self.ambiguity, self.expected_wrong = 1.0, 0.0, 0.0
        self._objects = Objects.unmet(layout)
        sides, size = np.unique(sorted_log_sides(layout.size), axis=0, return_inverse=True)
        kinds_of_size = np.unique(np.column_stack([layout.category_code, size.reshape(m)]), axis=0)
        self.room = Room(
            *scene.size,
            kinds,
            layout.elevation.copy(),
            size.reshape(m),
            sides,
            CostModel(
                weights.translation / scene.diagonal,
                float(weights.rotation),
                compare_sizes=len(kinds_of_size) > kinds,  # elsewhere they cost the same
            ),
        )
        self._found = Found(
            np.full((m, 4), np.nan),
            np.full(m, np.nan),
            np.zeros(m, dtype=np.bool_),
            np.full((m, m), np.nan),
        )
        self._seen_of: tuple[World, float, Layout, Camera] | None = None

    def meet(self, layout: Layout, order: IntArray) -> None:
        """From now on the objects have another order, (M,)."""
        introduce(order, layout.category_code, layout.fixed, self._objects)
        self._found.pose[:], self._seen_of = np.nan, None

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
        if was is None or believed is not was[2] or camera is not was[3]:
            self._found.pose[:] = np.nan
        self.least_margin, self.ambiguity, self.expected_wrong = read_table(
            world.places,
            Believed(believed.position, believed.yaw),
            visibility.eyes_of(camera),
            self._objects,
            self.room,
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
    eyes: Structs[Eye],
    objects: Objects,
    room: Room,
    found: Found,
    numbers: Float32Array,
) -> tuple[float, float, float]:
    """Fill in the features of the table.

    Args:
        places: (M, 3 or more) where objects are: x, z, pymunk's angle.
        believed: where their labels are believed to be.
        eyes: (1,) the camera, as `visibility.eyes_of` has it.
        objects: in the agent's order.
        room: what does not change.
        found: last time, with the same beliefs; brought up to date.
        numbers: all parts as they were filled last time, flat; filled, but for `budget` and `hand`. (Each
            array that is passed takes a quarter of a microsecond; so the parts are distinguished in here.)

    Returns:
        `least_margin`, `ambiguity` and `expected_wrong` of `Features`.
    """
    widest = objects.rivals.shape[1]
    space = workspace_for(len(objects.number), widest, True, room.kinds)
    return read_table_in(places, believed, eyes, objects, room, found, numbers, space)


@compiled
def read_table_in(
    places: FloatArray,
    believed: Believed,
    eyes: Structs[Eye],
    objects: Objects,
    room: Room,
    found: Found,
    numbers: Float32Array,
    space: Workspace,
) -> tuple[float, float, float]:
    """`read_table`, in a workspace for all objects."""
    parts = parts_of(numbers, len(objects.number), room.kinds, objects.rivals.shape[1])
    pose, eye, changed, anew = found.pose, eyes[0], space.changed, space.changed_kinds
    anew[: room.kinds] = 0
    for k in range(len(objects.number)):
        i, kind = objects.number[k], objects.kind[k]
        x, z, yaw = places[i, 0], places[i, 1], wrap_angle(-places[i, 2])
        changed[i] = 0
        if x == pose[i, 0] and z == pose[i, 1] and yaw == pose[i, 2]:
            continue
        seen = 1.0 if sees(eye, x, room.elevation[i], z) else 0.0
        pose[i, 0], pose[i, 1], pose[i, 2], pose[i, 3] = x, z, yaw, seen
        changed[i] = anew[kind] = 1
        _describe(k, i, x, z, yaw, believed, room, parts)
        parts.category[k, :] = 0.0
        parts.category[k, kind] = 1.0
        parts.in_view[k] = seen
        parts.fixed[k] = 1.0 if objects.fixed[k] else 0.0
    parts.camera[0] = within(2 * eye.x / room.width - 1, -4, 4)
    parts.camera[1] = within(2 * eye.z / room.depth - 1, -4, 4)
    parts.camera[2], parts.camera[3] = eye.sine, eye.cosine
    for kind in range(room.kinds):
        if anew[kind]:
            _assess(kind, believed, objects, room, found, space)
    least, ambiguity, wrong = np.inf, 0.0, 0.0
    for k in range(len(objects.number)):
        i, margin = objects.number[k], np.inf
        if pose[i, 3] != 0:
            margin = found.margin[i]
            if not objects.fixed[k] and margin < np.inf:
                least = min(least, margin)
                ambiguity += (1 - within(margin / MARGIN_SCALE, 0, 1)) / 2
                signed = margin if found.right[i] else -margin
                wrong += (1 - within(signed / MARGIN_SCALE, -1, 1)) / 2
        if anew[objects.kind[k]]:
            parts.margin[k] = min(margin / MARGIN_SCALE, 1.0)
            for column in range(objects.rivals.shape[1]):
                j = objects.rivals[k, column]
                parts.cost[k, column] = within(found.cost[i, j], 0, NO_RIVAL) if j >= 0 else NO_RIVAL
    return (least if least < np.inf else 1.0), ambiguity, wrong


@compiled(inline="always")
def _describe(
    k: int, i: int, x: float, z: float, yaw: float, believed: Believed, room: Room, parts: Parts
) -> None:
    """Fill in where object i, met as the k-th, is and where its label is believed to be."""
    bx, bz, by = believed.position[i, 0], believed.position[i, 1], believed.yaw[i]
    parts.position[k, 0] = within(2 * x / room.width - 1, -2, 2)
    parts.position[k, 1] = within(2 * z / room.depth - 1, -2, 2)
    parts.heading[k, 0], parts.heading[k, 1] = sin(yaw), cos(yaw)
    parts.believed_position[k, 0] = within(2 * bx / room.width - 1, -2, 2)
    parts.believed_position[k, 1] = within(2 * bz / room.depth - 1, -2, 2)
    parts.believed_heading[k, 0], parts.believed_heading[k, 1] = sin(by), cos(by)
    parts.difference[k, 0] = within(2 * (x - bx) / room.width, -2, 2)
    parts.difference[k, 1] = within(2 * (z - bz) / room.depth, -2, 2)
    parts.difference[k, 2] = wrap_angle(yaw - by) / pi


@compiled
def _assess(
    kind: int, believed: Believed, objects: Objects, room: Room, found: Found, space: Workspace
) -> None:
    """Find the costs of what changed of a kind, and the margins of what is in view of it."""
    rows, columns, n, width = space.rows, space.columns, 0, 0
    for k in range(len(objects.number)):
        if objects.kind[k] == kind:
            i, place = objects.number[k], width
            if found.pose[i, 3] != 0:
                rows[n] = i
                n += 1
            while place > 0 and columns[place - 1] > i:
                columns[place] = columns[place - 1]
                place -= 1
            columns[place] = i
            width += 1
    for place in range(width):
        half = believed.yaw[columns[place]] / 2
        space.half_sine[place], space.half_cosine[place] = sin(half), cos(half)
    for row in range(width):
        i = columns[row]
        half = (sin(found.pose[i, 2] / 2), cos(found.pose[i, 2] / 2))
        for place in range(width):
            j = columns[place]
            if space.changed[i] or space.changed[j]:
                found.cost[i, j] = _cost(
                    i, j, half, (space.half_sine[place], space.half_cosine[place]), believed, room, found
                )
    cost = space.cost[: n * width].reshape(n, width)
    for row in range(n):
        for place in range(width):
            cost[row, place] = found.cost[rows[row], columns[place]]
    assign_most_in(cost, space)
    find_margins_in(cost, space)
    for row in range(n):
        i = rows[row]
        found.margin[i], found.right[i] = space.margin[row], columns[space.column_of[row]] == i


@compiled(inline="always")
def _cost(
    i: int,
    j: int,
    half: tuple[float, float],
    label_half: tuple[float, float],
    believed: Believed,
    room: Room,
    found: Found,
) -> float:
    """Of giving object i, as it was found, label j; of both sine and cosine of half the yaw."""
    dx, dz = found.pose[i, 0] - believed.position[j, 0], found.pose[i, 1] - believed.position[j, 1]
    model = room.model
    cost = cost_of_moving(dx, dz, half, label_half, model.translation_weight, model.rotation_weight)
    if model.compare_sizes:
        cost = size_factor(room.sides[room.size[i]], room.sides[room.size[j]]) * cost
    return cost
