"""The table as numbers: a state observation, and how near a mistake is, in one compiled call."""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs.ordering import FIXED, KIND, OBJECT, RIVALS, introduce
from farm_ar.game_logic import visibility
from farm_ar.geometry.angles import wrap_angle
from farm_ar.geometry.camera import Eye, sees
from farm_ar.kernels import compiled
from farm_ar.reid import dimension_cost
from farm_ar.reid.kernels import assign
from farm_ar.reid.margins import find_margins
from farm_ar.scenes import Camera, Layout, Scene
from farm_ar.structs import new_structs

if TYPE_CHECKING:
    from farm_ar.envs.worlds import World

MARGIN_SCALE = 0.3
"""The margin that is observed as 1."""

NO_RIVAL = 2.0
"""In place of a cost, where a kind has fewer objects than the largest one."""

X, Z, ANGLE = range(3)
"""Columns of where objects are."""

BELIEVED_X, BELIEVED_Z, BELIEVED_YAW, ELEVATION = range(4)
"""Columns of where they are believed to be, and how high they are."""

WIDTH, DEPTH, TRANSLATION, ROTATION, KINDS, WHITE_BOX, CONSTANTS = range(7)
"""What does not change: the table's sides, metres; the costs' weights; how many kinds there are; whether
what is believed is observed; how many these are."""

SEEN, FOUND, COSTS = range(3)
"""Columns of what was found last time: whether an object was in view, its margin, from there on its costs."""

LEAST, AMBIGUITY, READ_AT, SUMMARY = range(4)
"""The smallest margin of a movable object in view, 1 where none has another choice; half the sum over those
in view of 1 - margin / 0.3, each from 0 (clear) to 1 (a tie); the `changes` of the world at which all this
was read; how many numbers there are."""


class Reading:
    """What there is to say of a scene's table, kept until something changes.

    Args:
        scene: the room.
        white_box: whether what is believed is observed.
        length: how many numbers the observation has.

    Attributes:
        numbers: (length,) the observation, of the object parts as `observations` orders them; others are
            left.
        summary: (SUMMARY,) `LEAST`, `AMBIGUITY` and `READ_AT`.
        sheet: all that it keeps, as `pages` divides it.
        met: (M, `RIVALS` + W) the objects as they are met.
    """

    def __init__(self, scene: Scene, white_box: bool, length: int) -> None:
        layout, weights = scene.layout, scene.cost_weights
        self.numbers: npt.NDArray[np.float32] = np.zeros(length, dtype=np.float32)
        m, widest = len(layout), int(np.bincount(layout.category_code).max())
        self.met = np.zeros((m, RIVALS + widest), dtype=np.int64)
        self.sheet = np.zeros(SUMMARY + CONSTANTS + m * (m + ELEVATION + 1 + COSTS + widest))
        self.summary, self._fixed, self._where, self._dimension, self._known = pages(self.sheet, m, widest)
        self.summary[LEAST], self._known[:] = 1.0, np.nan
        self._fixed[WIDTH], self._fixed[DEPTH] = scene.size
        self._fixed[TRANSLATION] = weights.translation / scene.diagonal
        self._fixed[ROTATION], self._fixed[KINDS] = weights.rotation, len(layout.categories)
        self._fixed[WHITE_BOX] = white_box
        self._dimension[:] = dimension_cost(layout.size, layout.size)
        self._where[:, ELEVATION] = layout.elevation
        self._world: World | None = None
        self._believed: Layout | None = None
        self._camera: Camera | None = None
        self._eye = new_structs(Eye, 1)[0]

    def meet(self, layout: Layout, order: IntArray) -> None:
        """From now on the objects are met in another order, (M,)."""
        introduce(order, layout.category_code, layout.fixed, self.met)
        self._known[:], self._world = np.nan, None

    def read(self, world: World) -> None:
        """Bring `numbers` and `summary` up to date."""
        camera, believed, changes = world.camera, world.tracker.belief.layout, world.changes
        if (
            changes == self.summary.item(READ_AT)
            and believed is self._believed
            and camera is self._camera
            and world is self._world
        ):
            return
        if believed is not self._believed:
            self._where[:, BELIEVED_X : BELIEVED_Z + 1] = believed.position
            self._where[:, BELIEVED_YAW], self._believed = believed.yaw, believed
        if camera is not self._camera:
            self._eye, self._camera = visibility.eye_of(camera), camera
        read_table(
            world.places,
            self._where,
            self._eye,
            self.met,
            self._dimension,
            self._fixed,
            self._known,
            self.numbers,
            self.summary,
        )
        self._world, self.summary[READ_AT] = world, changes


@compiled
def pages(
    sheet: FloatArray, m: int, widest: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """What a reading of M objects, of one kind at most `widest`, keeps: parts of one array.

    Returns:
        Summary and constants; where objects are believed to be; what their sizes cost; what was found.
    """
    where = SUMMARY + CONSTANTS
    dimension = where + (ELEVATION + 1) * m
    known = dimension + m * m
    return (
        sheet[:SUMMARY],
        sheet[SUMMARY:where],
        sheet[where:dimension].reshape(m, ELEVATION + 1),
        sheet[dimension:known].reshape(m, m),
        sheet[known:].reshape(m, COSTS + widest),
    )


@compiled
def within(value: float, low: float, high: float) -> float:
    """The value, or the limit that it is beyond."""
    return min(max(value, low), high)


@compiled
def read_table(
    places: FloatArray,
    where: FloatArray,
    eye: Eye,
    met: IntArray,
    dimension: FloatArray,
    fixed: FloatArray,
    known: FloatArray,
    numbers: npt.NDArray[np.float32],
    summary: FloatArray,
) -> None:
    """Fill in what there is to say of the table.

    Args:
        places: (M, 3 or more) where objects are: x, z, pymunk's angle.
        where: (M, 4) where they are believed to be, and how high they are.
        eye: the camera, as `visibility.eye_of` has it.
        met: (M, 3 + W) the objects as they are met, W the most of a kind.
        dimension: (M, M) what their sizes cost (Eq. 6).
        fixed: what does not change.
        known: (M, 2 + W) what was found last time; brought up to date. Margins are found anew only of kinds
            of which something else is seen, or costs something else.
        numbers: filled: positions, headings, kinds, in view, fixed, camera; then after four places, if what
            is believed is observed, believed positions and headings, differences, costs, margins.
        summary: filled.
    """
    m, widest, kinds = len(met), met.shape[1] - RIVALS, int(fixed[KINDS])
    width, depth = fixed[WIDTH], fixed[DEPTH]
    heading, kind_at = 2 * m, 4 * m
    seen_at = kind_at + kinds * m
    fixed_at, camera_at = seen_at + m, seen_at + 2 * m
    believed_at = camera_at + 8
    believed_heading, difference = believed_at + 2 * m, believed_at + 4 * m
    cost_at = difference + 3 * m
    margin_at = cost_at + widest * m
    white_box = fixed[WHITE_BOX] != 0
    numbers[kind_at:camera_at] = 0.0
    cost, rows, anew = known[:, COSTS:], np.empty(m, dtype=np.int64), np.zeros(kinds, dtype=np.bool_)
    for k in range(m):
        i = met[k, OBJECT]
        x, z, yaw = places[i, X], places[i, Z], wrap_angle(-places[i, ANGLE])
        seen = 1.0 if sees(eye, x, where[i, ELEVATION], z) else 0.0
        if seen != known[k, SEEN]:
            known[k, SEEN], anew[met[k, KIND]] = seen, True
        numbers[2 * k], numbers[2 * k + 1] = (
            within(2 * x / width - 1, -2, 2),
            within(2 * z / depth - 1, -2, 2),
        )
        numbers[heading + 2 * k], numbers[heading + 2 * k + 1] = sin(yaw), cos(yaw)
        numbers[kind_at + kinds * k + met[k, KIND]] = 1.0
        numbers[seen_at + k] = seen
        numbers[fixed_at + k] = met[k, FIXED]
        for column in range(widest):
            j = met[k, RIVALS + column]
            if j < 0:
                cost[k, column] = NO_RIVAL
                continue
            dx, dz = x - where[j, BELIEVED_X], z - where[j, BELIEVED_Z]
            turn = abs(sin((yaw - where[j, BELIEVED_YAW]) / 2))
            moved = fixed[TRANSLATION] * sqrt(dx * dx + dz * dz) + fixed[ROTATION] * turn
            moved *= dimension[i, j]
            if moved != cost[k, column]:
                cost[k, column], anew[met[k, KIND]] = moved, True
        if white_box:
            bx, bz, by = where[i, BELIEVED_X], where[i, BELIEVED_Z], where[i, BELIEVED_YAW]
            numbers[believed_at + 2 * k] = within(2 * bx / width - 1, -2, 2)
            numbers[believed_at + 2 * k + 1] = within(2 * bz / depth - 1, -2, 2)
            numbers[believed_heading + 2 * k] = sin(by)
            numbers[believed_heading + 2 * k + 1] = cos(by)
            numbers[difference + 3 * k] = within(2 * (x - bx) / width, -2, 2)
            numbers[difference + 3 * k + 1] = within(2 * (z - bz) / depth, -2, 2)
            numbers[difference + 3 * k + 2] = wrap_angle(yaw - by) / pi
            for column in range(widest):
                numbers[cost_at + widest * k + column] = within(cost[k, column], 0, NO_RIVAL)
            numbers[margin_at + k] = 1.0
    numbers[camera_at] = within(2 * eye.x / width - 1, -4, 4)
    numbers[camera_at + 1] = within(2 * eye.z / depth - 1, -4, 4)
    numbers[camera_at + 2], numbers[camera_at + 3] = eye.sine, eye.cosine
    summary[LEAST], summary[AMBIGUITY] = np.inf, 0.0
    for kind in range(kinds):
        n, count = 0, 0
        for k in range(m):
            if met[k, KIND] == kind and known[k, SEEN] != 0:
                rows[n] = k
                n += 1
        if n == 0:
            continue
        if anew[kind]:
            while count < widest and met[rows[0], RIVALS + count] >= 0:
                count += 1
            block = np.empty((n, count))
            for row in range(n):
                block[row] = cost[rows[row], :count]
            chosen = np.empty(n, dtype=np.int64)
            assign(block, chosen, np.empty(n), np.empty(count))
            found = find_margins(block, chosen)[0]
            for row in range(n):
                known[rows[row], FOUND] = found[row]
        for row in range(n):
            k = rows[row]
            margin = known[k, FOUND]
            if white_box:
                numbers[margin_at + k] = min(margin / MARGIN_SCALE, 1.0)
            if met[k, FIXED] == 0 and margin < np.inf:
                summary[LEAST] = min(summary[LEAST], margin)
                summary[AMBIGUITY] += (1 - within(margin / MARGIN_SCALE, 0, 1)) / 2
    if summary[LEAST] == np.inf:
        summary[LEAST] = 1.0
