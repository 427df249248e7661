"""The tabletop: where the buildings really stand, and what a hand does to them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import hypot

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.errors import SceneError
from farm_ar.game_logic.carrying import CARRY_SPEED, Carry, carry
from farm_ar.game_logic.guiding import drag, glide
from farm_ar.game_logic.hand import HAND_RADIUS, MAX_HAND_SPEED, MAX_TWIST, Hand, HandState
from farm_ar.game_logic.overlaps import deepest_overlap
from farm_ar.game_logic.physics import FIXED, MOVABLE, TICK, Plane
from farm_ar.geometry import footprint_corners, from_pymunk, to_pymunk, wrap
from farm_ar.scenes import Layout

Pair = Sequence[float] | FloatArray
"""An x and a z."""

REACH = 0.06
"""How far from a footprint the middle of a hand may be and still take hold of the building, metres."""

HAND_ROOM = 0.5
"""How far beyond the table a hand may go, metres."""

# Steps of the simulation in a tick. A hand faster than `_FAST`, metres a second, moves too far in a whole
# tick for clean bumps. A guided hand presses, and with fewer steps it now and then wedges a building in.
_FAST = 0.75
_SLOW_STEPS, _FAST_STEPS, _GUIDED_STEPS = 1, 2, 3


class Tabletop:
    """Buildings on a table and at most one hand, simulated in ticks of 1/60 s.

    The same layout and the same calls give the same bytes, in another process too. The way back to an earlier
    moment is to make a new tabletop and repeat the calls: contacts have a memory that no copy keeps.

    Args:
        layout: what stands on the table, a single arrangement. Footprints that overlap each other or the edge
            are pushed apart in the first ticks.
        size: width (x) and depth (z) of the table [0, width] x [0, depth], metres.

    Attributes:
        size: the size of the table.
        ticks: how many ticks have passed.

    Raises:
        SceneError: the layout is a batch.
    """

    def __init__(self, layout: Layout, size: tuple[float, float]) -> None:
        if layout.batch_shape:
            raise SceneError("layout", "must be a single arrangement", layout.batch_shape)
        self.size = (float(size[0]), float(size[1]))
        self.ticks = 0
        self._layout = layout.with_poses(layout.position, wrap(layout.yaw))
        self._poses = (self._layout.position, self._layout.yaw)
        self._stale = False
        self._plane = Plane(*to_pymunk(*self._poses), layout.size, layout.fixed, self.size)
        self._moving = np.flatnonzero(layout.movable)
        self._hand: Hand | None = None
        self._gripped: int | None = None
        self._goes_low = False

    @property
    def layout(self) -> Layout:
        """Everything where it stands now, yaws in [-pi, pi)."""
        position, yaw = self.poses()
        if self._layout.position is not position:
            self._layout = self._layout.with_poses(position, yaw)
            self._poses = (self._layout.position, self._layout.yaw)
        return self._layout

    @property
    def movable(self) -> BoolArray:
        """(N,) objects that a hand can move."""
        return self._layout.movable

    def poses(self) -> tuple[FloatArray, FloatArray]:
        """Positions (N, 2) in metres and yaws (N,) in [-pi, pi) now, in the layout's order; read-only."""
        if self._stale:
            state = self._plane.read()
            place, heading = from_pymunk(state[:, :2], state[:, 2])
            if (
                np.maximum.reduce(np.abs(heading), initial=0.0) >= np.pi
            ):  # wrap takes longer than all the rest
                heading = wrap(heading)
            position, yaw = self._layout.position.copy(), self._layout.yaw.copy()
            position[self._moving], yaw[self._moving] = place, heading
            position.flags.writeable = yaw.flags.writeable = False
            self._poses, self._stale = (position, yaw), False
        return self._poses

    @property
    def still(self) -> bool:
        """Whether everything has come to rest; a new tabletop has to show it first."""
        return self._plane.still

    @property
    def hand(self) -> HandState | None:
        """The hand as it is now, None while there is none."""
        hand = self._hand
        if hand is None:
            return None
        x, z, angle = hand.pose
        yaw = -angle if abs(angle) < np.pi else float(wrap(-angle))
        return HandState(np.array([x, z]), yaw, np.array(hand.velocity), self._gripped, hand.raised)

    def bring_hand(self, position: Pair, raised: bool = False) -> None:
        """Put the hand in, in place of one that may be there.

        Args:
            position: (2,) where, metres; what is more than `HAND_ROOM` beyond the table is taken nearer.
            raised: whether it stays above the buildings. Otherwise it goes down, where it bumps into them, as
                soon as there is room for it.
        """
        self.remove_hand()
        x, z = np.clip(position, -HAND_ROOM, np.add(self.size, HAND_ROOM)).tolist()
        self._hand = Hand(self._plane.space, x, z)
        self._goes_low = not raised

    def raise_hand(self) -> None:
        """Let go, and stay above the buildings from now on."""
        self.release()
        self._goes_low = False
        if self._hand is not None:
            self._hand.lift()

    def remove_hand(self) -> None:
        """Let go, and take the hand out."""
        self.raise_hand()
        self._hand = None

    def grip(self, index: int) -> bool:
        """Take hold of a building whose footprint is within `REACH` of the middle of the hand.

        A hand that holds another building, and one that would hold a fixed object, does nothing.

        Returns:
            Whether the hand holds this building now.
        """
        hand = self._hand
        if hand is not None and self._gripped is None and self.movable[index]:
            x, z, _ = hand.pose
            if self._plane.distance(index, x, z) <= REACH:
                hand.grip(self._plane.bodies[index])
                self._gripped = index
                self._plane.wake()
        return self._gripped is not None and self._gripped == index

    def release(self) -> None:
        """Let go of what the hand holds. The hand hovers until there is room for it on the table."""
        if self._hand is not None and self._gripped is not None:
            self._hand.lift()
            self._gripped = None
            self._plane.wake()

    def tick(self, velocity: Pair = (0.0, 0.0), twist: float = 0.0, count: int = 1) -> None:
        """Let 1/60 s pass, or a number of such ticks, while the hand is moved.

        Args:
            velocity: (2,) of the hand, metres a second; one above `MAX_HAND_SPEED` is scaled down to it.
            twist: rate of turn of the hand, clockwise, radians a second; at most `MAX_TWIST` either way.
            count: how many ticks.
        """
        vx, vz = float(velocity[0]), float(velocity[1])
        speed = hypot(vx, vz)
        if speed > MAX_HAND_SPEED:
            vx, vz = vx * MAX_HAND_SPEED / speed, vz * MAX_HAND_SPEED / speed
        spin = -min(max(float(twist), -MAX_TWIST), MAX_TWIST)
        hand = self._hand
        if hand is not None and self._gripped is None:
            x, z, _ = hand.pose
            vx = _held_back(x, vx, self.size[0], count * TICK)
            vz = _held_back(z, vz, self.size[1], count * TICK)
            if (
                hand.raised
                and self._goes_low
                and self._plane.nearest(x, z, HAND_RADIUS, MOVABLE | FIXED) is None
            ):
                hand.lower()
        if hand is not None:
            hand.steer(vx, vz, spin)
            hand.hover(count * TICK)
        self._let_pass(count, _FAST_STEPS if speed > _FAST else _SLOW_STEPS)

    def settle(self, max_ticks: int = 600, record: Callable[[Tabletop], None] | None = None) -> int:
        """Let time pass, with the hand held where it is, until everything is at rest.

        Returns:
            How many ticks it took; `max_ticks` also where they were not enough.
        """
        start = self.ticks
        while not self._plane.still and self.ticks - start < max_ticks:
            if self._hand is not None:
                self._hand.steer(0.0, 0.0, 0.0)
            self._let_pass(1, _GUIDED_STEPS)
            if record is not None:
                record(self)
        return self.ticks - start

    def guide_hand(
        self,
        position: Pair,
        turn: float,
        speed: float,
        record: Callable[[Tabletop], None] | None = None,
    ) -> None:
        """Move the hand on a straight line, smoothly from rest to rest, with whatever it holds.

        Where something holds it up it presses on for half a second.

        Args:
            position: (2,) where to, metres.
            turn: how far it turns on the way, clockwise, radians.
            speed: its highest speed on the way, metres a second.
            record: called after every tick.
        """
        hand = self._hand
        if hand is None:
            return

        def let_pass(ticks: int) -> None:
            if record is None:
                self._let_pass(ticks, _GUIDED_STEPS)
                return
            for _ in range(ticks):
                self._let_pass(1, _GUIDED_STEPS)
                record(self)

        goal = float(position[0]), float(position[1]), hand.pose[2] - turn
        if hand.raised:
            glide(hand, goal, speed, let_pass, watched=record is not None)
        else:
            drag(hand, goal, speed, let_pass, delay=TICK / _GUIDED_STEPS)

    def carry(
        self,
        index: int,
        position: Pair,
        yaw: float,
        record: Callable[[Tabletop], None] | None = None,
        *,
        speed: float = CARRY_SPEED,
        leave: bool = True,
    ) -> Carry:
        """Carry a building to a pose with the hand: reach over, grip, drag, let go, leave; then all settles.

        It is dragged on a straight line and turned the shorter way meanwhile, and pushes what is in its way.

        Args:
            index: the building.
            position: (2,) where to, metres.
            yaw: heading there, radians.
            record: called after every tick.
            speed: highest speed of the drag, metres a second.
            leave: whether the hand goes out afterwards; otherwise it stays above the place.

        Returns:
            What became of it.
        """
        return carry(self, index, position, yaw, record, speed, leave)

    def find_building(self, point: Pair, reach: float = REACH) -> int | None:
        """Index of the movable building whose footprint is nearest to a point, None if none is within reach.

        Args:
            point: (2,) metres.
            reach: how far at most, metres.
        """
        return self._plane.nearest(float(point[0]), float(point[1]), reach, MOVABLE)

    def on_table(self, tolerance: float = 0.0) -> BoolArray:
        """(N,) whether each footprint lies on the table, or at most `tolerance` metres beyond its edge."""
        corners = footprint_corners(*self.poses(), self._layout.size)
        inside: BoolArray = np.all(
            (corners >= -tolerance) & (corners <= np.add(self.size, tolerance)), axis=(1, 2)
        )
        return inside

    def overlap(self) -> float:
        """How deep the deepest two footprints stand inside each other now, metres."""
        return deepest_overlap(*self.poses(), self._layout.size)

    def _let_pass(self, ticks: int, steps: int) -> None:
        """Let ticks pass, each in a number of steps, while the hand moves as it was steered."""
        self.ticks += ticks
        driven = self._hand is not None and self._hand.drives
        if driven or not self._plane.still:
            self._plane.advance(ticks, steps, driven)
            self._stale = True


def _held_back(place: float, velocity: float, extent: float, seconds: float) -> float:
    """The velocity along one axis that takes a hand no farther than `HAND_ROOM` beyond the table."""
    lowest, highest = (-HAND_ROOM - place) / seconds, (extent + HAND_ROOM - place) / seconds
    return min(max(velocity, lowest), highest)
