"""Refinement of poses by analysis by synthesis: things are rendered where they may stand, with neighbours.

No colour need be known. Where a thing stands right, each of its flat pieces is of about one colour,
and what is around it is not: pixels are described by the mean colour and the variance of their piece, or by
those of the background around them, and the pose is the one under which they are most probable (region
competition, Zhu and Yuille 1996).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.rendering import Mesh, View
from farm_ar.rendering.kernels import Faces, Lens, Nearness, rasterise
from farm_ar.rendering.renderer import lens_of
from farm_ar.structs import Structs
from farm_ar.vision.base import Image, size_of

MOST_FACES = 20_000
"""Of a mesh; what has more is not refined."""

_MOST_PIECES = 48
_VARIANCE = 30.0
"""That of a colour on one piece, at the least, of 255 squared: noise."""

_RING_PX = 9
"""How far around a pixel the background is looked at."""

_AROUND_PX = 6
"""Pixels around a thing that are compared."""

_OWN_COLOUR = 4.0
"""What a piece costs whose colour is not known before, nats."""

Pieces = tuple[FloatArray, IntArray, int]
"""Corners and pieces of a thing, and how many pieces there are."""

Eye = tuple[FloatArray, FloatArray, Structs[Lens]]
"""Where the camera is, its axes in the world, and its lens."""

Around = tuple[Nearness, Nearness, Nearness]
"""(H, W) nearness of other things, (H, W, 3) the image, (H, W) what each pixel costs without the thing."""

_compile = compiled(error_model="numpy")


@dataclass(frozen=True, eq=False)
class Solid:
    """A mesh for refinement.

    Args:
        corners: (F, 3, 3) metres.
        piece: (F,) the flat piece of one colour that each triangle is of; the last for all small ones.
        size: (3,) width, height and depth, metres.
    """

    corners: FloatArray
    piece: IntArray
    size: FloatArray

    @classmethod
    def of(cls, mesh: Mesh) -> Solid:
        """Of a mesh: triangles of one part, direction and colour are one piece."""
        across = np.cross(mesh.corners[:, 1] - mesh.corners[:, 0], mesh.corners[:, 2] - mesh.corners[:, 0])
        area = np.linalg.norm(across, axis=1)
        normal = across / np.maximum(area, 1e-300)[:, None]
        keys = np.column_stack([mesh.part, np.rint(2 * normal), np.rint(mesh.colour / 24)]).astype(np.int64)
        _, piece = np.unique(keys, axis=0, return_inverse=True)
        piece = piece.reshape(-1)
        share = np.bincount(piece, area) / area.sum()
        order = np.argsort(-share, kind="stable")
        rank = np.empty_like(order)
        rank[order] = np.arange(len(order))
        kept = min(_MOST_PIECES, int((share > 0.002).sum()))
        return cls(mesh.corners, np.minimum(rank, kept)[piece], size_of(mesh))


@dataclass(frozen=True, eq=False)
class Refined:
    """What refinement found.

    Args:
        pose: (N, 3) x, z and yaw, metres and radians.
        gain: (N,) how much more probable the pixels are with the thing than without it, nats a pixel.
        seen: (N,) share of its pixels that no other thing hides and that are in the image.
        curvature: (N, 3) of the cost along x, z and yaw, nats per square metre or radian.
        flip: (N,) by how much the opposite heading costs more, nats a pixel; NaN where it was not tried.
        opposite: (N, 3) the refined pose of the opposite heading; NaN likewise.
    """

    pose: FloatArray
    gain: FloatArray
    seen: FloatArray
    curvature: FloatArray
    flip: FloatArray
    opposite: FloatArray


@dataclass(frozen=True, eq=False)
class Guesses:
    """Where N things may stand.

    Args:
        category: of each.
        pose: (N, 3) x, z and yaw, metres and radians.
        flipped: (N,) probability that a heading is the opposite; from `TRIED` on both are tried.
        reach: (N,) how far off a place may be, metres.
        sure: (N,) whether there is such a thing, probably; what is not hides nothing.
    """

    category: tuple[str, ...]
    pose: FloatArray
    flipped: FloatArray
    reach: FloatArray
    sure: BoolArray


def refine(image: Image, camera: View, solids: Mapping[str, Solid], guesses: Guesses) -> Refined:
    """Refine the poses of things that an image shows.

    Args:
        image: (H, W, 3).
        camera: its camera.
        solids: of each category.
        guesses: where N things may stand.
    """
    stage = _Stage(image, camera, [solids[name] for name in guesses.category], guesses)
    count = len(guesses.pose)
    opposite, flip = np.full((count, 3), np.nan), np.full(count, np.nan)
    away = np.linalg.norm(guesses.pose[:, :2] - camera.eye[[0, 2]], axis=1)
    order = np.argsort(away, kind="stable").tolist()
    for k in order:
        stage.seek(k)
        stage.refine(k, _FIRST_STEP, 5)
    for k in order:
        before = stage.refine(k, _SECOND_STEP, 4)
        if guesses.flipped[k] >= TRIED:
            kept = stage.pose[k].copy()
            stage.pose[k, 2] += np.pi
            stage.seek(k)
            after = stage.refine(k, _FIRST_STEP, 6)
            opposite[k], stage.pose[k] = stage.pose[k], kept
            flip[k] = (after - before) / max(stage.pixels(k), 1)
    found = [stage.look_at(k) for k in range(count)]
    gain, seen, curvature = (np.array([one[i] for one in found]) for i in range(3))
    return Refined(stage.pose, gain, seen, curvature.reshape(count, 3), flip, opposite)


TRIED = 0.05
_STARTS = 3
_FIRST_STEP, _SECOND_STEP = np.array([0.04, 0.04, 0.07]), np.array([0.01, 0.01, 0.02])
"""Shares of a thing's largest side, and radians."""


class _Stage:
    """The image, and where things are thought to stand."""

    def __init__(self, image: Image, camera: View, solids: list[Solid], guesses: Guesses) -> None:
        fewer = max(1, int(camera.intrinsics.width // 640))
        if fewer > 1:
            lens = camera.intrinsics.resized(
                camera.intrinsics.width // fewer, camera.intrinsics.height // fewer
            )
            image = np.asarray(
                cv2.resize(image, (lens.width, lens.height), interpolation=cv2.INTER_AREA), np.uint8
            )
            camera = View(lens, camera.eye, camera.yaw, camera.pitch, camera.roll)
        self.camera, self.solids, self.pose = camera, solids, np.array(guesses.pose, dtype=np.float64)
        self._reach, self._sure = guesses.reach, guesses.sure
        self._image = image.astype(np.float32)
        self._turn = np.ascontiguousarray(camera.rotation)

    def seek(self, k: int) -> None:
        """Move a thing to the best of some poses within reach, mostly farther and nearer along the ray."""
        reach = float(self._reach[k])
        view = self._around(k, reach)
        if view is None:
            return
        to = self.pose[k, :2] - self.camera.eye[[0, 2]]
        toward = to / max(float(np.linalg.norm(to)), 1e-9)
        best = np.empty((_STARTS, 3))
        best_of(self.pose[k], toward, reach, best, *view)
        steps = _FIRST_STEP * np.array([self.solids[k].size.max(), self.solids[k].size.max(), 1.0])
        costs = [float(search(pose, steps, 3, *view)) for pose in best]
        self.pose[k] = best[int(np.argmin(costs))]

    def refine(self, k: int, step: FloatArray, halvings: int) -> float:
        """Search around a thing's pose; the cost that was found, compared with the background, nats."""
        view = self._around(k)
        if view is None:
            return 0.0
        scale = float(self.solids[k].size.max())
        steps = step * np.array([scale, scale, 1.0])
        pose = self.pose[k].copy()
        cost = search(pose, steps, halvings, *view)
        self.pose[k] = pose
        return float(cost)

    def pixels(self, k: int) -> int:
        """How many pixels a thing has in the image."""
        view = self._around(k)
        return 0 if view is None else int((show(self.pose[k], *view[:2], view[2][0]) >= 0).sum())

    def look_at(self, k: int) -> tuple[float, float, list[float]]:
        """Gain a pixel, share that is seen, and curvature of the cost along x, z and yaw."""
        view = self._around(k)
        if view is None:
            return 0.0, 0.0, [0.0] * 3
        pose = self.pose[k]
        here, number = float(cost_of(pose, *view)), self.pixels(k)
        scale = float(self.solids[k].size.max())
        curvature = []
        for axis, step in enumerate((0.015 * scale, 0.015 * scale, 0.03)):
            shift = np.zeros(3)
            shift[axis] = step
            rise = (float(cost_of(pose + shift, *view)) + float(cost_of(pose - shift, *view))) / 2 - here
            curvature.append(2 * rise / step**2)
        return -here / max(number, 1), number / max(self._alone(k), 1), curvature

    def _alone(self, k: int) -> int:
        """Pixels of a thing, were it alone and the image without edges."""
        corners = self.camera.axes(_placed(self.solids[k].corners, self.pose[k]))
        box = self._box(corners, inside=False)
        if box is None:
            return 0
        nearness = np.zeros((box[1] - box[0], box[3] - box[2]), np.float32)
        rasterise(corners, self._lens(box), 0, nearness, np.empty(nearness.shape, np.int32))
        return int(np.count_nonzero(nearness))

    def _box(
        self, corners: FloatArray, inside: bool = True, more: int = 0
    ) -> tuple[int, int, int, int] | None:
        """First and last row and column around a thing; None where it is not in the image."""
        lens = self.camera.intrinsics
        if not (corners[..., 2] > 0.02).all():
            return None
        u = corners[..., 0] / corners[..., 2] * lens.fx + lens.cx
        v = corners[..., 1] / corners[..., 2] * lens.fy + lens.cy
        margin = _AROUND_PX + more
        box = [v.min() - margin, v.max() + margin + 1, u.min() - margin, u.max() + margin + 1]
        if not np.isfinite(box).all() or max(map(abs, box)) > 1e5:
            return None
        top, low, left, right = (int(np.floor(value)) for value in box)
        if inside:
            top, low = max(top, 0), min(low, lens.height)
            left, right = max(left, 0), min(right, lens.width)
        small = low - top < 4 or right - left < 4 or (low - top) * (right - left) > 1_500_000
        return None if small else (top, low, left, right)

    def _lens(self, box: tuple[int, int, int, int]) -> Structs[Lens]:
        lens = lens_of(self.camera)
        lens["cx"] -= box[2]
        lens["cy"] -= box[0]
        return lens

    def _around(self, k: int, reach: float = 0.0) -> tuple[Pieces, Eye, Around] | None:
        """What `search` needs to know of a thing and what is around it."""
        solid = self.solids[k]
        corners = self.camera.axes(_placed(solid.corners, self.pose[k]))
        more = reach * self.camera.intrinsics.fx / max(float(corners[..., 2].min()), 0.1)
        box = self._box(corners, more=round(more))
        if box is None:
            return None
        lens = self._lens(box)
        shape = (box[1] - box[0], box[3] - box[2])
        nearness, face = np.zeros(shape, np.float32), np.full(shape, -1, np.int32)
        pieces, first, numbers = [np.zeros(0, np.int64)], 0, 0
        for j, other in enumerate(self.solids):
            near = 4 * (solid.size.max() + other.size.max())
            if j == k or not self._sure[j] or np.linalg.norm(self.pose[j, :2] - self.pose[k, :2]) > near:
                continue
            place = self.camera.axes(_placed(other.corners, self.pose[j]))
            rasterise(place, lens, first, nearness, face)
            pieces.append(other.piece + numbers)
            first, numbers = first + len(other.corners), numbers + int(other.piece.max()) + 1
        region = np.append(np.concatenate(pieces), -1)[face]
        own = np.zeros(shape, np.float32)
        rasterise(corners, lens, 0, own, np.empty(shape, np.int32))
        here = np.ascontiguousarray(self._image[box[0] : box[1], box[2] : box[3]])
        background = _background(here, region, own > nearness, numbers)
        local = (solid.corners, solid.piece, int(solid.piece.max()) + 1)
        return local, (self.camera.eye, self._turn, lens), (nearness, here, background)


def _placed(corners: FloatArray, pose: FloatArray) -> FloatArray:
    cosine, sine = np.cos(pose[2]), np.sin(pose[2])
    turn = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    placed: FloatArray = corners @ turn.T + np.array([pose[0], 0.0, pose[1]])
    return placed


def _background(
    image: npt.NDArray[np.float32], region: IntArray, own: npt.NDArray[np.bool_], regions: int
) -> npt.NDArray[np.float32]:
    """(H, W) nats that each pixel costs without the thing: as its neighbour's piece, or as what is around."""
    found = np.zeros(image.shape[:2])
    free = ((region < 0) & ~own).astype(np.float32)
    if free.sum() < 8:
        free = (region < 0).astype(np.float32) + np.float32(1e-3)
    window = (2 * _RING_PX + 1,) * 2
    weight = np.asarray(cv2.boxFilter(free, -1, window, normalize=False, borderType=cv2.BORDER_CONSTANT))
    total = free.sum()
    for c in range(3):
        layer = image[..., c]
        first, second = (
            np.asarray(
                cv2.boxFilter(free * power, -1, window, normalize=False, borderType=cv2.BORDER_CONSTANT)
            )
            for power in (layer, layer * layer)
        )
        # The mean of all that is free counts as a few pixels.
        whole, square = float((free * layer).sum() / total), float((free * layer * layer).sum() / total)
        mean = (first + 4 * whole) / (weight + 4)
        variance = np.maximum((second + 4 * square) / (weight + 4) - mean * mean, 0) + _VARIANCE
        nats = 0.5 * np.log(variance) + (layer - mean) ** 2 / (2 * variance)
        if regions:
            of_piece = np.where(region >= 0, region, regions)
            number = np.bincount(of_piece.ravel(), minlength=regions + 1) + 1e-9
            means = np.bincount(of_piece.ravel(), layer.ravel(), regions + 1) / number
            spread = (
                np.bincount(of_piece.ravel(), (layer.ravel() - means[of_piece.ravel()]) ** 2, regions + 1)
                / number
                + _VARIANCE
            )
            theirs = 0.5 * np.log(spread[of_piece]) + (layer - means[of_piece]) ** 2 / (2 * spread[of_piece])
            nats = np.where(region >= 0, theirs, nats)
        found += nats
    return found.astype(np.float32)


@_compile
def cost_of(pose: FloatArray, solid: Pieces, camera: Eye, around: Around) -> float:
    """How improbable pixels are with a thing at a pose, less how improbable they are without it, nats."""
    (_, piece, pieces), (others, image, background) = solid, around
    face = show(pose, solid, camera, others)
    sums = np.zeros((pieces, 7))
    total = 0.0
    for row in range(face.shape[0]):
        for column in range(face.shape[1]):
            k = face[row, column]
            if k < 0:
                continue
            s = piece[k]
            total -= background[row, column]
            sums[s, 0] += 1.0
            for c in range(3):
                value = float(image[row, column, c])
                sums[s, 1 + c] += value
                sums[s, 4 + c] += value * value
    for s in range(pieces):
        number = sums[s, 0]
        if number < 1.0:
            continue
        for c in range(3):
            mean = sums[s, 1 + c] / number
            variance = max(sums[s, 4 + c] / number - mean * mean, 0.0)
            spread = variance + _VARIANCE
            total += 0.5 * number * (np.log(spread) + variance / spread)
        total += _OWN_COLOUR
    return total


@_compile
def show(pose: FloatArray, solid: Pieces, camera: Eye, others: Nearness) -> Faces:
    """(H, W) which triangle of a thing at a pose each pixel shows, -1 for none."""
    (corners, _, _), (eye, turn, lens) = solid, camera
    nearness, face = others.copy(), np.full(others.shape, -1, np.int32)
    place = np.empty_like(corners)
    cosine, sine = np.cos(pose[2]), np.sin(pose[2])
    for k in range(len(corners)):
        for i in range(3):
            x = cosine * corners[k, i, 0] + sine * corners[k, i, 2] + pose[0] - eye[0]
            y = corners[k, i, 1] - eye[1]
            z = cosine * corners[k, i, 2] - sine * corners[k, i, 0] + pose[1] - eye[2]
            for c in range(3):
                place[k, i, c] = turn[c, 0] * x + turn[c, 1] * y + turn[c, 2] * z
    rasterise(place, lens, 0, nearness, face)
    return face


@_compile
def search(
    pose: FloatArray, steps: FloatArray, halvings: int, solid: Pieces, camera: Eye, around: Around
) -> float:
    """Move a pose downhill, with steps that are halved; the cost where it ends. The pose is changed."""
    least = cost_of(pose, solid, camera, around)
    step, trial = steps.copy(), pose.copy()
    for _ in range(halvings):
        for _ in range(3):
            better = False
            for axis in range(3):
                for side in (1.0, -1.0):
                    trial[:] = pose
                    trial[axis] += side * step[axis]
                    cost = cost_of(trial, solid, camera, around)
                    if cost < least:
                        least, better = cost, True
                        pose[:] = trial
                        break
            if not better:
                break
        step *= 0.5
    return least


@_compile
def best_of(
    pose: FloatArray,
    toward: FloatArray,
    reach: float,
    best: FloatArray,
    solid: Pieces,
    camera: Eye,
    around: Around,
) -> None:
    """Fill in those of 45 poses around one that cost least.

    Args:
        pose: (3,) x, z and yaw.
        toward: (2,) unit vector along the ray from the eye on the plane.
        reach: metres.
        best: (S, 3), filled in.
        solid: the thing.
        camera: the camera.
        around: what is around it.
    """
    cost = np.empty(45)
    poses = np.empty((45, 3))
    for n in range(45):
        along, across, turn = n // 9 - 2, n // 3 % 3 - 1, n % 3 - 1
        ahead, beside = 0.5 * reach * along, 0.4 * reach * across
        poses[n, 0] = pose[0] + toward[0] * ahead + toward[1] * beside
        poses[n, 1] = pose[1] + toward[1] * ahead - toward[0] * beside
        poses[n, 2] = pose[2] + 0.25 * turn
        cost[n] = cost_of(poses[n], solid, camera, around)
    for s in range(len(best)):
        n = int(cost.argmin())
        best[s] = poses[n]
        cost[n] = np.inf
