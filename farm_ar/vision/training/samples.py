"""Samples to learn from: an image of the network's size, and what stands where in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.geometry import wrap
from farm_ar.rendering import Instance, Mesh, Renderer, View
from farm_ar.rendering.kernels import rasterise
from farm_ar.rendering.renderer import lens_of
from farm_ar.vision.base import Image
from farm_ar.vision.canonical import HEIGHT, PADDING, STRIDE, WIDTH, azimuth
from farm_ar.vision.training.scenes import RandomScene, Stage

COLUMNS = ("category", "u", "v", "foot_u", "foot_v", "yaw", "visible", "extent")
"""Of a thing in a sample: what it is; pixels of its middle, kept within the image, and of its foot; heading
relative to the ray from the eye; share that is seen; extent of its box in the image, pixels."""


@dataclass(frozen=True, eq=False)
class Sample:
    """An image and what is to be learnt of it.

    Args:
        image: (`HEIGHT`, `WIDTH`, 3).
        things: (N, 8) of `COLUMNS`.
        foreground: (H, W) of cells: share that shows objects, 0 to 255.
        window: (4,) first and last column, first and last row of the pixels that are not padding.
    """

    image: Image
    things: npt.NDArray[np.float32]
    foreground: npt.NDArray[np.uint8]
    window: IntArray


class Samples:
    """Sample number k of a seed is always the same.

    Args:
        meshes: of each category.
        seed: of all samples.
    """

    def __init__(self, meshes: Mapping[str, Mesh], seed: int = 0) -> None:
        self.stage, self._seed = Stage(meshes), seed

    def __getitem__(self, number: int) -> Sample:
        rng = np.random.default_rng(np.random.SeedSequence(self._seed, spawn_key=(number,)))
        scene = self.stage.scene(rng)
        renderer = Renderer([*scene.rest, *scene.things], scene.light, rng.uniform(0, 255, 3).tolist())
        picture = renderer.draw(scene.view)
        window = _window(rng)
        image = cv2.resize(picture.rgb, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
        image = padded(photographed(np.asarray(image, np.uint8), rng), window)
        of_thing = ((picture.ids >= 0) & (picture.ids < len(scene.things))).astype(np.float32)
        cells = (WIDTH // STRIDE, HEIGHT // STRIDE)
        share = np.asarray(cv2.resize(of_thing, cells, interpolation=cv2.INTER_AREA))
        things = labels_of(scene, picture.ids, window)
        return Sample(image, things, np.rint(255 * share).astype(np.uint8), window)


def labels_of(scene: RandomScene, ids: npt.NDArray[np.int32], window: IntArray) -> npt.NDArray[np.float32]:
    """(N, 8) `COLUMNS` of the objects in a scene whose picture has some ids."""
    if not scene.things:
        return np.empty((0, len(COLUMNS)), np.float32)
    view, small = scene.view, scene.view.intrinsics.resized(WIDTH, HEIGHT)
    flat = replace(view, intrinsics=small)
    left, right, top, bottom = window.tolist()
    more = view.intrinsics.width / WIDTH
    down, across = (slice(round(a * more), round((b + 1) * more)) for a, b in ((top, bottom), (left, right)))
    inside = ids[down, across]
    seen = np.bincount(inside[inside >= 0].clip(0, len(scene.things)), minlength=len(scene.things) + 1)
    whole = pixels_alone(scene.things, view)
    rows = []
    for k, thing in enumerate(scene.things):
        foot = thing.position
        tall = float(thing.mesh.bounds[1, 1])
        middle, ground = flat.pixels(np.array([foot + np.array([0, tall / 2, 0]), foot]))
        corners = flat.pixels(thing.corners.reshape(-1, 3))
        extent = float(np.sqrt(np.prod(np.ptp(corners, axis=0).clip(1, 1e3))))
        relative = float(wrap(thing.yaw - azimuth(view, foot[[0, 2]])))
        u, v = np.clip(middle, (left + 2, top + 2), (right - 2, bottom - 2))
        visible = min(seen[k] / max(whole[k], 1.0), 1.0)
        rows.append((scene.category[k], u, v, *ground, relative, visible, extent))
    return np.array(rows, np.float32)


def pixels_alone(things: list[Instance], view: View) -> FloatArray:
    """(N,) how many pixels each thing would cover, were it alone and the image without edges."""
    small = view.intrinsics.resized(WIDTH // 2, HEIGHT // 2)
    of_one = (view.intrinsics.width / small.width) ** 2
    wide = replace(
        small,
        cx=small.cx + small.width / 2,
        cy=small.cy + small.height / 2,
        width=2 * small.width,
        height=2 * small.height,
    )
    canvas = replace(view, intrinsics=wide)
    lens = lens_of(canvas)
    found = []
    for thing in things:
        nearness = np.zeros((wide.height, wide.width), np.float32)
        rasterise(canvas.axes(thing.corners), lens, 0, nearness, np.empty(nearness.shape, np.int32))
        found.append(np.count_nonzero(nearness) * of_one)
    return np.array(found)


def photographed(image: Image, rng: np.random.Generator) -> Image:
    """The image as some camera takes it: light that falls unevenly, gain, tint, gamma, blur, noise, JPEG."""
    value = image.astype(np.float32) / 255
    if rng.random() < 0.6:
        uneven = rng.uniform(0, 0.3) * rng.standard_normal((4, 6), dtype=np.float32)
        size = (image.shape[1], image.shape[0])
        field = np.asarray(cv2.resize(uneven, size, interpolation=cv2.INTER_CUBIC))
        value *= np.exp(field)[..., None]
    gain = rng.uniform(0.7, 1.35) if rng.random() < 0.75 else rng.uniform(0.25, 0.7)
    value *= gain * (1 + rng.uniform(0, 0.12) * rng.standard_normal(3)).astype(np.float32)
    if rng.random() < 0.3:
        value = np.maximum(value, 0) ** np.float32(rng.uniform(0.6, 1.6))
    if rng.random() < 0.15:
        grey = value.mean(axis=2, keepdims=True)
        value = grey + np.float32(rng.uniform(0, 0.6)) * (value - grey)
    if rng.random() < 0.5:
        value = np.asarray(cv2.GaussianBlur(value, (0, 0), rng.uniform(0.2, 1.1)))
    noise = rng.uniform(0, 8 if rng.random() < 0.75 else 14) / 255
    value = value + np.float32(noise) * rng.standard_normal(value.shape, dtype=np.float32)
    if rng.random() < 0.2:  # single bright pixels
        lit = rng.random(value.shape[:2]) < rng.uniform(0.001, 0.02)
        value[lit] += rng.uniform(0.05, 0.5, (int(lit.sum()), 1)).astype(np.float32)
    seen = np.clip(np.rint(255 * value), 0, 255).astype(np.uint8)
    if rng.random() < 0.6:
        quality = int(rng.integers(40, 96))
        _, data = cv2.imencode(".jpg", seen, [cv2.IMWRITE_JPEG_QUALITY, quality])
        seen = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)
    return seen


def padded(image: Image, window: IntArray) -> Image:
    """The image with grey outside of a window."""
    left, right, top, bottom = window.tolist()
    whole = np.full_like(image, PADDING)
    whole[top : bottom + 1, left : right + 1] = image[top : bottom + 1, left : right + 1]
    return whole


def _window(rng: np.random.Generator) -> IntArray:
    """Which part of the canonical image a camera covers: all but 6 rows at the top and bottom, mostly."""
    kind = rng.random()
    if kind < 0.85:
        return np.array([0, WIDTH - 1, 6, HEIGHT - 7])
    if kind < 0.93:
        return np.array([0, WIDTH - 1, 0, HEIGHT - 1])
    across, down = int(rng.integers(0, 60)), int(rng.integers(0, 30))
    return np.array([across, WIDTH - 1 - across, down, HEIGHT - 1 - down])
