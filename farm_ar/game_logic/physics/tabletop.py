"""The tabletop: where the buildings really stand, and what a hand does to them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.errors import OptionError, SceneError
from farm_ar.game_logic.physics import gripper, lifting, proximity, stepping, trajectory
from farm_ar.game_logic.physics.gripper import HAND_ROOM, REACH, HandState
from farm_ar.game_logic.physics.limits import Motion, MotionLimit
from farm_ar.game_logic.physics.space import PhysicsSpace
from farm_ar.game_logic.physics.state import Limits
from farm_ar.game_logic.physics.trajectory import CARRY_SPEED, ENTRY, REACH_SPEED, Trajectory
from farm_ar.geometry import deepest_overlap, footprint_corners, from_pymunk, wrap
from farm_ar.scenes import Layout
from farm_ar.structs import Structs, new_structs

__all__ = ["HAND_ROOM", "REACH", "Carry", "MotionLimit", "Pair", "Tabletop"]

Pair = Sequence[float] | FloatArray
"""An x and a z."""

REACHED_M, REACHED_RAD = 0.01, float(np.deg2rad(3.0))
"""How near to where it was to go a building must come to rest to have reached it."""

_LONG = 1_000_000


@dataclass(frozen=True)
class Carry:
    """What became of one pick-and-place.

    Args:
        gripped: whether the building can be gripped at all.
        reached: whether it came to rest within 1 cm and 3 degrees of where it was to go.
        error_m: how far from there, metres.
        error_rad: the same for its heading, radians, not negative.
        ticks: how many ticks it took, from the hand's coming in until it was out and everything at rest.
    """

    gripped: bool
    reached: bool
    error_m: float
    error_rad: float
    ticks: int


class Tabletop:
    """Buildings on a table and at most one hand, simulated in ticks of 1/60 s.

    The same layout and the same calls give the same bytes, in another process too. The way back to an earlier
    moment is to make a new tabletop and repeat the calls: contacts have a memory that no copy keeps.

    Args:
        layout: what stands on the table, a single arrangement. Footprints that overlap each other or the edge
            are pushed apart in the first ticks.
        size: width (x) and depth (z) of the table [0, width] x [0, depth], metres.
        lifts: whether the hand lifts what it holds over everything else and sets it down where there is room.
            Nothing is pushed then, and everything stays exactly where it was put.

    Attributes:
        size: the size of the table.
        space: its physics, for compiled kernels.

    Raises:
        SceneError: the layout is a batch.
    """

    def __init__(self, layout: Layout, size: tuple[float, float], lifts: bool = False) -> None:
        if layout.batch_shape:
            raise SceneError("layout", "must be a single arrangement", layout.batch_shape)
        self.size = (float(size[0]), float(size[1]))
        self._layout, yaw = layout, wrap(layout.yaw)
        yaw.flags.writeable = False
        self._poses = (layout.position, yaw)
        self.space = PhysicsSpace(layout, self.size)
        self._state, self._bodies = self.space.states[0], self.space.bodies
        self._hand, self._read = self.space.states["hand"], 0
        self._lifts = lifts
        self.space.states["lifts"] = self.space.states["still"] = lifts
        self._moving = np.flatnonzero(layout.movable)

    @property
    def ticks(self) -> int:
        """How many ticks have passed."""
        return int(self.space.states["ticks"].item())

    @property
    def layout(self) -> Layout:
        """Everything where it stands now, yaws in [-pi, pi)."""
        position, yaw = self.poses()
        if self._layout.yaw is not yaw:
            self._layout = self._layout.placed(position, yaw)
        return self._layout

    @property
    def movable(self) -> BoolArray:
        """(N,) objects that a hand can move."""
        return self._layout.movable

    def poses(self) -> tuple[FloatArray, FloatArray]:
        """Positions (N, 2) in metres and yaws (N,) in [-pi, pi) now, in the layout's order; read-only."""
        changes = self.space.states["changes"].item()
        if changes != self._read:
            now = self.space.places[self._moving]
            place, heading = from_pymunk(now[:, :2], now[:, 2])
            position, yaw = self._poses[0].copy(), self._poses[1].copy()
            position[self._moving], yaw[self._moving] = place, wrap(heading)
            position.flags.writeable = yaw.flags.writeable = False
            self._poses, self._read = (position, yaw), changes
        return self._poses

    @property
    def moved(self) -> Motion:
        """How far all buildings together have been moved and turned so far, by the ways they went."""
        states = self.space.states
        return Motion(states["metres"].item(), states["radians"].item())

    @property
    def still(self) -> bool:
        """Whether everything has come to rest; a new tabletop has to show it first."""
        return bool(self.space.states["still"].item())

    @property
    def hand(self) -> HandState | None:
        """The hand as it is now, None while there is none."""
        if not self._hand["present"].item():
            return None
        x, z, angle = gripper.hand_pose(self._state)
        vx, vz, _ = gripper.hand_motion(self._state)
        gripped = self._hand["gripped"].item()
        held, raised = None if gripped < 0 else gripped, self._hand["raised"].item()
        return HandState(np.array([x, z]), float(gripper.yaw_of(angle)), np.array([vx, vz]), held, raised)

    def bring_hand(self, position: Pair, raised: bool = False) -> None:
        """Put the hand in, in place of one that may be there.

        Args:
            position: (2,) where, metres; what is more than `HAND_ROOM` beyond the table is taken nearer.
            raised: whether it stays above the buildings. Otherwise it goes down, where it bumps into them, as
                soon as there is room for it.
        """
        self.put_down()
        x, z = float(position[0]), float(position[1])
        gripper.bring_hand(self._state, self._bodies, x, z, raised or self._lifts)

    def raise_hand(self) -> None:
        """Let go, and stay above the buildings from now on."""
        self.put_down()
        gripper.raise_hand(self._state, self._bodies)

    def remove_hand(self) -> None:
        """Let go, and take the hand out."""
        self.raise_hand()
        self._hand["present"] = False

    def grip(self, index: int) -> bool:
        """Take hold of a building whose footprint is within `REACH` of the middle of the hand.

        A hand that holds another building, and one that would hold a fixed object, does nothing.

        Returns:
            Whether the hand holds this building now.
        """
        take = lifting.take if self._lifts else gripper.grip
        take(self._state, self._bodies, index, REACH)
        return bool(self._hand["gripped"].item() == index)

    def release(self) -> None:
        """Let go of what the hand holds. The hand hovers until there is room for it on the table."""
        if self._lifts:
            self.put_down()
        elif self._hand["gripped"].item() >= 0:
            gripper.lift(self._state, self._bodies)

    def put_down(self, limits: Structs[Limits] | npt.NDArray[Any] | None = None) -> None:
        """Set down what is lifted: where it is, or on the straight way back, as soon as there is room.

        Args:
            limits: (1,) that are kept; none by default.
        """
        if self._lifts:
            if limits is None:
                MotionLimit().begin(limits := new_structs(Limits, 1), self.moved)
            lifting.set_down_within(self._state, self._bodies, limits[0])

    def tick(self, velocity: Pair = (0.0, 0.0), twist: float = 0.0, count: int = 1) -> None:
        """Let 1/60 s pass, or a number of such ticks, while the hand is moved.

        Args:
            velocity: (2,) of the hand, metres a second; one above `MAX_HAND_SPEED` is scaled down to it.
            twist: rate of turn of the hand, clockwise, radians a second; at most `MAX_TWIST` either way.
            count: how many ticks.
        """
        vx, vz = float(velocity[0]), float(velocity[1])
        stepping.tick(self._state, self._bodies, vx, vz, -float(twist), count)

    def settle(self, max_ticks: int = 600, record: Callable[[Tabletop], None] | None = None) -> int:
        """Let time pass, with the hand held where it is, until everything is at rest.

        Returns:
            How many ticks it took; `max_ticks` also where they were not enough.
        """
        start = self.ticks
        if record is None:
            stepping.settle(self.space.states, self._bodies, max_ticks)
        while record is not None and not self.still and self.ticks - start < max_ticks:
            stepping.settle(self.space.states, self._bodies, 1)
            record(self)
        return self.ticks - start

    def guide_hand(
        self,
        position: Pair,
        turn: float,
        speed: float,
        record: Callable[[Tabletop], None] | None = None,
        most: MotionLimit | None = None,
    ) -> None:
        """Move the hand on a straight line, smoothly from rest to rest, with whatever it holds.

        Where something holds it up it presses on for half a second.

        Args:
            position: (2,) where to, metres.
            turn: how far it turns on the way, clockwise, radians.
            speed: its highest speed on the way, metres a second.
            record: called after every tick.
            most: how much the buildings may be moved meanwhile. The hand stops before it is more.

        Raises:
            OptionError: it would be on its way for more than an hour.
        """
        if not self._hand["present"].item():
            return
        way, limits = new_structs(Trajectory, 1), new_structs(Limits, 1)
        x, z = float(position[0]), float(position[1])
        seconds = trajectory.plan(self.space.states, way, x, z, float(turn), float(speed))
        if not seconds <= trajectory.LONGEST_S:
            raise too_far((x, z))
        (most or MotionLimit()).begin(limits, self.moved)
        ticks = _LONG if record is None else 1
        while not way["done"].item():
            trajectory.follow(self.space.states, self._bodies, way, limits, ticks)
            if record is not None:
                record(self)

    def carry(
        self,
        index: int,
        position: Pair,
        yaw: float,
        record: Callable[[Tabletop], None] | None = None,
        *,
        speed: float = CARRY_SPEED,
        leave: bool = True,
        most: MotionLimit | None = None,
    ) -> Carry:
        """Carry a building to a pose with the hand: reach over, grip, drag, let go, leave; then all settles.

        It is moved on a straight line and turned the shorter way meanwhile. Dragged it pushes what is in its
        way; lifted it is set down on the way back where there is no room for it.

        Args:
            index: the building.
            position: (2,) where to, metres.
            yaw: heading there, radians.
            record: called after every tick.
            speed: highest speed of the drag, metres a second.
            leave: whether the hand goes out afterwards; otherwise it stays above the place.
            most: how much the buildings may be moved meanwhile. The hand stops before it is more.

        Returns:
            What became of it.
        """
        start = self.ticks
        places, headings = self.poses()
        gripped = bool(self.movable[index])
        limits = new_structs(Limits, 1)
        if gripped and self._lifts and leave and record is None and self.hand is None:
            (most or MotionLimit()).begin(limits, self.moved)
            turn = float(wrap(yaw - headings[index]))
            goal = float(position[0]), float(position[1])
            done = trajectory.lift_over(
                self.space.states, self._bodies, limits, index, *goal, turn, float(speed)
            )
            if not done:
                raise too_far(goal)
            places, headings = self.poses()
        elif gripped:
            x, z = places[index].tolist()
            if self.hand is None:
                self.bring_hand((x, ENTRY), raised=True)
            self.raise_hand()
            self.guide_hand((x, z), 0.0, REACH_SPEED, record)
            self.grip(index)
            (most or MotionLimit()).begin(limits, self.moved)
            self.guide_hand(position, float(wrap(yaw - headings[index])), speed, record, most)
            self.put_down(limits)
            self.raise_hand()
            if leave:
                self.guide_hand((x, ENTRY), 0.0, REACH_SPEED, record)
                self.remove_hand()
            self.settle(record=record)
            places, headings = self.poses()
        x, z = places[index].tolist()
        error_m = hypot(x - position[0], z - position[1])
        error_rad = abs(float(wrap(headings[index] - yaw)))
        reached = gripped and error_m <= REACHED_M and error_rad <= REACHED_RAD
        return Carry(gripped, reached, error_m, error_rad, self.ticks - start)

    def find_building(self, point: Pair, reach: float = REACH) -> int | None:
        """Index of the movable building whose footprint is nearest to a point, None if none is within reach.

        Args:
            point: (2,) metres.
            reach: how far at most, metres.
        """
        found = int(proximity.nearest(self._bodies, float(point[0]), float(point[1]), float(reach), False))
        return None if found < 0 else found

    def on_table(self, tolerance: float = 0.0) -> BoolArray:
        """(N,) whether each footprint lies on the table, or at most `tolerance` metres beyond its edge."""
        corners = footprint_corners(*self.poses(), self._layout.size)
        inside: BoolArray = np.all(
            (corners >= -tolerance) & (corners <= np.add(self.size, tolerance)), axis=(1, 2)
        )
        return inside

    def overlap(self) -> float:
        """How deep the deepest two footprints stand inside each other now, metres."""
        return float(deepest_overlap(*self.poses(), self._layout.size))


def too_far(position: tuple[float, float]) -> OptionError:
    """What is said of a place to which a hand would be on its way for too long."""
    return OptionError("position", f"must be reached within {trajectory.LONGEST_S:g} s", position)
