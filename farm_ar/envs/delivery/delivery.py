"""One delivery: a robot in a room whose chairs were moved, and what it knows of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs.delivery.config import DeliveryConfig
from farm_ar.envs.delivery.planner import Grid, length_of
from farm_ar.envs.delivery.rgbd import DepthCamera
from farm_ar.envs.delivery.robot import TICK_S, Pose, Robot, Twist
from farm_ar.envs.delivery.room import Room
from farm_ar.geometry import direction
from farm_ar.reid import Reidentifier, Tracking, reid_factory, track
from farm_ar.scenes import Layout, Scene, Snapshot

STEP_TICKS = 12
"""Ticks of a step: a fifth of a second."""

LOOK_STEPS = 5
"""Steps from one look to the next: a second."""

RAYS = 45
"""Of a scan of depths."""

REACH_M = 0.75
"""How far from the middle of a chair a robot can stand to deliver there."""

HAND_OVER_M = 0.55
"""How far ahead of its middle it puts what it delivers; the nearest chair within `REACH_M` gets it."""

MOST_SNAPSHOTS = 24
"""Of those with detections, the newest that are fused."""

START_CLEAR_M = 0.45
"""How far from everything a robot starts, metres."""


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What the robot knows: only what it has measured, no true poses.

    Args:
        scene: the chairs as they were last known.
        target: the label that is to get the delivery.
        pose: its estimate of its own pose, in the frame `map`.
        speed: how fast the wheels turn it.
        angle: (R,) of the scan, radians to the right.
        distance: (R,) metres, infinite where nothing is.
        tracking: what follows from all its snapshots; None before the first detection.
        looks: how many snapshots it has taken.
        seconds: since the start.
    """

    scene: Scene
    target: str
    pose: Pose
    speed: Twist
    angle: FloatArray
    distance: FloatArray
    tracking: Tracking | None
    looks: int
    seconds: float

    @property
    def probability(self) -> FloatArray:
        """(K,) of each object's being the target; of 0 and 1 where the method has no probabilities."""
        if self.tracking is None or self.target not in self.tracking.identification.candidates:
            return np.zeros(0 if self.tracking is None else len(self.tracking.objects))
        return self.tracking.whereabouts(self.target).probability

    @property
    def given(self) -> int | None:
        """The object that was given the target's label."""
        labels = () if self.tracking is None else self.tracking.identification.labels
        return labels.index(self.target) if self.target in labels else None


class Delivery:
    """A robot on its way.

    Args:
        config: what was chosen.
        scene: the chairs as they were last known.
        layout: where they are.
        start: of the robot, in the frame `map`.
        rng: where all randomness comes from.
    """

    def __init__(
        self, config: DeliveryConfig, scene: Scene, layout: Layout, start: Pose, rng: np.random.Generator
    ) -> None:
        self.config, self.scene, self.layout = config, scene, layout
        self.room, self._rng = Room(scene), rng
        self.things = self.room.furnished(layout)
        self.size: tuple[float, float] = scene.size
        self.camera: DepthCamera = config.camera()
        self.robot = Robot(self.things, self.size, start)
        self.start = start
        self.steps, self.looks = 0, 0
        self.snapshots: list[Snapshot] = []
        self.truths: list[IntArray] = []
        self.tracking: Tracking | None = None
        self.delivered: int | None = None
        self._reid: Reidentifier = reid_factory(config.reid)(scene)
        self._chairs = np.arange(len(self.things)) < len(layout)
        self._look()

    @property
    def seconds(self) -> float:
        """Since the start."""
        return self.steps * STEP_TICKS * TICK_S

    @property
    def target(self) -> int:
        """Index of the chair that is to get the delivery."""
        return self.layout.index(self.config.target)

    def step(self, command: Twist, hand_over: bool) -> None:
        """A fifth of a second; at its end the robot looks if a second is over, and hands over if asked to."""
        self.robot.drive(command, STEP_TICKS, self._rng)
        self.steps += 1
        if self.steps % LOOK_STEPS == 0:
            self._look()
        self._scan()
        if hand_over:
            self.delivered = self.within_reach()

    def within_reach(self) -> int | None:
        """Index of the chair that would get the delivery now; None where none is within reach."""
        here = self.robot.truth
        away = np.linalg.norm(self.layout.position - here.place, axis=1)
        ahead = here.place + HAND_OVER_M * direction(here.yaw)
        off = np.where(away <= REACH_M, np.linalg.norm(self.layout.position - ahead, axis=1), np.inf)
        return int(off.argmin()) if np.isfinite(off).any() else None

    def knowledge(self) -> Knowledge:
        """What the robot knows."""
        return Knowledge(
            self.scene,
            self.config.target,
            self.robot.believed,
            self.robot.speed,
            *self._scanned,
            self.tracking,
            self.looks,
            self.seconds,
        )

    def shortest(self) -> float:
        """Length of the shortest way to the target for one who knew where everything is, metres; or NaN."""
        grid = Grid(self.size)
        grid.add_boxes(self.things)
        way = grid.way(self.start.place, self.layout.position[self.target], REACH_M - 0.05)
        return float("nan") if way is None else length_of(way)

    def _look(self) -> None:
        """Find out where the robot is, take a snapshot, and identify what all snapshots show together."""
        self.looks += 1
        self.robot.localise(self._rng)
        snapshot, found = self.camera.look(
            self.things, self._chairs, self.robot.truth, self.robot.believed, self._rng
        )
        if self.looks == 1:
            self._scan()
        if not len(found):
            return
        self.snapshots = [*self.snapshots, snapshot][-MOST_SNAPSHOTS:]
        self.truths = [*self.truths, found][-MOST_SNAPSHOTS:]
        self.tracking = track(self._reid, self.snapshots)

    def _scan(self) -> None:
        self._scanned = self.camera.scan(self.things, self.size, self.robot.truth, RAYS, self._rng)


def start_of(room: Room, layout: Layout, rng: np.random.Generator) -> Pose:
    """Where a robot starts: anywhere with room around it, facing the middle of the room, more or less.

    Args:
        room: the room.
        layout: where its chairs are.
        rng: where the randomness comes from.
    """
    grid, size = Grid(room.scene.size), np.asarray(room.scene.size)
    grid.add_boxes(room.furnished(layout))
    free = np.argwhere(grid.clearance >= min(START_CLEAR_M, float(grid.clearance.max())))
    place = (free[rng.integers(len(free))] + 0.5) * (size / grid.taken.shape)
    dx, dz = size / 2 - place
    yaw = float(np.arctan2(dx, dz) + rng.uniform(-np.pi / 6, np.pi / 6))
    return Pose.of(place, yaw)
