"""How much the buildings may be moved, and kernels by which a hand keeps to that."""

from __future__ import annotations

from dataclasses import dataclass
from math import fabs, inf, pi
from typing import Any, NamedTuple

import numpy.typing as npt

from farm_ar.game_logic.physics import chipmunk, gripper
from farm_ar.game_logic.physics.state import Body, Limits, State
from farm_ar.geometry.rectangles import length
from farm_ar.structs import Structs

# What is let go at 1 m/s slides on for this many metres (space damping of 1e-6); what the arm brakes at 1 m/s
# goes on for this many.
SLIDE = 1 / 13.8
BRAKE = 1 / 50

# A braking hand that is slower than this, metres a second, has stopped; it waits so many ticks for that.
_STOPPED, _PATIENCE = 0.02, 10

# By how much a limit may be exceeded before the hand stops: nothing that is moved keeps its heading to the
# last bit.
_SLACK_METRES, _SLACK_RADIANS = 1e-3, 1e-2


class Motion(NamedTuple):
    """What happened to all objects together, those that were pushed included.

    Args:
        metres: how far they were moved, summed.
        radians: how far they were turned, summed.
    """

    metres: float = 0.0
    radians: float = 0.0

    def __add__(self, other: Motion) -> Motion:  # type: ignore[override]  # two motions are no longer tuple
        return Motion(self.metres + other.metres, self.radians + other.radians)

    def __sub__(self, other: Motion) -> Motion:
        return Motion(self.metres - other.metres, self.radians - other.radians)

    def effort(self, diagonal: float) -> float:
        """Metres as a share of a scene's diagonal, plus radians as a share of half a turn."""
        return self.metres / diagonal + self.radians / pi


@dataclass(frozen=True)
class MotionLimit:
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

    def begin(self, limits: Structs[Limits] | npt.NDArray[Any], moved: Motion) -> None:
        """Have kernels keep to it from now on.

        Args:
            limits: (1,) filled in.
            moved: how much the buildings have been moved so far.
        """
        limits[0] = (self.metres, self.radians, self.effort, self.diagonal, *moved, 0, False)


@chipmunk.compiled
def still_to_come(state: State, bodies: Structs[Body]) -> tuple[float, float]:
    """How far all bodies will still slide, and turn, if the hand brakes now; metres and radians."""
    metres = radians = 0.0
    for i in range(len(bodies)):
        body = bodies[i]
        if body.movable:
            vx, vz = chipmunk.get_velocity(body.address)
            speed, spin = length(vx, vz), fabs(chipmunk.get_spin(body.address))
            if i == state.hand.gripped:
                metres += BRAKE * speed * speed
            else:
                metres += SLIDE * speed
                radians += SLIDE * spin
    return metres, radians


@chipmunk.compiled
def exceeds(state: State, bodies: Structs[Body], limits: Limits) -> bool:
    """Whether going on would move or turn the bodies by more than the limits."""
    if limits.metres == inf and limits.radians == inf and limits.effort == inf:
        return False
    metres = radians = 0.0
    if not state.still:
        metres, radians = still_to_come(state, bodies)
    metres += state.metres - limits.began_metres
    radians += state.radians - limits.began_radians
    effort = metres / limits.scene_diagonal + radians / pi
    slack = _SLACK_METRES / limits.scene_diagonal + _SLACK_RADIANS / pi
    return bool(
        metres > limits.metres + _SLACK_METRES
        or radians > limits.radians + _SLACK_RADIANS
        or effort > limits.effort + slack
    )


@chipmunk.compiled
def brake(state: State, bodies: Structs[Body], limits: Limits) -> None:
    """After a tick of braking: a hand that has stopped lets go and touches nothing any more."""
    limits.braking += 1
    vx, vz, _ = gripper.hand_motion(state)
    if length(vx, vz) < _STOPPED or limits.braking > _PATIENCE:
        gripper.raise_hand(state, bodies)
        limits.halted = True
