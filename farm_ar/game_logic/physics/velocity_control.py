"""Kernels: a hand whose velocity, twist and grip are given tick by tick."""

from __future__ import annotations

from farm_ar.game_logic.physics import chipmunk, gripper, lifting, stepping
from farm_ar.game_logic.physics.gripper import REACH
from farm_ar.game_logic.physics.limits import brake, exceeds
from farm_ar.game_logic.physics.state import TICK, Body, Limits, State
from farm_ar.geometry.camera import Eye
from farm_ar.structs import Structs


@chipmunk.compiled
def use_hand(state: State, bodies: Structs[Body], eye: Eye, closed: bool) -> None:
    """Close on the nearest building within reach, if that is in view, or let go."""
    hand = state.hand
    if not hand.present:
        return
    if not closed:
        if hand.gripped >= 0:
            gripper.lift(state, bodies)
    elif hand.gripped < 0:
        x, z, _ = gripper.hand_pose(state)
        found = gripper.in_reach(bodies, eye, x, z)
        if found >= 0:
            gripper.grip(state, bodies, found, REACH)


@chipmunk.compiled
def control_tick(
    state: State,
    bodies: Structs[Body],
    eye: Eye,
    limits: Limits,
    vx: float,
    vz: float,
    spin: float,
    closed: bool,
) -> None:
    """A tick under a steered hand, which stops and touches nothing any more when its limits are reached.

    Args:
        state: of the table.
        bodies: likewise.
        eye: the headset's camera: only what it sees can be gripped.
        limits: how much may be moved.
        vx: of the hand, metres a second.
        vz: likewise.
        spin: of the hand, radians a second, Chipmunk's way round.
        closed: whether the hand is closed.
    """
    if state.lifts:
        lifting.control_tick(state, bodies, eye, limits, vx, vz, spin, closed)
        return
    low = not state.hand.raised and not limits.halted and limits.braking == 0
    if low and exceeds(state, bodies, limits):
        limits.braking = 1
    if limits.halted:
        gripper.raise_hand(state, bodies)
    elif limits.braking == 0:
        use_hand(state, bodies, eye, closed)
    else:
        vx = vz = spin = 0.0
    stepping.tick(state, bodies, vx, vz, spin, 1)
    if not limits.halted and limits.braking != 0:
        brake(state, bodies, limits)


@chipmunk.compiled
def rests(state: State, bodies: Structs[Body], limits: Limits) -> bool:
    """Whether ticks under an open hand that is on the table and not moved change nothing but their number."""
    hand = state.hand
    if (
        not hand.present
        or not state.still
        or hand.raised
        or hand.gripped >= 0
        or stepping.drives(state)
        or limits.halted
        or limits.braking != 0
        or exceeds(state, bodies, limits)
    ):
        return False
    x, z, _ = gripper.hand_pose(state)
    back_x = gripper.held_back(x, 0.0, state.width, TICK)
    return bool(back_x == 0 and gripper.held_back(z, 0.0, state.depth, TICK) == 0)
