"""Scenes: a room and what the headset last knew of it."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import SceneError
from farm_ar.scenes import Layout, Scene, Site, Template, Weights

LAYOUT = Layout(
    ("a", "b", "c"), ("chair", "chair", "table"), [(1, 1), (3, 1), (2, 2)], [0, 0, 0], np.ones((3, 3))
)


def scene(**changes) -> Scene:
    return Scene(**{"name": "room", "size": (4, 3), "layout": LAYOUT} | changes)


def test_the_area_and_the_diagonal_are_those_of_the_room():
    assert scene().area == 12
    assert scene().diagonal == 5


def test_the_papers_weights_are_0_36_times_the_root_of_the_area_and_1():
    weights = Weights.of_area(49)
    assert (weights.translation, weights.rotation) == (pytest.approx(2.52), 1)


def test_a_scene_without_weights_has_the_papers_for_its_area():
    assert scene().cost_weights == Weights.of_area(12)


def test_a_scenes_own_weights_go_before_the_papers_even_if_they_are_zero():
    assert scene(weights=Weights(0, 0)).cost_weights == Weights(0, 0)


def test_each_object_belongs_to_the_site_nearest_to_it():
    sites = (Site("right", 3, 1), Site("left", 0, 1), Site("far", 100, -50))
    np.testing.assert_array_equal(scene(sites=sites).object_site, [1, 0, 0])
    np.testing.assert_array_equal(scene(sites=sites).site_positions, [(3, 1), (0, 1), (100, -50)])


@given(
    st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=1, max_size=6, unique=True).filter(
        lambda places: len({(x + 0.0, z + 0.0) for x, z in places}) == len(places)
    )
)
def test_no_other_site_is_nearer_to_an_object_than_its_own(places):
    room = scene(sites=[Site(f"S{i}", x, z) for i, (x, z) in enumerate(places)])
    away = np.linalg.norm(LAYOUT.position[:, None] - room.site_positions, axis=-1)
    own = away[np.arange(3), room.object_site]
    assert (own <= away.min(axis=1) + 1e-9).all()


def test_without_sites_all_objects_belong_together():
    assert scene().site_positions.shape == (0, 2)
    np.testing.assert_array_equal(scene().object_site, [0, 0, 0])


def test_a_scene_may_have_no_objects():
    empty = scene(layout=Layout((), (), [], [], []), sites=(Site("S1", 0, 0),))
    assert empty.object_site.shape == (0,)


def test_a_scene_says_briefly_what_it_is():
    assert repr(scene(sites=(Site("S1", 0, 0),))) == "Scene('room', 4 x 3 m, 3 objects, 1 sites)"


def test_a_scene_can_be_pickled_for_another_process_and_stays_read_only():
    room = scene(symmetry={"table": np.pi}, sites=[Site("S1", 0, 1)], weights=Weights(1, 2))
    other = pickle.loads(pickle.dumps(room))
    assert other.symmetry == {"table": np.pi}
    assert (other.name, other.size, other.sites, other.weights) == (
        room.name,
        room.size,
        room.sites,
        room.weights,
    )
    assert other.layout.labels == LAYOUT.labels
    assert not other.layout.position.flags.writeable


def test_the_symmetry_of_a_scene_cannot_be_changed():
    periods = {"table": np.pi}
    room = scene(symmetry=periods)
    periods["table"] = 1.0
    assert room.symmetry["table"] == np.pi
    with pytest.raises(TypeError):
        room.symmetry["table"] = 2.0


def test_a_symmetry_may_be_anything_from_none_to_a_full_turn():
    assert scene(symmetry={"table": 0, "chair": np.deg2rad(360)}).symmetry["table"] == 0


def test_the_objects_of_a_scene_may_be_replaced_by_some_of_them():
    room = scene(templates=(Template("table", 0, (1, 1, 1)),), symmetry={"table": np.pi})
    part = replace(room, layout=LAYOUT.subset([0, 1]))
    assert part.layout.categories == ("chair",)
    assert part.symmetry == room.symmetry


def test_numbers_of_any_kind_become_plain_ones_so_that_errors_and_files_show_them_so():
    room = scene(size=np.array([4, 3]), camera_speed=np.float32(2))
    site, template, weights = (
        Site("S", np.int64(1), 2),
        Template("c", 1, np.ones(3)),
        Weights(np.float64(1), 2),
    )
    shown = (*room.size, room.camera_speed, site.x, site.z, template.yaw, *template.size)
    assert {type(value) for value in (*shown, weights.translation, weights.rotation)} == {float}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": ""}, "name: must be a non-empty string of Unicode, got ''"),
        ({"name": 3}, "name: must be a non-empty string of Unicode, got 3"),
        ({"size": (4,)}, r"size_m: must be 2 positive numbers in metres, from 1e-6 to 1e6, got \[4.0\]"),
        (
            {"size": (4, 3, 2)},
            r"size_m: must be 2 positive numbers in metres, from 1e-6 to 1e6, got \[4.0, 3.0, 2.0\]",
        ),
        (
            {"size": (4, 0)},
            r"size_m: must be 2 positive numbers in metres, from 1e-6 to 1e6, got \[4.0, 0.0\]",
        ),
        (
            {"size": (np.nan, 3)},
            r"size_m: must be 2 positive numbers in metres, from 1e-6 to 1e6, got \[nan, 3.0\]",
        ),
        (
            {"size": (np.inf, 3)},
            r"size_m: must be 2 positive numbers in metres, from 1e-6 to 1e6, got \[inf, 3.0\]",
        ),
        (
            {"layout": LAYOUT.with_poses(np.zeros((2, 3, 2)), np.zeros((2, 3)))},
            r"layout: must be a single arrangement, got \(2,\)",
        ),
        (
            {"camera_speed": 0},
            "camera.speed_m_s: must be a positive number, from 1e-6 to 1e6 metres a second, got 0.0",
        ),
        (
            {"camera_speed": np.nan},
            "camera.speed_m_s: must be a positive number, from 1e-6 to 1e6 metres a second, got nan",
        ),
        ({"sites": (Site("", 0, 0),)}, r"sites\[0\].name: must be a non-empty string of Unicode, got ''"),
        (
            {"sites": (Site("S", np.nan, 0),)},
            r"sites\[0\]: must have a finite x and z, from -1e6 to 1e6 metres, got \(nan, 0.0\)",
        ),
        (
            {"sites": (Site("S", 0, 0), Site("S", 1, 0))},
            r"sites\[1\].name: must not repeat an earlier site's, got 'S'",
        ),
        (
            {"sites": (Site("S", 0, 0), Site("T", 0, 0))},
            r"sites\[1\]: must not stand where an earlier site does, got \(0.0, 0.0\)",
        ),
        (
            {"templates": (Template("chair", 0, (1, 1, 1)),) * 2},
            r"templates\[1\].category: must not repeat an earlier template's, got 'chair'",
        ),
        (
            {"symmetry": {"chair": -0.1}},
            r"symmetry\['chair'\]: must be an angle from 0 to 360 degrees, got -0.1",
        ),
        (
            {"symmetry": {"chair": 6.3}},
            r"symmetry\['chair'\]: must be an angle from 0 to 360 degrees, got 6.3",
        ),
        (
            {"symmetry": {"chair": np.nan}},
            r"symmetry\['chair'\]: must be an angle from 0 to 360 degrees, got nan",
        ),
    ],
)
def test_a_scene_that_cannot_be_is_refused_by_the_name_of_its_field(changes, message):
    with pytest.raises(SceneError, match=message):
        scene(**changes)


@pytest.mark.parametrize("wrong", [-1, np.nan, np.inf])
def test_weights_are_not_negative_and_finite(wrong):
    with pytest.raises(SceneError, match=r"weights.translation: must be a number not below 0"):
        Weights(wrong)
    with pytest.raises(SceneError, match=r"weights.rotation: must be a number not below 0"):
        Weights(1, wrong)


@pytest.mark.parametrize(
    ("yaw", "size", "message"),
    [
        (np.nan, (1, 1, 1), "template.yaw: must be finite, at most 1e6 turns, got nan"),
        (
            0,
            (1, 1),
            r"template.size: must be 3 positive numbers in metres, from 1e-6 to 1e6, got \(1.0, 1.0\)",
        ),
        (
            0,
            (1, 0, 1),
            r"template.size: must be 3 positive numbers in metres, from 1e-6 to 1e6, got \(1.0, 0.0, 1.0\)",
        ),
        (
            0,
            (1, np.inf, 1),
            r"template.size: must be 3 positive numbers in metres, from 1e-6 to 1e6, got \(1.0, inf, 1.0\)",
        ),
    ],
)
def test_a_template_that_cannot_be_is_refused(yaw, size, message):
    with pytest.raises(SceneError, match=message):
        Template("chair", yaw, size)


def test_a_scene_that_knows_another_arrangement_has_the_same_room_and_finds_the_objects_sites_anew():
    room = scene(sites=(Site("left", 0, 0), Site("right", 4, 3)))
    assert room.object_site.tolist() == [0, 1, 1]
    other = LAYOUT.with_poses([(3, 1), (1, 1), (1, 2)], [0, 0, 1])
    known = room.knowing(other)
    assert known.layout is other
    assert (known.name, known.size, known.sites) == (room.name, room.size, room.sites)
    assert known.object_site.tolist() == [1, 0, 0]
    assert room.layout is LAYOUT
