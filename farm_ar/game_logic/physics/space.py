"""The space factory: a table's objects in Chipmunk, made and freed in one compiled call each.

Metres, seconds, kilograms, and Chipmunk's angles. The settings belong together; pymunk's own are meant for
pixels, and in metres its slop alone would let buildings stand 10 cm inside each other. The objects are
Chipmunk's own: pymunk's Python objects take a hundred times as long to make.
"""

from __future__ import annotations

import weakref
from functools import lru_cache

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.game_logic.physics import chipmunk, gripper
from farm_ar.game_logic.physics.state import Body, State
from farm_ar.geometry import to_pymunk, wrap
from farm_ar.scenes import Layout
from farm_ar.structs import Structs, new_structs, words_of

SKIN = 0.001
"""How far a building's solid surface stands out from its footprint, metres: what sinks in, sinks in here."""

FRICTION = 0.3
"""Between any two surfaces that touch."""

MOVABLE, FIXED, EDGE, HAND = 0b0001, 0b0010, 0b0100, 0b1000
"""Collision categories. A hand reaches over the edges."""

EDGES = 4
"""Shapes of a space beside those of its bodies and the hand's disc."""

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


class PhysicsSpace:
    """Boxes on a table without gravity, where what slides comes to rest, and a hand that is not there yet.

    Everything is made in the order of the layout, so that the same calls give the same bytes. Chipmunk's
    objects are freed with this one.

    Args:
        layout: what stands on the table, a single arrangement.
        extent: width and depth of the table [0, width] x [0, depth], metres.

    Attributes:
        states: (1,) the state.
        bodies: (N,) the bodies.
        places: (N, 3 or more) the same memory: x and z, metres, and Chipmunk's angle, radians.
    """

    def __init__(self, layout: Layout, extent: tuple[float, float]) -> None:
        n = len(layout)
        self.states, self.bodies = new_structs(State, 1), new_structs(Body, n)
        self.places = words_of(self.bodies)
        position, angle = to_pymunk(layout.position, wrap(layout.yaw))
        bodies, state = self.bodies, self.states
        bodies["x"], bodies["z"], bodies["angle"] = position[:, 0], position[:, 1], angle
        bodies["old_x"], bodies["old_z"], bodies["old_angle"] = position[:, 0], position[:, 1], angle
        bodies["half_width"], bodies["half_depth"] = layout.size[:, 0] / 2, layout.size[:, 2] / 2
        bodies["movable"], bodies["elevation"] = layout.movable, layout.elevation
        state["width"], state["depth"] = extent
        state["hand"]["gripped"] = -1
        shapes: IntArray = np.zeros(n + EDGES + 1, dtype=np.int64)
        make_objects(state, bodies, shapes, edge_corners(extent))
        # Not when Python ends, which may have taken the kernel away by then.
        weakref.finalize(self, free_objects, state, bodies, shapes).atexit = False


@chipmunk.compiled
def make_objects(
    states: Structs[State], bodies: Structs[Body], shapes: IntArray, corners: FloatArray
) -> None:
    """Make a space, a hand's arm and disc, which are not in it yet, the bodies, and the edges, in this order.

    Args:
        states: (1,) whose space is filled in.
        bodies: (N,) whose addresses are filled in.
        shapes: (N + `EDGES` + 1,) filled with the addresses of the shapes: the disc's, those of the bodies,
            those of the edges.
        corners: (`EDGES`, 4, 2) the edges' corners, metres.
    """
    own = states[0].space
    space = chipmunk.new_space()
    chipmunk.set_damping(space, _DAMPING)
    chipmunk.set_iterations(space, _ITERATIONS)
    chipmunk.set_slop(space, _SLOP)
    chipmunk.set_bias(space, _BIAS)
    chipmunk.set_sleep_time(space, _SLEEP_S)
    chipmunk.set_sleep_speed(space, _SLEEP_SPEED)
    own.space, own.arm = space, chipmunk.new_kinematic_body()
    own.disc = chipmunk.new_body(_HAND_MASS, _HAND_MOMENT)
    shapes[0] = chipmunk.new_circle(own.disc, gripper.HAND_RADIUS, 0.0, 0.0)
    own.disc_shape = shapes[0]
    finish_shape(shapes[0], HAND, MOVABLE | FIXED)
    n = len(bodies)
    for i in range(n):
        body = bodies[i]
        width, depth = 2 * body.half_width, 2 * body.half_depth
        if body.movable:
            address = chipmunk.new_body(_MASS, chipmunk.moment_of_box(_MASS, width, depth))
        else:
            address = chipmunk.new_static_body()
        chipmunk.set_position(address, body.x, body.z)
        chipmunk.set_angle(address, body.angle)
        body.address, shapes[1 + i] = address, chipmunk.new_box(address, width, depth, SKIN)
        finish_shape(shapes[1 + i], MOVABLE if body.movable else FIXED, _ANYTHING)
        chipmunk.add_body(space, address)
        chipmunk.add_shape(space, shapes[1 + i])
    everywhere = chipmunk.static_body(space)
    for k in range(EDGES):
        edge = chipmunk.new_polygon(everywhere, 4, corners[k].ctypes.data, 0.0)
        shapes[1 + n + k] = edge
        finish_shape(edge, EDGE, MOVABLE)
        chipmunk.add_shape(space, edge)


@chipmunk.compiled
def finish_shape(shape: int, category: int, others: int) -> None:
    """Give a shape what all have, what it is, and what it collides with."""
    chipmunk.set_friction(shape, FRICTION)
    chipmunk.set_filter(shape, 0, chipmunk.touches(category, others))


@chipmunk.compiled
def free_objects(states: Structs[State], bodies: Structs[Body], shapes: IntArray) -> None:
    """Free all of a table: the space first, which still looks at its bodies."""
    own = states[0].space
    chipmunk.free_space(own.space)
    for joint in (own.pull, own.twist):
        if joint != 0:
            chipmunk.free_constraint(joint)
    for shape in shapes:
        chipmunk.free_shape(shape)
    chipmunk.free_body(own.arm)
    chipmunk.free_body(own.disc)
    for i in range(len(bodies)):
        chipmunk.free_body(bodies[i].address)


@lru_cache(maxsize=16)
def edge_corners(extent: tuple[float, float]) -> FloatArray:
    """(`EDGES`, 4, 2) corners of the edges of a table [0, width] x [0, depth], metres; never write to it."""
    left, right = -_EDGE_WIDTH, extent[0] + _EDGE_WIDTH
    near, far = -_EDGE_WIDTH, extent[1] + _EDGE_WIDTH
    sides = (left, near, 0.0, far), (extent[0], near, right, far)
    ends = (left, near, right, 0.0), (left, extent[1], right, far)
    # Round about in the order of Chipmunk's own boxes.
    return np.array([[(x1, z0), (x1, z1), (x0, z1), (x0, z0)] for x0, z0, x1, z1 in sides + ends])
