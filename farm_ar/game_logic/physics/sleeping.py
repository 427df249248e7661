"""Kernels: where the bodies are, and whether everything has come to rest."""

from __future__ import annotations

from math import fabs

from farm_ar.game_logic.physics import chipmunk, overlap_resolution
from farm_ar.game_logic.physics.state import TICK, Body, State
from farm_ar.geometry.rectangles import length
from farm_ar.structs import Structs

# At rest: from the sixth tick after the last touch on, nothing gets on by more than 3 mm/s, or 30 mrad/s, in
# three ticks. Places are compared because what pushes overlapping bodies apart does not show in their
# velocities, over three ticks because a wedged body trembles.
_WINDOW = 3
_STILL_METRES, _STILL_RADIANS = 3e-3 * _WINDOW * TICK, 3e-2 * _WINDOW * TICK


@chipmunk.compiled
def read_poses(state: State, bodies: Structs[Body]) -> None:
    """Bring the bodies' poses up to date, and add up how far they have been moved and turned."""
    changed = False
    for i in range(len(bodies)):
        body = bodies[i]
        if body.movable:
            x, z = chipmunk.get_position(body.address)
            angle = chipmunk.get_angle(body.address)
            dx, dz, turn = x - body.x, z - body.z, angle - body.angle
            if dx != 0 or dz != 0 or turn != 0:
                changed = True
                state.metres += length(dx, dz)
                state.radians += fabs(turn)
                body.x, body.z, body.angle = x, z, angle
    if changed:
        state.changes += 1


@chipmunk.compiled
def wake(state: State) -> None:
    """Something was touched."""
    state.still = False
    state.quiet = 0


@chipmunk.compiled
def fall_asleep(state: State, bodies: Structs[Body]) -> None:
    """After a tick in which nobody moved anything: see whether all is still by now."""
    state.quiet += 1
    if state.quiet % _WINDOW != 0:
        return
    still = True
    for i in range(len(bodies)):
        body = bodies[i]
        if body.movable:
            if (
                fabs(body.x - body.old_x) > _STILL_METRES
                or fabs(body.z - body.old_z) > _STILL_METRES
                or fabs(body.angle - body.old_angle) > _STILL_RADIANS
            ):
                still = False
            body.old_x, body.old_z, body.old_angle = body.x, body.z, body.angle
    if still and state.quiet > _WINDOW:
        state.still = True
        overlap_resolution.resolve_overlaps(state, bodies)
        read_poses(state, bodies)
        for i in range(len(bodies)):
            body = bodies[i]
            if body.movable:
                vx, vz = chipmunk.get_velocity(body.address)
                if vx != 0 or vz != 0 or chipmunk.get_spin(body.address) != 0:
                    chipmunk.set_velocity(body.address, 0.0, 0.0)
                    chipmunk.set_spin(body.address, 0.0)
