"""What an agent sees."""

from dataclasses import replace

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.geometry import wrap
from farm_ar.reid import SpatialReid, solve_assignment
from farm_ar.reid.assignment import margins
from farm_ar.scenes import Camera, Detections, builtin_scene, observe

MIND = {"believed_position", "believed_heading", "difference", "cost", "margin"}
LEAVE, STAY = np.array([10, 3, 3, 3]), np.array([0, 3, 3, 3])


def moved_env(**arguments):
    """An environment in which something has been moved; its last observation; and its order."""
    env = FarmToTableEnv(**{"jitter": "default", "play_seconds": 0.0, **arguments})
    env.reset(seed=2)
    for _ in range(3):
        which = int(np.flatnonzero(env.action_masks()[:10])[0])
        observation, *_ = env.step(np.array([which, 5, 5, 5]))
    return env, observation, env.view.order


def test_a_black_box_hides_what_the_headset_believes_and_nothing_else():
    white, open_view, _ = moved_env()
    black, closed_view, _ = moved_env(knowledge="black-box")
    assert set(open_view) - set(closed_view) == MIND
    assert set(white.observation_space.spaces) - set(black.observation_space.spaces) == MIND
    for name, values in closed_view.items():
        np.testing.assert_array_equal(values, open_view[name])


def test_poses_are_those_of_truth_and_belief_in_the_order_of_the_actions():
    env, observation, order = moved_env()
    truth, believed = env.world.truth, env.world.believed
    assert np.abs(truth.position - believed.position).max() > 0.05
    for name, layout in (("", truth), ("believed_", believed)):
        places = observation[f"{name}position"].reshape(-1, 2)
        np.testing.assert_allclose((places + 1) / 2 * [1.2, 0.8], layout.position[order], atol=1e-6)
        sine, cosine = observation[f"{name}heading"].reshape(-1, 2).T
        yaw = layout.yaw[order]
        np.testing.assert_allclose([sine, cosine], [np.sin(yaw), np.cos(yaw)], atol=1e-6)
    difference = observation["difference"].reshape(-1, 3)
    shift, turn = (truth.position - believed.position)[order], wrap(truth.yaw - believed.yaw)[order]
    np.testing.assert_allclose(difference[:, :2] * [0.6, 0.4], shift, atol=1e-6)
    np.testing.assert_allclose(difference[:, 2] * np.pi, turn, atol=1e-6)


def test_the_order_is_each_episodes_own():
    env, orders = FarmToTableEnv(jitter="hard"), set()
    for seed in range(4):
        observation, _ = env.reset(seed=seed)
        order, truth = env.view.order, env.world.truth
        orders.add(tuple(order))
        cost = observation["cost"].reshape(len(order), 5)
        for row, i in enumerate(order):
            rivals = [j for j in order if truth.category[j] == truth.category[i]]
            assert cost[row, rivals.index(i)] < 1e-6
            metres = np.linalg.norm(truth.position[i] - truth.position[rivals], axis=1) / np.hypot(1.2, 0.8)
            assert np.all(cost[row, : len(rivals)] >= metres.astype(np.float32) - 1e-6)
    assert len(orders) > 1


def test_kinds_views_and_what_is_fixed_are_told():
    env, observation, order = moved_env()
    layout = env.world.truth
    code = observation["category"].reshape(len(layout), -1).argmax(axis=1)
    assert [layout.categories[c] for c in code] == [layout.category[i] for i in order]
    assert observation["category"].sum() == len(layout)
    np.testing.assert_array_equal(observation["in_view"], env.view.in_view[order])
    np.testing.assert_array_equal(observation["fixed"], [0] * 10 + [1])


def test_costs_are_the_papers_between_objects_and_labels_of_one_kind():
    env, observation, order = moved_env()
    truth, believed = env.world.truth, env.world.believed
    cost = observation["cost"].reshape(len(order), 5)
    for row, i in enumerate(order):
        rivals = [j for j in order if truth.category[j] == truth.category[i]]
        for column in range(5):
            if column >= len(rivals):
                assert cost[row, column] == 2
                continue
            j = rivals[column]
            metres = np.linalg.norm(truth.position[i] - believed.position[j])
            turn = abs(np.sin((truth.yaw[i] - believed.yaw[j]) / 2))
            assert cost[row, column] == pytest.approx(metres / np.hypot(1.2, 0.8) + turn, abs=1e-6)


def test_margins_are_what_the_cheapest_other_assignment_would_cost(plain, offsets):
    env = plain(visits=2)
    observation, info = env.reset(seed=0)
    # Both coops would have to go 10 cm, at 1 a metre; 0.3 is observed as 1.
    np.testing.assert_allclose(observation["margin"], [0.2 / 0.3, 0.2 / 0.3, 1])
    assert info["paper_margin"] == pytest.approx(0.2)


def test_margins_out_of_view_are_one_and_rivals_out_of_view_still_count(plain, left_only):
    observation, info = (env := plain()).reset(seed=0, options={"camera": left_only})
    np.testing.assert_array_equal(env.view.in_view, [True, False, False])
    # The left one could take the label of the other, which is not seen: 10 cm.
    np.testing.assert_allclose(observation["margin"], [0.1 / 0.3, 1, 1])
    assert info["paper_margin"] == pytest.approx(0.1)


def test_margins_are_those_of_the_papers_rule():
    env, observation, order = moved_env()
    truth = env.world.truth
    scene = replace(builtin_scene("farm"), layout=env.world.believed)
    snapshot, names = observe(truth, env.world.camera)
    cost = SpatialReid(scene).cost_matrix(snapshot.detections)
    kind = np.array(snapshot.detections.category)[:, None]
    cost[kind != np.array(scene.layout.category)] = np.inf
    expected = dict(zip(names, margins(cost, solve_assignment(cost)), strict=True))
    for row, i in enumerate(order):
        margin = min(expected.get(truth.labels[i], 1.0) / 0.3, 1.0)
        assert observation["margin"][row] == pytest.approx(margin, abs=1e-5)


def test_what_is_beyond_the_bounds_is_clipped_to_them():
    env = FarmToTableEnv()
    observation, _ = env.reset(options={"camera": Camera(np.array([-90.0, 50.0]), np.array(0.3))})
    np.testing.assert_array_equal(observation["camera"][:2], [-4, 4])
    assert env.observation_space.contains(observation)


def test_the_hand_is_seen_where_it_is(drive, straight_on):
    env = FarmToTableEnv(control="hand", jitter="none", hand_seconds=30.0)
    observation, _ = env.reset(seed=0, options={"camera": straight_on})
    np.testing.assert_allclose(observation["hand"][[2, 3, 6, 7]], [0, 1, 0, 0])
    assert observation["hand"][1] < -1
    drive(env, (0.6, 0.05), grip=False)
    observation, *_ = env.step(np.array([0.2, 0.0, 0.0, -1.0], dtype=np.float32))
    hand = env.world.tabletop.hand
    expected = [*(2 * hand.position / [1.2, 0.8] - 1), np.sin(hand.yaw), np.cos(hand.yaw)]
    np.testing.assert_allclose(observation["hand"][:4], expected, atol=1e-6)
    np.testing.assert_allclose(observation["hand"][4:6], hand.velocity / 1.5, atol=1e-6)
    assert observation["hand"][4] == pytest.approx(0.2, abs=0.01)
    np.testing.assert_array_equal(observation["hand"][6:], [0, 1])


def test_observations_are_the_callers_own():
    env = FarmToTableEnv(play_seconds=0.0)
    first, _ = env.reset(seed=0)
    kept = {name: values.copy() for name, values in first.items()}
    # Nothing changes on the table, so that what was observed might have been kept.
    for action in (STAY, STAY, LEAVE):
        second, *_ = env.step(action)
        assert np.any(second["position"] != 0)
        for values in second.values():
            values[...] = 0
    for name, values in first.items():
        np.testing.assert_array_equal(values, kept[name])
    third, _ = env.reset(seed=0)
    for name, values in third.items():
        np.testing.assert_array_equal(values, kept[name])


@pytest.mark.parametrize("name", ["L1", "H1"])
def test_a_scene_brings_as_many_objects_as_it_has(name):
    scene = builtin_scene(name)
    env = FarmToTableEnv(scene=name, control="layout", game=False)
    n, kinds = len(scene.layout), len(scene.layout.categories)
    assert env.observation_space["position"].shape == (2 * n,)
    assert env.observation_space["category"].shape == (kinds * n,)
    assert env.action_space.shape == (3 * int(scene.layout.movable.sum()),)


def pixels(**arguments):
    env = FarmToTableEnv(observation="pixels", play_seconds=0.0, visits=2, **arguments)
    first, _ = env.reset(seed=0)
    which = int(np.flatnonzero(env.action_masks()[:10])[0])
    second, *_ = env.step(np.array([which, 0, 3, 3]))
    return env, first, second


def test_pixels_show_what_moves():
    _, first, second = pixels()
    assert first.shape == (96, 144, 3)
    assert first.std() > 10
    assert (first != second).any(axis=2).sum() > 20


def test_pixels_of_a_black_box_do_not_depend_on_what_is_believed():
    def looks(knowledge):
        env, *_ = pixels(knowledge=knowledge)
        picture = env.observe()
        belief, seen = env.world.tracker.belief, env.world.truth
        labels = [seen.labels[i] for i in (1, 0, 3, 2)]
        four = Detections(seen.category[:4], seen.position[:4], seen.yaw[:4], seen.size[:4])
        belief.read(labels, four, [0, 1, 2, 3])
        return picture, env.observe()

    before, after = looks("black-box")
    np.testing.assert_array_equal(before, after)
    before, after = looks("white-box")
    assert (before != after).any()


def test_the_headset_s_picture_shows_what_moves_in_view_and_nothing_that_is_believed():
    env = FarmToTableEnv(observation="headset", play_seconds=0.0, visits=2)
    first, _ = env.reset(seed=0)
    assert first.shape == (84, 84, 3)
    assert first.std() > 10
    belief, seen = env.world.tracker.belief, env.world.truth
    four = Detections(seen.category[:4], seen.position[:4], seen.yaw[:4], seen.size[:4])
    belief.read([seen.labels[i] for i in (1, 0, 3, 2)], four, [0, 1, 2, 3])
    np.testing.assert_array_equal(env.observe(), first)
    which = int(np.flatnonzero(env.action_masks()[:10])[0])
    second, *_ = env.step(np.array([which, 0, 3, 3]))
    assert (first != second).any(axis=2).sum() > 20


def test_the_last_observation_has_what_is_believed_after_the_last_snapshot():
    env, before, order = moved_env()
    assert np.abs(before["difference"]).max() > 0.05
    changes = env.world.changes
    after, _, over, _, _ = env.step(LEAVE)
    assert (over, env.world.changes) == (True, changes)
    places = after["believed_position"].reshape(-1, 2)
    np.testing.assert_allclose((places + 1) / 2 * [1.2, 0.8], env.world.believed.position[order], atol=1e-6)
    assert np.abs(after["believed_position"] - before["believed_position"]).max() > 0.05


def test_a_camera_that_is_set_is_observed_at_once():
    env = FarmToTableEnv()
    env.reset(seed=0)
    away = Camera(np.array([0.6, -0.3]), np.array(np.pi), env.world.camera.fov)
    assert env.observe()["in_view"].any()
    env.world.camera = away
    seen = env.observe()
    np.testing.assert_allclose(seen["camera"], [0, -1.75, 0, -1], atol=1e-6)
    assert not seen["in_view"].any()
