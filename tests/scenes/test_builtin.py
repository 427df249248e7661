"""The built-in scenes agree with the paper's tables, stand as the originals do, and make sense as rooms."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from farm_ar.errors import OptionError
from farm_ar.geometry import (
    footprint_corners,
    footprints_overlap,
    in_view,
    inside_footprint,
    polyline_length,
)
from farm_ar.scenes import load_scene
from farm_ar.scenes.builtin import (
    BUILTIN,
    DESCRIPTIONS,
    FACING_S1,
    FACING_S4,
    builtin_names,
    builtin_scene,
)
from farm_ar.scenes.builtin.furniture import Model, Piece, as_left, facing_rows, placed, ring, wander
from farm_ar.scenes.camera import PAPER_FIELD_OF_VIEW
from farm_ar.scenes.scene import Scene, Weights

# Sites, object types, objects, side of the square room in metres.
TABLE_1 = {
    "L1": (2, 1, 16, 5.0),
    "L2": (4, 1, 8, 8.0),
    "M1": (5, 3, 35, 8.0),
    "M2": (6, 2, 30, 5.0),
    "H1": (10, 5, 52, 7.0),
    "H2": (14, 11, 48, 15.0),
}
# Sites, chairs, square metres.
TABLE_4 = {"pantry": (2, 10, 18.0), "cafeteria": (5, 16, 49.0), "classroom": (7, 29, 130.0)}

each_scene = pytest.mark.parametrize("name", BUILTIN)
each_synthetic = pytest.mark.parametrize("name", TABLE_1)
each_room = pytest.mark.parametrize("name", [name for name in BUILTIN if name != "farm"])


def nearest(position, k=1):
    """(N,) distance of each of N > k points to its k-th nearest other."""
    distance = np.linalg.norm(position[:, None] - position[None], axis=-1)
    return np.sort(distance, axis=1)[:, k]


def same_category_spacing(scene: Scene, k=1):
    """Mean distance to the k-th nearest object of the same category, where there are that many."""
    code, position = scene.layout.category_code, scene.layout.position
    groups = [position[code == c] for c in np.unique(code)]
    return np.concatenate([nearest(group, k) for group in groups if len(group) > k]).mean()


def seat_spacing(scene: Scene):
    """Mean distance of a chair, of whatever category, to the nearest other chair."""
    return nearest(scene.layout.position[["chair" in name for name in scene.layout.category]]).mean()


def seen_from_path(scene: Scene, count=200):
    """Mean number of objects in view from equally spaced poses on the scene's path."""
    camera = scene.camera_path.cameras(count, PAPER_FIELD_OF_VIEW)
    fov = camera.fov
    seen = in_view(scene.layout.position, camera.position, camera.yaw, fov.left, fov.right, fov.range_m)
    return seen.sum(axis=-1).mean()


def heading_spread(scene: Scene):
    """Mean rotation cost (Eq. 5) between two objects of one category."""
    code, yaw = scene.layout.category_code, scene.layout.yaw
    pairs = (code[:, None] == code[None]) & ~np.eye(len(code), dtype=bool)
    return np.abs(np.sin((yaw[:, None] - yaw[None]) / 2))[pairs].mean()


@each_synthetic
def test_synthetic_scenes_agree_with_table_1(name):
    scene, (sites, types, objects, side) = builtin_scene(name), TABLE_1[name]
    assert (len(scene.sites), len(scene.layout.categories), len(scene.layout)) == (sites, types, objects)
    assert scene.size == (side, side)
    assert scene.fov == PAPER_FIELD_OF_VIEW
    assert scene.cost_weights.translation == pytest.approx(0.36 * side)


@pytest.mark.parametrize("name", TABLE_4)
def test_real_rooms_agree_with_table_4(name):
    scene, (sites, chairs, area) = builtin_scene(name), TABLE_4[name]
    assert (len(scene.sites), scene.layout.category, scene.area) == (sites, ("chair",) * chairs, area)


def test_the_lab_has_seven_chairs():
    scene = builtin_scene("lab")
    assert scene.layout.category == ("chair",) * 7
    assert scene.layout.movable.all()


@each_room
def test_objects_are_numbered_from_1(name):
    layout = builtin_scene(name).layout
    assert layout.labels == tuple(str(i + 1) for i in range(len(layout)))


@each_synthetic
def test_categories_are_made_up_as_in_the_originals(name, paper_scenes: Path):
    ours, theirs = builtin_scene(name).layout, load_scene(paper_scenes / f"{name}.json").layout
    assert sorted(Counter(ours.category).values()) == sorted(Counter(theirs.category).values())


@each_synthetic
@pytest.mark.parametrize(
    "spacing",
    [
        same_category_spacing,
        lambda scene: nearest(scene.layout.position).mean(),
        seat_spacing,
        lambda scene: same_category_spacing(scene, 3),
    ],
    ids=["same category", "any object", "any chair", "third of same category"],
)
def test_spacing_is_within_15_percent_of_the_originals(name, spacing, paper_scenes: Path):
    theirs = spacing(load_scene(paper_scenes / f"{name}.json"))
    assert spacing(builtin_scene(name)) == pytest.approx(theirs, rel=0.15)


@each_synthetic
def test_the_path_shows_about_as_much_as_in_the_originals(name, paper_scenes: Path):
    ours, theirs = builtin_scene(name), load_scene(paper_scenes / f"{name}.json")
    assert ours.camera_path.length == pytest.approx(theirs.camera_path.length, rel=0.25)
    assert seen_from_path(ours) == pytest.approx(seen_from_path(theirs), rel=0.25)


@each_synthetic
def test_headings_vary_as_in_the_originals(name, paper_scenes: Path):
    theirs = heading_spread(load_scene(paper_scenes / f"{name}.json"))
    assert heading_spread(builtin_scene(name)) == pytest.approx(theirs, abs=0.06)


@each_scene
def test_footprints_lie_inside_the_room(name):
    scene = builtin_scene(name)
    corners = footprint_corners(scene.layout.position, scene.layout.yaw, scene.layout.size)
    assert (corners >= 0).all()
    assert (corners <= scene.size).all()


@each_scene
def test_only_a_chair_and_its_table_overlap(name):
    layout = builtin_scene(name).layout
    surface = np.array([category.endswith(("table", "desk")) for category in layout.category])
    i, j = np.triu_indices(len(layout), 1)
    alike = surface[i] == surface[j]
    i, j = i[alike], j[alike]
    poses = layout.position, layout.yaw, layout.size
    overlap = footprints_overlap(*(value[i] for value in poses), *(value[j] for value in poses))
    assert [(layout.labels[a], layout.labels[b]) for a, b in zip(i[overlap], j[overlap], strict=True)] == []


@each_room
def test_the_camera_wanders_through_the_whole_room_and_never_through_furniture(name):
    scene = builtin_scene(name)
    path, layout = scene.camera_path.polyline, scene.layout
    assert scene.camera_path.closed
    np.testing.assert_array_equal(path[0], path[-1])
    assert (path > 0).all()
    assert (path < scene.size).all()
    assert not inside_footprint(path[:, None], layout.position, layout.yaw, layout.size).any()
    # Past every group: at most a fifth of the room's diagonal from its middle.
    to_site = np.linalg.norm(path[:, None] - scene.site_positions, axis=-1).min(axis=0)
    assert (to_site < 0.2 * scene.diagonal).all()


@each_scene
def test_templates_are_the_first_of_each_category(name):
    scene = builtin_scene(name)
    assert {template.category for template in scene.templates} == set(scene.layout.categories)
    for template in scene.templates:
        first = scene.layout.category.index(template.category)
        assert template.yaw == scene.layout.yaw[first]
        assert template.size == tuple(scene.layout.size[first])


@each_scene
def test_a_scene_is_built_once_and_the_same_every_time(name):
    scene, again = builtin_scene(name), BUILTIN[name]()
    assert builtin_scene(name) is scene
    assert again is not scene
    np.testing.assert_array_equal(again.layout.position, scene.layout.position)
    np.testing.assert_array_equal(again.layout.yaw, scene.layout.yaw)
    assert scene.name == name


def test_every_scene_has_a_description_of_one_line():
    assert builtin_names() == tuple(DESCRIPTIONS)
    for text in DESCRIPTIONS.values():
        assert text.endswith(".")
        assert "\n" not in text


def test_an_unknown_name_is_answered_with_those_known():
    with pytest.raises(OptionError, match=r"scene: must be one of .*cafeteria.*, got 'L3'"):
        builtin_scene("L3")


def farm_seen(camera):
    """Labels of the farm whose whole footprint, and those of which at least a corner, the camera sees."""
    layout, fov = builtin_scene("farm").layout, camera.fov
    corners = footprint_corners(layout.position, layout.yaw, layout.size)
    seen = in_view(corners, camera.position, camera.yaw, fov.left, fov.right, fov.range_m)
    whole = {label for label, corner in zip(layout.labels, seen, strict=True) if corner.all()}
    part = {label for label, corner in zip(layout.labels, seen, strict=True) if corner.any()}
    return whole, part


def test_facing_s1_the_player_sees_the_shed_three_coops_and_three_hutches():
    whole, part = farm_seen(FACING_S1)
    around_s1 = {"yellow-coop", "blue-coop", "red-coop", "cyan-hutch", "magenta-hutch", "purple-hutch"}
    assert whole == part == around_s1 | {"shed"}


def test_facing_s4_the_player_sees_part_of_the_shed_two_coops_and_two_hutches():
    whole, part = farm_seen(FACING_S4)
    assert whole == {"orange-coop", "green-coop", "white-hutch", "brown-hutch"}
    assert part - whole == {"shed"}


@pytest.mark.parametrize("camera", [FACING_S1, FACING_S4])
def test_the_player_stands_at_s3_with_eyes_above_the_table_and_looks_down(camera):
    s3 = next(site for site in builtin_scene("farm").sites if site.name == "S3")
    assert camera.position == pytest.approx([s3.x, s3.z])
    assert camera.height == pytest.approx(0.45)
    assert -np.pi / 4 < camera.pitch < 0


def test_the_farm_is_the_games_table():
    scene = builtin_scene("farm")
    assert scene.size == (1.2, 0.8)
    assert scene.weights == Weights(1.0, 1.0)
    assert scene.camera_path is None
    assert {s.name: (s.x, s.z) for s in scene.sites} == {
        "S1": (0.33, 0.45),
        "S4": (0.90, 0.45),
        "S2": (0.60, 1.10),
        "S3": (0.60, -0.30),
    }
    layout = scene.layout
    assert Counter(layout.category) == {"coop": 5, "hutch": 5, "shed": 1}
    assert [label for label, fixed in zip(layout.labels, layout.fixed, strict=True) if fixed] == ["shed"]
    sizes = {category: tuple(layout.size[layout.category.index(category)]) for category in layout.categories}
    assert sizes == {"coop": (0.10, 0.08, 0.09), "hutch": (0.09, 0.07, 0.07), "shed": (0.20, 0.14, 0.16)}


def test_each_building_stands_in_the_cell_of_its_site():
    scene = builtin_scene("farm")
    at = {label: scene.sites[k].name for label, k in zip(scene.layout.labels, scene.object_site, strict=True)}
    assert {label for label, site in at.items() if site == "S4"} == {
        "orange-coop",
        "green-coop",
        "white-hutch",
        "brown-hutch",
    }
    assert set(at.values()) == {"S1", "S4"}


def test_a_hand_finds_room_between_the_farms_buildings():
    layout = builtin_scene("farm").layout
    assert nearest(layout.position).min() > 0.13
    movable = layout.yaw[layout.movable]
    assert (np.abs(np.rad2deg((movable + np.pi) % (2 * np.pi) - np.pi)) <= 30).all()


CHAIR = Model("chair", (0.4, 0.8, 0.4))


def test_a_ring_of_chairs_faces_its_middle():
    for piece, radius in zip(ring(CHAIR, (1.0, 2.0, 3.0), 30.0), (1.0, 2.0, 3.0), strict=True):
        ahead = np.array([np.sin(np.deg2rad(piece.yaw_deg)), np.cos(np.deg2rad(piece.yaw_deg))])
        np.testing.assert_allclose((piece.x, piece.z) + radius * ahead, 0, atol=1e-12)


def test_facing_rows_face_one_another():
    near, far = facing_rows(CHAIR, [0.3], apart=2.0)
    assert (near.x, near.z, near.yaw_deg) == (0.3, -1.0, 0.0)
    assert (far.x, far.z, far.yaw_deg) == (0.3, 1.0, 180.0)


def test_a_group_turned_clockwise_takes_its_front_to_the_right():
    front, right = placed([Piece(CHAIR, 0.0, 1.0, 10.0), Piece(CHAIR, 2.0, 0.0)], 5.0, 7.0, 90.0)
    assert (front.x, front.z, front.yaw_deg) == pytest.approx((6.0, 7.0, 100.0))
    assert (right.x, right.z, right.yaw_deg) == pytest.approx((5.0, 5.0, 90.0))


def test_people_leave_things_within_two_deviations(rng):
    left = as_left([Piece(CHAIR, 1.0, 2.0, 45.0)] * 500, rng, shift_m=0.1, turn_deg=10.0)
    off = np.array([(p.x - 1.0, p.z - 2.0, p.yaw_deg - 45.0) for p in left]) / (0.1, 0.1, 10.0)
    assert np.abs(off).max() <= 2.0 + 1e-9
    assert off.std(axis=0) == pytest.approx(0.959, abs=0.06)  # a normal clipped at two deviations


def test_a_wandering_path_is_smooth_and_passes_its_stops():
    stops = [(0.0, 0.0), (3.0, 1.0), (4.0, 4.0), (1.0, 5.0)]
    path = wander(stops)
    np.testing.assert_allclose(path.points[:-1:3], stops)
    arriving, leaving = path.points[2::3], np.roll(path.points[1::3], -1, axis=0)
    anchors = path.points[3::3]
    step_in, step_out = anchors - arriving, leaving - anchors
    cross = step_in[:, 0] * step_out[:, 1] - step_in[:, 1] * step_out[:, 0]
    np.testing.assert_allclose(cross, 0, atol=1e-12)
    assert (np.sum(step_in * step_out, axis=1) > 0).all()
    assert path.length > polyline_length(np.array(stops), closed=True)
