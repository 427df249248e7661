"""The headset: where it looks, what it sees, and how it moves."""

import numpy as np
import pytest

from farm_ar.errors import OptionError
from farm_ar.game_logic.headset import (
    FIELDS_OF_VIEW,
    HeadMotion,
    field_of_view,
    gaze_target,
    look_at,
    random_camera,
)
from farm_ar.scenes import builtin_scene, visible

FARM = builtin_scene("farm")


def test_the_fields_of_view_are_those_of_the_hololens_2():
    photo, display = FIELDS_OF_VIEW["photo"], FIELDS_OF_VIEW["display"]
    assert np.rad2deg(photo.left + photo.right) == pytest.approx(64.7)
    assert np.rad2deg(display.left + display.right) == pytest.approx(43)
    assert np.rad2deg(display.up + display.down) == pytest.approx(29)


def test_an_unknown_field_of_view_is_refused_with_those_known():
    with pytest.raises(OptionError, match="fov: must be one of display, photo, got 'wide'"):
        field_of_view("wide")


def test_a_camera_looks_at_its_target_in_heading_and_pitch():
    camera = look_at(np.array([0.0, 0.0]), np.array([0.3, 0.3]), FIELDS_OF_VIEW["photo"], height=0.3)
    assert np.rad2deg(camera.yaw) == pytest.approx(45)
    assert np.tan(-camera.pitch) == pytest.approx(0.3 / np.hypot(0.3, 0.3))


def test_the_gaze_goes_to_a_site_or_sweeps_from_the_left_one_to_the_right_one_and_back():
    np.testing.assert_allclose(gaze_target(FARM, "S4"), (0.90, 0.45))
    np.testing.assert_allclose(gaze_target(FARM, "sweep", 0.0), (0.33, 0.45))
    np.testing.assert_allclose(gaze_target(FARM, "sweep", 4.0), (0.90, 0.45))
    np.testing.assert_allclose(gaze_target(FARM, "sweep", 8.0), (0.33, 0.45), atol=1e-12)
    with pytest.raises(OptionError, match="gaze: must be one of"):
        gaze_target(FARM, "S9")


def test_a_random_camera_stands_behind_the_near_edge_and_sees_six_or_seven_of_ten(rng):
    cameras = [random_camera(FARM, FIELDS_OF_VIEW["photo"], rng) for _ in range(400)]
    x, z = np.array([camera.position for camera in cameras]).T
    assert x.min() >= 0.3
    assert x.max() <= 0.9
    assert z.min() >= -0.4
    assert z.max() <= -0.25
    movable = FARM.layout.movable
    seen = [visible(FARM.layout, camera)[movable].sum() for camera in cameras]
    assert 6.0 < np.mean(seen) < 7.5


def test_the_head_sways_by_as_much_as_it_is_said_to_and_forgets(rng):
    camera = look_at(np.array([0.6, -0.3]), np.array([0.6, 0.4]), FIELDS_OF_VIEW["photo"])
    motion = HeadMotion(position_sd=0.01, angle_sd=0.02, memory=0.5)
    np.testing.assert_array_equal(motion.applied(camera).position, camera.position)
    places, angles = [], []
    for _ in range(4000):
        motion.step(1.0, rng)
        swayed = motion.applied(camera)
        places.append(swayed.position - camera.position)
        angles.append(swayed.yaw - camera.yaw)
    assert np.std(places) == pytest.approx(0.01, rel=0.1)
    assert np.std(angles) == pytest.approx(0.02, rel=0.1)
    assert abs(np.corrcoef(angles[:-1], angles[1:])[0, 1] - np.exp(-2)) < 0.06
