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

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.rendering import Mesh, View
from farm_ar.rendering.kernels import Lens, rasterise
from farm_ar.rendering.renderer import lens_of
from farm_ar.structs import Structs
from farm_ar.vision.base import Image, size_of
from farm_ar.vision.refinement_kernels import (
    Around,
    Eye,
    Pieces,
    background,
    best_of,
    cost_of,
    pixels_of,
    search,
)

MOST_FACES = 20_000
"""Of a mesh; what has more is not refined."""

_MOST_PIECES = 48

_AROUND_PX = 6
"""Pixels around a thing that are compared."""


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
    """Where N objects may stand.

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
    """Refine the poses of objects that an image shows.

    Args:
        image: (H, W, 3).
        camera: its camera.
        solids: of each category.
        guesses: where N objects may stand.
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
        before, number = stage.refine(k, _SECOND_STEP, 4), stage.pixels[k]
        if guesses.flipped[k] >= TRIED:
            kept = stage.pose[k].copy()
            stage.pose[k, 2] += np.pi
            stage.seek(k)
            after = stage.refine(k, _FIRST_STEP, 6)
            opposite[k], stage.pose[k] = stage.pose[k], kept
            flip[k] = (after - before) / max(number, 1)
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
        self.pixels = np.zeros(len(solids), np.int64)
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
        costs = [float(search(pose, steps, 2, *view)) for pose in best]
        self.pose[k] = best[int(np.argmin(costs))]

    def refine(self, k: int, step: FloatArray, halvings: int) -> float:
        """Search around a thing's pose; the cost that was found, compared with the background, nats.

        Its number of pixels is kept in `pixels`.
        """
        view = self._around(k)
        if view is None:
            self.pixels[k] = 0
            return 0.0
        scale = float(self.solids[k].size.max())
        steps = step * np.array([scale, scale, 1.0])
        pose = self.pose[k].copy()
        cost = search(pose, steps, halvings, *view)
        self.pose[k] = pose
        self.pixels[k] = pixels_of(pose, *view[:2], view[2][0])
        return float(cost)

    def look_at(self, k: int) -> tuple[float, float, list[float]]:
        """Gain a pixel, share that is seen, and curvature of the cost along x, z and yaw."""
        view = self._around(k)
        if view is None:
            return 0.0, 0.0, [0.0] * 3
        pose = self.pose[k]
        here, number = float(cost_of(pose, *view)), pixels_of(pose, *view[:2], view[2][0])
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
        without = background(here, region, own > nearness, numbers)
        local = (solid.corners, solid.piece, int(solid.piece.max()) + 1)
        return local, (self.camera.eye, self._turn, lens), (nearness, here, without)


def _placed(corners: FloatArray, pose: FloatArray) -> FloatArray:
    cosine, sine = np.cos(pose[2]), np.sin(pose[2])
    turn = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    placed: FloatArray = corners @ turn.T + np.array([pose[0], 0.0, pose[1]])
    return placed
