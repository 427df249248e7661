"""Poses from an image: what the network saw, lifted onto the plane, refined, with their uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry import bearing, wrap
from farm_ar.rendering import Instance, Mesh, View
from farm_ar.scenes import Detections
from farm_ar.vision import heads
from farm_ar.vision.base import Image, PoseEstimates, PoseEstimator, check_question, size_of
from farm_ar.vision.calibration import Calibration, Evidence
from farm_ar.vision.camera_refinement import Landmarks, refine_camera
from farm_ar.vision.canonical import azimuth, canonical_image, canonical_view, on_plane
from farm_ar.vision.network import SHIPPED, PoseNetwork, network_of
from farm_ar.vision.refinement import MOST_FACES, Guesses, Refined, Solid, refine

LEAST_HEAT = 0.18
"""What the network is less confident of is not looked at."""

SURE_HEAT = 0.35
"""Of what hides other objects."""

FARTHEST_SIZES = 40.0
"""What is farther away than so many of its sizes is not looked at."""


class NetworkEstimator(PoseEstimator):
    """Finds what a network was trained for, and refines it by rendering.

    Args:
        model: the network's file; that of the farm's buildings by default.
        refined: whether poses are refined.
        least_score: what is less probable is left out.
        landmarks: what stands still, by which the camera's pose is put right first; None where it is exact.

    Raises:
        OptionError: there is no such model.
    """

    def __init__(
        self,
        model: str | Path = SHIPPED,
        refined: bool = True,
        least_score: float = 0.5,
        landmarks: Landmarks | None = None,
    ) -> None:
        self._model, self._refined, self._least = str(model), refined, least_score
        self._landmarks = landmarks
        network_of(self._model)
        self._solids: dict[str, tuple[Mesh, Solid]] = {}

    def estimate(self, image: Image, camera: View, meshes: Mapping[str, Mesh]) -> PoseEstimates:
        """The poses of all objects of some categories that an image shows."""
        check_question(image, camera, meshes)
        network: PoseNetwork = network_of(self._model)
        found = candidates(image, camera, network, meshes)
        if self._landmarks is not None:
            camera, _ = refine_camera(image, camera, self._landmarks, _instances(found, meshes))
            found = candidates(image, camera, network, meshes)
        calibration = Calibration.of(network.calibration, self._refined)
        # What no refinement can make probable, and what hides nothing, need not be refined.
        most = calibration.most(found.heat, found.visible)
        found = found.only((most >= self._least) | (found.heat > SURE_HEAT))
        refined = None
        if self._refined and len(found) and all(len(meshes[name]) <= MOST_FACES for name in found.category):
            solids = {name: self._solid(name, meshes[name]) for name in set(found.category)}
            refined = refine(image, camera, solids, guesses_of(found, meshes))
        evidence = evidence_of(found, refined, camera)
        calibration = Calibration.of(network.calibration, refined is not None)
        return _estimates(found, refined, evidence, calibration, camera, meshes, self._least)

    def _solid(self, name: str, mesh: Mesh) -> Solid:
        kept = self._solids.get(name)
        if kept is None or kept[0] is not mesh:
            kept = self._solids[name] = (mesh, Solid.of(mesh))
        return kept[1]


def _instances(found: Found, meshes: Mapping[str, Mesh]) -> list[Instance]:
    """Objects where the network has them."""
    sure = found.heat > SURE_HEAT
    return [
        Instance(meshes[name], np.array([x, 0.0, z]), yaw)
        for name, (x, z, yaw), here in zip(found.category, found.pose.tolist(), sure, strict=True)
        if here
    ]


@dataclass(frozen=True, eq=False)
class Found:
    """N objects as the network has them, on the plane.

    Args:
        category: of each.
        pose: (N, 3) x, z and yaw, metres and radians.
        heat: (N,) of their peaks.
        flipped: (N,) probability that the yaw is the opposite.
        visible: (N,) share that is seen.
        spread: (N, 2) expected absolute errors, metres and radians.
    """

    category: tuple[str, ...]
    pose: FloatArray
    heat: FloatArray
    flipped: FloatArray
    visible: FloatArray
    spread: FloatArray

    def __len__(self) -> int:
        return len(self.category)

    def only(self, kept: BoolArray | IntArray) -> Found:
        """Some of them."""
        index = np.flatnonzero(kept) if kept.dtype == bool else kept
        rest = (getattr(self, name)[index] for name in ("pose", "heat", "flipped", "visible", "spread"))
        return Found(tuple(self.category[i] for i in index), *rest)


def candidates(image: Image, camera: View, network: PoseNetwork, meshes: Mapping[str, Mesh]) -> Found:
    """What the network sees of some categories, the most probable first."""
    canonical = canonical_view(camera)
    read = heads.read(network(canonical_image(image, camera, canonical)), LEAST_HEAT)
    place = on_plane(canonical, read.foot)
    away = np.linalg.norm(place - camera.eye[[0, 2]], axis=1)
    beside = on_plane(canonical, read.foot + np.array([0.0, 1.0]))
    spread = read.spread.copy()
    spread[:, 0] *= np.linalg.norm(beside - place, axis=1)
    pose = np.column_stack([place, wrap(read.heading + azimuth(camera, place))])
    category = tuple(network.names[c] for c in read.category)
    found = Found(category, pose, read.heat, read.flipped, read.visible, spread)
    largest = np.array([float(network.sizes[name].max()) for name in category])
    kept = np.isfinite(pose).all(axis=1) & np.isfinite(spread).all(axis=1)
    kept &= np.nan_to_num(away, nan=np.inf) < FARTHEST_SIZES * largest
    found = found.only(kept)
    found = found.only(_apart(found, network))
    return found.only(np.array([name in meshes for name in found.category], bool))


def _apart(found: Found, network: PoseNetwork) -> BoolArray:
    """(N,) which do not stand in one that is more probable."""
    kept = np.zeros(len(found), bool)
    half = np.array([network.sizes[name][[0, 2]].min() / 2 for name in found.category])
    for k in range(len(found)):
        away = np.linalg.norm(found.pose[:, :2] - found.pose[k, :2], axis=1)
        kept[k] = not (kept & (away < 0.6 * (half + half[k]))).any()
    return kept


def guesses_of(found: Found, meshes: Mapping[str, Mesh]) -> Guesses:
    """What refinement starts from."""
    largest = np.array([float(size_of(meshes[name]).max()) for name in found.category])
    reach = np.clip(2.5 * found.spread[:, 0], 0.04 * largest, 0.4 * largest)
    return Guesses(found.category, found.pose, found.flipped, reach, found.heat > SURE_HEAT)


def evidence_of(found: Found, refined: Refined | None, camera: View) -> Evidence:
    """What is known of each thing beside its pose."""
    away = np.linalg.norm(found.pose[:, :2] - camera.eye[[0, 2]], axis=1)
    of_network = (found.heat, found.visible, found.flipped, found.spread, away)
    if refined is None:
        nothing = np.zeros(len(found))
        return Evidence(*of_network, nothing, nothing + 1, nothing, nothing * np.nan)
    moved = np.linalg.norm(refined.pose[:, :2] - found.pose[:, :2], axis=1)
    return Evidence(*of_network, refined.gain, refined.seen, moved, refined.flip)


def _estimates(
    found: Found,
    refined: Refined | None,
    evidence: Evidence,
    calibration: Calibration,
    camera: View,
    meshes: Mapping[str, Mesh],
    least: float,
) -> PoseEstimates:
    pose = np.array(found.pose if refined is None else refined.pose)
    opposite = pose + np.array([0.0, 0.0, np.pi])
    if refined is not None:
        tried = np.isfinite(refined.opposite).all(axis=1)
        opposite[tried] = refined.opposite[tried]
    flipped = calibration.flipped(evidence)
    turned = flipped > 0.5
    pose[turned], opposite[turned] = opposite[turned].copy(), pose[turned].copy()
    flipped = np.minimum(flipped, 1 - flipped)
    score = calibration.score(evidence)
    covariance = calibration.covariance(evidence, azimuth(camera, pose[:, :2]))
    kept = np.flatnonzero(score >= least)
    order = bearing(camera.eye[[0, 2]], np.asarray(camera.yaw), pose[kept, :2])
    kept = kept[np.argsort(order, kind="stable")]
    size = np.array([size_of(meshes[found.category[k]]) for k in kept]).reshape(-1, 3)
    detections = Detections(
        category=tuple(found.category[k] for k in kept),
        position=pose[kept, :2],
        yaw=wrap(pose[kept, 2]),
        size=size,
        confidence=score[kept],
    )
    rival = flipped[kept] >= calibration.least_rival
    return PoseEstimates(
        detections,
        covariance[kept],
        np.minimum(evidence.visible, evidence.seen)[kept],
        np.where(rival, wrap(opposite[kept, 2]), np.nan),
        np.where(rival, flipped[kept], np.nan),
    )
