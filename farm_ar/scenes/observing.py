"""Observing a layout from a camera: what is in view, what hides what, and what the detector makes of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.errors import OptionError
from farm_ar.geometry import (
    bearing,
    direction,
    distance,
    footprint_corners,
    in_vertical_view,
    in_view,
    inside_footprint,
    points_in_picture,
    segment_hits_box,
    segment_hits_footprint,
)
from farm_ar.kernels import compiled
from farm_ar.scenes.camera import Camera
from farm_ar.scenes.layout import Layout
from farm_ar.scenes.snapshot import UNKNOWN, Snapshot, SnapshotBatch


@dataclass(frozen=True)
class Detector:
    """What goes wrong between the scene and the detections; by default nothing.

    Args:
        occlusion: whether an object is missed when a nearer one hides it, as `occluded` says.
        whole: whether an object is missed unless all of its box is in view, as `whole_in_view` says.
        position_sd: noise of the detected x and z, metres.
        yaw_sd: noise of the detected heading, radians.
        size_sd: noise of each detected side, as a share of it.
        miss_rate: probability that an object in view is not detected.
        false_rate: mean number of detections a snapshot of objects that are not there (Poisson): anywhere on
            the plane in view, turned anyhow, otherwise like some object of the layout; none if it has none.
        unknown_rate: probability that a detection's category is not known.

    Raises:
        OptionError: a value is out of its limits.
    """

    occlusion: bool = False
    position_sd: float = 0.0
    yaw_sd: float = 0.0
    size_sd: float = 0.0
    miss_rate: float = 0.0
    false_rate: float = 0.0
    unknown_rate: float = 0.0
    whole: bool = False

    def __post_init__(self) -> None:
        for name in ("position_sd", "yaw_sd", "size_sd", "false_rate"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise OptionError(name, "must be a number not below 0", value)
        for name in ("miss_rate", "unknown_rate"):
            if not 0 <= getattr(self, name) <= 1:
                raise OptionError(name, "must be a probability", getattr(self, name))

    @property
    def random(self) -> bool:
        """Whether it needs a random generator."""
        return self != Detector(occlusion=self.occlusion, whole=self.whole)


_Found = dict[str, npt.NDArray[Any]]
"""What is to be detected, by the names of a batch's arrays, and `label`; each array (B, N, ...)."""

PERFECT = Detector()
"""The paper's synthetic experiments: every pivot in view is detected exactly."""


def visible(layout: Layout, camera: Camera, occlusion: bool = False, whole: bool = False) -> BoolArray:
    """Which objects the camera sees: those whose pivot is within its field of view and range.

    Args:
        layout: N objects, its batch shape broadcasting with the camera's.
        camera: one camera or a batch; the vertical limits of its view count where its height is known.
        occlusion: whether objects hide one another, as `occluded` says.
        whole: whether all of an object's box must be in view, as `whole_in_view` says.

    Returns:
        (..., N), the batch shapes broadcast together.
    """
    if whole:
        seen = whole_in_view(layout, camera)
        return seen & ~_hidden(layout, camera, seen) if occlusion else seen
    fov = camera.fov
    seen = in_view(layout.position, camera.position, camera.yaw, fov.left, fov.right, fov.range_m)
    if fov.up is not None and fov.down is not None and camera.height is not None:
        pivot = _raised(layout.position, layout.elevation)
        eye = _raised(camera.position, camera.height)
        seen = seen & in_vertical_view(pivot, eye, camera.yaw, camera.pitch, fov.up, fov.down)
    return seen & ~_hidden(layout, camera, seen) if occlusion else seen


def whole_in_view(layout: Layout, camera: Camera) -> BoolArray:
    """Which objects' boxes are wholly inside the camera's view volume (the paper's section 4.2).

    All eight corners must be between the edges of the camera's picture and within its range on the plane;
    where the camera has no height or no vertical limits, the four corners of the footprint must be in view.
    An object of unknown size counts by its pivot, one of unknown heading as if it were 0.

    Returns:
        (..., N), the batch shapes broadcast together.
    """
    fov, size, n = camera.fov, np.nan_to_num(layout.size), len(layout)
    shape = np.broadcast_shapes(layout.batch_shape, camera.batch_shape)
    position = np.broadcast_to(layout.position, (*shape, n, 2))
    yaw = np.broadcast_to(np.nan_to_num(layout.yaw), (*shape, n))
    corners = footprint_corners(position, yaw, size)
    flat = corners.reshape(*shape, 4 * n, 2)
    if fov.up is None or fov.down is None or camera.height is None:
        seen = in_view(flat, camera.position, camera.yaw, fov.left, fov.right, fov.range_m)
        return _all_corners(seen, (*shape, n))
    seen = distance(camera.position, flat) <= fov.range_m
    eye = _raised(camera.position, camera.height)
    edges = (fov.left, fov.right, fov.up, fov.down)
    for height in (layout.elevation, layout.elevation + size[:, 1]):
        points = _raised(corners, height[:, None]).reshape(*shape, 4 * n, 3)
        seen = seen & points_in_picture(points, eye, camera.yaw, camera.pitch, edges)
    return _all_corners(seen, (*shape, n))


def _all_corners(seen: BoolArray, shape: tuple[int, ...]) -> BoolArray:
    every: BoolArray = np.all(seen.reshape(*shape, 4), axis=-1)
    return every


def occluded(layout: Layout, camera: Camera) -> BoolArray:
    """Which objects stand behind a nearer one, as the camera sees it.

    With the camera's height known, an object is hidden when the line from the eye to its middle passes
    through another object's box; without it, when the line to its pivot passes over another's footprint. What
    holds the hidden one's pivot in its footprint (a table over a chair), or the camera, hides nothing.

    Returns:
        (..., N), the batch shapes broadcast together.
    """
    shape = np.broadcast_shapes(layout.batch_shape, camera.batch_shape)
    return _hidden(layout, camera, np.ones((*shape, len(layout)), dtype=bool))


def _hidden(layout: Layout, camera: Camera, asked: BoolArray) -> BoolArray:
    """(..., N) which of the objects asked for stand behind another."""
    shape, n = asked.shape[:-1], len(layout)
    if not shape and not layout.batch_shape:
        return _hidden_from_one(layout, camera, asked)
    flat = (math.prod(shape), n)
    row, target = np.nonzero(asked.reshape(flat))
    cameras = _flat_camera(camera, shape)
    position = np.broadcast_to(layout.position, (*shape, n, 2)).reshape(*flat, 2)[row]
    yaw = np.broadcast_to(layout.yaw, (*shape, n)).reshape(flat)[row]
    pivot = position[np.arange(len(row)), target, None]
    start = cameras.position[row, None]
    if cameras.height is None:
        hit = segment_hits_footprint(start, pivot, position, yaw, layout.size)
        around_camera = inside_footprint(start, position, yaw, layout.size)
    else:
        middle = _raised(pivot, (layout.elevation + layout.size[:, 1] / 2)[target, None])
        eye = _raised(start, cameras.height[row, None])
        hit = segment_hits_box(eye, middle, position, yaw, layout.size, layout.elevation)
        around_camera = segment_hits_box(eye, eye, position, yaw, layout.size, layout.elevation)
    around_pivot = inside_footprint(pivot, position, yaw, layout.size)
    hidden = np.zeros(flat, dtype=bool)
    hidden[row, target] = np.any(hit & ~around_pivot & ~around_camera, axis=-1)
    return hidden.reshape(asked.shape)


def _hidden_from_one(layout: Layout, camera: Camera, asked: BoolArray) -> BoolArray:
    """(N,) `_hidden` of one layout and one camera, compiled: of all that a session asks, oftenest."""
    height = np.nan if camera.height is None else float(camera.height)
    place = np.array([camera.position[0], height, camera.position[1]])
    axes = np.stack([np.cos(layout.yaw), np.sin(layout.yaw)], axis=-1)
    hidden = np.zeros(len(layout), dtype=bool)
    hide(place, np.array(layout.position), axes, layout.size / 2, np.array(layout.elevation), asked, hidden)
    return hidden


@compiled(error_model="numpy")
def hide(
    eye: FloatArray,
    position: FloatArray,
    axes: FloatArray,
    half: FloatArray,
    elevation: FloatArray,
    asked: BoolArray,
    hidden: BoolArray,
) -> None:
    """Fill in which objects stand behind another, as `occluded` says.

    Args:
        eye: (3,) x, height and z of the camera, metres; the height NaN where it is not known.
        position: (N, 2) metres.
        axes: (N, 2) cosine and sine of the headings.
        half: (N, 3) half of width, height and depth, metres.
        elevation: (N,) metres.
        asked: (N,) which objects are asked for.
        hidden: (N,) filled.
    """
    flat = math.isnan(eye[1])
    start, end, there = np.zeros(3), np.zeros(3), np.zeros(3)
    for target in range(len(position)):
        if not asked[target]:
            continue
        for other in range(len(position)):
            for k, x, y, z in (
                (0, eye[0], eye[1], eye[2]),
                (1, position[target, 0], elevation[target] + half[target, 1], position[target, 1]),
            ):
                off_x, off_z = x - position[other, 0], z - position[other, 1]
                there[0] = off_x * axes[other, 0] + off_z * -axes[other, 1]
                there[1] = 0.0 if flat else y - (elevation[other] + half[other, 1])
                there[2] = off_x * axes[other, 1] + off_z * axes[other, 0]
                (start if k == 0 else end)[:] = there
            around_pivot = abs(end[0]) <= half[other, 0] and abs(end[2]) <= half[other, 2]
            if around_pivot or not _enters(start, end, half[other], flat):
                continue
            if not _enters(start, start, half[other], flat):
                hidden[target] = True
                break


@compiled(error_model="numpy")
def _enters(start: FloatArray, end: FloatArray, half: FloatArray, flat: bool) -> bool:
    """Whether a segment, in a box's own axes, has a point in the box; on the plane only if `flat`."""
    first, last = 0.0, 1.0
    for axis in range(3):
        if flat and axis == 1:
            continue
        along = end[axis] - start[axis]
        if along == 0:
            if not abs(start[axis]) <= half[axis]:
                return False
            continue
        low, high = (-half[axis] - start[axis]) / along, (half[axis] - start[axis]) / along
        if not (low <= high or high <= low):  # a size or a heading that is not known
            return False
        first, last = max(first, min(low, high)), min(last, max(low, high))
    return first <= last


def observe(
    layout: Layout, camera: Camera, detector: Detector = PERFECT, rng: np.random.Generator | None = None
) -> tuple[Snapshot, tuple[str | None, ...]]:
    """One snapshot of one layout, and the label that each detection really is (None for a false one).

    Raises:
        OptionError: layout or camera is a batch, or the detector is random and no generator was given.
    """
    shape = layout.batch_shape + camera.batch_shape
    if shape:
        raise OptionError("layout, camera", "must be one of each (for batches: observe_many)", shape)
    batch = observe_many(layout, camera, detector, rng)
    return batch.snapshot(0), batch.true_labels(0, layout.labels)


def observe_many(
    layout: Layout, camera: Camera, detector: Detector = PERFECT, rng: np.random.Generator | None = None
) -> SnapshotBatch:
    """Snapshots of many layouts from many cameras at once.

    Detections stand in the order in which the camera sees them, from left to right, so that their order
    reveals nothing of their labels.

    Args:
        layout: its batch shape broadcasts with the camera's. L layouts seen from each of C cameras: give
            the poses the shapes (L, 1, N, 2) and (L, 1, N).
        camera: one camera or a batch.
        detector: what goes wrong.
        rng: where the randomness comes from; not needed by a detector without any.

    Returns:
        The B snapshots, flattened in C order, with `truth` as indices into the layout's labels.

    Raises:
        OptionError: the detector is random and no generator was given.
    """
    if rng is None and detector.random:
        raise OptionError("rng", "must be a numpy random Generator for a detector with noise", None)
    shape = np.broadcast_shapes(layout.batch_shape, camera.batch_shape)
    cameras = _flat_camera(camera, shape)
    n, b = len(layout), math.prod(shape)
    seen = np.broadcast_to(visible(layout, camera, detector.occlusion, detector.whole), (*shape, n)).reshape(
        b, n
    )
    found: _Found = {
        "label": np.broadcast_to(np.arange(n), (b, n)),
        "category": np.broadcast_to(layout.category_code, (b, n)),
        "position": np.broadcast_to(layout.position, (*shape, n, 2)).reshape(b, n, 2),
        "yaw": np.broadcast_to(layout.yaw, (*shape, n)).reshape(b, n),
        "size": np.broadcast_to(layout.size, (b, n, 3)),
        "elevation": np.broadcast_to(layout.elevation, (b, n)),
    }
    if layout.tilt is not None:
        found["tilt"] = np.broadcast_to(layout.tilt, (b, n, 2))
    if rng is not None and detector.random:
        seen, found = _detect(seen, found, layout, cameras, detector, rng)
    order, count = _left_to_right(seen, found["position"], cameras)
    packed = {name: _take(values, order) for name, values in found.items()}
    truth = packed.pop("label")
    return SnapshotBatch.trusted(
        camera=cameras, count=count, categories=layout.categories, truth=truth, **packed
    )


def _detect(
    seen: BoolArray,
    found: _Found,
    layout: Layout,
    cameras: Camera,
    detector: Detector,
    rng: np.random.Generator,
) -> tuple[BoolArray, _Found]:
    """What the detector makes of what is in view: noise, misses, false detections, unknown categories."""
    seen = seen & (rng.random(seen.shape) >= detector.miss_rate)
    found = dict(found)
    found["position"] = found["position"] + rng.normal(0.0, detector.position_sd, found["position"].shape)
    found["yaw"] = found["yaw"] + rng.normal(0.0, detector.yaw_sd, found["yaw"].shape)
    scale = 1.0 + rng.normal(0.0, detector.size_sd, found["size"].shape)
    found["size"] = found["size"] * np.maximum(scale, 0.05)
    if detector.false_rate > 0 and len(layout):
        extra, ghosts = _false_detections(layout, cameras, detector.false_rate, rng)
        seen = np.concatenate([seen, extra], axis=1)
        found = {name: np.concatenate([values, ghosts[name]], axis=1) for name, values in found.items()}
    unknown = rng.random(seen.shape) < detector.unknown_rate
    found["category"] = np.where(unknown, UNKNOWN, found["category"])
    return seen, found


def _false_detections(
    layout: Layout, cameras: Camera, rate: float, rng: np.random.Generator
) -> tuple[BoolArray, _Found]:
    """Detections of nothing, uniform over the plane in view: which of them exist, and their values."""
    number = rng.poisson(rate, len(cameras.yaw))
    shape = (len(number), int(number.max(initial=0)))
    fov = cameras.fov
    angle = cameras.yaw[:, None] + rng.uniform(-fov.left, fov.right, shape)
    reach = fov.range_m * np.sqrt(rng.random(shape))
    like = rng.integers(len(layout), size=shape)
    ghosts: _Found = {
        "label": np.full(shape, UNKNOWN),
        "category": layout.category_code[like],
        "position": cameras.position[:, None] + reach[..., None] * direction(angle),
        "yaw": rng.uniform(-np.pi, np.pi, shape),
        "size": layout.size[like],
        "elevation": layout.elevation[like],
    }
    if layout.tilt is not None:
        ghosts["tilt"] = layout.tilt[like]
    return np.arange(shape[1]) < number[:, None], ghosts


def _left_to_right(seen: BoolArray, position: FloatArray, cameras: Camera) -> tuple[IntArray, IntArray]:
    """(B, K) columns of what is seen, from left to right, then of what is not; (B,) how many are seen."""
    angle = np.where(seen, bearing(cameras.position, cameras.yaw, position), np.inf)
    count = seen.sum(axis=1)
    widest = int(count.max(initial=0))
    return np.argsort(angle, axis=1, kind="stable")[:, :widest], count


def _take(values: npt.NDArray[Any], order: IntArray) -> npt.NDArray[Any]:
    index = order.reshape(order.shape + (1,) * (values.ndim - 2))
    return np.take_along_axis(values, index, axis=1)


def _flat_camera(camera: Camera, shape: tuple[int, ...]) -> Camera:
    height = None if camera.height is None else np.broadcast_to(camera.height, shape).reshape(-1)
    return Camera(
        position=np.broadcast_to(camera.position, (*shape, 2)).reshape(-1, 2),
        yaw=np.broadcast_to(camera.yaw, shape).reshape(-1),
        fov=camera.fov,
        height=height,
        pitch=np.broadcast_to(camera.pitch, shape).reshape(-1),
    )


def _raised(position: FloatArray, height: FloatArray) -> FloatArray:
    """(..., 3) points at heights (...) above points (..., 2) of the plane, broadcast together."""
    return np.stack(np.broadcast_arrays(position[..., 0], height, position[..., 1]), axis=-1)
