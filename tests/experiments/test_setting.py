"""What the experiments are given: options, scenes, workers, snapshots along the path."""

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from farm_ar.errors import OptionError, SceneError
from farm_ar.experiments.setting import (
    SCENES,
    Setting,
    accuracies,
    load_scenes,
    mean_and_sd,
    mean_per_layout,
    named_scene,
    noisy_snapshots,
    path_cameras,
)
from farm_ar.reid import SpatialReid
from farm_ar.scenes import LayoutNoise, save_scene, scene_to_dict, visible

NOISE = LayoutNoise.of(0.4, 40.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"layouts": 0}, "layouts: must be a whole number not below 1, got 0"),
        ({"seed": -1}, "seed: must be a whole number not below 0, got -1"),
        ({"layouts": 2.5}, "layouts: must be a whole number not below 1, got 2.5"),
    ],
)
def test_options_out_of_their_limits_are_refused(options, message):
    with pytest.raises(OptionError) as problem:
        Setting(**options)
    assert str(problem.value) == message


def test_generators_differ_by_key_and_by_seed_and_repeat():
    settings = [Setting(seed=seed) for seed in (0, 1)]
    numbers = {
        (setting.seed, key): setting.rng(*key).random()
        for setting in settings
        for key in ((2, 0), (2, 1), (20,), (2,))
    }
    assert len(set(numbers.values())) == len(numbers)
    assert settings[1].rng(2, 0).random() == numbers[1, (2, 0)]


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(
        SceneError, match=r"scenes: must be a folder with L1.json to H2.json, got '.*nowhere'"
    ):
        load_scenes(tmp_path / "nowhere")


@pytest.fixture
def folder(own_scenes, tmp_path) -> Path:
    """A folder with the six scenes as files."""
    for name, scene in own_scenes.items():
        save_scene(scene, tmp_path / f"{name}.json")
    return tmp_path


def test_a_folder_of_scenes_is_read_as_it_stands(own_scenes, folder):
    read = load_scenes(folder)
    assert list(read) == list(SCENES)
    for name in SCENES:
        assert scene_to_dict(read[name]) == scene_to_dict(own_scenes[name])


def test_a_folder_that_lacks_a_scene_is_refused_by_name(folder):
    (folder / "M2.json").unlink()
    with pytest.raises(SceneError, match=r"M2\.json: file: must be a readable file, got 'No such file"):
        load_scenes(folder)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"camera_path": None}, "H1.json: camera_path: must be there for the experiments, got nothing"),
        ({"sites": []}, "H1.json: sites: must be at least one for the experiments, got []"),
        ({"objects": []}, "H1.json: objects: must be at least one for the experiments, got []"),
        (
            {"camera_path": {"closed": False, "bezier_points": [[-90, 0], [-91, 0], [-92, 0], [-93, 0]]}},
            "H1.json: camera_path: must pass where the camera sees an object, got '3.0 m of path'",
        ),
    ],
)
def test_a_scene_that_the_experiments_can_do_nothing_with_is_refused_before_they_run(folder, change, message):
    file = folder / "H1.json"
    data = {**json.loads(file.read_text()), **change}
    if not data["objects"]:
        data.pop("templates", None)
    file.write_text(json.dumps({key: value for key, value in data.items() if value is not None}))
    with pytest.raises(SceneError) as problem:
        load_scenes(folder)
    assert str(problem.value) == message


def test_a_scene_is_made_again_from_its_parameters(own_scenes, folder):
    for setting in (Setting(), Setting(folder)):
        again = named_scene(**setting.scene_parameters("H1"))
        assert scene_to_dict(again) == scene_to_dict(own_scenes["H1"])


def test_units_are_told_apart_by_what_is_in_the_file_of_their_scene(own_scenes, folder):
    before = Setting(folder).scene_parameters("H1")
    save_scene(own_scenes["M1"], folder / "H1.json")
    assert Setting(folder).scene_parameters("H1") != before
    assert before != Setting().scene_parameters("H1")
    named_scene.cache_clear()
    with pytest.raises(SceneError, match="file: must stay as it is while the experiments run"):
        named_scene(**before)


def test_snapshots_are_evenly_spaced_on_the_path_and_look_along_it(own_scenes):
    for scene in own_scenes.values():
        cameras = path_cameras(scene)
        spacing = scene.camera_path.length / len(cameras.yaw)
        assert spacing == pytest.approx(0.617, rel=0.05)
        ahead = np.roll(cameras.position, -1, axis=0) - cameras.position
        steps = np.linalg.norm(ahead, axis=1)
        assert np.all(steps[:-1] < 1.05 * spacing)
        along = np.stack([np.sin(cameras.yaw), np.cos(cameras.yaw)], axis=1)
        assert np.median(np.sum(along * ahead, axis=1) / steps) > 0.9


def test_about_as_many_snapshots_as_the_papers_62_detect_anything(authors_scenes):
    scene = authors_scenes["H1"]
    cameras = path_cameras(scene)
    assert len(cameras.yaw) == 80
    assert 58 <= np.count_nonzero(visible(scene.layout, cameras).any(axis=-1)) <= 66
    batch = noisy_snapshots(scene, LayoutNoise.of(0.3, 30.0), 20, np.random.default_rng(0))
    assert 58 <= np.count_nonzero(batch.count) / 20 <= 66


def test_every_noisy_layout_is_seen_from_every_pose(own_scenes, rng):
    scene = own_scenes["L2"]
    cameras = path_cameras(scene)
    poses = len(cameras.yaw)
    batch = noisy_snapshots(scene, NOISE, 3, rng)
    assert len(batch) == 3 * poses
    assert np.array_equal(batch.camera.position, np.tile(cameras.position, (3, 1)))
    for layout in np.arange(3 * poses).reshape(3, poses):
        seen = {}
        for b in layout:
            for label, position in zip(batch.truth[b, : batch.count[b]], batch.position[b], strict=False):
                seen.setdefault(int(label), set()).add(tuple(position))
        assert len(seen) > 4
        assert all(len(places) == 1 for places in seen.values()), "an object moved between the snapshots"


def test_accuracies_are_those_of_solving_each_snapshot_by_the_equations(own_scenes, rng):
    """Eqs. 4 to 8 and 10 written out for L2."""
    scene = own_scenes["L2"]
    layout = scene.layout
    batch = noisy_snapshots(scene, NOISE, 4, rng)
    found = accuracies(SpatialReid(scene), batch, 4)
    expected = []
    for b, n in enumerate(batch.count):
        if n == 0:
            expected.append(np.nan)
            continue
        cost = np.empty((n, len(layout)))
        for i, j in np.ndindex(cost.shape):
            moved = np.hypot(*(batch.position[b, i] - layout.position[j])) / np.hypot(8.0, 8.0)
            turned = abs(np.sin((batch.yaw[b, i] - layout.yaw[j]) / 2))
            ratio = np.log([batch.size[b, i]] / layout.size[j][list(itertools.permutations(range(3)))])
            resized = np.exp(np.abs(ratio).sum(axis=1).min())
            cost[i, j] = (0.36 * 8.0 * moved + turned) * resized
        rows, columns = linear_sum_assignment(cost)
        expected.append(np.mean(columns == batch.truth[b, rows]))
    assert found.shape == (4, len(path_cameras(scene).yaw))
    assert 0.2 < np.nanmean(found) < 1.0
    np.testing.assert_allclose(found.reshape(-1), expected)


def test_without_noise_every_identity_is_right_in_every_scene(own_scenes, rng):
    for name, scene in own_scenes.items():
        batch = noisy_snapshots(scene, LayoutNoise.of(0.0, 0.0), 1, rng)
        found = accuracies(SpatialReid(scene), batch, 1)
        assert np.nanmin(found) == 1.0, name


def test_accuracy_falls_with_noise_in_every_scene(own_scenes, rng):
    levels = [LayoutNoise.of(*level) for level in ((0.1, 10.0), (0.5, 45.0), (2.0, 110.0))]
    for name, scene in own_scenes.items():
        reid = SpatialReid(scene)
        low, middle, high = (
            np.nanmean(accuracies(reid, noisy_snapshots(scene, noise, 10, rng), 10)) for noise in levels
        )
        assert low > middle + 0.05, name
        assert middle > high + 0.2, name


def test_mean_per_layout_leaves_out_what_detected_nothing():
    nan = np.nan
    found = mean_per_layout(np.array([[1.0, 0.5, nan], [nan, nan, 0.25], [nan, nan, nan]]))
    np.testing.assert_array_equal(found, [0.75, 0.25, nan])


def test_mean_and_sd_leave_out_what_detected_nothing():
    assert mean_and_sd(np.array([[1.0, 0.5], [np.nan, 0.0]])) == pytest.approx((0.5, np.sqrt(1 / 6)))
    assert np.isnan(mean_and_sd(np.array([np.nan]))).all()


def test_scenes_other_than_the_papers_rooms_have_snapshots_too(own_scenes):
    short = replace(
        own_scenes["L1"].camera_path, points=own_scenes["L1"].camera_path.points[:4], closed=False
    )
    cameras = path_cameras(replace(own_scenes["L1"], camera_path=short))
    assert len(cameras.yaw) >= 2
