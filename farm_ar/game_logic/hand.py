"""The player's hand: a disc that bumps into buildings while it is low, and that holds one when it grips."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pymunk

from farm_ar.arrays import FloatArray
from farm_ar.game_logic.physics import FIXED, FRICTION, HAND, MOVABLE, TICK

Pose = tuple[float, float, float]
"""x and z in metres, and pymunk's angle in radians."""

MAX_HAND_SPEED = 1.5
"""Fastest that a hand is moved, metres a second."""

MAX_TWIST = np.pi
"""Fastest that a hand is turned, radians a second."""

HAND_RADIUS = 0.03
"""Radius of the disc, metres."""

_MASS = 0.5
_MOMENT = 9e-4

# What the arm can do at most, newtons and newton metres. An arm without limits shoots away what it squeezes
# against an edge; one of 50 N now and then wedges a building into a gap too narrow for it.
_FORCE = 30.0
_TORQUE = 3.0


_NO_MOTION = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class HandState:
    """A hand as it is now.

    Args:
        position: (2,) middle of the hand (x, z), metres.
        yaw: heading, radians, in [-pi, pi); 0 when it comes in.
        velocity: (2,) how it moves, metres a second.
        gripped: index of the building that it holds, None for none.
        raised: whether it hovers above the buildings and touches none.
    """

    position: FloatArray
    yaw: float
    velocity: FloatArray
    gripped: int | None
    raised: bool


class Hand:
    """A hand on a plane: hovering, low, or holding a building.

    Hovering it is not in the space at all. Low it is a disc, holding it is a point of the building, and an
    arm of limited force makes the disc or the building move as it is steered. The arm follows a velocity, not
    a place: when something holds it up it presses, but does not make up for it afterwards.

    Args:
        space: the space.
        x: where it comes in, metres.
        z: the same.

    Attributes:
        raised: whether it hovers.
    """

    def __init__(self, space: pymunk.Space, x: float, z: float) -> None:
        self.raised = True
        self._space = space
        self._pose = (x, z, 0.0)
        self._motion = _NO_MOTION
        self._arm = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        self._disc = pymunk.Body(_MASS, _MOMENT)
        self._shape = pymunk.Circle(self._disc, HAND_RADIUS)
        self._shape.friction = FRICTION
        self._shape.filter = pymunk.ShapeFilter(categories=HAND, mask=MOVABLE | FIXED)
        self._moved, self._point, self._turn = self._disc, (0.0, 0.0), 0.0
        self._parts: tuple[pymunk.Body | pymunk.Shape | pymunk.Constraint, ...] = ()

    @property
    def pose(self) -> Pose:
        """Where it is."""
        if self.raised:
            return self._pose
        x, z = self._moved.local_to_world(self._point)
        return x, z, self._moved.angle + self._turn

    @property
    def velocity(self) -> tuple[float, float]:
        """How it moves, metres a second."""
        return self._motion[:2] if self.raised else self._moved.velocity_at_local_point(self._point)

    @property
    def spin(self) -> float:
        """How it turns, radians a second, pymunk's way round."""
        return self._motion[2] if self.raised else self._moved.angular_velocity

    def lower(self) -> None:
        """Put the disc on the table, where it bumps into buildings."""
        x, z, angle = self.pose
        self._disc.position, self._disc.angle = (x, z), angle
        self._disc.velocity, self._disc.angular_velocity = (0.0, 0.0), 0.0
        self._join(self._disc, self._shape, self._disc)

    def grip(self, building: pymunk.Body) -> None:
        """Hold a building by the point where the hand is. There is no disc then that could shove anything."""
        self.lift()
        self._join(building)

    def lift(self) -> None:
        """Let go, and hover."""
        if not self.raised:
            self._pose = self.pose
            self._space.remove(*self._parts)
            self._motion, self.raised = _NO_MOTION, True

    def steer(self, vx: float, vz: float, spin: float) -> None:
        """Move it from now on at vx and vz, metres a second, turning at pymunk's rate, radians a second."""
        motion = (vx, vz, spin)
        if motion != self._motion:
            self._motion = motion
            self._arm.velocity, self._arm.angular_velocity = (vx, vz), spin

    def place(self, pose: Pose) -> None:
        """Be there a tick later, above everything."""
        (x, z, angle), (to_x, to_z, to_angle) = self._pose, pose
        self._motion = ((to_x - x) / TICK, (to_z - z) / TICK, (to_angle - angle) / TICK)
        self._pose = pose

    @property
    def drives(self) -> bool:
        """Whether it moves, or tries to move, something in the space."""
        return not self.raised and self._motion != _NO_MOTION

    def hover(self, seconds: float) -> None:
        """Go on as steered, if it hovers."""
        if not self.raised:
            return
        x, z, angle = self._pose
        vx, vz, spin = self._motion
        self._pose = (x + vx * seconds, z + vz * seconds, angle + spin * seconds)

    def _join(self, moved: pymunk.Body, *own: pymunk.Body | pymunk.Shape) -> None:
        x, z, angle = self.pose
        self._moved, self._point, self._turn = moved, moved.world_to_local((x, z)), angle - moved.angle
        pull = pymunk.PivotJoint(self._arm, moved, (0, 0), self._point)
        pull.max_force, pull.max_bias = _FORCE, 0.0
        twist = pymunk.GearJoint(self._arm, moved, 0.0, 1.0)
        twist.max_force, twist.max_bias = _TORQUE, 0.0
        self._parts = (pull, twist, *own, self._arm)
        self._space.add(*self._parts)
        self.raised = False
        self.steer(0.0, 0.0, 0.0)
