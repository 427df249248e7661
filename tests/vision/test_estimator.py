"""The estimator that comes with the package, on pictures of the farm and on random frames."""

import numpy as np
import pytest

from farm_ar.rendering import HOLOLENS_2, View
from farm_ar.testing import check_pose_estimator
from farm_ar.vision import NetworkEstimator, PoseEstimates, PoseEstimator
from farm_ar.vision.measured_noise import in_picture, moments_of
from farm_ar.vision.scoring import farm_meshes

from .conftest import compared


def test_it_keeps_the_contract():
    check_pose_estimator(NetworkEstimator, nearest_m=0.03)


def test_buildings_are_found_where_they_stand(farm, pixels):
    seen = found = false = 0
    away, turn = [], []
    for number, (truth, camera) in enumerate(moments_of(farm, 12, 11)):
        perceived = pixels.perceive(truth, camera, np.random.default_rng(number))
        there = in_picture(truth, camera)
        seen, found = seen + there.sum(), found + np.isin(np.flatnonzero(there), perceived.source).sum()
        false += (perceived.source < 0).sum()
        metres, radians = compared(perceived, truth)
        away, turn = [*away, *metres], [*turn, *radians]
    assert found > 0.8 * seen
    assert false < 0.1 * found
    assert np.median(away) < 0.005
    assert np.median(turn) < np.deg2rad(4)
    assert np.mean(np.array(turn) > np.deg2rad(90)) < 0.2


def test_no_building_is_found_on_an_empty_table_or_in_noise():
    camera = View(HOLOLENS_2, np.array([0.0, 0.45, -0.6]), 0.0, -0.65)
    estimator, meshes = NetworkEstimator(), farm_meshes()
    noise = np.random.default_rng(0).integers(0, 256, (360, 640, 3), np.uint8)
    for image in (np.full((360, 640, 3), 120, np.uint8), noise):
        assert len(estimator.estimate(image, camera, meshes)) == 0


def test_categories_that_were_not_asked_for_are_left_out(farm, pixels):
    truth, camera = moments_of(farm, 1, 11)[0]
    image, view = pixels.picture(truth, camera, np.random.default_rng(0))
    meshes = farm_meshes()
    all_of_them = NetworkEstimator().estimate(image, view, meshes)
    coops = NetworkEstimator().estimate(image, view, {"coop": meshes["coop"]})
    assert set(coops.detections.category) == {"coop"}
    assert len(coops) == all_of_them.detections.category.count("coop")
    dragons = NetworkEstimator().estimate(image, view, {"dragon": meshes["coop"]})
    assert len(dragons) == 0


def test_detections_stand_from_left_to_right(farm, pixels):
    truth, camera = moments_of(farm, 1, 11)[0]
    found, _, view = pixels.look(truth, camera, np.random.default_rng(0))
    columns = view.pixels(np.insert(found.detections.position, 1, 0.0, axis=1))[:, 0]
    assert len(columns) > 3
    assert (np.diff(columns) > -40).all()


class Recorder(PoseEstimator):
    def __init__(self):
        self.asked = []

    def estimate(self, image, camera, meshes):
        self.asked.append((image, camera, meshes))
        return NetworkEstimator(refined=False).estimate(image, camera, meshes)


def test_nothing_but_image_camera_and_meshes_reaches_the_estimator(farm):
    from farm_ar.vision.perception import PixelPerception

    recorder = Recorder()
    perception = PixelPerception(farm, recorder)
    truth, camera = moments_of(farm, 1, 11)[0]
    perceived = perception.perceive(truth, camera, np.random.default_rng(0))
    # Two coops change places: the picture is the same, and so is what is believed to be seen.
    position, yaw = truth.position.copy(), truth.yaw.copy()
    position[[0, 1]], yaw[[0, 1]] = position[[1, 0]], yaw[[1, 0]]
    swapped = perception.perceive(truth.placed(position, yaw), camera, np.random.default_rng(0))
    (image, view, meshes), (again, _, _) = recorder.asked
    np.testing.assert_array_equal(image, again)
    assert image.shape == (360, 640, 3)
    assert isinstance(view, View)
    assert sorted(meshes) == ["coop", "hutch", "shed"]
    first, second = perceived.snapshot.detections, swapped.snapshot.detections
    np.testing.assert_array_equal(first.position, second.position)
    order = np.array([1, 0, *range(2, len(truth)), -1])
    np.testing.assert_array_equal(order[perceived.source], swapped.source)


def test_what_is_told_of_uncertainty_holds(farm, pixels):
    ratios, rivals = [], 0
    for number, (truth, camera) in enumerate(moments_of(farm, 8, 12)):
        rng = np.random.default_rng(number)
        found, _, _ = pixels.look(truth, camera, rng)
        assert isinstance(found, PoseEstimates)
        rivals += np.isfinite(found.runner_up_yaw).sum()
        for k, (place, category) in enumerate(
            zip(found.detections.position, found.detections.category, strict=True)
        ):
            same = [i for i, name in enumerate(truth.category) if name == category]
            error = (truth.position[same] - place)[
                np.linalg.norm(truth.position[same] - place, axis=1).argmin()
            ]
            ratios.append(error @ np.linalg.solve(found.covariance[k, :2, :2], error))
    # Half of all within the ellipse that holds half of a normal distribution, or nearly.
    assert 0.2 < np.mean(np.array(ratios) < 1.386) < 0.97
    assert np.mean(np.array(ratios) < 25) > 0.7
    assert rivals >= 0


@pytest.mark.parametrize("roll", [-0.2, 0.2])
def test_a_rolled_camera_finds_the_same(farm, pixels, roll):
    from dataclasses import replace as change

    from farm_ar.rendering import Instance, Renderer, Sensor
    from farm_ar.vision.meshes import meshes_of

    meshes = meshes_of(farm)
    truth, camera = moments_of(farm, 1, 13)[0]
    _, view = pixels.picture(truth, camera, np.random.default_rng(0))
    rolled = change(view, roll=roll)
    things = [
        Instance(meshes[name], np.array([x, 0.0, z]), yaw)
        for name, (x, z), yaw in zip(truth.category, truth.position, truth.yaw.tolist(), strict=True)
    ]
    image = Sensor().expose(Renderer(things).draw(rolled).rgb, np.random.default_rng(0))
    found = NetworkEstimator().estimate(image, rolled, meshes).detections
    assert len(found) >= 3
    nearest = np.linalg.norm(found.position[:, None] - truth.position[None], axis=-1).min(axis=1)
    assert np.median(nearest) < 0.01
