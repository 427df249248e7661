"""Players in the environments: what they do, and how they rank."""

import gymnasium as gym
import numpy as np
import pytest

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.agents.policies import (
    POLICIES,
    AnalyticPolicy,
    CmaPolicy,
    ConstantPolicy,
    GreedyPolicy,
    RandomPolicy,
    best_constant,
    play_episode,
    play_episodes,
)
from farm_ar.agents.policies.greedy import allowed_actions
from farm_ar.agents.policies.lookahead import look_ahead
from farm_ar.errors import OptionError

SEEDS = range(3)


def table(action="slot", control="move", **options):
    name = {"move": "FarmToTable-v0", "layout": "FarmToTableLayout-v0", "hand": "FarmToTableHand-v0"}[control]
    chosen = {"action": action} if control == "move" else {}
    return gym.make(name, animals_a_second=0.0, play_seconds=0.0, **chosen, **options)


def mean_total(env, player):
    return np.mean([episode.total for episode in play_episodes(env, player, SEEDS)])


@pytest.mark.parametrize("name", POLICIES)
@pytest.mark.parametrize("action", ["slot", "displacement", "continuous"])
def test_every_player_gives_actions_of_the_space(name, action):
    env = table(action)
    env.reset(seed=0)
    player = POLICIES[name](np.random.default_rng(0))
    over = False
    while not over:
        chosen = player.act(env.unwrapped)
        assert env.action_space.contains(np.asarray(chosen, dtype=env.action_space.dtype))
        _, _, over, _, _ = env.step(chosen)


@pytest.mark.parametrize("name", POLICIES)
def test_the_same_seed_plays_the_same_episode(name):
    env = table()
    first, second = (play_episode(env, POLICIES[name](np.random.default_rng(5)), seed=3) for _ in range(2))
    assert first == second


def test_looking_ahead_beats_chance_and_planning_beats_looking_ahead():
    env = table()
    chance = mean_total(env, RandomPolicy(np.random.default_rng(0)))
    ahead = mean_total(env, GreedyPolicy(np.random.default_rng(0)))
    planned = mean_total(env, AnalyticPolicy())
    assert chance + 0.5 < ahead < planned
    assert planned > 3.0


def test_searching_beats_chance_and_leaves_when_nothing_is_to_be_gained():
    env = table(control="layout")
    player = CmaPolicy(np.random.default_rng(0), tries=300)
    assert mean_total(env, player) > 0.5 > mean_total(env, RandomPolicy(np.random.default_rng(0)))
    episode = play_episode(table(effort_weight=1000.0), CmaPolicy(np.random.default_rng(0), 60), seed=0)
    assert episode.effort == 0


def test_a_plan_of_a_whole_layout_fools_the_rule():
    assert mean_total(table(control="layout"), AnalyticPolicy()) > 1.0


def test_a_greedy_helper_makes_the_table_clearer_than_chance_does():
    env = table(sign=-1, reward="margin", moves=3)
    assert mean_total(env, GreedyPolicy(np.random.default_rng(0))) > 0
    assert mean_total(env, RandomPolicy(np.random.default_rng(0))) < 0


def test_a_greedy_player_of_a_box_may_do_nothing():
    env = gym.make("SceneLayout-v0", scene="L2", effort_weight=1000.0)
    episode = play_episode(env, GreedyPolicy(np.random.default_rng(0), samples=20), seed=0)
    assert episode.effort == 0


@pytest.mark.parametrize(
    "player", [GreedyPolicy(np.random.default_rng(0)), AnalyticPolicy(), CmaPolicy(np.random.default_rng(0))]
)
def test_planners_refuse_to_steer_the_hand(player):
    env = table(control="hand")
    env.reset(seed=0)
    with pytest.raises(OptionError, match="control: must be move or layout"):
        player.act(env.unwrapped)


def test_an_analytic_player_refuses_to_help():
    env = table(sign=-1)
    env.reset(seed=0)
    with pytest.raises(OptionError, match="sign: must be 1"):
        AnalyticPolicy().act(env.unwrapped)


@pytest.mark.parametrize("action", ["slot", "displacement", "continuous"])
def test_an_analytic_player_leaves_when_nothing_is_to_be_gained(action):
    env = table(action, effort_weight=1000.0)
    episode = play_episode(env, AnalyticPolicy(), seed=0)
    assert (episode.effort, episode.steps) == (0, 1)


def test_a_constant_player_begins_anew_with_every_visit():
    env = table(visits=2, moves=2)
    env.reset(seed=0)
    player = ConstantPolicy([[0, 1, 0], [1, 0, 0], [2, 0, 0]])
    given = []
    for _ in range(4):
        given.append(player.act(env.unwrapped).tolist())
        env.step(np.array(given[-1]))
    assert given == [[0, 1, 0], [1, 0, 0]] * 2


def test_a_constant_player_repeats_its_last_action():
    env = table(moves=3)
    env.reset(seed=0)
    player = ConstantPolicy([[0, 1, 0], [1, 0, 0]])
    given = []
    for _ in range(3):
        given.append(player.act(env.unwrapped).tolist())
        env.step(np.array(given[-1]))
    assert given == [[0, 1, 0], [1, 0, 0], [1, 0, 0]]


def test_the_best_constant_is_at_least_as_good_as_the_first_that_is_drawn():
    env = table(jitter="none")
    first = best_constant(env, np.random.default_rng(0), 1, [0, 1])
    best = best_constant(env, np.random.default_rng(0), 12, [0, 1])
    totals = [sum(e.total for e in play_episodes(env, player, [0, 1])) for player in (first, best)]
    assert totals[1] > totals[0]


def test_all_allowed_actions_are_those_of_objects_in_view_and_leaving_once():
    env = table()
    env.reset(seed=0)
    view = env.unwrapped.view
    actions = allowed_actions(env.unwrapped)
    assert set(actions[:-1, 0]) == set(np.flatnonzero(view.in_view[view.movable]))
    assert actions[-1].tolist() == [10, 0, 0]
    assert len(actions) == view.in_view[view.movable].sum() * 15 + 1


def test_the_lookahead_of_the_table_as_it_stands_is_what_the_view_says():
    env = table(jitter="hard").unwrapped
    for seed in range(5):
        env.reset(seed=seed)
        truth = env.view.truth
        seen = look_ahead(env, truth.position[None], truth.yaw[None])
        assert seen.wrong.tolist() == [0]
        assert seen.ambiguity[0] == pytest.approx(env.ambiguity)


def test_the_lookahead_of_a_moved_table_is_what_the_snapshot_says(rng):
    env = table(jitter="hard").unwrapped
    wrong = 0
    for seed in range(8):
        env.reset(seed=seed)
        truth = env.view.truth
        position = truth.position + rng.normal(size=truth.position.shape) * 0.2 * truth.movable[:, None]
        seen = look_ahead(env, position[None], truth.yaw[None])
        tracker = env.world.tracker
        tracker.look(truth.with_poses(position, truth.yaw), env.view.camera, rng)
        assert seen.wrong[0] == tracker.belief.wrong_labels
        wrong += int(seen.wrong[0])
    assert wrong > 0
