"""The physics of the tabletop: boxes that slide on a plane between edges, and settings that keep them apart.

Metres, seconds, kilograms, and pymunk's angles. The settings belong together; pymunk's own are meant for
pixels, and in metres its slop alone would let buildings stand 10 cm inside each other.
"""

from __future__ import annotations

import numpy as np
import pymunk
from pymunk.batch import BodyFields, Buffer, get_space_bodies

from farm_ar.arrays import BoolArray, FloatArray

TICK = 1 / 60
"""Length of a tick, seconds."""

SKIN = 0.001
"""How far a building's solid surface stands out from its footprint, metres: what sinks in, sinks in here."""

FRICTION = 0.3
"""Between any two surfaces that touch."""

MOVABLE, FIXED, EDGE, HAND = 0b0001, 0b0010, 0b0100, 0b1000
"""Collision categories. A hand reaches over the edges."""

_MASS = 1.0
_EDGE_WIDTH = 0.5  # wider than anything moves in a step

# The table's friction: the share of its velocity that a sliding building keeps after a second. One let go at
# 1 m/s slides on for 7 cm.
_DAMPING = 1e-6
_ITERATIONS = 20  # with 10, what is forced into a gap as wide as itself now and then stays wedged there
_SLOP = 2e-4
_BIAS = 0.7**60  # 30% of an overlap is undone in each tick

# At rest: from the sixth tick after the last touch on, nothing gets on by more than 3 mm/s, or 30 mrad/s, in
# three ticks. Places are compared because what pushes overlapping buildings apart does not show in their
# velocities, over three ticks because a wedged building trembles.
_WINDOW = 3
_STILL = np.array([3e-3, 3e-3, 3e-2]) * _WINDOW * TICK

_POSE = BodyFields.POSITION | BodyFields.ANGLE
_VELOCITY = BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY


class Plane:
    """Boxes on a plane without gravity, where whatever slides comes to rest.

    Everything is made in the order of the arguments, so that the same calls give the same bytes.

    Args:
        position: (N, 2) centres of the boxes, metres.
        angle: (N,) their angles, radians.
        size: (N, 3) width, height and depth, metres.
        fixed: (N,) boxes that nothing moves.
        extent: width and depth of the plane [0, width] x [0, depth], metres.

    Attributes:
        space: pymunk's space.
        bodies: the bodies of the boxes, in their order.
        still: whether everything is at rest; time passes then without an effect.
    """

    def __init__(
        self,
        position: FloatArray,
        angle: FloatArray,
        size: FloatArray,
        fixed: BoolArray,
        extent: tuple[float, float],
    ) -> None:
        self.space = pymunk.Space()
        self.space.damping = _DAMPING
        self.space.iterations = _ITERATIONS
        self.space.collision_slop = _SLOP
        self.space.collision_bias = _BIAS
        self.bodies: list[pymunk.Body] = []
        self._shapes: list[pymunk.Shape] = []
        boxes = zip(position.tolist(), angle.tolist(), size.tolist(), fixed.tolist(), strict=True)
        for (x, z), turned, (width, _, depth), immovable in boxes:
            self._add_box((x, z), turned, (width, depth), immovable)
        self._add_edges(*extent)
        self._index = {shape: i for i, shape in enumerate(self._shapes)}
        self._movers = [body for body, still in zip(self.bodies, fixed, strict=True) if not still]
        self._buffer = Buffer()
        self._before = self.read()
        self._quiet = 0
        self.still = False

    def _add_box(
        self, place: tuple[float, float], angle: float, footprint: tuple[float, float], fixed: bool
    ) -> None:
        if fixed:
            body = pymunk.Body(body_type=pymunk.Body.STATIC)
        else:
            body = pymunk.Body(_MASS, pymunk.moment_for_box(_MASS, footprint))
        body.position, body.angle = place, angle
        shape = pymunk.Poly.create_box(body, footprint, SKIN)
        shape.friction = FRICTION
        shape.filter = pymunk.ShapeFilter(categories=FIXED if fixed else MOVABLE)
        self.space.add(body, shape)
        self.bodies.append(body)
        self._shapes.append(shape)

    def _add_edges(self, width: float, depth: float) -> None:
        left, right = -_EDGE_WIDTH, width + _EDGE_WIDTH
        near, far = -_EDGE_WIDTH, depth + _EDGE_WIDTH
        sides = (left, near, 0.0, far), (width, near, right, far)
        ends = (left, near, right, 0.0), (left, depth, right, far)
        for x0, z0, x1, z1 in sides + ends:
            edge = pymunk.Poly(self.space.static_body, [(x0, z0), (x1, z0), (x1, z1), (x0, z1)])
            edge.friction = FRICTION
            edge.filter = pymunk.ShapeFilter(categories=EDGE, mask=MOVABLE)
            self.space.add(edge)

    def wake(self) -> None:
        """Something was touched."""
        self.still, self._quiet = False, 0

    def advance(self, ticks: int, steps: int, driven: bool) -> None:
        """Let ticks pass, each in a number of steps; driven means that something is moved all the while."""
        if driven:
            self.wake()
        step, seconds = self.space.step, TICK / steps
        for _ in range(ticks):
            if self.still:
                return
            for _ in range(steps):
                step(seconds)
            if not driven:
                self._come_to_rest()

    def _come_to_rest(self) -> None:
        self._quiet += 1
        if self._quiet % _WINDOW:
            return
        before, self._before = self._before, self.read()
        if self._quiet > _WINDOW and (np.abs(self._before - before) <= _STILL).all():
            self.still = True
            for i in np.flatnonzero(self._fetch(_VELOCITY).any(axis=1)).tolist():
                self._movers[i].velocity, self._movers[i].angular_velocity = (0.0, 0.0), 0.0

    def read(self) -> FloatArray:
        """(M, 3) x and z, metres, and angle, radians, of the M boxes that can be moved."""
        return self._fetch(_POSE)

    def _fetch(self, fields: BodyFields) -> FloatArray:
        """(M, 3) values of the movable boxes, read together; one by one they take ten times as long."""
        self._buffer.clear()
        get_space_bodies(self.space, fields, self._buffer)
        # The boxes that move come first: they were added first, and hands come and go behind them.
        return np.frombuffer(bytes(self._buffer.float_buf())).reshape(-1, 3)[: len(self._movers)]

    def distance(self, index: int, x: float, z: float) -> float:
        """From a point to a box's footprint, metres; negative inside."""
        return self._shapes[index].point_query((x, z)).distance + SKIN

    def nearest(self, x: float, z: float, reach: float, categories: int) -> int | None:
        """The box nearest to a point among those of some categories, None if none is within reach."""
        found = self.space.point_query_nearest((x, z), reach - SKIN, pymunk.ShapeFilter(mask=categories))
        return None if found is None or found.shape is None else self._index[found.shape]
