"""Kernels: ticks of physics under a hand that is steered."""

from __future__ import annotations

from math import fabs

from farm_ar.game_logic.physics import chipmunk, gripper, lifting, proximity, sleeping
from farm_ar.game_logic.physics.state import TICK, Body, State
from farm_ar.geometry.rectangles import length
from farm_ar.structs import Structs

# Steps of the simulation in a tick. A hand faster than `_FAST`, metres a second, moves too far in a whole
# tick for clean bumps. A guided hand presses, and with fewer steps it now and then wedges a body in. While
# nothing is near what moves, and nothing else moves, one step does.
_FAST = 0.75
_FAST_STEPS, GUIDED_STEPS = 2, 3


@chipmunk.compiled
def drives(state: State) -> bool:
    """Whether the hand moves, or tries to move, something in the space."""
    hand = state.hand
    if not hand.present or hand.raised:
        return False
    return bool(hand.velocity_x != 0 or hand.velocity_z != 0 or hand.spin != 0)


@chipmunk.compiled
def step(state: State, bodies: Structs[Body], ticks: int, steps: int) -> None:
    """Let ticks pass, each in a number of steps, while the hand moves as it was steered."""
    driven = drives(state)
    state.ticks += ticks
    if driven:
        sleeping.wake(state)
    for _ in range(ticks):
        if state.still:
            return
        for _ in range(steps):
            chipmunk.step_space(state.space.space, TICK / steps)
        sleeping.read_poses(state, bodies)
        if not driven:
            sleeping.fall_asleep(state, bodies)


@chipmunk.compiled
def tick(state: State, bodies: Structs[Body], vx: float, vz: float, spin: float, count: int) -> None:
    """Let ticks pass while the hand is moved at vx and vz, turning at Chipmunk's rate `spin`."""
    hand = state.hand
    speed = length(vx, vz)
    if speed > gripper.MAX_HAND_SPEED:
        vx, vz = vx * gripper.MAX_HAND_SPEED / speed, vz * gripper.MAX_HAND_SPEED / speed
    spin = min(max(spin, -gripper.MAX_TWIST), gripper.MAX_TWIST)
    steps = 1
    if hand.present:
        if hand.gripped < 0:
            x, z, _ = gripper.hand_pose(state)
            vx = gripper.held_back(x, vx, state.width, count * TICK)
            vz = gripper.held_back(z, vz, state.depth, count * TICK)
            if (
                hand.raised
                and hand.goes_low
                and proximity.nearest(bodies, x, z, gripper.HAND_RADIUS, True) < 0
            ):
                gripper.lower(state, vx, vz, spin)
        gripper.move_arm(state, vx, vz, spin)
        if hand.raised:
            hand.x += vx * count * TICK
            hand.z += vz * count * TICK
            hand.angle += spin * count * TICK
            if hand.gripped >= 0:
                lifting.follow(state, bodies)
        elif speed > _FAST:
            way, turn = speed * count * TICK, fabs(spin) * count * TICK
            if hand.gripped < 0 or not is_clear(state, bodies, way, turn):
                steps = _FAST_STEPS
    step(state, bodies, count, steps)


@chipmunk.compiled
def is_clear(state: State, bodies: Structs[Body], metres: float, radians: float) -> bool:
    """Whether what the hand moves meets nothing within so far a way and turn, and nothing else moves."""
    x, z = 0.0, 0.0
    if state.hand.gripped < 0:
        x, z, _ = gripper.hand_pose(state)
    return proximity.is_clear(state, bodies, x, z, gripper.HAND_RADIUS, metres, radians)


@chipmunk.compiled
def settle(states: Structs[State], bodies: Structs[Body], most: int) -> None:
    """Let ticks pass on the one table, with the hand held where it is, until everything is at rest."""
    state = states[0]
    for _ in range(most):
        if state.still:
            return
        if state.hand.present:
            gripper.move_arm(state, 0.0, 0.0, 0.0)
        step(state, bodies, 1, GUIDED_STEPS)
