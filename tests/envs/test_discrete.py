"""Actions that are one number: what each does, which are useful, and learners that know no others."""

import json

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import InvalidAction
from stable_baselines3 import DQN

from farm_ar.envs import FarmToTableEnv, replay
from farm_ar.envs.actions import DiscreteAction, ExchangeAction, Move, SlotAction, SteeringAction
from farm_ar.errors import OptionError

SHARES = (0.55, 0.8, 1.0)


def begun(seed=0, **arguments):
    env = FarmToTableEnv(**{"action": "discrete", "play_seconds": 0.0, **arguments})
    env.reset(seed=seed)
    return env


def plain(scene="M2", seed=0, **arguments):
    """A room with several kinds, of which there are differently many."""
    return begun(seed, scene=scene, control="layout", game=False, **arguments)


def labels_of(view):
    """For each movable object, by number, the numbers of those of its kind."""
    code = view.truth.category_code[view.movable]
    return [[j for j in range(len(code)) if code[j] == code[i]] for i in range(len(code))]


def test_a_number_is_the_choice_of_slot_with_that_object_label_and_share():
    view = plain().view
    n, k = len(view.movable), max(len(labels) for labels in labels_of(view))
    discrete, slot = DiscreteAction(n, k, 1.0), SlotAction(n, k, 1.0)
    assert discrete.space.n == 3 * n * k + 1
    assert discrete.decode(3 * n * k, view) is None
    for which in range(n):
        for label in range(len(labels_of(view)[which])):
            for share in range(3):
                (found,) = discrete.decode((which * k + label) * 3 + share, view)
                (wanted,) = slot.decode([which, label, share], view)
                assert (found.index, found.turn) == (wanted.index, wanted.turn)
                np.testing.assert_array_equal(found.displacement, wanted.displacement)


def test_the_mask_allows_exactly_what_moves_something_in_view():
    env = begun(seed=3, visits=2)
    for _ in range(4):
        view, allowed = env.view, []
        for which, labels in enumerate(labels_of(view)):
            for j in labels:
                here, there = view.movable[which], view.movable[j]
                shift = view.believed.position[there] - view.truth.position[here]
                moves = np.any(shift != 0) or view.believed.yaw[there] != view.truth.yaw[here]
                first = (which * 5 + labels.index(j)) * 3
                allowed += [first, first + 1, first + 2] if moves and view.in_view[here] else []
        np.testing.assert_array_equal(np.flatnonzero(env.action_masks()), [*allowed, 150])
        env.step(allowed[len(allowed) // 2])
    # Who has not moved stands where its own label is believed to be: that choice is none.
    assert len(allowed) < 15 * view.in_view[view.movable].sum()


def test_labels_that_a_kind_does_not_have_are_masked():
    env = plain(budget=9.0)
    labels = labels_of(env.view)
    counts = np.array([len(one) for one in labels])
    assert counts.min() < counts.max()
    action = DiscreteAction(len(counts), int(counts.max()), 1.0)
    useful = action.mask(env.view)[:-1].reshape(len(counts), -1, 3).any(axis=2)
    for which, count in enumerate(counts):
        assert not useful[which, count:].any()


@pytest.mark.parametrize("share", [0, 1, 2])
def test_an_exchange_moves_both_objects_by_that_share_of_the_way_between_them(share):
    env = plain(scene="farm", budget=9.0, seed=1)
    view = env.view
    choice = int(np.flatnonzero(env.action_masks()[:-1].reshape(-1, 3)[:, share])[0]) * 3 + share
    which, slot = divmod(choice // 3, 5)
    first, second = (int(view.movable[i]) for i in (which, labels_of(view)[which][slot]))
    assert view.in_view[[first, second]].all()
    before = view.truth.position[[first, second]]
    *_, over, _, info = env.step(choice)
    moved = env.world.truth.position[[first, second]] - before
    way = before[1] - before[0]
    np.testing.assert_allclose(moved, [SHARES[share] * way, -SHARES[share] * way], atol=1e-9)
    assert over
    assert info["wrong_labels"] == 2  # each is nearer to the other's place than to its own


def test_of_a_pair_with_one_out_of_view_only_the_other_moves(pair, left_only):
    env = begun(scene=pair, control="layout", game=False, jitter="none", budget=9.0)
    env.reset(seed=0, options={"camera": left_only})
    before = env.world.truth.position
    np.testing.assert_array_equal(np.flatnonzero(env.action_masks()), [3, 4, 5, 12])  # left to right's place
    env.step(5)
    np.testing.assert_allclose(env.world.truth.position - before, [[0.1, 0], [0, 0], [0, 0]], atol=1e-9)


def test_the_mask_of_exchanges_has_every_pair_in_view_once():
    env = plain(seed=4)
    view, labels = env.view, labels_of(env.view)
    widest = max(len(one) for one in labels)
    wanted = set()
    for i, same in enumerate(labels):
        for j in same:
            a, b = (bool(view.in_view[view.movable[k]]) for k in (i, j))
            if i != j and a and (not b or i < j):
                wanted.add(i * widest + same.index(j))
    mask = env.action_masks()
    assert mask[-1]
    assert set(np.flatnonzero(mask[:-1].reshape(-1, 3).all(axis=1))) == wanted
    assert mask.sum() == 3 * len(wanted) + 1


def test_what_an_exchange_does_is_encoded_as_that_exchange():
    env = plain(scene="farm", seed=2)
    view, action = env.view, env.control.action
    assert isinstance(action, ExchangeAction)
    assert not action.decode(action.encode([], view), view)
    for choice in np.flatnonzero(env.action_masks()[:-1]):
        assert action.encode(action.decode(choice, view), view) == choice


def test_of_a_plan_that_no_exchange_carries_out_the_pair_that_does_most_is_taken():
    env = plain(scene="farm", seed=2)
    view, action = env.view, env.control.action
    choice = int(np.flatnonzero(env.action_masks()[:-1])[0]) + 2
    whole = action.decode(choice, view)
    third = next(int(i) for i in view.movable if i not in {move.index for move in whole})
    plan = [*whole, Move(third, np.array([0.01, 0.01]), 0.0)]
    assert action.encode(plan, view) == choice
    assert action.encode([Move(third, np.array([0.001, 0.0]), 0.0)], view) == action.space.n - 1


def test_steering_goes_one_of_eight_ways_open_or_closed_or_twists_closed():
    action = SteeringAction()
    given = [action.decode(k) for k in range(20)]
    assert given[0] == (0, 0, 0, False)
    assert given[9] == (0, 0, 0, True)
    ways = {tuple(np.round(np.divide(one[:2], np.hypot(*one[:2])), 3)) for one in given[1:9]}
    assert len(ways) == 8
    for k in range(1, 9):
        assert np.hypot(*given[k][:2]) == pytest.approx(0.75)
        assert given[9 + k] == (*given[k][:3], True)
    assert given[18:] == [(0, 0, -np.pi, True), (0, 0, np.pi, True)]
    for k in range(20):
        x, z, twist, closed = given[k]
        assert action.decode(action.mirror(np.array(k))) == (-x, z, -twist, closed)
        assert action.mirror(action.mirror(np.array([k, k]))).tolist() == [k, k]


def test_only_a_held_building_can_be_twisted(drive):
    env = FarmToTableEnv(control="hand", play_seconds=0.0, jitter="none")
    env.reset(seed=0)
    assert "action_mask" not in env.reset(seed=0)[1]
    env = begun(control="hand", jitter="none")
    assert env.action_masks().tolist() == 18 * [True] + 2 * [False]
    ways = np.array([env.control._action.decode(k)[:2] for k in range(9)])
    goal = env.world.truth.position[env.view.movable[env.view.in_view[env.view.movable]][0]]
    while np.linalg.norm(goal - env.world.tabletop.hand.position) > 0.06:
        after = env.world.tabletop.hand.position + 0.1 * ways
        *_, over, _, info = env.step(int(np.argmin(np.linalg.norm(goal - after, axis=1))))
        assert not over
    *_, info = env.step(9)
    assert env.world.tabletop.hand.gripped is not None
    assert info["action_mask"].all()
    before = env.world.tabletop.hand.yaw
    env.step(19)
    assert np.pi / 20 < env.world.tabletop.hand.yaw - before <= np.pi / 10  # it takes a tick to get going


@pytest.mark.parametrize("wrong", [151, -1, 3.0, [3], None, "3", 10**30])
def test_a_number_that_is_no_choice_is_refused(wrong):
    env = begun()
    with pytest.raises(InvalidAction, match=r"must be in Discrete\(151\)"):
        env.step(wrong)


@pytest.mark.parametrize("form", [int, np.int64, np.array, np.uint8])
def test_a_number_may_be_pythons_or_numpys_and_its_trace_plays_again(form):
    env = begun()
    env.step(form(int(np.flatnonzero(env.action_masks())[0])))
    trace = json.loads(json.dumps(env.trace()))
    assert replay(trace, begun()) == trace["hash"]


def test_a_continuous_action_still_has_no_masks():
    with pytest.raises(OptionError, match="must be discrete, displacement or slot"):
        begun(action="continuous").action_masks()


@pytest.mark.parametrize("name", ["FarmToTable", "FarmToTableHand", "FarmToTableLayout", "SceneLayout"])
def test_the_flat_observation_is_gymnasiums_flattening_of_the_state(name):
    flat = gym.make(f"{name}Discrete-v0")
    state = gym.wrappers.FlattenObservation(gym.make(f"{name}-v0", action="discrete"))
    assert flat.observation_space == state.observation_space
    np.testing.assert_array_equal(flat.reset(seed=5)[0], state.reset(seed=5)[0])
    for _ in range(3):
        action = int(np.flatnonzero(flat.unwrapped.action_masks())[0])
        given = [env.step(action) for env in (flat, state)]
        np.testing.assert_array_equal(given[0][0], given[1][0])
        if given[0][2]:
            break


@pytest.mark.parametrize("name", ["FarmToTable", "FarmToTableHand", "FarmToTableLayout", "SceneLayout"])
def test_a_learner_that_knows_only_numbers_begins_to_learn(name):
    env = gym.make(f"farm_ar:{name}Discrete-v0", **({} if name == "SceneLayout" else {"play_seconds": 0.0}))
    model = DQN("MlpPolicy", env, learning_starts=8, batch_size=8, train_freq=4, buffer_size=64, seed=0)
    before = [values.clone() for values in model.policy.parameters()]
    model.learn(24)
    assert any((now != then).any() for now, then in zip(model.policy.parameters(), before, strict=True))
