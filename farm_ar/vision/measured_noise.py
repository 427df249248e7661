"""The oracle with errors as large and as frequent as those that were measured on pictures of the farm."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.game_logic import visibility
from farm_ar.game_logic.headset import field_of_view, random_camera
from farm_ar.game_logic.perception import Perceived
from farm_ar.geometry import bearing, deepest_overlap, heading, wrap
from farm_ar.scenes import (
    Camera,
    Detections,
    Layout,
    Scene,
    Snapshot,
    SnapshotBatch,
    Uncertainty,
    builtin_scene,
)
from farm_ar.vision.canonical import azimuth
from farm_ar.vision.frames import errors
from farm_ar.vision.perception import SIZE, PixelPerception, view_of

FILE = Path(__file__).parent / "models" / "measured.json"
"""What was measured; `benchmarks/measured_noise.py` makes it."""


@dataclass(frozen=True, eq=False)
class MeasuredNoise:
    """Errors of poses from pixels, by distance.

    Args:
        edges: (D - 1,) metres from the eye on the plane, between classes of distance.
        miss: (D,) share of the objects in the picture that is not found.
        flip: (D,) share of those found whose yaw is more than 90 degrees off.
        bias: (D, 3) mean error of the rest: away from the eye and to its side, metres; of the yaw, radians.
        covariance: (D, 3, 3) of it.
        false_rate: detections of nothing, a picture.
        found_rate: detections of something, a picture.
    """

    edges: FloatArray
    miss: FloatArray
    flip: FloatArray
    bias: FloatArray
    covariance: FloatArray
    false_rate: float
    found_rate: float

    @property
    def precision(self) -> float:
        """Share of the detections that are of something."""
        return self.found_rate / (self.found_rate + self.false_rate)

    def uncertainty(self, offset: FloatArray, yaw: FloatArray) -> Uncertainty:
        """What is known of the errors of detections at offsets (..., 2) from the eye, with headings (...)."""
        kind = np.searchsorted(self.edges, np.linalg.norm(offset, axis=-1))
        # From (away from the eye, to its side, yaw) to (x, z, yaw).
        toward = heading(offset)
        sine, cosine = np.sin(toward), np.cos(toward)
        turn = np.zeros((*kind.shape, 3, 3))
        turn[..., 0, 0], turn[..., 0, 1], turn[..., 1, 0], turn[..., 1, 1] = sine, cosine, cosine, -sine
        turn[..., 2, 2] = 1.0
        covariance = turn @ self.covariance[kind] @ np.swapaxes(turn, -1, -2)
        covariance = (covariance + np.swapaxes(covariance, -1, -2)) / 2
        flip = np.minimum(self.flip[kind], 0.5)
        return Uncertainty(covariance, np.ones(kind.shape), wrap(yaw + np.pi), flip)

    def for_sizes(self, size: FloatArray) -> MeasuredNoise:
        """The same of objects of other sizes, which look as large from a distance larger by as much.

        Args:
            size: (N, 3) sides of the objects, metres; lengths go with the mean of their logarithms.
        """
        farm = builtin_scene("farm").layout
        factor = float(np.exp(np.log(size).mean() - np.log(farm.size[farm.movable]).mean()))
        unit = np.array([factor, factor, 1.0])
        return replace(
            self,
            edges=self.edges * factor,
            bias=self.bias * unit,
            covariance=self.covariance * np.outer(unit, unit),
        )

    def sd(self, away: float) -> tuple[float, float]:
        """SD at a distance of the place, in its worse direction, and of the heading, metres and radians."""
        covariance = self.covariance[np.searchsorted(self.edges, away)]
        return float(np.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[1])), float(np.sqrt(covariance[2, 2]))

    def missed(self, away: FloatArray, uniform: FloatArray) -> BoolArray:
        """Which objects at distances (...) are not found, by uniform random numbers (...)."""
        return np.asarray(uniform < self.miss[np.searchsorted(self.edges, away)])

    def errors(self, offset: FloatArray, normal: FloatArray, uniform: FloatArray) -> FloatArray:
        """Errors of the objects that are found.

        Args:
            offset: (..., 2) of them from the eye, metres.
            normal: (..., 3) standard normal random numbers.
            uniform: (...) uniform ones, which say whose heading is turned by half.

        Returns:
            (..., 3) of x, z and yaw, metres and radians.
        """
        kind = np.searchsorted(self.edges, np.linalg.norm(offset, axis=-1))
        root = np.linalg.cholesky(self.covariance + 1e-18 * np.eye(3))
        error = self.bias[kind] + np.einsum("...ij,...j->...i", root[kind], normal)
        yaw = error[..., 2] + np.pi * (uniform < self.flip[kind])
        toward = heading(offset)
        sine, cosine = np.sin(toward), np.cos(toward)
        x = sine * error[..., 0] + cosine * error[..., 1]
        z = cosine * error[..., 0] - sine * error[..., 1]
        return np.stack([x, z, yaw], axis=-1)

    @classmethod
    def from_json(cls, document: dict[str, Any]) -> MeasuredNoise:
        """From a file."""
        edges, miss, flip, bias, covariance = (
            np.array(document[name], float) for name in ("edges", "miss", "flip", "bias", "covariance")
        )
        # The classes of distance have equally many things.
        found = document["things"] / document["pictures"] * (1 - miss.mean())
        return cls(edges, miss, flip, bias, covariance, float(document["false_rate"]), float(found))


@lru_cache(maxsize=1)
def measured_noise() -> MeasuredNoise:
    """What was measured with the estimator that comes with the package."""
    return MeasuredNoise.from_json(json.loads(FILE.read_text()))


@dataclass(frozen=True)
class MeasuredPerception:
    """True poses of what is in the picture, with measured errors."""

    def perceive(self, truth: Layout, camera: Camera, rng: np.random.Generator) -> Perceived:
        """The snapshot that the camera takes of the objects where they truly are."""
        noise, eye = measured_noise(), view_of(camera)
        source = np.flatnonzero(in_picture(truth, camera))
        offset = truth.position[source] - camera.position
        found = ~noise.missed(np.linalg.norm(offset, axis=1), rng.random(len(source)))
        source = source[found]
        error = noise.errors(offset[found], rng.standard_normal((len(source), 3)), rng.random(len(source)))
        position, yaw = truth.position[source] + error[:, :2], wrap(truth.yaw[source] + error[:, 2])
        numbers, ghosts = _with_false(source, truth, camera, noise, rng)
        position = np.concatenate([position, ghosts[:, :2]])
        yaw = np.concatenate([yaw, ghosts[:, 2]])
        of = np.concatenate([source, np.full(len(ghosts), -1)])
        order = np.argsort(wrap(azimuth(eye, position) - camera.yaw), kind="stable")
        like = numbers[order]
        detections = Detections(
            tuple(truth.category[i] for i in like),
            position[order],
            yaw[order],
            truth.size[like],
            truth.elevation[like],
            confidence=np.full(len(like), noise.precision),
            uncertainty=noise.uncertainty(position[order] - camera.position, yaw[order]),
        )
        return Perceived(Snapshot(camera, detections), of[order])


def disturbed(
    batch: SnapshotBatch, labels: int, noise: MeasuredNoise, rng: np.random.Generator
) -> SnapshotBatch:
    """Snapshots of exact poses with measured errors and misses; detections of nothing are not added.

    Args:
        batch: B snapshots whose truth is known, each detection of a label.
        labels: how many there are: each has its random numbers, whatever else is in view.
        noise: how large and how frequent the errors are.
        rng: where the randomness comes from.
    """
    assert batch.truth is not None
    rows, of = np.arange(len(batch))[:, None], batch.truth
    uniform, normal = rng.random((2, len(batch), labels)), rng.standard_normal((len(batch), labels, 3))
    offset = batch.position - batch.camera.position[:, None]
    there = np.arange(of.shape[1]) < batch.count[:, None]
    there &= ~noise.missed(np.linalg.norm(offset, axis=-1), uniform[0][rows, of])
    error = noise.errors(offset, normal[rows, of], uniform[1][rows, of])
    position = batch.position + error[..., :2]
    angle = np.where(there, bearing(batch.camera.position, batch.camera.yaw, position), np.inf)
    order = np.argsort(angle, axis=1, kind="stable")
    values = {name: getattr(batch, name) for name in ("category", "size", "elevation", "truth", "tilt")}
    values |= {"position": position, "yaw": wrap(batch.yaw + error[..., 2])}
    taken: dict[str, Any] = {
        name: None if value is None else value[rows, order] for name, value in values.items()
    }
    known = noise.uncertainty(taken["position"] - batch.camera.position[:, None], taken["yaw"])
    return replace(batch, count=there.sum(axis=1), uncertainty=known, **taken)


def _with_false(
    source: IntArray, truth: Layout, camera: Camera, noise: MeasuredNoise, rng: np.random.Generator
) -> tuple[IntArray, FloatArray]:
    """Which object each detection is like; (G, 3) poses of those of nothing."""
    count = int(rng.poisson(noise.false_rate))
    like = rng.choice(np.flatnonzero(truth.movable), count)
    across = rng.uniform(-camera.fov.left, camera.fov.right, count) + camera.yaw
    away = rng.uniform(0.4, 1.3, count)
    place = camera.position + away[:, None] * np.column_stack([np.sin(across), np.cos(across)])
    return np.concatenate([source, like]), np.column_stack([place, rng.uniform(-np.pi, np.pi, count)])


def in_picture(truth: Layout, camera: Camera) -> BoolArray:
    """(N,) which objects the camera has in view with their pivot in its picture."""
    seen: BoolArray = visibility.seen_by(camera, truth)[0]
    view = view_of(camera)
    pivot = np.insert(truth.position, 1, truth.elevation, axis=1)
    column, row = view.pixels(pivot).T
    width, height = SIZE
    before = view.axes(pivot)[:, 2] > 0
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    return np.asarray(seen & before & inside)


def measure(
    perception: PixelPerception, moments: list[tuple[Layout, Camera]], seed: int, classes: int = 5
) -> dict[str, Any]:
    """Errors of poses from pictures of moments, by distance, as a file holds them.

    Args:
        perception: that takes the pictures.
        moments: what stands where, and the camera.
        seed: of the sensor's noise.
        classes: of distance, with equally many objects in each.
    """
    rng = np.random.default_rng(seed)
    rows, false = [], 0
    for truth, camera in moments:
        seen = in_picture(truth, camera)
        perceived = perception.perceive(truth, camera, rng)
        found, view = perceived.snapshot.detections, view_of(camera)
        false += int((perceived.source < 0).sum())
        for k in np.flatnonzero(seen):
            away = float(np.linalg.norm(truth.position[k] - camera.position))
            mine = np.flatnonzero(perceived.source == k)
            error = np.full(3, np.nan)
            if len(mine):
                pose = np.column_stack([found.position[mine], found.yaw[mine]])
                error = errors(view, pose, np.array([[*truth.position[k], truth.yaw[k]]]))[0]
            rows.append((away, *error))
    table = np.array(rows)
    edges = np.quantile(table[:, 0], np.arange(1, classes) / classes).round(3)
    return _summary(table[:, 0], table[:, 1:], edges) | {
        "false_rate": false / len(moments),
        "pictures": len(moments),
        "things": len(table),
    }


def _summary(away: FloatArray, error: FloatArray, edges: FloatArray) -> dict[str, Any]:
    kind = np.asarray(np.searchsorted(edges, away))
    missed = np.asarray(~np.isfinite(error).all(axis=1))
    flipped = np.asarray(np.abs(error[:, 2]) > np.pi / 2)
    found: dict[str, list[Any]] = {name: [] for name in ("miss", "flip", "bias", "covariance")}
    for k in range(len(edges) + 1):
        here = np.equal(kind, k)
        good = error[here & ~missed & ~flipped]
        found["miss"].append(float(missed[here].mean()))
        found["flip"].append(float(flipped[here & ~missed].mean()))
        found["bias"].append(good.mean(axis=0).tolist())
        found["covariance"].append(np.cov(good.T).tolist())
    return {"edges": edges.tolist(), **found}


def moments_of(
    scene: Scene, count: int, seed: int, moved: float = 0.07, turned: float = float(np.deg2rad(25))
) -> list[tuple[Layout, Camera]]:
    """Moments of visits to a scene: movable objects around their homes but not in one another; cameras.

    Args:
        scene: with their homes.
        count: how many.
        seed: of them all.
        moved: SD of x and of z, metres.
        turned: SD of the heading, radians.
    """
    layout, found = scene.layout, []
    for number in range(count):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
        position, yaw = layout.position.copy(), layout.yaw.copy()
        for k in rng.permutation(np.flatnonzero(layout.movable)):
            kept = position[k].copy(), yaw[k]
            shifted = position[k] + moved * rng.standard_normal(2)
            position[k] = np.clip(shifted, 0.05, np.array(scene.size) - 0.05)
            yaw[k] += turned * rng.standard_normal()
            if deepest_overlap(position, yaw, layout.size) > 0:
                position[k], yaw[k] = kept
        camera = random_camera(scene, field_of_view("photo"), rng)
        found.append((layout.placed(position, yaw), camera))
    return found
