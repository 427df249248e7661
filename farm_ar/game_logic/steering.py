"""A compiled kernel of a steered hand: many ticks of grip, physics, sight and phase in one call.

It works on the arrays of a `plane`, of the flock, and of a visit: `phase`, whose places are named below, a
`way` whose limits are the budget, and an `eye`. Like those of the plane it runs in Python, too.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.game_logic import arm, chipmunk, guiding, nearness, plane, running, sight, ticking
from farm_ar.game_logic.plane import Addresses

VISITED, AWAY, PENDING, KNOWN, PHASES = range(5)
"""Places in `phase`: 1 while the hand is in view, or not yet long enough out of it; for how many ticks it
has been out of view and empty; for how many ticks animals still have to run; the `CHANGES` for which they
know where they arrive, -1 for none; how many places there are."""

TOLD = 8
"""How many numbers an observation has of the hand."""

WAY_AT, EYE_AT = PHASES, PHASES + guiding.WAYS
OUTCOME_AT = EYE_AT + sight.LOOKS
VISIT = OUTCOME_AT + 5
"""Where in the numbers of a visit its way, its eye and what was done last begin, after its phase; how many
there are."""

AWAY_TICKS = 30
"""After so many ticks out of view, holding nothing, a visit is over: half a second."""

REACH = 0.06
"""How far from a footprint the middle of a hand may be and still take hold of the building, metres."""


@chipmunk.compiled
def use_hand(handle: Addresses, state: FloatArray, box: FloatArray, eye: FloatArray, closed: bool) -> None:
    """Close on the nearest building within reach, if that is in view, or let go."""
    if state[plane.PRESENT] == 0:
        return
    if not closed:
        if state[plane.GRIPPED] >= 0:
            arm.lift(handle, state)
    elif state[plane.GRIPPED] < 0:
        x, z, _ = arm.hand_pose(handle, state)
        found = nearness.nearest(box, x, z, REACH, False)
        if found >= 0 and sight.in_sight(
            eye, box[found, plane.BOX_X], box[found, plane.ELEVATION], box[found, plane.BOX_Z]
        ):
            arm.grip(handle, state, box, found, REACH)


@chipmunk.compiled
def press(
    handle: Addresses,
    state: FloatArray,
    box: FloatArray,
    eye: FloatArray,
    way: FloatArray,
    vx: float,
    vz: float,
    spin: float,
    closed: bool,
) -> None:
    """A tick under a steered hand, which stops and touches nothing any more when its budget is spent."""
    low = state[plane.RAISED] == 0 and way[guiding.WAY_DONE] == 0 and way[guiding.BRAKING] == 0
    if low and guiding.exceeds(handle, state, box, way):
        way[guiding.BRAKING] = 1.0
    if way[guiding.WAY_DONE] != 0:
        arm.raise_hand(handle, state)
    elif way[guiding.BRAKING] == 0:
        use_hand(handle, state, box, eye, closed)
    else:
        vx = vz = spin = 0.0
    ticking.tick(handle, state, box, vx, vz, spin, 1)
    if way[guiding.WAY_DONE] == 0 and way[guiding.BRAKING] != 0:
        guiding.braked(handle, state, way)


@chipmunk.compiled
def rests(handle: Addresses, state: FloatArray, box: FloatArray, way: FloatArray) -> bool:
    """Whether ticks under an open hand that is on the table and not moved change nothing but their number."""
    if (
        state[plane.PRESENT] == 0
        or state[plane.STILL] == 0
        or state[plane.RAISED] != 0
        or state[plane.GRIPPED] >= 0
        or ticking.drives(state)
        or way[guiding.WAY_DONE] != 0
        or way[guiding.BRAKING] != 0
        or guiding.exceeds(handle, state, box, way)
    ):
        return False
    x, z, _ = arm.hand_pose(handle, state)
    back_x = arm.held_back(x, 0.0, state[plane.WIDTH], plane.TICK)
    return bool(back_x == 0 and arm.held_back(z, 0.0, state[plane.DEPTH], plane.TICK) == 0)


@chipmunk.compiled
def watch(state: FloatArray, phase: FloatArray, seen: bool) -> bool:
    """After a tick: begin a visit when the hand is seen.

    Returns:
        Whether the visit is over.
    """
    if state[plane.PRESENT] != 0 and seen:
        phase[VISITED], phase[AWAY] = 1.0, 0.0
    elif state[plane.PRESENT] != 0 and state[plane.GRIPPED] >= 0:
        phase[AWAY] = 0.0
    else:
        phase[AWAY] += 1
    if phase[VISITED] == 0:
        phase[PENDING] += 1
        return False
    return bool(phase[AWAY] >= AWAY_TICKS)


@chipmunk.compiled
def tell(handle: Addresses, state: FloatArray, phase: FloatArray, told: npt.NDArray[np.float32]) -> None:
    """Fill in the numbers, (TOLD,), that an observation has of the hand.

    x, z with the table from -1 to 1, sine and cosine of its yaw, velocity over its limit, whether it holds
    something, whether it is in view; 0 where there is none.
    """
    told[:] = 0.0
    if state[plane.PRESENT] == 0:
        return
    x, z, angle = arm.hand_pose(handle, state)
    vx, vz, _ = arm.hand_motion(handle, state)
    told[0] = min(max(2 * x / state[plane.WIDTH] - 1, -4.0), 4.0)
    told[1] = min(max(2 * z / state[plane.DEPTH] - 1, -4.0), 4.0)
    told[2], told[3] = sin(-angle), cos(angle)
    told[4] = min(max(vx / arm.MAX_HAND_SPEED, -4.0), 4.0)
    told[5] = min(max(vz / arm.MAX_HAND_SPEED, -4.0), 4.0)
    told[6] = 1.0 if state[plane.GRIPPED] >= 0 else 0.0
    told[7] = phase[VISITED]


@chipmunk.compiled
def steer(
    handle: Addresses,
    state: FloatArray,
    box: FloatArray,
    visit: FloatArray,
    queue: FloatArray,
    animal: FloatArray,
    clock: FloatArray,
    lane: FloatArray,
    counts: IntArray,
    vx: float,
    vz: float,
    spin: float,
    closed: bool,
    ticks: int,
) -> bool:
    """Ticks under a hand that is steered, seen where it truly is.

    Args:
        handle: of the plane.
        state: of the plane.
        box: of the plane.
        visit: (VISIT,) the game's phase; a way, whose limits are the budget, with `BRAKING` while the hand
            stops and `WAY_DONE` once the budget is spent; the headset's camera; and at last, filled in: how
            many ticks have passed, fewer than asked for where a visit is over, or buildings have moved while
            animals run, who then have to run before they move again; whether the visit is over; for how many
            ticks animals have yet to run; how far all buildings have been moved and turned.
        queue: of the flock.
        animal: of the flock.
        clock: of the flock.
        lane: of the game's lanes.
        counts: of the game.
        vx: of the hand, metres a second.
        vz: likewise.
        spin: of the hand, radians a second, Chipmunk's way round.
        closed: whether the hand is closed.
        ticks: how many.

    Returns:
        Whether there is more to say of it than that all ticks have passed.
    """
    phase, way, eye = visit[:WAY_AT], visit[WAY_AT:EYE_AT], visit[EYE_AT:OUTCOME_AT]
    metres, radians, over, done = state[plane.METRES], state[plane.RADIANS], False, 0
    quiet = vx == 0 and vz == 0 and spin == 0 and not closed and rests(handle, state, box, way)
    seen = False
    while done < ticks:
        before = state[plane.CHANGES]
        if quiet:
            state[plane.TICKS] += 1
        else:
            press(handle, state, box, eye, way, vx, vz, spin, closed)
        if not quiet or done == 0:
            x, z, _ = arm.hand_pose(handle, state)
            seen = state[plane.PRESENT] != 0 and sight.arm_in_sight(eye, x, z)
        done += 1
        over = watch(state, phase, seen)
        if over or (phase[VISITED] == 0 and state[plane.CHANGES] != before):
            break
    pending, phase[PENDING] = phase[PENDING], 0.0
    end = clock[running.NOW] + pending * plane.TICK
    known = pending > 0 and phase[KNOWN] == state[plane.CHANGES]
    if known and running.run(queue, animal, clock, lane, counts, end):
        pending = 0.0
    metres, radians = state[plane.METRES] - metres, state[plane.RADIANS] - radians
    outcome = visit[OUTCOME_AT:]
    outcome[0], outcome[1], outcome[2] = done, 1.0 if over else 0.0, pending
    outcome[3], outcome[4] = metres, radians
    return bool(over or pending != 0 or metres != 0 or radians != 0 or done < ticks)
