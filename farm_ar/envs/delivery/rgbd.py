"""An RGB-D camera like Intel's RealSense D435: detections of chairs with its noise, and a scan of depths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs.delivery.robot import Pose
from farm_ar.geometry import direction, heading, wrap
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Snapshot, visible


@dataclass(frozen=True)
class DepthCamera:
    """What the camera sees and how exactly, by default as the data sheet of the D435 says where it does.

    A stereo camera's depth has an SD of z² x subpixel / (focal length x baseline), at a distance z.

    Args:
        across: field of view, radians.
        down: the same from top to bottom.
        nearest: depth that can be measured, metres.
        farthest: likewise.
        width: of the picture, pixels, from which with `across` the focal length follows.
        baseline: between its two eyes, metres.
        subpixel: SD of a disparity, pixels.
        pixel: SD of where in the picture the middle of a chair is found, pixels.
        yaw_sd: of a chair's estimated heading, radians.
        size_sd: of its sides, as a share.
        height: of the camera above the floor, metres.
    """

    across: float = float(np.deg2rad(87.0))
    down: float = float(np.deg2rad(58.0))
    nearest: float = 0.3
    farthest: float = 3.0
    width: int = 848
    baseline: float = 0.05
    subpixel: float = 0.08
    pixel: float = 8.0
    yaw_sd: float = float(np.deg2rad(4.0))
    size_sd: float = 0.05
    height: float = 0.55

    @property
    def focal(self) -> float:
        """Focal length, pixels."""
        return float(self.width / 2 / np.tan(self.across / 2))

    @property
    def fov(self) -> FieldOfView:
        """What it sees on the plane; `look` leaves out what is too near, too high or too low."""
        return FieldOfView.symmetric(self.across, self.farthest)

    def depth_sd(self, depth: FloatArray) -> FloatArray:
        """SD of a depth, metres."""
        sd: FloatArray = depth**2 * self.subpixel / (self.focal * self.baseline)
        return sd

    def at(self, pose: Pose) -> Camera:
        """The camera on a robot with that pose in the frame `map`."""
        return Camera(pose.place, np.array(pose.yaw), self.fov, np.array(self.height))

    def look(
        self, things: Layout, seen: BoolArray, truth: Pose, believed: Pose, rng: np.random.Generator
    ) -> tuple[Snapshot, IntArray]:
        """A snapshot of the chairs in view, none hidden by another thing, where the robot takes them to be.

        Args:
            things: all that stands in the room.
            seen: (N,) those of them that are detected: the chairs.
            truth: of the robot.
            believed: likewise; an error in it is one of all detections.
            rng: for the noise.

        Returns:
            The snapshot, and the (K,) indices of what its detections really are.
        """
        camera = self.at(truth)
        far = np.linalg.norm(things.position - camera.position, axis=1)
        rise = np.arctan2(things.elevation + things.size[:, 1] / 2 - self.height, far)
        near = (far >= self.nearest) & (np.abs(rise) <= self.down / 2)
        found = np.flatnonzero(visible(things, camera, occlusion=True) & seen & near)
        offset = things.position[found] - camera.position
        angle = wrap(heading(offset) - camera.yaw)
        found, angle, depth = _left_to_right(found, angle, np.linalg.norm(offset, axis=1))
        depth = depth + rng.normal(size=len(found)) * self.depth_sd(depth)
        angle = angle + rng.normal(size=len(found)) * self.pixel / self.focal
        size = things.size[found] * np.maximum(1 + self.size_sd * rng.normal(size=(len(found), 3)), 0.2)
        turned = wrap(things.yaw[found] - truth.yaw + self.yaw_sd * rng.normal(size=len(found)))
        position = believed.place + depth[:, None] * direction(believed.yaw + angle)
        detections = Detections(
            category=tuple(things.category[i] for i in found.tolist()),
            position=position,
            yaw=wrap(turned + believed.yaw),
            size=size,
        )
        return Snapshot(self.at(believed), detections), found

    def scan(
        self, things: Layout, size: tuple[float, float], truth: Pose, rays: int, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """Distances to what is ahead, at the height of the camera.

        Args:
            things: all that stands in the room.
            size: width and depth of the room, metres.
            truth: of the robot.
            rays: how many, from left to right over the field of view.
            rng: for the noise.

        Returns:
            (rays,) angles to the right of straight ahead, radians; (rays,) distances, metres, infinite where
            nothing is from `nearest` to `farthest`.
        """
        angle = np.linspace(-self.across / 2, self.across / 2, rays)
        ahead = direction(truth.yaw + angle)
        distance = np.minimum(_to_boxes(truth.place, ahead, things), _to_walls(truth.place, ahead, size))
        kept = (distance >= self.nearest) & (distance <= self.farthest)
        noise = rng.normal(size=rays) * self.depth_sd(np.where(kept, distance, 0.0))
        return angle, np.where(kept, distance + noise, np.inf)


def _left_to_right(
    found: IntArray, angle: FloatArray, depth: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    order = np.argsort(angle, kind="stable")
    return found[order], angle[order], depth[order]


def _to_boxes(eye: FloatArray, ahead: FloatArray, things: Layout) -> FloatArray:
    """(R,) distances along rays to the nearest footprint, by slabs; infinite where none is."""
    right, front = direction(things.yaw + np.pi / 2), direction(things.yaw)
    offset = eye - things.position
    near, far = np.full((len(ahead), len(things)), -np.inf), np.full((len(ahead), len(things)), np.inf)
    for axis, half in ((right, things.size[:, 0] / 2), (front, things.size[:, 2] / 2)):
        start, rate = (offset * axis).sum(axis=1), ahead @ axis.T
        with np.errstate(divide="ignore", invalid="ignore"):
            first, second = (-half - start) / rate, (half - start) / rate
        near = np.fmax(near, np.fmin(first, second))
        far = np.fmin(far, np.fmax(first, second))
    hit = (near <= far) & (near > 0)
    distance: FloatArray = np.where(hit, near, np.inf).min(axis=1, initial=np.inf)
    return distance


def _to_walls(eye: FloatArray, ahead: FloatArray, size: tuple[float, float]) -> FloatArray:
    """(R,) distances from inside a room to its walls."""
    with np.errstate(divide="ignore"):
        along = np.where(ahead > 0, (np.asarray(size) - eye) / ahead, -eye / ahead)
    distance: FloatArray = along.min(axis=1)
    return distance
