"""A robot's own head: where to go next, how to get there, and when to hand over."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.envs.delivery.delivery import REACH_M, Knowledge
from farm_ar.envs.delivery.planner import KEEP_M, Grid
from farm_ar.envs.delivery.robot import MOST_M_S, MOST_RAD_S, RADIUS_M, Twist
from farm_ar.envs.delivery.room import Room
from farm_ar.geometry import direction, heading, wrap
from farm_ar.scenes import Layout

STOP_M = REACH_M - 0.1
"""How near to a chair's middle it plans to get."""

NEAR_SCAN_M = 2.0
"""Farther points of a scan are too inexact for the grid."""

AHEAD_M = 0.35
"""How far along its way it steers to."""

FACING = float(np.deg2rad(12.0))
"""How exactly it faces what it hands something over to, radians."""

AGAIN_STEPS = 5
"""Steps after which it plans anew."""


@dataclass(frozen=True, eq=False)
class Goal:
    """Where the robot is to go, as a ROS goal has it: a place in the frame `map`.

    Args:
        kind: "last known", "target", "search" or "confirm".
        place: (2,) our x and z, metres.
        seconds: when it was issued.
    """

    kind: str
    place: FloatArray
    seconds: float


class Courier:
    """Drives to where the target was last known until it is identified; then that goal is cancelled.

    Args:
        naive: whether it does without identification: the chair nearest to where the target was gets it.
        confirm: where the method has probabilities, it first looks at the rest of the room while the
            likeliest object has less than this, and there is time.
        patience: seconds after which it stops looking around, and takes the likeliest object, if any.

    Attributes:
        way: (P, 2) that it means to go, metres; None where it knows none.
        goals: all goals that were issued, the newest last; each cancels the one before.
        sure: probability that the object it means to deliver to is the target; NaN where the method has
            none.
    """

    def __init__(self, naive: bool = False, confirm: float = 0.8, patience: float = 60.0) -> None:
        self.naive, self.confirm, self.patience = naive, confirm, patience
        self.goals: list[Goal] = []
        self.sure = float("nan")
        self._grid: Grid | None = None
        self.way: FloatArray | None = None
        self._planned, self._steps, self._turned, self._left_to_see = -AGAIN_STEPS, 0, 0.0, list[FloatArray]()

    def act(self, known: Knowledge) -> tuple[Twist, bool]:
        """The command to the wheels, and whether to hand over."""
        self._remember(known)
        self._steps += 1
        goal = self._choose(known)
        here, yaw = known.pose.place, known.pose.yaw
        away = float(np.linalg.norm(goal.place - here))
        if goal.kind == "target" and away <= STOP_M + 0.05:
            error = float(wrap(heading(goal.place - here) - yaw))
            if abs(error) <= FACING:
                return Twist(), True
            return _turn(error), False
        if goal.kind != "target" and away <= STOP_M + 0.05:
            return self._look_around(), False
        return self._along(known, goal), False

    def _choose(self, known: Knowledge) -> Goal:
        """The goal now; a new one is issued where it is another, or lies elsewhere."""
        wanted = self._wanted(known)
        before = self.goals[-1] if self.goals else None
        if before is None or before.kind != wanted.kind or np.linalg.norm(before.place - wanted.place) > 0.05:
            self.goals.append(wanted)
            self._planned, self._turned = -AGAIN_STEPS, 0.0
        return self.goals[-1]

    def _wanted(self, known: Knowledge) -> Goal:
        scene, now = known.scene, known.seconds
        last = scene.layout.position[scene.layout.index(known.target)]
        if self.naive:
            return self._without_identity(known, last)
        found, probability, tracking = known.given, known.probability, known.tracking
        if found is None and now >= self.patience and probability.max(initial=0.0) > 0:
            found = int(probability.argmax())
        if found is not None and tracking is not None:
            place = tracking.objects.position[found]
            assured = tracking.identification.probability is not None
            self.sure = float(probability[found]) if assured else float("nan")
            unsure = assured and probability[found] < self.confirm and now < self.patience
            if not (unsure and len(tracking.objects) < len(scene.layout)):
                return Goal("target", place, now)
            return self._search(known, "confirm", last)
        return self._search(known, "search", last)

    def _without_identity(self, known: Knowledge, last: FloatArray) -> Goal:
        """The naive robot's: the chair nearest to where the target was, within a metre of there."""
        if known.tracking is not None and self._seen_from_near(known, last):
            place = known.tracking.objects.position
            away = np.linalg.norm(place - last, axis=1)
            if len(away) and away.min() <= 1.0:
                return Goal("target", place[away.argmin()], known.seconds)
        return Goal("last known", last, known.seconds)

    def _seen_from_near(self, known: Knowledge, place: FloatArray) -> bool:
        """Whether the robot has come so near to a place that it sees what stands there."""
        return bool(np.linalg.norm(known.pose.place - place) <= 1.6)

    def _search(self, known: Knowledge, kind: str, last: FloatArray) -> Goal:
        """The first place that has not been looked at."""
        if not self.goals:
            self._left_to_see = self._places(known, last)
            return Goal("last known", last, known.seconds)
        before = self.goals[-1]
        if before.kind in ("last known", "search", "confirm") and self._turned < 2 * pi:
            return before
        if before.kind != "target" and len(self._left_to_see):
            self._left_to_see.pop(0)
        if not self._left_to_see:
            self._left_to_see = self._places(known, last)
        return Goal(kind, self._left_to_see[0], known.seconds)

    def _places(self, known: Knowledge, last: FloatArray) -> list[FloatArray]:
        """Where to look: at the target's own place, the others', the nearest first, and in each quarter."""
        layout, size = known.scene.layout, np.asarray(known.scene.size)
        quarters = size * [(0.25, 0.25), (0.25, 0.75), (0.75, 0.75), (0.75, 0.25)]
        others = np.delete(layout.position, layout.index(known.target), axis=0)
        order = np.argsort(np.linalg.norm(others - known.pose.place, axis=1))
        return [last, *others[order], *quarters]

    def _look_around(self) -> Twist:
        self._turned += 0.9 * MOST_RAD_S / 2 * 0.2
        return Twist(0.0, MOST_RAD_S / 2)

    def _remember(self, known: Knowledge) -> None:
        """What it sees to be in the way goes on its grid."""
        if self._grid is None:
            self._grid = Grid(known.scene.size)
            self._grid.add_boxes(Room(known.scene).tables)
        near = known.distance <= NEAR_SCAN_M
        points = known.pose.place + known.distance[near, None] * direction(known.pose.yaw + known.angle[near])
        inside = ((points > 0.05) & (points < np.asarray(known.scene.size) - 0.05)).all(axis=1)
        self._grid.add_points(points[inside])

    def _along(self, known: Knowledge, goal: Goal) -> Twist:
        """The command that follows the way to a goal, planned anew once a second."""
        grid, here = self._grid, known.pose.place
        assert grid is not None
        if self._steps - self._planned >= AGAIN_STEPS:
            seen = _with_seen(grid, known)
            self.way = seen.way(here, goal.place, STOP_M)
            if self.way is None:
                self.way = seen.way(here, goal.place, 2.5 * STOP_M)
            self._planned = self._steps
        if self.way is None or len(self.way) < 2:
            return self._look_around()
        aim = _aim(self.way, here)
        error = float(wrap(heading(aim - here) - known.pose.yaw))
        if abs(error) > 0.7:
            return _turn(error)
        clear = grid.clearance_at(here + 0.15 * direction(known.pose.yaw))
        careful = min(max((clear - RADIUS_M) / (KEEP_M - RADIUS_M + 0.1), 0.25), 1.0)
        if self._blocked(known):
            self._planned = -AGAIN_STEPS
            return _turn(error if abs(error) > 0.1 else 0.5)
        ahead = MOST_M_S * careful * max(cos(error), 0.0)
        return Twist(ahead, -float(np.clip(2.5 * error, -MOST_RAD_S, MOST_RAD_S)))

    def _blocked(self, known: Knowledge) -> bool:
        """Whether something is right before the base."""
        across, ahead = known.distance * np.sin(known.angle), known.distance * np.cos(known.angle)
        near = np.isfinite(known.distance) & (np.abs(across) < RADIUS_M + 0.02) & (ahead < RADIUS_M + 0.13)
        return bool(near.any())


def _with_seen(grid: Grid, known: Knowledge) -> Grid:
    """The grid with the chairs as they are fused from all snapshots."""
    seen = Grid(known.scene.size)
    seen.taken = grid.taken.copy()
    if known.tracking is not None:
        objects = known.tracking.objects
        layout = known.scene.layout
        usual = np.median(layout.size, axis=0)
        seen.add_boxes(
            Layout(
                labels=tuple(str(k) for k in range(len(objects))),
                category=("chair",) * len(objects),
                position=objects.position,
                yaw=objects.yaw,
                size=np.tile(usual, (len(objects), 1)),
            )
        )
    return seen


def _aim(way: FloatArray, here: FloatArray) -> FloatArray:
    """The point of a way that lies `AHEAD_M` beyond the one nearest to the robot."""
    nearest = int(np.linalg.norm(way - here, axis=1).argmin())
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way[nearest:], axis=0), axis=1))])
    aim: FloatArray = way[nearest + min(int(np.searchsorted(along, AHEAD_M)), len(along) - 1)]
    return aim


def _turn(error: float) -> Twist:
    """Turn where it stands; an error to the right is a command to the right."""
    return Twist(0.0, -float(np.clip(2.0 * error, -MOST_RAD_S, MOST_RAD_S)))
