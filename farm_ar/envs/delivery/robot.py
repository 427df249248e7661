"""A differential drive in pymunk, of the size of a LoCoBot, and its odometry.

ROS conventions (REP 103): x is ahead, y to the left, angles turn anticlockwise. pymunk's plane has our x
and z.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, sin

import numpy as np
import pymunk

from farm_ar.arrays import FloatArray
from farm_ar.geometry import footprint_corners
from farm_ar.scenes import Layout

RADIUS_M = 0.177
"""Of the round base."""

MOST_M_S, MOST_RAD_S = 0.4, 1.5
"""Highest speeds, ahead and turning."""

ACCELERATION_M_S2, ACCELERATION_RAD_S2 = 0.8, 6.0

MASS_KG = 6.3

TICK_S = 1 / 60

SLIP = 0.02
"""SD of the error of the wheels' odometry, as a share of the speed."""

FIX_M, FIX_RAD = 0.02, float(np.deg2rad(0.5))
"""SD of the position and heading of the robot on its map, each time that it localises itself."""

_ROBOT, _THING = 1, 2


@dataclass(frozen=True)
class Twist:
    """A command to the wheels, as ROS's `geometry_msgs/Twist` has it.

    Args:
        ahead: `linear.x`, metres a second.
        left: `angular.z`, radians a second, anticlockwise.
    """

    ahead: float = 0.0
    left: float = 0.0


@dataclass(frozen=True)
class Pose:
    """A pose on the plane in a ROS frame: x ahead, y to the left, metres; angle anticlockwise, radians."""

    x: float
    y: float
    angle: float

    def after(self, child: Pose) -> Pose:
        """A pose given in the frame that stands here, in the frame in which this one is given."""
        c, s = cos(self.angle), sin(self.angle)
        turned = wrapped(self.angle + child.angle)
        return Pose(self.x + c * child.x - s * child.y, self.y + s * child.x + c * child.y, turned)

    def inverse(self) -> Pose:
        """The pose of the outer frame in the frame that stands here."""
        c, s = cos(self.angle), sin(self.angle)
        return Pose(-c * self.x - s * self.y, s * self.x - c * self.y, wrapped(-self.angle))

    @classmethod
    def of(cls, position: FloatArray, yaw: float) -> Pose:
        """A place (x, z) and heading of ours in the frame `map`, whose x is our z and whose y is our -x."""
        return cls(float(position[1]), -float(position[0]), wrapped(-float(yaw)))

    @property
    def place(self) -> FloatArray:
        """(2,) our x and z of a pose in the frame `map`."""
        return np.array([-self.y, self.x])

    @property
    def yaw(self) -> float:
        """Our heading of a pose in the frame `map`, radians."""
        return -self.angle


def wrapped(angle: float) -> float:
    """An angle from -pi to pi."""
    return atan2(sin(angle), cos(angle))


class Robot:
    """The robot among objects that do not give way.

    Args:
        things: what stands in the room.
        size: width and depth of the room, metres; its walls are in the way too.
        start: where the robot stands, in the frame `map`.

    Attributes:
        touches: how often it has begun to touch something.
        driven: how far it has gone, metres.
        odom: where the wheels say that it is: in the frame `odom`, which begins where it started.
        map_to_odom: where that frame lies on the map, as far as the robot knows (REP 105).
    """

    def __init__(self, things: Layout, size: tuple[float, float], start: Pose) -> None:
        self.touches, self.driven = 0, 0.0
        self.odom, self.map_to_odom = Pose(0.0, 0.0, 0.0), start
        self._speed = Twist()
        self._space = space = pymunk.Space()
        space.collision_slop = 0.001  # metres; pymunk's own is meant for pixels
        walls = ((0.0, 0.0), (size[0], 0.0), size, (0.0, size[1]))
        fixed: list[pymunk.Shape] = [
            pymunk.Segment(space.static_body, walls[k - 1], walls[k], 0.0) for k in range(4)
        ]
        for corners in footprint_corners(things.position, things.yaw, things.size).tolist():
            fixed.append(pymunk.Poly(space.static_body, [tuple(corner) for corner in corners]))
        for shape in fixed:
            shape.collision_type = _THING
        self._body = pymunk.Body(MASS_KG, pymunk.moment_for_circle(MASS_KG, 0.0, RADIUS_M))
        x, z = start.place.tolist()
        self._body.position, self._body.angle = (x, z), start.angle
        base = pymunk.Circle(self._body, RADIUS_M)
        base.collision_type = _ROBOT
        space.add(*fixed, self._body, base)
        space.on_collision(_ROBOT, _THING, begin=self._touch)

    @property
    def truth(self) -> Pose:
        """Where it really is, in the frame `map`."""
        x, z = self._body.position
        return Pose(float(z), -float(x), wrapped(float(self._body.angle)))

    @property
    def believed(self) -> Pose:
        """Its estimate of its own pose, in the frame `map`: `base_link` via `odom`."""
        return self.map_to_odom.after(self.odom)

    @property
    def speed(self) -> Twist:
        """How fast the wheels turn it."""
        return self._speed

    def localise(self, rng: np.random.Generator) -> None:
        """Find out anew where it is on the map; the frame `odom` jumps, `base_link` in it does not."""
        dx, dy, turn = (rng.normal(size=3) * [FIX_M, FIX_M, FIX_RAD]).tolist()
        here = self.truth
        found = Pose(here.x + dx, here.y + dy, wrapped(here.angle + turn))
        self.map_to_odom = found.after(self.odom.inverse())

    def drive(self, command: Twist, ticks: int, rng: np.random.Generator) -> None:
        """Obey a command for some ticks; what is beyond the limits of speed is taken as the limit.

        Args:
            command: for the wheels.
            ticks: of 1/60 s.
            rng: for the odometry's errors.
        """
        ahead = min(max(command.ahead, -MOST_M_S), MOST_M_S)
        left = min(max(command.left, -MOST_RAD_S), MOST_RAD_S)
        wrong = (1 + SLIP * rng.normal(size=2)).tolist()
        for _ in range(ticks):
            before = self.truth
            # The robot looks along its own y in pymunk's plane: our z at an angle of 0.
            sine, cosine = -sin(before.angle), cos(before.angle)
            vx, vz = self._body.velocity  # what it has run into may have stopped it
            speed = Twist(
                _toward(sine * vx + cosine * vz, ahead, ACCELERATION_M_S2 * TICK_S),
                _toward(float(self._body.angular_velocity), left, ACCELERATION_RAD_S2 * TICK_S),
            )
            self._speed = speed
            self._body.velocity = (sine * speed.ahead, cosine * speed.ahead)
            self._body.angular_velocity = speed.left
            self._space.step(TICK_S)
            step = before.inverse().after(self.truth)
            self.driven += hypot(step.x, step.y)
            self.odom = self.odom.after(Pose(step.x * wrong[0], step.y, step.angle * wrong[1]))

    def _touch(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        self.touches += 1


def _toward(value: float, goal: float, most: float) -> float:
    return value + min(max(goal - value, -most), most)
