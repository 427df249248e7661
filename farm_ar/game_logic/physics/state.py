"""The state of one tabletop's physics, as structs for the kernels of this package.

Metres, seconds, radians, and Chipmunk's angles (`angle = -yaw`). Kernels take `state`, the one `State` of a
table, and `bodies`, the `Body` of each object. Only `math` is used in them, not NumPy, so that they give the
same bytes where they are not compiled.
"""

from __future__ import annotations

from farm_ar.structs import Struct

TICK = 1 / 60
"""Length of a tick, seconds."""


class Body(Struct):
    """A box on the table."""

    x: float
    z: float
    angle: float
    half_width: float
    half_depth: float
    movable: bool
    old_x: float
    """Its pose when it was last looked at for whether it moves."""
    old_z: float
    old_angle: float
    elevation: float
    """How high its pivot is."""
    address: int
    """Chipmunk's body."""


class Hand(Struct):
    """The hand. Hovering it is not in Chipmunk's space; low it is a disc; holding it is a point of a body."""

    present: bool
    raised: bool
    goes_low: bool
    """Whether it is to go down as soon as there is room."""
    gripped: int
    """The body that it holds, -1 for none."""
    x: float
    """Where it hovers."""
    z: float
    angle: float
    velocity_x: float
    """How it is steered."""
    velocity_z: float
    spin: float
    point_x: float
    """The point of the moved body that it is at."""
    point_z: float
    turn: float
    """How it is turned against the moved body."""
    from_x: float
    """Where the body that it lifts stood."""
    from_z: float
    from_angle: float


class Space(Struct):
    """Addresses of Chipmunk's objects."""

    space: int
    arm: int
    disc: int
    disc_shape: int
    pull: int
    """Joints between the arm and the body that it moves, 0 for none."""
    twist: int
    moved: int
    """The body that the arm moves."""


class State(Struct):
    """What there is of a table beside its bodies."""

    space: Space
    hand: Hand
    width: float
    depth: float
    ticks: int
    still: bool
    """Whether everything has come to rest."""
    quiet: int
    """For how many ticks nothing was touched."""
    metres: float
    """How far all bodies together have been moved so far, by the ways they went."""
    radians: float
    changes: int
    """How often poses have changed."""
    lifts: bool
    """Whether the hand lifts what it holds over everything else, instead of dragging it."""


class Limits(Struct):
    """How much the bodies may be moved from some moment on, and what has become of it.

    A hand that would exceed a limit brakes, and touches nothing any more when it has halted.
    """

    metres: float
    radians: float
    effort: float
    """Metres as a share of the scene's diagonal, plus radians as a share of half a turn."""
    scene_diagonal: float
    began_metres: float
    """What there was at that moment."""
    began_radians: float
    braking: int
    """For how many ticks the hand has been braking."""
    halted: bool
