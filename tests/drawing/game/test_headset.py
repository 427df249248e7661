from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.drawing.game.colours import WRONG, Image, label_colours
from farm_ar.drawing.game.floating_labels import stack
from farm_ar.drawing.game.headset import HeadsetView
from farm_ar.drawing.game.pinhole import NEAR_M, Pinhole, before_camera
from farm_ar.game_logic.physics.gripper import HandState
from farm_ar.game_logic.render_state import RenderState
from farm_ar.geometry import direction
from farm_ar.scenes import Camera, FieldOfView, Scene
from farm_ar.scenes.builtin import FACING_S1, FACING_S4, builtin_scene

FARM = builtin_scene("farm")
HAND = HandState(np.array([0.45, 0.3]), 0.0, np.zeros(2), None, True)


def start(scene: Scene = FARM, camera: Camera = FACING_S1) -> RenderState:
    n = len(scene.layout)
    return RenderState(
        scene,
        scene.layout,
        scene.layout,
        np.zeros(n, dtype=bool),
        camera,
        counts=np.arange(n),
        misplaced=None,
    )


def has(image: Image, colour: tuple[int, int, int], tolerance: int = 40) -> bool:
    return bool((np.abs(image.astype(int) - colour).max(axis=-1) <= tolerance).sum() > 15)


def test_a_picture_has_the_size_asked_for_and_equal_moments_give_equal_bytes():
    first = HeadsetView(FARM, (320, 240)).draw(start())
    assert first.shape == (240, 320, 3)
    drawer = HeadsetView(FARM, (320, 240))
    drawer.draw(start(camera=FACING_S4))
    assert drawer.draw(start()).tobytes() == first.tobytes()


def test_the_ends_of_the_view_are_the_sides_of_the_picture():
    fov = FieldOfView(np.deg2rad(20.0), np.deg2rad(40.0), 3.0)
    camera = Camera(np.array([1.0, 2.0]), 0.7, fov, np.array(0.5))
    view = Pinhole.of(camera, 400, 300)
    for angle, column in ((-fov.left, 0.0), (0.0, view.middle[0]), (fov.right, 400.0)):
        place = camera.position + 2.0 * direction(0.7 + angle)
        pixel = view.pixels(view.frame(np.array([place[0], 0.5, place[1]])))
        assert pixel == pytest.approx([column, 150.0])


def test_what_is_behind_the_eye_is_cut_off():
    across = np.array([(-1.0, 0.0, -1.0), (1.0, 0.0, -1.0), (1.0, 0.0, 3.0), (-1.0, 0.0, 3.0)])
    assert before_camera(across)[:, 2].min() == pytest.approx(NEAR_M)
    assert len(before_camera(across)) == 4
    assert len(before_camera(across - [0.0, 0.0, 5.0])) == 0


def test_a_building_that_is_moved_is_seen_elsewhere_but_its_label_stays():
    drawer = HeadsetView(FARM)
    position = FARM.layout.position.copy()
    i = FARM.layout.index("cyan-hutch")
    position[i] += [0.3, -0.05]
    moved = replace(start(), truth=FARM.layout.with_poses(position, FARM.layout.yaw))
    before, after = drawer.draw(start()), drawer.draw(moved)
    view = Pinhole.of(FACING_S1, 480, 480)
    x, y = view.pixels(view.frame(np.array([position[i, 0], 0.03, position[i, 1]]))).astype(int)
    assert not np.array_equal(before[y - 5 : y + 5, x - 5 : x + 5], after[y - 5 : y + 5, x - 5 : x + 5])
    believed = replace(moved, believed=moved.truth)
    assert not np.array_equal(after, drawer.draw(believed))


@pytest.mark.parametrize(("camera", "label"), [(FACING_S1, "yellow-coop"), (FACING_S4, "green-coop")])
def test_a_label_floats_only_where_it_is_believed_in_view(camera: Camera, label: str):
    drawer, counts = HeadsetView(FARM), np.zeros(len(FARM.layout), dtype=int)
    counts[FARM.layout.index(label)] = 55
    for gaze in (FACING_S1, FACING_S4):
        state = start(camera=gaze)
        counted = replace(state, counts=counts)
        blank = replace(state, counts=np.zeros_like(counts))
        seen = not np.array_equal(drawer.draw(counted), drawer.draw(blank))
        assert seen == (gaze is camera)


def test_a_label_beyond_the_range_of_the_view_does_not_float():
    short = replace(FACING_S1, fov=FieldOfView(FACING_S1.fov.left, FACING_S1.fov.right, 0.65))
    drawer, state = HeadsetView(FARM), start(camera=short)
    for label, seen in (("yellow-coop", False), ("cyan-hutch", True)):
        counts = np.zeros(len(FARM.layout), dtype=int)
        counts[FARM.layout.index(label)] = 55
        blank = drawer.draw(replace(state, counts=np.zeros_like(counts)))
        assert np.array_equal(drawer.draw(replace(state, counts=counts)), blank) != seen


def test_the_headset_does_not_know_that_a_label_is_wrong():
    drawer = HeadsetView(FARM)
    wrong = replace(start(), wrong=np.ones(len(FARM.layout), dtype=bool))
    assert np.array_equal(drawer.draw(start()), drawer.draw(wrong))


def test_an_animal_stands_where_it_is_and_hops_only_when_it_moves():
    drawer, place = HeadsetView(FARM), np.array([[0.45, 0.25]])
    bunny = FARM.layout.index("magenta-hutch")
    one = replace(start(), animal=place, animal_heading=np.zeros(1), animal_goal=np.array([bunny]))
    view = Pinhole.of(FACING_S1, 480, 480)
    x, y = view.pixels(view.frame(np.array([0.45, 0.015, 0.25]))).astype(int)
    area = np.s_[y - 12 : y + 12, x - 12 : x + 12]
    magenta = label_colours(FARM.layout.labels)[bunny]
    assert has(drawer.draw(one)[area], magenta)
    assert not has(drawer.draw(start())[area], magenta)
    later = drawer.draw(replace(one, seconds=0.4))
    assert np.array_equal(drawer.draw(one)[area], later[area])


def test_a_frozen_picture_is_bluer_and_the_hand_is_seen_in_it():
    drawer = HeadsetView(FARM)
    play, frozen = drawer.draw(start()), drawer.draw(replace(start(), phase="hand"))
    assert (frozen[300:440, 100:400, 2].astype(int) - play[300:440, 100:400, 2]).mean() > 20
    with_hand = drawer.draw(replace(start(), phase="hand", hand=HAND))
    changed = (with_hand != frozen).any(axis=-1)
    assert changed[:200].sum() < changed[200:].sum()
    assert changed[-1].any() or changed[:, -1].any() or changed[:, 0].any()


def test_what_the_view_does_not_reach_up_and_down_is_dark():
    fov = FieldOfView.symmetric(np.deg2rad(43.0), 1.5, np.deg2rad(29.0))
    narrow = Camera(FACING_S1.position, FACING_S1.yaw, fov, FACING_S1.height, FACING_S1.pitch)
    whole = replace(narrow, fov=FieldOfView.symmetric(np.deg2rad(43.0), 1.5))
    drawer = HeadsetView(FARM, header=False)
    limited, free = (drawer.draw(start(camera=camera)) for camera in (narrow, whole))
    assert limited[-20:].mean() < 0.5 * free[-20:].mean()
    assert np.array_equal(limited[300:320], free[300:320])


@pytest.mark.parametrize("name", ["L1", "H1", "pantry"])
def test_any_scene_can_be_seen_from_inside(name: str):
    scene = builtin_scene(name)
    assert scene.camera_path is not None
    cameras = scene.camera_path.cameras(8, scene.fov)
    drawer = HeadsetView(scene)
    pictures = [drawer.draw(start(scene, cameras.at(k))) for k in range(8)]
    assert len({picture.tobytes() for picture in pictures}) == 8


@given(st.lists(st.tuples(st.floats(0, 480), st.floats(10, 90), st.floats(20, 470)), min_size=1, max_size=12))
def test_floating_labels_never_cover_each_other(labels: list[tuple[float, float, float]]):
    middle, half, base = np.array(labels).T
    row = stack(middle, half, base, 18.0, 40.0, 476.0)
    for i in range(len(row)):
        for j in range(i):
            over = abs(middle[i] - middle[j]) < half[i] + half[j] - 1e-6
            assert not over or np.isnan(row[i] + row[j]) or abs(row[i] - row[j]) >= 18.0 - 1e-6
    assert np.all(np.isnan(row) | ((row >= 40.0) & (row <= 476.0)))


def test_labels_with_room_float_where_they_belong_and_glide_when_they_come_near():
    half, base = np.array([50.0, 50.0]), np.array([300.0, 290.0])
    rows = [
        stack(np.array([200.0, x]), half, base, 18.0, 40.0, 476.0) for x in np.arange(350.0, 250.0, -0.25)
    ]
    assert rows[0] == pytest.approx(base)
    assert rows[-1] == pytest.approx([300.0, 282.0])
    assert np.abs(np.diff(rows, axis=0)).max() < 2.5


def test_an_object_that_is_not_where_it_is_believed_has_an_outline_there_in_its_labels_colour():
    drawer = HeadsetView(FARM)
    position = FARM.layout.position.copy()
    i = FARM.layout.index("cyan-hutch")
    position[i] += [0.25, -0.05]
    believed = replace(start(), believed=FARM.layout.with_poses(position, FARM.layout.yaw))
    view = Pinhole.of(FACING_S1, 480, 480)
    x, y = view.pixels(view.frame(np.array([position[i, 0], 0.0, position[i, 1]]))).astype(int)
    area = np.s_[y - 30 : y + 30, x - 40 : x + 40]
    cyan = label_colours(FARM.layout.labels)[i]
    assert has(drawer.draw(believed)[area], cyan)
    assert not has(drawer.draw(start())[area], cyan)


def test_an_outline_behind_the_eye_is_not_drawn():
    inside = Camera(np.array([0.6, 0.4]), 0.0, FACING_S1.fov, np.array(0.2))
    position = FARM.layout.position.copy()
    position[FARM.layout.index("cyan-hutch")] = [0.6, 0.1]
    moved = FARM.layout.with_poses(position, FARM.layout.yaw)
    drawer, plain = HeadsetView(FARM), start(camera=inside)
    assert np.array_equal(drawer.draw(replace(plain, believed=moved)), drawer.draw(plain))


def test_a_building_hides_an_animal_behind_it_but_not_one_before_it():
    i = FARM.layout.index("cyan-hutch")
    place, colour = FARM.layout.position[i], label_colours(FARM.layout.labels)[i]
    away = (place - FACING_S1.position) / np.linalg.norm(place - FACING_S1.position)
    drawer, seen = HeadsetView(FARM), []
    for step in (-0.1, 0.1):
        one = replace(
            start(), animal=(place + step * away)[None], animal_heading=np.zeros(1), animal_goal=np.array([i])
        )
        changed = (drawer.draw(one) != drawer.draw(start())).any(axis=-1)
        seen.append(int((np.abs(drawer.draw(one)[changed].astype(int) - colour).max(axis=-1) < 40).sum()))
    assert seen[0] > 100 > 3 * seen[1]


def test_what_is_kept_from_the_picture_before_does_not_show():
    drawer, state = HeadsetView(FARM), start()
    layout = FARM.layout
    position = layout.position.copy()
    position[1] += [0.1, -0.1]
    moved = replace(state, truth=layout.with_poses(position, layout.yaw))
    turned = replace(state, truth=layout.with_poses(layout.position, layout.yaw + 0.3))
    for other in (moved, turned, start(camera=FACING_S4), state, moved):
        assert np.array_equal(drawer.draw(other), HeadsetView(FARM).draw(other))


def test_parts_can_be_taken_off_and_gates_opened():
    view, shed = HeadsetView(FARM, (320, 240)), FARM.layout.category.index("shed")
    for camera, index, change in (
        (FACING_S4, 4, {"missing": {4: ("stairs", "ramp")}}),
        (FACING_S1, shed, {"open_gates": {shed: 1.0}}),
    ):
        moment = start(camera=camera)
        whole, changed = view.draw(moment), view.draw(replace(moment, **change))
        pinhole, place = Pinhole.of(camera, 320, 240), FARM.layout.position[index]
        pixel = pinhole.pixels(pinhole.frame(np.array([place[0], 0.03, place[1]])))
        differs = np.argwhere((changed != whole).any(axis=-1))
        assert 10 < len(differs) < 2000
        assert np.linalg.norm(differs.mean(axis=0)[::-1] - pixel) < 40
        assert view.draw(moment).tobytes() == whole.tobytes()


def test_a_wrong_label_is_marked_only_where_the_truth_is_shown():
    wrong = np.zeros(len(FARM.layout), dtype=bool)
    wrong[FARM.layout.labels.index("cyan-hutch")] = True
    view, moment = HeadsetView(FARM, (480, 480)), replace(start(), wrong=wrong)
    hidden, shown = view.draw(moment), view.draw(moment, truth=True)
    assert (hidden == view.draw(start())).all()
    framed = (shown != hidden).any(axis=-1)
    assert (shown[framed] == WRONG).all()
    assert framed.sum() > 200
    assert (view.draw(start(), truth=True) == hidden).all()
