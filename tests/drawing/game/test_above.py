from dataclasses import replace

import numpy as np
import pytest

from farm_ar.drawing.game.above import TableFromAbove
from farm_ar.drawing.game.colours import GO, ICE, WRONG, Image, label_colours
from farm_ar.drawing.game.pixel_observation import PixelObservation
from farm_ar.game_logic.physics.gripper import HandState
from farm_ar.game_logic.render_state import RenderState
from farm_ar.scenes import Camera, Scene
from farm_ar.scenes.builtin import FACING_S1, FACING_S4, builtin_scene

FARM = builtin_scene("farm")
HAND = HandState(np.array([0.6, 0.2]), 0.0, np.zeros(2), None, True)


def start(scene: Scene = FARM, camera: Camera = FACING_S1) -> RenderState:
    """The game before anything has happened."""
    n = len(scene.layout)
    wrong = np.zeros(n, dtype=bool)
    return RenderState(
        scene, scene.layout, scene.layout, wrong, camera, counts=np.arange(n), misplaced=np.zeros(n)
    )


def exchanged(state: RenderState, *labels: str) -> RenderState:
    """The same, but two labels are believed in each other's place."""
    layout = state.believed
    i, j = (layout.index(label) for label in labels)
    order = np.arange(len(layout))
    order[[i, j]] = j, i
    wrong = np.array(state.wrong)
    wrong[[i, j]] = True
    return replace(state, believed=layout.with_poses(layout.position[order], layout.yaw[order]), wrong=wrong)


def with_animals(state: RenderState, count: int = 30) -> RenderState:
    rng = np.random.default_rng(0)
    places = np.array([0.62, 0.2]) + rng.uniform(-0.08, 0.08, size=(count, 2))
    goal = np.arange(count) % 10
    return replace(state, animal=places, animal_heading=rng.uniform(-3, 3, count), animal_goal=goal)


def share_of(image: Image, colour: tuple[int, int, int], tolerance: int = 12) -> float:
    return float((np.abs(image.astype(int) - colour).max(axis=-1) <= tolerance).mean())


def test_a_picture_has_the_size_asked_for_and_is_rgb():
    assert TableFromAbove(FARM).draw(start()).shape == (480, 640, 3)
    wide = TableFromAbove(FARM, (800, 500)).draw(start())
    assert wide.shape == (500, 800, 3)
    assert wide.dtype == np.uint8
    meadow = wide[200:300, 200:600].reshape(-1, 3).mean(axis=0)
    assert meadow[1] > meadow[0] > meadow[2]


def test_equal_moments_give_equal_bytes_from_any_drawer():
    state = with_animals(exchanged(start(), "blue-coop", "red-coop"))
    first = TableFromAbove(FARM)
    first.draw(start())
    assert first.draw(state).tobytes() == TableFromAbove(FARM).draw(state).tobytes()


@pytest.mark.parametrize("labels", [True, False])
def test_a_wrong_label_is_red_and_a_right_one_is_not(labels: bool):
    drawer = TableFromAbove(FARM)
    right = drawer.draw(start(), labels)
    wrong = drawer.draw(exchanged(start(), "white-hutch", "brown-hutch"), labels)
    assert share_of(right, WRONG, 3) < 0.001
    assert share_of(wrong, WRONG, 3) > 2 * share_of(right, WRONG, 3) + 0.001


def test_a_belief_that_differs_from_the_truth_has_an_outline_in_its_colour():
    state = start()
    i = FARM.layout.index("cyan-hutch")
    position = FARM.layout.position.copy()
    position[i] += [0.4, -0.1]
    moved = replace(state, believed=FARM.layout.with_poses(position, FARM.layout.yaw))
    drawer = TableFromAbove(FARM)
    x, y = drawer.viewport.pixels(position[i] + np.array([-0.02, 0.01])).astype(int)
    cyan = label_colours(["cyan-hutch"])[0]
    without = drawer.draw(moved, labels=False, beliefs=False)[y, x].astype(int)
    outlined = drawer.draw(moved, labels=False)[y, x].astype(int)
    assert np.abs(outlined - cyan).sum() < np.abs(without - cyan).sum() - 40


def test_nothing_of_the_belief_is_seen_where_it_is_not_wanted():
    drawer = TableFromAbove(FARM)
    wrong = exchanged(start(), "yellow-coop", "green-coop")
    for labels in (True, False):
        hidden = drawer.draw(wrong, labels=labels, beliefs=False)
        assert np.array_equal(hidden, drawer.draw(start(), labels=labels, beliefs=False))


def test_without_labels_nothing_is_written():
    drawer = TableFromAbove(FARM)
    plain = drawer.draw(start(), labels=False)
    counted = replace(start(), counts=np.full(len(FARM.layout), 77), caption="a caption", seconds=0.4)
    assert share_of(plain[:24], GO) == 0 < share_of(drawer.draw(start())[:24], GO)
    assert np.array_equal(plain, drawer.draw(replace(counted, seconds=0.0), labels=False))


def test_a_frozen_picture_is_blue_and_says_so_and_its_animals_stay():
    drawer = TableFromAbove(FARM)
    state = with_animals(start())
    frozen = replace(state, phase="hand")
    play, ice = drawer.draw(state), drawer.draw(frozen)
    assert share_of(ice[:24], ICE) > 0.2 > share_of(play[:24], ICE)
    table = np.s_[60:320, 100:540]
    bluer = ice[table].astype(int)[..., 2] - play[table].astype(int)[..., 2]
    assert bluer.mean() > 20
    away = replace(frozen, hand=replace(HAND, position=np.array([0.15, 0.1])))
    x, y = drawer.viewport.pixels(np.array([0.62, 0.2])).astype(int)
    near = np.s_[y - 30 : y + 30, x - 30 : x + 30]
    assert np.array_equal(ice[near], drawer.draw(away)[near])
    assert not np.array_equal(ice, drawer.draw(away))


def test_an_animal_is_drawn_in_its_labels_colour_where_it_is():
    drawer = TableFromAbove(FARM)
    goal = FARM.layout.index("magenta-hutch")
    animal = np.array([[0.62, 0.2]])
    one = replace(start(), animal=animal, animal_heading=np.array([1.0]), animal_goal=np.array([goal]))
    x, y = drawer.viewport.pixels(animal[0]).astype(int)
    area = np.s_[y - 12 : y + 12, x - 12 : x + 12]
    magenta = label_colours(FARM.layout.labels)[goal]
    assert share_of(drawer.draw(one, labels=False)[area], magenta, 60) > 0.1
    assert share_of(drawer.draw(start(), labels=False)[area], magenta, 60) == 0


def test_what_is_in_view_is_lighter_than_what_is_not():
    drawer = TableFromAbove(FARM)
    x, y = drawer.viewport.pixels(np.array([1.05, 0.12])).astype(int)
    facing = drawer.draw(start(camera=FACING_S4))[y - 4 : y + 4, x - 4 : x + 4]
    turned = drawer.draw(start(camera=FACING_S1))[y - 4 : y + 4, x - 4 : x + 4]
    assert facing.mean() > turned.mean() + 5


@pytest.mark.parametrize("name", ["farm", "L1", "H1", "H2"])
def test_labels_lie_in_the_picture_and_none_over_another(name: str):
    scene = builtin_scene(name)
    state = start(scene, Camera(np.array(scene.size) / 2, 0.3))
    if name != "farm":
        state = replace(state, counts=None, misplaced=None)
    box = TableFromAbove(scene).label_placement(state).box
    assert len(box) == scene.layout.movable.sum()
    for k, (left, top, right, bottom) in enumerate(box):
        assert left >= 0
        assert top >= 24
        assert right <= 640
        assert bottom <= 480
        others = box[k + 1 :]
        apart = (others[:, 0] >= right) | (others[:, 2] <= left) | (others[:, 1] >= bottom)
        assert np.all(apart | (others[:, 3] <= top))


def test_labels_stay_where_they_are_while_counters_rise_and_buildings_are_moved():
    drawer, state = TableFromAbove(FARM), replace(start(), counts=np.full(11, 8))
    before = drawer.label_placement(state).box
    truth = FARM.layout.with_poses(FARM.layout.position + 0.01, FARM.layout.yaw)
    later = replace(state, counts=np.full(11, 12), truth=truth, phase="hand", hand=HAND)
    assert np.array_equal(drawer.label_placement(later).box, before)


def test_a_hand_is_skin_coloured_and_comes_from_the_near_side():
    drawer = TableFromAbove(FARM)
    with_hand = drawer.draw(replace(start(), phase="hand", hand=HAND), labels=False)
    without = drawer.draw(replace(start(), phase="hand"), labels=False)
    rows, columns = np.nonzero((with_hand != without).any(axis=-1))
    x, y = drawer.viewport.pixels(HAND.position)
    assert abs(np.median(columns) - x) < 12
    assert y - 45 < rows.min() < y
    assert rows.max() == 479


def test_life_around_the_buildings_moves_with_the_time_played_only():
    drawer = TableFromAbove(FARM)
    first, later = (drawer.draw(replace(start(), seconds=s), labels=False) for s in (0.0, 3.0))
    assert not np.array_equal(first, later)
    assert np.array_equal(first, drawer.draw(start(), labels=False))
    room = builtin_scene("L1")
    still = [TableFromAbove(room).draw(replace(start(room), seconds=s), labels=False) for s in (0.0, 3.0)]
    assert np.array_equal(*still)


@pytest.mark.parametrize("name", ["farm", "L1", "H1"])
def test_the_small_picture_shows_belief_only_when_asked_to(name: str):
    scene = builtin_scene(name)
    width = round(96 * scene.size[0] / scene.size[1])
    drawer = TableFromAbove(scene, (width, 96))
    state = start(scene, Camera(np.array(scene.size) / 2, 0.3))
    elsewhere = scene.layout.with_poses(scene.layout.position[::-1], scene.layout.yaw)
    believing = replace(state, believed=elsewhere)
    small = drawer.draw_pixel_observation(state, beliefs=False)
    assert small.shape == (96, width, 3)
    assert np.array_equal(small, drawer.draw_pixel_observation(believing, beliefs=False))
    assert not np.array_equal(
        drawer.draw_pixel_observation(state, True), drawer.draw_pixel_observation(believing, True)
    )


def test_the_small_picture_hides_which_label_a_building_has():
    i, j = FARM.layout.index("yellow-coop"), FARM.layout.index("green-coop")
    order = np.arange(len(FARM.layout))
    order[[i, j]] = j, i
    truth = FARM.layout.with_poses(FARM.layout.position[order], FARM.layout.yaw[order])
    drawer = PixelObservation(FARM)
    assert np.array_equal(drawer.draw(start(), False), drawer.draw(replace(start(), truth=truth), False))


def test_the_small_picture_shows_truth_heading_view_and_hand():
    drawer, state = PixelObservation(FARM), start()
    layout = FARM.layout
    changes = [
        replace(state, truth=layout.with_poses(layout.position + 0.02, layout.yaw)),
        replace(state, truth=layout.with_poses(layout.position, layout.yaw + np.pi)),
        replace(state, camera=FACING_S4),
        replace(state, hand=replace(HAND, raised=False)),
    ]
    first = drawer.draw(state, False)
    assert first.shape == (96, 144, 3)
    for change in changes:
        assert not np.array_equal(first, drawer.draw(change, False))


def test_labels_leave_the_names_of_sites_and_the_animals_before_the_sheds_door_in_sight():
    drawer = TableFromAbove(FARM)
    box = drawer.label_placement(start()).box
    shed = FARM.layout.index("shed")
    before_door = FARM.layout.position[shed] - np.array([0.0, FARM.layout.size[shed, 2] / 2])
    kept_free = [before_door - np.array([0.0, ahead]) for ahead in (0.02, 0.08, 0.14)]
    kept_free += [np.array([site.x, site.z]) for site in FARM.sites if site.name in ("S1", "S4")]
    for x, y in drawer.viewport.pixels(np.array(kept_free)):
        covered = (box[:, 0] <= x) & (x <= box[:, 2]) & (box[:, 1] <= y) & (y <= box[:, 3])
        assert not covered.any()


def test_the_name_of_the_site_on_which_the_player_stands_is_written_beside_the_head():
    drawer = TableFromAbove(FARM)
    away = replace(FACING_S1, position=FACING_S1.position + np.array([0.3, 0.0]))
    x, y = drawer.viewport.pixels(np.array([0.60, -0.30])).astype(int)
    beside, at_site = np.s_[y - 22 : y - 6, x + 30 : x + 48], np.s_[y - 14 : y, x + 4 : x + 22]
    on_site, elsewhere = (drawer.draw(start(camera=camera), labels=False) for camera in (FACING_S1, away))
    assert (
        share_of(on_site[beside], (252, 250, 244), 30)
        > 0.1
        > share_of(elsewhere[beside], (252, 250, 244), 30)
    )
    assert share_of(elsewhere[at_site], (252, 250, 244), 30) > 0.1
