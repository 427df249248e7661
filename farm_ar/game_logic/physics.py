"""The physics of the tabletop: boxes that slide on a plane between edges, and settings that keep them apart.

Metres, seconds, kilograms, and pymunk's angles. The settings belong together; pymunk's own are meant for
pixels, and in metres its slop alone would let buildings stand 10 cm inside each other.
"""

from __future__ import annotations

import numpy as np
from pymunk._chipmunk_cffi import ffi, lib

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.game_logic import plane_kernels as kernels
from farm_ar.game_logic.chipmunk import address
from farm_ar.game_logic.plane_kernels import HAND_RADIUS, TICK, Addresses

__all__ = ["TICK", "Plane"]

SKIN = 0.001
"""How far a building's solid surface stands out from its footprint, metres: what sinks in, sinks in here."""

FRICTION = 0.3
"""Between any two surfaces that touch."""

MOVABLE, FIXED, EDGE, HAND = 0b0001, 0b0010, 0b0100, 0b1000
"""Collision categories. A hand reaches over the edges."""

ANYTHING = 0xFFFFFFFF

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


class Plane:
    """Boxes on a plane without gravity, where what slides comes to rest, and a hand that is not there yet.

    Everything is made in the order of the arguments, so that the same calls give the same bytes. The objects
    are Chipmunk's own, made through pymunk's C functions: pymunk's Python objects take twenty times as long
    to make.

    Args:
        position: (N, 2) centres of the boxes, metres.
        angle: (N,) their angles, radians.
        size: (N, 3) width, height and depth, metres.
        fixed: (N,) boxes that nothing moves.
        extent: width and depth of the plane [0, width] x [0, depth], metres.

    Attributes:
        handle: addresses of Chipmunk's objects, as `plane_kernels` wants them.
        state: numbers that change, likewise.
        box: (N, `COLUMNS`) the boxes, likewise.
    """

    def __init__(
        self,
        position: FloatArray,
        angle: FloatArray,
        size: FloatArray,
        fixed: BoolArray,
        extent: tuple[float, float],
    ) -> None:
        self.handle: Addresses = np.zeros(kernels.FIRST + len(angle), dtype=np.int64)
        self.state = np.zeros(kernels.STATES)
        self.state[[kernels.WIDTH, kernels.DEPTH, kernels.GRIPPED]] = *extent, -1.0
        self.box = np.zeros((len(angle), kernels.COLUMNS))
        self.box[:, kernels.BOX_X : kernels.BOX_Z + 1], self.box[:, kernels.BOX_ANGLE] = position, angle
        self.box[:, kernels.HALF_WIDTH], self.box[:, kernels.HALF_DEPTH] = size[:, 0] / 2, size[:, 2] / 2
        self.box[:, kernels.MOVABLE] = ~fixed
        self.box[:, kernels.OLD_X : kernels.OLD_ANGLE + 1] = self.box[:, : kernels.BOX_ANGLE + 1]
        self._parts = _Parts()
        self._fill()
        self.handle[: len(self._parts.handle)] = self._parts.handle
        # Freed with it.
        self._space = ffi.gc(self._parts.space, _Freeing(self.handle, self._parts))

    def _fill(self) -> None:
        make, width, depth = self._parts, self.state[kernels.WIDTH], self.state[kernels.DEPTH]
        for row in self.box.tolist():
            x, z, angle = row[: kernels.BOX_ANGLE + 1]
            sides = 2 * row[kernels.HALF_WIDTH], 2 * row[kernels.HALF_DEPTH]
            make.box(x, z, angle, *sides, bool(row[kernels.MOVABLE]))
        make.edges(float(width), float(depth))


class _Parts:
    """Chipmunk's objects of one plane, to be freed together."""

    def __init__(self) -> None:
        self.space = lib.cpSpaceNew()
        lib.cpSpaceSetDamping(self.space, _DAMPING)
        lib.cpSpaceSetIterations(self.space, _ITERATIONS)
        lib.cpSpaceSetCollisionSlop(self.space, _SLOP)
        lib.cpSpaceSetCollisionBias(self.space, _BIAS)
        lib.cpSpaceSetSleepTimeThreshold(self.space, _SLEEP_S)
        lib.cpSpaceSetIdleSpeedThreshold(self.space, _SLEEP_SPEED)
        arm, disc = lib.cpBodyNewKinematic(), lib.cpBodyNew(_HAND_MASS, _HAND_MOMENT)
        around = lib.cpCircleShapeNew(disc, HAND_RADIUS, (0.0, 0.0))
        lib.cpShapeSetFriction(around, FRICTION)
        lib.cpShapeSetFilter(around, (0, HAND, MOVABLE | FIXED))
        self.bodies, self.shapes = [arm, disc], [around]
        self.handle = [address(thing) for thing in (self.space, arm, disc, around)] + [0, 0, 0]

    def box(self, x: float, z: float, angle: float, width: float, depth: float, moves: bool) -> None:
        """One box."""
        if moves:
            body = lib.cpBodyNew(_MASS, lib.cpMomentForBox(_MASS, width, depth))
        else:
            body = lib.cpBodyNewStatic()
        lib.cpBodySetPosition(body, (x, z))
        lib.cpBodySetAngle(body, angle)
        shape = lib.cpBoxShapeNew(body, width, depth, SKIN)
        lib.cpShapeSetFriction(shape, FRICTION)
        lib.cpShapeSetFilter(shape, (0, MOVABLE if moves else FIXED, ANYTHING))
        lib.cpSpaceAddBody(self.space, body)
        lib.cpSpaceAddShape(self.space, shape)
        self.bodies.append(body)
        self.shapes.append(shape)
        self.handle.append(address(body))

    def edges(self, width: float, depth: float) -> None:
        """The edges of the plane [0, width] x [0, depth]."""
        left, right = -_EDGE_WIDTH, width + _EDGE_WIDTH
        near, far = -_EDGE_WIDTH, depth + _EDGE_WIDTH
        sides = (left, near, 0.0, far), (width, near, right, far)
        ends = (left, near, right, 0.0), (left, depth, right, far)
        everywhere = lib.cpSpaceGetStaticBody(self.space)
        for x0, z0, x1, z1 in sides + ends:
            edge = lib.cpBoxShapeNew2(everywhere, (x0, z0, x1, z1), 0.0)
            lib.cpShapeSetFriction(edge, FRICTION)
            lib.cpShapeSetFilter(edge, (0, EDGE, MOVABLE))
            lib.cpSpaceAddShape(self.space, edge)
            self.shapes.append(edge)


class _Freeing:
    """Frees a plane's objects: the space first, which still looks at its bodies."""

    def __init__(self, handle: Addresses, parts: _Parts) -> None:
        self._handle, self._shapes, self._bodies = handle, parts.shapes, parts.bodies

    def __call__(self, space: object) -> None:
        lib.cpSpaceFree(space)
        for joint in self._handle[[kernels.PULL, kernels.TWIST]].tolist():
            if joint:
                lib.cpConstraintFree(ffi.cast("struct cpConstraint *", joint))
        for shape in self._shapes:
            lib.cpShapeFree(shape)
        for body in self._bodies:
            lib.cpBodyFree(body)
