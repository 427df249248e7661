"""What the actions do, by name."""

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import ContinuousAction, Move, SlotAction, VelocityAction
from farm_ar.envs.table import TableView
from farm_ar.geometry import bearing, wrap
from farm_ar.scenes import Camera, FieldOfView, Scene

AT_EASE = {"jitter": "none", "play_seconds": 0.0, "budget": 9.0}


def begun(**arguments):
    env = FarmToTableEnv(**{**AT_EASE, **arguments})
    env.reset(seed=0)
    return env


def first_in_view(env):
    """The first object that can be picked: its number in actions, and in the layout."""
    view = env.view
    number = int(np.flatnonzero(view.in_view[view.movable])[0])
    return number, int(view.movable[number])


def test_displacements_are_levels_of_metres_and_degrees():
    env = begun()
    number, index = first_in_view(env)
    before = env.world.truth
    env.step(np.array([number, 2, 4, 5]))
    after = env.world.truth
    np.testing.assert_allclose(after.position[index] - before.position[index], [-0.1, 0.1], atol=0.01)
    assert np.rad2deg(wrap(after.yaw[index] - before.yaw[index])) == pytest.approx(60, abs=3)


def test_slots_lead_towards_the_believed_place_of_a_label_of_the_kind():
    env = begun(action="slot")
    view = env.view
    number, index = first_in_view(env)
    same = [i for i in view.movable if view.truth.category[i] == view.truth.category[index]]
    slot = 1 if same[0] == index else 0
    home = view.believed.position[same[slot]]
    (move,) = env.control.action.decode(np.array([number, slot, 0]), view)
    assert move.index == index
    np.testing.assert_allclose(move.displacement, 0.55 * (home - view.truth.position[index]))
    turn = wrap(view.believed.yaw[same[slot]] - view.truth.yaw[index])
    assert move.turn == pytest.approx(0.55 * turn)
    (whole,) = env.control.action.decode(np.array([number, slot, 2]), view)
    np.testing.assert_allclose(view.truth.position[index] + whole.displacement, home)


def test_a_continuous_action_picks_the_nearest_building_in_view():
    env = begun(action="continuous")
    _, index = first_in_view(env)
    before = env.world.truth.position[index]
    pick = 2 * np.add(before, (0.02, -0.01)) / [1.2, 0.8] - 1
    *_, over, _, _ = env.step(np.array([*pick, 0.0, -0.2, 0.0], dtype=np.float32))
    assert not over
    np.testing.assert_allclose(env.world.truth.position[index] - before, [0, -0.06], atol=0.005)


def test_a_continuous_pick_of_nothing_is_leaving():
    env = begun(action="continuous")
    *_, over, _, _ = env.step(np.array([1.0, -1.0, 0.5, 0.5, 0.5], dtype=np.float32))
    assert over


def test_a_continuous_pick_of_a_building_out_of_view_is_leaving():
    env = begun(action="continuous")
    view = env.view
    hidden = next(i for i in view.movable if not view.in_view[i])
    pick = 2 * view.truth.position[hidden] / [1.2, 0.8] - 1
    *_, over, _, info = env.step(np.array([*pick, 0.5, 0.5, 0.0], dtype=np.float32))
    assert (over, info["effort"]) == (True, 0.0)


@pytest.mark.parametrize("action", ["displacement", "slot"])
def test_only_buildings_in_view_move(action):
    env = begun(action=action)
    view = env.view
    before = env.world.truth.position
    shape = [6, 6, 6] if action == "displacement" else [1, 2]
    for number, index in enumerate(view.movable):
        if not view.in_view[index]:
            *_, info = env.step(np.array([number, *shape]))
            assert info["effort"] == 0.0
            break
    else:
        pytest.fail("everything is in view")
    np.testing.assert_array_equal(env.world.truth.position, before)


def test_of_a_whole_layout_only_what_is_in_view_moves(pair, plain, offsets, left_only):
    env = plain()
    env.reset(seed=0, options={"camera": left_only})
    before = env.world.truth.position
    env.step(offsets((0, 0.05), (0, 0.05)))
    np.testing.assert_allclose(env.world.truth.position - before, [[0, 0.05], [0, 0], [0, 0]], atol=1e-7)


def test_what_an_earlier_move_of_a_layout_pushed_out_of_view_stays_there(pair):
    # The view ends just right of the right coop. Pushed over that border it cannot be gripped.
    fov = FieldOfView(1.5, float(np.arctan2(0.06, 1.3)), 9.0)
    camera = Camera(np.array([0.3, -1.0]), np.array(0.0), fov)

    def end(offsets):
        env = FarmToTableEnv(scene=pair, control="layout", jitter="none", budget=9.0, play_seconds=0.0)
        env.reset(seed=0, options={"camera": camera})
        assert env.view.in_view[:2].all()
        env.step(np.array(offsets))
        return env.world.truth.position[1]

    np.testing.assert_allclose(end([0, 0, 0, 0, -0.5, 0]), [0.35, 0.248], atol=0.003)
    x, z = end([0.9, 0, 0, 0, -0.5, 0])
    assert x > 0.36
    assert z == pytest.approx(0.3, abs=0.01)


def test_a_move_without_a_displacement_costs_a_move_and_nothing_else():
    env = begun()
    number, _ = first_in_view(env)
    before = env.world.tabletop.ticks
    observation, reward, *_ = env.step(np.array([number, 3, 3, 3]))
    assert env.world.tabletop.ticks == before
    assert reward == 0.0
    np.testing.assert_allclose(observation["budget"], [1, 1, 5 / 6, 1])


@pytest.mark.parametrize(("action", "others"), [("displacement", 21), ("slot", 8)])
def test_masks_allow_what_is_in_view_leaving_and_every_level(action, others):
    env = begun(action=action)
    view, mask = env.view, env.action_masks()
    assert 0 < view.in_view[view.movable].sum() < 10
    np.testing.assert_array_equal(mask[:10], view.in_view[view.movable])
    assert mask[10:].all()
    assert len(mask) == 11 + others


def test_with_nothing_in_view_only_leaving_is_left():
    env = FarmToTableEnv(play_seconds=0.0)
    away = Camera(np.array([0.6, -1.0]), np.array(np.pi))
    _, info = env.reset(seed=0, options={"camera": away})
    np.testing.assert_array_equal(np.flatnonzero(env.action_masks()[:11]), [10])
    assert info["paper_margin"] == 1.0
    observation, reward, over, _, info = env.step(np.array([10, 0, 0, 0]))
    assert (reward, over, info["accuracy"], info["wrong_labels"]) == (0.0, True, 1.0, 0)
    assert np.all(observation["margin"] == 1)


def test_objects_are_numbered_kind_by_kind_from_left_to_right_and_keep_their_numbers():
    env = FarmToTableEnv(visits=2, jitter="hard", play_seconds=0.0)
    for seed in range(5):
        env.reset(seed=seed)
        view, camera = env.view, env.world.camera
        names = [view.truth.category[i] for i in view.order]
        assert names == ["coop"] * 5 + ["hutch"] * 5 + ["shed"]
        angle = bearing(camera.position, camera.yaw, view.truth.position)[view.order]
        assert np.all(np.diff(angle[:5]) > 0)
        assert np.all(np.diff(angle[5:10]) > 0)
        np.testing.assert_array_equal(view.order[:10], view.movable)
        for _ in range(3):
            env.step(np.array([int(np.flatnonzero(env.action_masks()[:10])[0]), 0, 6, 3]))
        env.step(np.array([10, 0, 0, 0]))
        np.testing.assert_array_equal(env.view.order, view.order)


def test_displacements_shrink_with_the_diagonal_of_the_scene(pair):
    env = FarmToTableEnv(scene=pair, **AT_EASE)
    env.reset(seed=0, options={"camera": {"position": [0.3, -0.9], "yaw": 0.0}})
    before = env.world.truth.position[0]
    env.step(np.array([0, 3, 1, 3]))
    metres = 0.2 * pair.diagonal / np.hypot(1.2, 0.8)
    np.testing.assert_allclose(env.world.truth.position[0] - before, [0, -metres], atol=0.005)


def test_lengths_grow_with_the_diagonal_of_the_scene():
    env = FarmToTableEnv(scene="L1", control="layout", game=False, jitter="none", budget=99.0)
    for seed in range(20):
        env.reset(seed=seed)
        if env.view.in_view.any():
            break
    index = int(np.flatnonzero(env.view.in_view)[0])
    number = int(np.flatnonzero(env.view.movable == index)[0])
    before = env.world.truth.position[index]
    action = np.zeros(env.action_space.shape, dtype=np.float32)
    toward = np.sign(np.array(env.view.size) / 2 - before)
    action[3 * number : 3 * number + 2] = 0.5 * toward
    env.step(action)
    metres = 0.5 * 0.15 * env.view.scene.diagonal / np.hypot(1.2, 0.8)
    np.testing.assert_allclose(env.world.truth.position[index] - before, metres * toward)


@pytest.mark.parametrize(("away", "taken"), [(0.059, True), (0.061, False)])
def test_a_continuous_pick_reaches_six_centimetres(away, taken):
    env = begun(action="continuous")
    view = env.view
    seen = [i for i in view.movable if view.in_view[i]]
    index = min(seen, key=lambda i: view.truth.position[i, 1])  # nobody is nearer to the player
    pick = 2 * (view.truth.position[index] - [0, away]) / view.size - 1
    moves = env.control.action.decode(np.array([*pick, 0.1, 0.1, 0.0]), view)
    assert (moves is not None) == taken


def test_a_hand_is_closed_by_what_is_positive_only():
    closed = [VelocityAction().decode([0.0, 0.0, 0.0, grip])[3] for grip in (-1.0, 0.0, 1e-9)]
    assert closed == [False, False, True]


def test_slots_beyond_the_labels_of_a_kind_begin_anew():
    env = FarmToTableEnv(scene="M2", control="layout", game=False)
    env.reset(seed=0)
    view, code = env.view, env.world.truth.category_code
    counts = np.bincount(code[view.movable])
    assert counts.min() < counts.max()
    action = SlotAction(len(view.movable), int(counts.max()), 1.0)
    number = int(np.flatnonzero(code[view.movable] == counts.argmin())[0])
    for slot in range(counts.min(), counts.max()):
        (move,) = action.decode([number, slot, 1], view)
        (same,) = action.decode([number, slot % counts.min(), 1], view)
        np.testing.assert_array_equal(move.displacement, same.displacement)
        assert move.turn == same.turn


def test_the_slot_nearest_to_a_move_is_the_same_in_a_room_of_ten_times_the_size(rng):
    env = begun(action="slot")
    view, action = env.view, env.control.action
    truth, believed = (
        layout.placed(10 * layout.position, layout.yaw) for layout in (view.truth, view.believed)
    )
    large = TableView(
        Scene("large", (12.0, 8.0), truth), truth, believed, view.camera, view.order, view.movable
    )
    shares = set()
    for index in view.movable.tolist():
        for _ in range(5):
            metres, turn = rng.uniform(-0.3, 0.3, 2), float(rng.uniform(-1.5, 1.5))
            chosen = action.encode([Move(index, metres, turn)], view)
            np.testing.assert_array_equal(action.encode([Move(index, 10 * metres, turn)], large), chosen)
            shares.add(int(chosen[2]))
    assert shares == {0, 1, 2}


@pytest.mark.parametrize("free", range(4))
def test_a_turn_is_ended_by_a_pick_at_the_corner_where_nothing_stands(free):
    view = begun(action="continuous").view
    position = view.truth.position.copy()
    corners = np.delete([[0.03, 0.03], [0.03, 0.77], [1.17, 0.03], [1.17, 0.77]], free, axis=0)
    position[view.movable[:3]] = corners
    truth = view.truth.placed(position, view.truth.yaw)
    all_round = Camera(np.array([0.6, 0.4]), 0.0, FieldOfView(np.pi, np.pi, 9.0))
    full = TableView(view.scene, truth, view.believed, all_round, view.order, view.movable)
    action = ContinuousAction(len(view.movable), 5, 1.0)
    assert action.decode(action.encode([], full), full) is None
    for corner in corners:
        assert action.decode(np.array([*(2 * corner / view.size - 1), 0, 0, 0]), full) is not None
