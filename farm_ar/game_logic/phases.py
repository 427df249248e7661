"""The phases of the game, and the kernel in which many ticks of a steered hand pass in one call."""

from __future__ import annotations

from enum import IntEnum
from math import cos, sin
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from farm_ar.game_logic.animals.arrival import Animal, Clock, Counts, Due, Herd, run
from farm_ar.game_logic.animals.routes import Route
from farm_ar.game_logic.physics import chipmunk, gripper
from farm_ar.game_logic.physics.state import TICK, Body, Limits, State
from farm_ar.game_logic.physics.velocity_control import control_tick, rests
from farm_ar.game_logic.visibility import sees_arm
from farm_ar.geometry.camera import Eye
from farm_ar.structs import Struct, Structs

AWAY_TICKS = 30
"""After so many ticks out of view, holding nothing, a visit is over: half a second."""


class Phase(IntEnum):
    """What is going on: animals run, or the hand is in view and they do not."""

    PLAY = 0
    HAND = 1

    @property
    def text(self) -> str:
        """Its name, for pictures."""
        return self.name.lower()


class Outcome(Struct):
    """What came of the ticks of one call of `steer`."""

    ticks: int
    """How many have passed: fewer than asked for where a visit is over, or buildings have moved while animals
    run, who then have to run before they move again."""
    over: bool
    """Whether the visit is over."""
    pending: int
    """For how many ticks animals have yet to run."""
    metres: float
    """How far all buildings have been moved."""
    radians: float


class Visit(Struct):
    """The phase, and what belongs to a visit."""

    visited: bool
    """Whether the hand is in view, or not yet long enough out of it."""
    away: int
    """For how many ticks it has been out of view and empty."""
    pending: int
    """For how many ticks animals still have to run."""
    known: int
    """The `changes` of the table for which animals know where they arrive, -1 for none."""
    limits: Limits
    eye: Eye
    """The headset's camera."""
    outcome: Outcome


class GameArrays(NamedTuple):
    """All that kernels need of a game; flat, because an array within costs the more the deeper it is.

    Args:
        states: (1,) of the table.
        bodies: (N,) of the table.
        visits: (1,) the visit.
        clocks: of the flock, as in a `Herd`.
        queue: likewise.
        animals: likewise.
        routes: (n, L) on which animals leave the shed.
        counts: (N,) of the labels.
    """

    states: Structs[State]
    bodies: Structs[Body]
    visits: Structs[Visit]
    clocks: Structs[Clock]
    queue: Structs[Due]
    animals: Structs[Animal]
    routes: Structs[Route]
    counts: Structs[Counts]


@chipmunk.compiled
def watch(state: State, visit: Visit, seen: bool) -> bool:
    """After a tick: begin a visit when the hand is seen.

    Returns:
        Whether the visit is over.
    """
    if state.hand.present and seen:
        visit.visited, visit.away = True, 0
    elif state.hand.present and state.hand.gripped >= 0:
        visit.away = 0
    else:
        visit.away += 1
    if not visit.visited:
        visit.pending += 1
        return False
    return bool(visit.away >= AWAY_TICKS)


@chipmunk.compiled
def steer(game: GameArrays, vx: float, vz: float, spin: float, closed: bool, ticks: int) -> bool:
    """Ticks under a hand that is steered, seen where it truly is.

    Args:
        game: all of it; the visit's outcome is filled in.
        vx: of the hand, metres a second.
        vz: likewise.
        spin: of the hand, radians a second, Chipmunk's way round.
        closed: whether the hand is closed.
        ticks: how many.

    Returns:
        Whether there is more to say of it than that all ticks have passed.
    """
    state, bodies, visit = game.states[0], game.bodies, game.visits[0]
    metres, radians, over, done = state.metres, state.radians, False, 0
    quiet = vx == 0 and vz == 0 and spin == 0 and not closed and rests(state, bodies, visit.limits)
    seen = False
    while done < ticks:
        before = state.changes
        if quiet:
            state.ticks += 1
        else:
            control_tick(state, bodies, visit.eye, visit.limits, vx, vz, spin, closed)
        if not quiet or done == 0:
            x, z, _ = gripper.hand_pose(state)
            seen = state.hand.present and sees_arm(visit.eye, x, z)
        done += 1
        over = watch(state, visit, seen)
        if over or (not visit.visited and state.changes != before):
            break
    pending, visit.pending = visit.pending, 0
    end = game.clocks[0].now + pending * TICK
    known = pending > 0 and visit.known == state.changes
    if known and run(Herd(game.clocks, game.queue, game.animals), game.routes, game.counts, end):
        pending = 0
    outcome = visit.outcome
    outcome.ticks, outcome.over, outcome.pending = done, over, pending
    outcome.metres, outcome.radians = state.metres - metres, state.radians - radians
    return bool(over or pending != 0 or outcome.metres != 0 or outcome.radians != 0 or done < ticks)


@chipmunk.compiled
def describe_hand(states: Structs[State], visits: Structs[Visit], numbers: npt.NDArray[np.float32]) -> None:
    """Fill in the (8,) numbers that an observation has of the hand.

    x, z with the table from -1 to 1, sine and cosine of its yaw, velocity over its limit, whether it holds
    something, whether it is in view; 0 where there is none.
    """
    state = states[0]
    numbers[:] = 0.0
    if not state.hand.present:
        return
    x, z, angle = gripper.hand_pose(state)
    vx, vz, _ = gripper.hand_motion(state)
    numbers[0] = min(max(2 * x / state.width - 1, -4.0), 4.0)
    numbers[1] = min(max(2 * z / state.depth - 1, -4.0), 4.0)
    numbers[2], numbers[3] = sin(-angle), cos(angle)
    numbers[4] = min(max(vx / gripper.MAX_HAND_SPEED, -4.0), 4.0)
    numbers[5] = min(max(vz / gripper.MAX_HAND_SPEED, -4.0), 4.0)
    numbers[6] = 1.0 if state.hand.gripped >= 0 else 0.0
    numbers[7] = 1.0 if visits[0].visited else 0.0
