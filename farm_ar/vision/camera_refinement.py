"""The camera's pose put right by what does not move: a fixed thing and the edges of the table.

A headset knows where it is to about a centimetre and half a degree. Where it is wrong, so is every pose that
is lifted through it, however good the image. The pose is moved to where the table's rim and the outlines of
fixed objects lie along edges of the image.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from farm_ar.arrays import BoolArray, FloatArray, Record
from farm_ar.rendering import Instance, Renderer, View
from farm_ar.rendering.light import Light
from farm_ar.vision.base import Image

POSITION_SD, ANGLE_SD = 0.006, 0.006
"""Of what is known of a camera before, metres and radians, along and about each axis."""

_ROUNDS = ((14.0, 3), (7.0, 3), (3.5, 4))
"""How far an edge is looked for from where it should be, pixels of a 640-pixel image, and how often."""

_EDGE_SD, _EVERY_PX = 0.7, 4.0
_FEWEST = 12
"""Points of edges that must be found."""


@dataclass(frozen=True, eq=False)
class Landmarks(Record):
    """What stands still.

    Args:
        fixed: objects whose poses are known, to be seen in the image.
        rim: (R, 2, 3) straight edges, as of a table's top, each from one end to the other, metres.
    """

    fixed: Sequence[Instance]
    rim: FloatArray

    @classmethod
    def of_table(
        cls, width: float, depth: float, fixed: Sequence[Instance] = (), rim: float = 0.0
    ) -> Landmarks:
        """A table's top from (0, 0, 0) to (width, 0, depth), and fixed objects on it.

        Args:
            width: of the top, metres.
            depth: likewise.
            fixed: objects on it.
            rim: how much farther a rim of another colour reaches, metres; 0 for none.
        """
        edges = []
        for more in {0.0, rim}:
            ends = [
                (-more, -more),
                (width + more, -more),
                (width + more, depth + more),
                (-more, depth + more),
            ]
            corners = np.array([(x, 0.0, z) for x, z in ends])
            edges.append(np.stack([corners, np.roll(corners, -1, axis=0)], axis=1))
        return cls(tuple(fixed), np.concatenate(edges))


def refine_camera(
    image: Image, camera: View, landmarks: Landmarks, hidden: Sequence[Instance] = ()
) -> tuple[View, FloatArray]:
    """The camera where its landmarks lie along edges of its image.

    Args:
        image: (H, W, 3).
        camera: about right, within centimetres and a degree or two.
        landmarks: what stands still.
        hidden: other objects, about where they are; what they hide of the landmarks is not looked for.

    Returns:
        The camera, and (6, 6) the covariance of its error: of x, y, z, metres, and of yaw, pitch, roll,
        radians. The camera as given, with what is known of it before, where too little of them is seen.
    """
    grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.float32)
    grey = np.asarray(cv2.GaussianBlur(grey, (0, 0), 1.0))
    before = np.repeat([POSITION_SD, ANGLE_SD], 3)
    change, covariance = np.zeros(6), np.diag(before**2)
    scale = camera.intrinsics.width / 640
    for reach, times in _ROUNDS:
        for _ in range(times):
            view = _changed(camera, change)
            points, along = _points(view, landmarks, hidden, _EVERY_PX * scale)
            pixel, normal, seen = _projected(view, points, along)
            offset, found = _edges_near(grey, pixel, normal, reach * scale)
            found &= seen
            if found.sum() < _FEWEST:
                return (camera, np.diag(before**2)) if not change.any() else (view, covariance)
            slope = _slopes(camera, change, points[found], normal[found])
            residual = offset[found]
            knee = max(1.5, reach / 4) * scale
            weight = 1 / (1 + (residual / knee) ** 2) / (_EDGE_SD * scale) ** 2
            # Neighbouring points of an edge err alike.
            weight /= 4
            precision = (slope * weight[:, None]).T @ slope + np.diag(1 / before**2)
            step = np.linalg.solve(precision, slope.T @ (weight * residual) - change / before**2)
            change = change + step
            covariance = np.linalg.inv(precision)
    return _changed(camera, change), covariance


def _changed(camera: View, change: FloatArray) -> View:
    x, y, z, yaw, pitch, roll = change.tolist()
    eye = camera.eye + np.array([x, y, z])
    return View(camera.intrinsics, eye, camera.yaw + yaw, camera.pitch + pitch, camera.roll + roll)


def _points(
    view: View, landmarks: Landmarks, hidden: Sequence[Instance], every: float
) -> tuple[FloatArray, FloatArray]:
    """(P, 3) points of the landmarks' edges that are to be seen, and (P, 3) where each edge leads."""
    ends = [landmarks.rim] + [_outline(view, one) for one in landmarks.fixed]
    edges = np.concatenate(ends)
    points, along = [], []
    for a, b in edges:
        local = view.axes(np.array([a, b]))
        across = local[:, :2] / np.maximum(local[:, 2:], 0.05)
        length = float(np.linalg.norm(across[1] - across[0]))
        count = int(np.clip(length * view.intrinsics.fx / every, 0, 150))
        share = (np.arange(count) + 0.5)[:, None] / max(count, 1)
        points.append(a + share * (b - a))
        along.append(np.tile((b - a) / np.linalg.norm(b - a), (count, 1)))
    place, way = np.concatenate(points), np.concatenate(along)
    kept = _free(view, place, [*landmarks.fixed, *hidden])
    return place[kept], way[kept]


def _outline(view: View, thing: Instance) -> FloatArray:
    """(E, 2, 3) edges of a thing between a face that is seen and one that is not, or none."""
    corners, normals = thing.corners, thing.normals
    large = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    facing = ((view.eye - corners[:, 0]) * normals).sum(axis=1) > 0
    ends: dict[tuple[bytes, bytes], list[bool]] = {}
    place: dict[tuple[bytes, bytes], FloatArray] = {}
    for k in np.flatnonzero(large > 0.05 * large.max()):
        for i in range(3):
            pair = corners[k, [i, (i + 1) % 3]]
            keys = sorted(np.rint(end * 1e5).astype(np.int64).tobytes() for end in pair)
            key = (keys[0], keys[1])
            ends.setdefault(key, []).append(bool(facing[k]))
            place[key] = pair
    kept = [place[key] for key, sides in ends.items() if any(sides) and not (len(sides) > 1 and all(sides))]
    return np.array(kept).reshape(-1, 2, 3)


def _free(view: View, points: FloatArray, things: Sequence[Instance]) -> BoolArray:
    """(P,) which points nothing hides that stands before them."""
    lens = view.intrinsics
    local = view.axes(points)
    before = local[:, 2] > 0.05
    pixel = np.rint(np.where(before[:, None], view.pixels(points), -9.0)).astype(np.int64)
    middle = np.array([lens.width, lens.height]) / 2
    inside = before & (np.abs(pixel - middle) < middle - 2).all(axis=1)
    if things:
        depth, _ = Renderer(things, Light(shadows=0)).ids(view)
        depth = np.asarray(cv2.erode(depth, np.ones((3, 3), np.uint8)))
        column, row = pixel[inside].T
        inside[inside] = depth[row, column] > local[inside, 2] - 0.012
    return inside


def _projected(view: View, points: FloatArray, along: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """(P, 2) pixels of points, (P, 2) unit vectors across their edges in the image, and which are inside."""
    lens = view.intrinsics
    pixel = view.pixels(points)
    way = view.pixels(points + 0.002 * along) - pixel
    normal = np.column_stack([-way[:, 1], way[:, 0]])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    most = np.array([lens.width - 3, lens.height - 3])
    return pixel, normal, np.asarray((pixel > 2).all(axis=1) & (pixel < most).all(axis=1))


def _edges_near(
    grey: npt.NDArray[np.float32], pixel: FloatArray, normal: FloatArray, reach: float
) -> tuple[FloatArray, BoolArray]:
    """(P,) how far along its normal the strongest edge near a pixel lies, pixels; and if there is one."""
    step = np.arange(-np.ceil(reach) - 2, np.ceil(reach) + 3)
    place = pixel[:, None] + step[None, :, None] * normal[:, None]
    maps = place.astype(np.float32)
    profile = cv2.remap(grey, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    change = np.abs(np.asarray(profile, np.float64)[:, 2:] - np.asarray(profile, np.float64)[:, :-2])
    # What is nearer counts for more: the pose is about right.
    prior = np.exp(-0.5 * (step[1:-1] / reach) ** 2)
    peak = (change * prior).argmax(axis=1)
    rows = np.arange(len(pixel))
    strength = change[rows, peak]
    inner = np.clip(peak, 1, change.shape[1] - 2)
    low, here, high = (change[rows, inner + k] for k in (-1, 0, 1))
    bend = low - 2 * here + high
    shift = np.where(bend < -1e-6, 0.5 * (low - high) / np.where(bend < -1e-6, bend, 1.0), 0.0)
    offset = step[1:-1][inner] + np.clip(shift, -0.5, 0.5)
    return offset, (strength > 12.0) & (np.abs(offset) <= reach) & (inner == peak)


def _slopes(camera: View, change: FloatArray, points: FloatArray, normal: FloatArray) -> FloatArray:
    """(P, 6) how points move along their normals with each number of the camera's pose, pixels."""
    found = np.empty((len(points), 6))
    for k in range(6):
        step = np.zeros(6)
        step[k] = 1e-5
        ahead, back = _changed(camera, change + step), _changed(camera, change - step)
        found[:, k] = ((ahead.pixels(points) - back.pixels(points)) * normal).sum(axis=1) / 2e-5
    return found
