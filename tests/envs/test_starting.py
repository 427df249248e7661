"""How episodes begin: layouts as the jitter draws them, or layout and camera as they are asked for."""

import json

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.generator import StartingLayouts
from farm_ar.envs.rewards import clutter
from farm_ar.game_logic.headset import field_of_view
from farm_ar.geometry import deepest_overlap, footprint_corners, footprints_overlap, wrap
from farm_ar.scenes import Camera, FieldOfView, Layout, Scene, builtin_scene

FARM = builtin_scene("farm")


def draws(jitter, scene=FARM, count=200):
    layouts, rng = StartingLayouts(scene, jitter), np.random.default_rng(0)
    return [layouts.draw(rng) for _ in range(count)]


def test_without_jitter_the_layout_is_the_scenes_own():
    assert all(layout is FARM.layout for layout in draws("none", count=3))


@pytest.mark.parametrize(("jitter", "metres", "degrees"), [("easy", 0.02, 6), ("default", 0.05, 15)])
def test_easy_and_default_stray_by_their_spread(jitter, metres, degrees):
    home, drawn = FARM.layout, draws(jitter)
    some = home.movable
    shift = np.array([layout.position - home.position for layout in drawn])[:, some]
    turn = np.rad2deg([wrap(layout.yaw - home.yaw) for layout in drawn])[:, some]
    # What overlaps or leaves the table or turns beyond 30 degrees is not kept, which makes it a little less.
    assert 0.8 * metres < shift.std() < 1.02 * metres
    assert 0.8 * degrees < turn.std() < 1.02 * degrees
    assert np.abs(shift.mean(axis=(0, 1))).max() < 0.2 * metres


def test_hard_layouts_are_anywhere_and_apart():
    drawn = draws("hard")
    places = np.array([layout.position[:10] for layout in drawn])
    assert places[..., 0].min() < 0.1 < 1.1 < places[..., 0].max()
    assert places[..., 1].min() < 0.1 < 0.7 < places[..., 1].max()
    for layout in drawn:
        distance = np.linalg.norm(layout.position[:, None] - layout.position, axis=-1)
        assert distance[~np.eye(11, dtype=bool)].min() >= 0.13


@pytest.mark.parametrize("jitter", ["easy", "default", "hard"])
def test_buildings_stay_on_the_table_apart_and_within_30_degrees(jitter):
    for layout in draws(jitter):
        assert deepest_overlap(layout.position, layout.yaw, layout.size) == 0
        corners = footprint_corners(layout.position, layout.yaw, layout.size)[layout.movable]
        assert np.all((corners >= -1e-12) & (corners <= np.add(FARM.size, 1e-12)))
        assert np.rad2deg(np.abs(layout.yaw[layout.movable])).max() <= 30 + 1e-9
        for name in ("position", "yaw"):
            fixed = layout.fixed
            np.testing.assert_array_equal(getattr(layout, name)[fixed], getattr(FARM.layout, name)[fixed])


@pytest.mark.parametrize("name", ["H1", "M2", "L1"])
def test_what_stands_apart_in_a_room_stays_apart_and_what_overlaps_may(name):
    scene = builtin_scene(name)
    home = scene.layout

    def overlaps(layout):
        poses = layout.position, layout.yaw, layout.size
        each = [values[:, None] for values in poses]
        return np.triu(footprints_overlap(*each, *poses), 1)

    own = overlaps(home)
    for layout in draws("default", scene, count=20):
        assert layout is not home
        assert not np.any(overlaps(layout) & ~own)


def test_truth_and_belief_begin_alike():
    env = FarmToTableEnv(jitter="hard")
    env.reset(seed=4)
    np.testing.assert_array_equal(env.world.truth.position, env.world.believed.position)
    np.testing.assert_allclose(env.world.truth.yaw, wrap(env.world.believed.yaw), atol=1e-12)
    assert env.world.tracker.belief.wrong_labels == 0


def test_the_layout_asked_for_is_used_exactly_whatever_the_jitter():
    layout = draws("hard", count=1)[0]
    env = FarmToTableEnv(jitter="default")
    for given in (layout, {"position": layout.position, "yaw": layout.yaw.tolist()}):
        env.reset(seed=0, options={"layout": given})
        np.testing.assert_array_equal(env.world.truth.position, layout.position)
        np.testing.assert_array_equal(env.world.truth.yaw, wrap(layout.yaw))
        np.testing.assert_array_equal(env.world.believed.position, layout.position)


@pytest.mark.parametrize("control", ["move", "hand", "layout"])
def test_the_camera_asked_for_is_used_exactly(control):
    env = FarmToTableEnv(control=control)
    camera = Camera(
        np.array([0.5, -0.3]),
        np.array(0.1),
        FieldOfView(0.4, 0.5, 2.0, 0.3, 0.2),
        np.array(0.4),
        np.array(-0.7),
    )
    values = {
        "position": [0.5, -0.3],
        "yaw": 0.1,
        "height": 0.4,
        "pitch": -0.7,
        "fov": {"left": 0.4, "right": 0.5, "range_m": 2.0, "up": 0.3, "down": 0.2},
    }
    for given in (camera, values):
        env.reset(seed=0, options={"camera": given})
        used = env.world.camera
        np.testing.assert_array_equal(used.position, camera.position)
        assert (used.yaw, used.height, used.pitch, used.fov) == (0.1, 0.4, -0.7, camera.fov)


@pytest.mark.parametrize(("fov", "width"), [("photo", 64.7), ("display", 43.0)])
def test_the_field_of_view_has_a_name(fov, width):
    env = FarmToTableEnv(fov=fov)
    env.reset(seed=0)
    view = env.world.camera.fov
    assert np.rad2deg(view.left + view.right) == pytest.approx(width)
    env.reset(seed=0, options={"camera": {"position": [0.6, -0.3], "yaw": 0.0}})
    assert env.world.camera.fov == view


def test_two_thirds_of_the_buildings_are_in_view():
    env = FarmToTableEnv()
    seen = []
    for seed in range(300):
        observation, _ = env.reset(seed=seed)
        seen.append(observation["in_view"][:10].sum())
    assert 6.5 <= np.mean(seen) <= 7.2


def test_a_plain_scene_is_seen_from_its_camera_path_with_its_field_of_view():
    scene = builtin_scene("L1")
    env = FarmToTableEnv(scene="L1", control="layout", game=False)
    for seed in range(5):
        env.reset(seed=seed)
        camera = env.world.camera
        nearest = np.linalg.norm(scene.camera_path.polyline - camera.position, axis=1).min()
        assert nearest < 0.02
        assert camera.fov == scene.fov


def test_seeds_decide_and_without_one_episodes_differ():
    env = FarmToTableEnv()
    places = []
    for seed in (7, None, 7, None, 8):
        env.reset(seed=seed)
        places.append(env.world.truth.position.tobytes())
    assert places[0] == places[2]
    assert places[1] == places[3]
    assert len(set(places)) == 3


def test_options_need_not_be_objects():
    options = {"layout": {"position": FARM.layout.position.tolist(), "yaw": FARM.layout.yaw.tolist()}}
    env = FarmToTableEnv()
    env.reset(options=json.loads(json.dumps(options)))
    np.testing.assert_array_equal(env.world.truth.position, FARM.layout.position)


def test_layouts_of_a_larger_table_stray_by_as_much_more():
    """Three times the farm: the same draws, three times as far."""
    home = FARM.layout
    layout = Layout(home.labels, home.category, 3 * home.position, home.yaw, 3 * home.size, fixed=home.fixed)
    large = Scene("large", (3.6, 2.4), layout)
    for jitter in ("easy", "default", "hard"):
        for ours, theirs in zip(draws(jitter, count=20), draws(jitter, large, count=20), strict=True):
            # Footprints keep 5 mm apart on any table, so that now and then another of the poses tried fits.
            same = np.isclose(3 * ours.position, theirs.position, atol=1e-9).all(axis=1)
            assert same.mean() > 0.8
            np.testing.assert_allclose(ours.yaw[same], theirs.yaw[same])
    apart = [
        np.linalg.norm(one.position[:, None] - one.position, axis=-1) for one in draws("hard", large, 50)
    ]
    assert min(d[~np.eye(11, dtype=bool)].min() for d in apart) >= 0.39


def test_what_the_page_says_of_jitter_animals_and_clutter_is_so():
    home, some = FARM.layout, FARM.layout.movable
    turns = np.array([wrap(layout.yaw - home.yaw)[some] for layout in draws("default", count=1000)])
    assert np.rad2deg(turns.std()) == pytest.approx(12.9, abs=0.3)
    yaws = np.array([layout.yaw[some] for layout in draws("hard", count=300)])
    assert np.rad2deg(np.abs(yaws).max()) == pytest.approx(30, abs=0.2)
    assert np.rad2deg(yaws.std()) == pytest.approx(60 / np.sqrt(12), abs=0.6)
    env, cluttered = FarmToTableEnv(jitter="hard"), []
    for seed in range(300):
        env.reset(seed=seed)
        cluttered.append(clutter(env))
    assert np.mean(cluttered) == pytest.approx(0.027, abs=4 * np.std(cluttered) / np.sqrt(300))
    env, animals = FarmToTableEnv(), []
    for seed in range(60):
        env.reset(seed=seed)
        animals.append(len(env.world.render_state().animal_goal))
    assert np.mean(animals) == pytest.approx(10 * 3.3, rel=0.1)


@pytest.mark.parametrize("game", [False, True])
def test_a_camera_given_without_a_field_of_view_has_the_scenes_on_a_path_and_the_headsets_in_the_game(game):
    scene = builtin_scene("farm" if game else "L1")
    env = FarmToTableEnv(scene=scene, control="layout", game=game)
    env.reset(seed=0, options={"camera": {"position": [1.0, 1.0], "yaw": 0.5}})
    headset = field_of_view("photo")
    assert env.world.camera.fov == (headset if game else scene.fov)
    assert game or scene.fov != headset
