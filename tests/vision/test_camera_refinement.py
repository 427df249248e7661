"""The camera is put right by the table's edges and the shed."""

import numpy as np
import pytest

from farm_ar.rendering import HOLOLENS_2, Instance, View
from farm_ar.scenes import builtin_scene
from farm_ar.vision.camera_refinement import Landmarks, refine_camera
from farm_ar.vision.canonical import on_plane
from farm_ar.vision.measured_noise import moments_of
from farm_ar.vision.meshes import meshes_of
from farm_ar.vision.perception import PixelPerception

RIM_M = 0.016
"""Of the drawn table."""


@pytest.fixture(scope="module")
def farm():
    scene = builtin_scene("farm")
    return scene, PixelPerception(scene, estimator=object()), meshes_of(scene)


def test_places_lifted_through_a_camera_that_is_off_come_right(farm):
    scene, perception, meshes = farm
    before, after, z = [], [], []
    for number, (truth, camera) in enumerate(moments_of(scene, 12, 3)):
        rng = np.random.default_rng(number)
        image, view = perception.picture(truth, camera, rng)
        shift, turn = (
            0.01 / np.sqrt(3) * rng.normal(size=3),
            np.deg2rad(0.5) / np.sqrt(3) * rng.normal(size=3),
        )
        angles = np.array([view.yaw, view.pitch, view.roll]) + turn
        wrong = View(view.intrinsics, view.eye + shift, *angles.tolist())
        things = [
            Instance(meshes[name], np.array([x, 0.0, z]), yaw)
            for name, (x, z), yaw in zip(truth.category, truth.position, truth.yaw.tolist(), strict=True)
        ]
        fixed = [thing for thing, still in zip(things, truth.fixed, strict=True) if still]
        landmarks = Landmarks.of_table(*scene.size, fixed, RIM_M)
        right, covariance = refine_camera(image, wrong, landmarks, things)
        pixel = view.pixels(np.insert(truth.position, 1, 0.0, axis=1))
        seen = (pixel > 0).all(axis=1) & (pixel < [640, 360]).all(axis=1)
        for found, camera_of in ((before, wrong), (after, right)):
            found += np.linalg.norm(on_plane(camera_of, pixel[seen]) - truth.position[seen], axis=1).tolist()
        z += ((right.eye - view.eye) / np.sqrt(np.diag(covariance)[:3])).tolist()
    assert np.percentile(before, 90) > 0.015
    assert np.percentile(after, 90) < 0.012
    assert np.percentile(np.abs(z), 80) < 4


def test_without_anything_to_hold_on_to_the_camera_stays(farm):
    scene, _, _ = farm
    grey = np.full((360, 640, 3), 90, np.uint8)
    camera = View(HOLOLENS_2, np.array([0.6, 0.45, -0.3]), 0.1, -0.6)
    found, covariance = refine_camera(grey, camera, Landmarks.of_table(*scene.size))
    assert found is camera
    assert (np.diag(covariance) > 0).all()
