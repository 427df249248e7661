"""Guiding a hand on a straight line, smoothly from rest to rest, with whatever it holds."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, hypot

from farm_ar.game_logic.hand import MAX_TWIST, Hand, Pose
from farm_ar.game_logic.physics import TICK

LetPass = Callable[[int], None]
"""Something that lets a number of ticks pass."""

# A hand on the table is corrected every so many ticks.
_PERIOD = 3

# How long it presses on at its goal where something holds it up, periods; and the most that a hand which has
# stopped moves by in a period, metres or radians.
_PATIENCE = 10
_STOPPED = 1.5e-4


def glide(hand: Hand, goal: Pose, speed: float, let_pass: LetPass, watched: bool) -> None:
    """Guide a hand that hovers.

    Args:
        hand: the hand.
        goal: where to.
        speed: highest speed on the way, metres a second.
        let_pass: is told of every tick, or of all at once where nobody watches.
        watched: whether somebody watches.
    """
    start = hand.pose
    ticks = _duration(start, goal, speed)
    if watched:
        for k in range(1, ticks):
            hand.place(_on_the_way(start, goal, k / ticks))
            let_pass(1)
    hand.place(goal)
    hand.steer(0.0, 0.0, 0.0)
    let_pass(1 if watched else ticks)


def drag(hand: Hand, goal: Pose, speed: float, let_pass: LetPass, delay: float) -> None:
    """Guide a hand that is low or holds a building; where something holds it up it presses on a while.

    Args:
        hand: the hand.
        goal: where to.
        speed: highest speed on the way, metres a second.
        let_pass: lets ticks pass.
        delay: seconds until the hand obeys: it first goes on as it does now.
    """
    start = hand.pose
    periods = ceil(_duration(start, goal, speed) / _PERIOD)
    seconds = _PERIOD * TICK
    x, z, angle = start
    for k in range(1, periods + _PATIENCE + 1):
        before = x, z, angle
        there = goal if k >= periods else _on_the_way(start, goal, k / periods)
        (vx, vz), spin = hand.velocity, hand.spin
        vx = (there[0] - x - vx * delay) / seconds
        vz = (there[1] - z - vz * delay) / seconds
        spin = (there[2] - angle - spin * delay) / seconds
        fast = max(1.0, hypot(vx, vz) / speed)
        hand.steer(vx / fast, vz / fast, min(max(spin, -MAX_TWIST), MAX_TWIST))
        let_pass(_PERIOD)
        x, z, angle = hand.pose
        moved = max(abs(x - before[0]), abs(z - before[1]), abs(angle - before[2]))
        if k > periods and moved < _STOPPED:
            break
    hand.steer(0.0, 0.0, 0.0)


def _duration(start: Pose, goal: Pose, speed: float) -> int:
    """Ticks that a smooth way takes at no more than `speed` metres a second and `MAX_TWIST`."""
    way = hypot(goal[0] - start[0], goal[1] - start[1])
    # In its middle smoothstep is one and a half times as fast as on average.
    seconds = 1.5 * max(way / speed, abs(goal[2] - start[2]) / MAX_TWIST)
    return max(1, ceil(seconds / TICK))


def _on_the_way(start: Pose, goal: Pose, time: float) -> Pose:
    """The pose after a share `time` of the time, by smoothstep."""
    share = time * time * (3 - 2 * time)
    (x, z, angle), (to_x, to_z, to_angle) = start, goal
    return x + share * (to_x - x), z + share * (to_z - z), angle + share * (to_angle - angle)
