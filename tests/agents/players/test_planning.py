"""Plans of visits: within the budget, on clear ways."""

import gymnasium as gym
import numpy as np
import pytest

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.agents.players.planning import _fitted, _Node, _way_is_clear, best_plan
from farm_ar.envs.moves import Move

SIZE = np.array([[0.1, 0.1, 0.1], [0.1, 0.1, 0.1]])
OTHERS = np.array([False, True])


@pytest.mark.parametrize("kernel", [_way_is_clear, _way_is_clear.py_func])
@pytest.mark.parametrize(
    ("target", "clear"),
    [((0.15, 0.0), True), ((0.25, 0.0), False), ((0.6, 0.0), False), ((0.6, 0.4), True)],
)
def test_a_way_through_another_object_is_not_clear(kernel, target, clear):
    position = np.array([[0.0, 0.0], [0.3, 0.0]])
    assert kernel(position, np.zeros(2), SIZE, OTHERS, 0, np.array(target), 0.0) is clear


def test_plans_have_a_step_per_object_and_no_more_than_moves_are_left():
    env = gym.make("FarmToTable-v0", action="slot", animals_a_second=0.0, moves=3).unwrapped
    for seed in range(3):
        env.reset(seed=seed)
        plan = best_plan(env, 4)
        assert 0 < len(plan) <= 3
        assert len({step.mover for step in plan}) == len(plan)


def test_what_the_budget_does_not_reach_is_scaled_down():
    env = gym.make("FarmToTable-v0", action="slot", animals_a_second=0.0, budget_m=0.3).unwrapped
    env.reset(seed=0)
    view = env.view
    node = _Node((), view.truth.position, view.truth.yaw, 0.25, 0.0)
    scaled = _fitted(env.budget, node, Move(0, np.array([0.06, 0.08]), 0.2))
    assert scaled.displacement == pytest.approx([0.03, 0.04])
    assert scaled.turn == pytest.approx(0.2)
    node = _Node((), view.truth.position, view.truth.yaw, 0.31, 0.0)
    assert not np.any(_fitted(env.budget, node, Move(0, np.array([0.06, 0.08]), 0.2)).displacement)
