"""Chipmunk's objects of one plane, made and freed in one compiled call each, and the settings that they have.

Metres, seconds, kilograms, and pymunk's angles. The settings belong together; pymunk's own are meant for
pixels, and in metres its slop alone would let buildings stand 10 cm inside each other.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.game_logic import arm, chipmunk, plane
from farm_ar.game_logic.plane import Addresses

SKIN = 0.001
"""How far a building's solid surface stands out from its footprint, metres: what sinks in, sinks in here."""

FRICTION = 0.3
"""Between any two surfaces that touch."""

MOVABLE, FIXED, EDGE, HAND = 0b0001, 0b0010, 0b0100, 0b1000
"""Collision categories. A hand reaches over the edges."""

EDGES = 4
"""Shapes of a plane beside those of its boxes and the hand's disc."""

_ANYTHING = -1
_MASS = 1.0
_HAND_MASS, _HAND_MOMENT = 0.5, 9e-4
_EDGE_WIDTH = 0.5  # wider than anything moves in a step

# The table's friction: the share of its velocity that a sliding building keeps after a second. One let go at
# 1 m/s slides on for 7 cm.
_DAMPING = 1e-6
_ITERATIONS = 20  # with 10, what is forced into a gap as wide as itself now and then stays wedged there
_SLOP = 2e-4
_BIAS = 0.7**60  # 30% of an overlap is undone in each tick

# What has moved by less than so many metres a second for so many seconds is left out of the steps until
# something touches it. By then half a percent is left of an overlap, whose undoing does not count as speed.
_SLEEP_S, _SLEEP_SPEED = 0.25, 3e-3


@chipmunk.compiled
def set_out(
    box: FloatArray,
    position: FloatArray,
    angle: FloatArray,
    size: FloatArray,
    fixed: BoolArray,
    height: FloatArray,
) -> None:
    """Fill in the (N, `COLUMNS`) boxes of a plane, as `Plane` is given them."""
    for i in range(len(box)):
        x, z = position[i, 0], position[i, 1]
        box[i, plane.BOX_X], box[i, plane.BOX_Z], box[i, plane.BOX_ANGLE] = x, z, angle[i]
        box[i, plane.OLD_X], box[i, plane.OLD_Z], box[i, plane.OLD_ANGLE] = x, z, angle[i]
        box[i, plane.HALF_WIDTH], box[i, plane.HALF_DEPTH] = size[i, 0] / 2, size[i, 2] / 2
        box[i, plane.MOVABLE] = 0.0 if fixed[i] else 1.0
        box[i, plane.ELEVATION] = height[i]


@chipmunk.compiled
def make_parts(handle: Addresses, shape: Addresses, corner: FloatArray, box: FloatArray) -> None:
    """Make a space, a hand's arm and disc, which are not in it yet, the boxes, and the edges, in this order.

    Args:
        handle: filled with the addresses that `plane` names.
        shape: (N + `EDGES` + 1,) filled with the addresses of the shapes: the disc's, those of the boxes,
            those of the edges.
        corner: (`EDGES`, 4, 2) the edges' corners, metres.
        box: (N, `COLUMNS`) the boxes.
    """
    space = chipmunk.new_space()
    chipmunk.set_damping(space, _DAMPING)
    chipmunk.set_iterations(space, _ITERATIONS)
    chipmunk.set_slop(space, _SLOP)
    chipmunk.set_bias(space, _BIAS)
    chipmunk.set_sleep_time(space, _SLEEP_S)
    chipmunk.set_sleep_speed(space, _SLEEP_SPEED)
    handle[plane.SPACE], handle[plane.ARM] = space, chipmunk.new_kinematic_body()
    handle[plane.DISC] = chipmunk.new_body(_HAND_MASS, _HAND_MOMENT)
    shape[0] = chipmunk.new_circle(handle[plane.DISC], arm.HAND_RADIUS, 0.0, 0.0)
    handle[plane.DISC_SHAPE] = shape[0]
    finish_shape(shape[0], HAND, MOVABLE | FIXED)
    n = len(box)
    for i in range(n):
        moves = box[i, plane.MOVABLE] > 0
        width, depth = 2 * box[i, plane.HALF_WIDTH], 2 * box[i, plane.HALF_DEPTH]
        if moves:
            body = chipmunk.new_body(_MASS, chipmunk.moment_of_box(_MASS, width, depth))
        else:
            body = chipmunk.new_static_body()
        chipmunk.set_position(body, box[i, plane.BOX_X], box[i, plane.BOX_Z])
        chipmunk.set_angle(body, box[i, plane.BOX_ANGLE])
        handle[plane.FIRST + i], shape[1 + i] = body, chipmunk.new_box(body, width, depth, SKIN)
        finish_shape(shape[1 + i], MOVABLE if moves else FIXED, _ANYTHING)
        chipmunk.add_body(space, body)
        chipmunk.add_shape(space, shape[1 + i])
    everywhere = chipmunk.static_body(space)
    for k in range(EDGES):
        edge = chipmunk.new_polygon(everywhere, 4, corner[k].ctypes.data, 0.0)
        shape[1 + n + k] = edge
        finish_shape(edge, EDGE, MOVABLE)
        chipmunk.add_shape(space, edge)


@chipmunk.compiled
def finish_shape(shape: int, category: int, others: int) -> None:
    """Give a shape what all have, what it is, and what it collides with."""
    chipmunk.set_friction(shape, FRICTION)
    chipmunk.set_filter(shape, 0, chipmunk.touches(category, others))


@chipmunk.compiled
def free_parts(handle: Addresses, shape: Addresses) -> None:
    """Free all of a plane: the space first, which still looks at its bodies."""
    chipmunk.free_space(handle[plane.SPACE])
    for joint in (plane.PULL, plane.TWIST):
        if handle[joint] != 0:
            chipmunk.free_constraint(handle[joint])
    for one in shape:
        chipmunk.free_shape(one)
    chipmunk.free_body(handle[plane.ARM])
    chipmunk.free_body(handle[plane.DISC])
    for i in range(plane.FIRST, len(handle)):
        chipmunk.free_body(handle[i])


@lru_cache(maxsize=16)
def edge_corners(extent: tuple[float, float]) -> FloatArray:
    """(`EDGES`, 4, 2) corners of the edges of a plane [0, width] x [0, depth], metres; never write to it."""
    left, right = -_EDGE_WIDTH, extent[0] + _EDGE_WIDTH
    near, far = -_EDGE_WIDTH, extent[1] + _EDGE_WIDTH
    sides = (left, near, 0.0, far), (extent[0], near, right, far)
    ends = (left, near, right, 0.0), (left, extent[1], right, far)
    # Round about in the order of Chipmunk's own boxes.
    return np.array([[(x1, z0), (x1, z1), (x0, z1), (x0, z0)] for x0, z0, x1, z1 in sides + ends])
