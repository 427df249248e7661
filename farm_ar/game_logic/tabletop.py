"""The tabletop: where the buildings really stand, and what a hand does to them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.errors import OptionError, SceneError
from farm_ar.game_logic import arm, guiding, nearness, plane, ticking
from farm_ar.game_logic.arm import HAND_ROOM
from farm_ar.game_logic.carrying import CARRY_SPEED, Carry, carry
from farm_ar.game_logic.hand import HandState
from farm_ar.game_logic.motion import Motion
from farm_ar.game_logic.overlaps import deepest_overlap
from farm_ar.game_logic.physics import Plane
from farm_ar.game_logic.steering import REACH
from farm_ar.geometry import footprint_corners, from_pymunk, to_pymunk, wrap
from farm_ar.scenes import Layout

__all__ = ["HAND_ROOM", "REACH", "Most", "Pair", "Tabletop"]

Pair = Sequence[float] | FloatArray
"""An x and a z."""


_LONG = 1_000_000


@dataclass(frozen=True)
class Most:
    """How much all buildings together may be moved.

    Args:
        metres: summed.
        radians: summed.
        effort: metres as a share of `diagonal`, plus radians as a share of half a turn.
        diagonal: of the scene, metres.
    """

    metres: float = inf
    radians: float = inf
    effort: float = inf
    diagonal: float = 1.0

    def as_row(self) -> tuple[float, float, float, float]:
        """The four, in that order."""
        return self.metres, self.radians, self.effort, self.diagonal


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
        arrays: the plane's, for compiled kernels.

    Raises:
        SceneError: the layout is a batch.
    """

    def __init__(self, layout: Layout, size: tuple[float, float]) -> None:
        if layout.batch_shape:
            raise SceneError("layout", "must be a single arrangement", layout.batch_shape)
        self.size = (float(size[0]), float(size[1]))
        self._layout, yaw = layout, wrap(layout.yaw)
        yaw.flags.writeable = False
        self._poses = (layout.position, yaw)
        place, angle = to_pymunk(*self._poses)
        self._plane = Plane(place, angle, layout.size, layout.fixed, layout.elevation, self.size)
        self.arrays = (self._plane.handle, self._plane.state, self._plane.box)
        self._read = 0.0
        self._moving = np.flatnonzero(layout.movable)

    @property
    def ticks(self) -> int:
        """How many ticks have passed."""
        return int(self._plane.state[plane.TICKS])

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
        changes = self._plane.state[plane.CHANGES]
        if changes != self._read:
            box = self._plane.box[self._moving]
            place, heading = from_pymunk(box[:, : plane.BOX_Z + 1], box[:, plane.BOX_ANGLE])
            position, yaw = self._poses[0].copy(), self._poses[1].copy()
            position[self._moving], yaw[self._moving] = place, wrap(heading)
            position.flags.writeable = yaw.flags.writeable = False
            self._poses, self._read = (position, yaw), changes
        return self._poses

    @property
    def moved(self) -> Motion:
        """How far all buildings together have been moved and turned so far, by the ways they went."""
        state = self._plane.state
        return Motion(float(state[plane.METRES]), float(state[plane.RADIANS]))

    @property
    def still(self) -> bool:
        """Whether everything has come to rest; a new tabletop has to show it first."""
        return bool(self._plane.state[plane.STILL])

    @property
    def hand(self) -> HandState | None:
        """The hand as it is now, None while there is none."""
        handle, state, _ = self.arrays
        if not state[plane.PRESENT]:
            return None
        values = np.empty(6)
        arm.look_at_hand(handle, state, values)
        gripped = int(state[plane.GRIPPED])
        return HandState(
            values[:2],
            float(arm.yaw_of(values[2])),
            values[3:5],
            None if gripped < 0 else gripped,
            bool(state[plane.RAISED]),
        )

    def bring_hand(self, position: Pair, raised: bool = False) -> None:
        """Put the hand in, in place of one that may be there.

        Args:
            position: (2,) where, metres; what is more than `HAND_ROOM` beyond the table is taken nearer.
            raised: whether it stays above the buildings. Otherwise it goes down, where it bumps into them, as
                soon as there is room for it.
        """
        handle, state, _ = self.arrays
        arm.bring_hand(handle, state, float(position[0]), float(position[1]), raised)

    def raise_hand(self) -> None:
        """Let go, and stay above the buildings from now on."""
        handle, state, _ = self.arrays
        arm.raise_hand(handle, state)

    def remove_hand(self) -> None:
        """Let go, and take the hand out."""
        self.raise_hand()
        self._plane.state[plane.PRESENT] = 0.0

    def grip(self, index: int) -> bool:
        """Take hold of a building whose footprint is within `REACH` of the middle of the hand.

        A hand that holds another building, and one that would hold a fixed object, does nothing.

        Returns:
            Whether the hand holds this building now.
        """
        arm.grip(*self.arrays, index, REACH)
        return bool(self._plane.state[plane.GRIPPED] == index)

    def release(self) -> None:
        """Let go of what the hand holds. The hand hovers until there is room for it on the table."""
        handle, state, _ = self.arrays
        if state[plane.GRIPPED] >= 0:
            arm.lift(handle, state)

    def tick(self, velocity: Pair = (0.0, 0.0), twist: float = 0.0, count: int = 1) -> None:
        """Let 1/60 s pass, or a number of such ticks, while the hand is moved.

        Args:
            velocity: (2,) of the hand, metres a second; one above `MAX_HAND_SPEED` is scaled down to it.
            twist: rate of turn of the hand, clockwise, radians a second; at most `MAX_TWIST` either way.
            count: how many ticks.
        """
        ticking.tick(*self.arrays, float(velocity[0]), float(velocity[1]), -float(twist), count)

    def settle(self, max_ticks: int = 600, record: Callable[[Tabletop], None] | None = None) -> int:
        """Let time pass, with the hand held where it is, until everything is at rest.

        Returns:
            How many ticks it took; `max_ticks` also where they were not enough.
        """
        start = self.ticks
        if record is None:
            ticking.settle(*self.arrays, max_ticks)
        while record is not None and not self.still and self.ticks - start < max_ticks:
            ticking.settle(*self.arrays, 1)
            record(self)
        return self.ticks - start

    def guide_hand(
        self,
        position: Pair,
        turn: float,
        speed: float,
        record: Callable[[Tabletop], None] | None = None,
        most: Most | None = None,
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
        handle, state, box = self.arrays
        if not state[plane.PRESENT]:
            return
        way = np.empty(guiding.WAYS)
        x, z = float(position[0]), float(position[1])
        seconds = guiding.plan(handle, state, way, x, z, float(turn), float(speed))
        if not seconds <= guiding.LONGEST_S:
            raise OptionError("position", f"must be reached within {guiding.LONGEST_S:g} s", (x, z))
        if most is not None:
            way[guiding.LIMIT_METRES : guiding.DIAGONAL + 1] = most.as_row()
        while not way[guiding.WAY_DONE]:
            guiding.guide(handle, state, box, way, _LONG if record is None else 1)
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
        most: Most | None = None,
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
            most: how much the buildings may be moved meanwhile. The hand stops before it is more.

        Returns:
            What became of it.
        """
        return carry(self, index, position, yaw, record, speed, leave, most)

    def find_building(self, point: Pair, reach: float = REACH) -> int | None:
        """Index of the movable building whose footprint is nearest to a point, None if none is within reach.

        Args:
            point: (2,) metres.
            reach: how far at most, metres.
        """
        found = int(nearness.nearest(self._plane.box, float(point[0]), float(point[1]), float(reach), False))
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
        return deepest_overlap(*self.poses(), self._layout.size)
