"""Many random steps: nothing breaks, nothing is not a number, nothing leaves the table or stands in another.

10 000 steps in `make test`; `make test-all` takes the rest of 100 000.
"""

import gymnasium as gym
import numpy as np
import pytest

MOVE, HAND, LAYOUT, SCENE = "FarmToTable-v0", "FarmToTableHand-v0", "FarmToTableLayout-v0", "SceneLayout-v0"

ORDINARY = [
    (MOVE, {}, 1500),
    (MOVE, {"action": "slot", "jitter": "hard", "visits": 3}, 800),
    (MOVE, {"action": "continuous", "jitter": "easy", "budget": 9.0}, 1200),
    (HAND, {}, 3000),
    (HAND, {"visits": 3, "budget": 9.0, "head_noise_deg": 5.0}, 1500),
    (LAYOUT, {"budget": 9.0}, 150),
    (SCENE, {}, 1000),
    (SCENE, {"scene": "M2", "jitter": "hard", "reward": "margin"}, 850),
]
LONG = [
    (MOVE, {"budget": 99.0, "moves": 50}, 15000),
    (MOVE, {"visits": 5, "jitter": "hard", "reid": "nearest"}, 10000),
    (MOVE, {"action": "slot", "budget": 99.0, "moves": 30}, 5000),
    (MOVE, {"action": "continuous", "budget": 99.0, "moves": 30}, 5000),
    (HAND, {"budget": 99.0, "hand_seconds": 60.0}, 20000),
    (HAND, {"visits": 4, "jitter": "hard", "reward": "margin"}, 15000),
    (LAYOUT, {"budget": 9.0, "jitter": "hard"}, 2500),
    (LAYOUT, {"visits": 3}, 2500),
    (SCENE, {"scene": "H1"}, 5000),
    (SCENE, {"budget": 99.0, "visits": 4}, 10000),
]
ON_TABLE_M, OVERLAP_M = 0.001, 0.002


CASES = [
    *(pytest.param(*case, id=f"{case[0]} {case[2]}") for case in ORDINARY),
    *(pytest.param(*case, id=f"{case[0]} {case[2]}", marks=pytest.mark.long) for case in LONG),
]


def test_there_are_10_000_steps_in_the_ordinary_run_and_100_000_in_all():
    assert sum(steps for *_, steps in ORDINARY) == 10_000
    assert sum(steps for *_, steps in ORDINARY + LONG) == 100_000


@pytest.mark.parametrize(("name", "arguments", "steps"), CASES)
def test_nothing_breaks(name, arguments, steps):
    env = gym.make(name, **arguments)
    inner, rng = env.unwrapped, np.random.default_rng(0)
    observation, _ = env.reset(seed=0)
    env.action_space.seed(0)
    left, action, wrong, effort, visits = 0, None, 0, 0.0, 0
    for _ in range(steps):
        if left == 0:
            action = env.action_space.sample()
            # A hand that is steered anew ten times a second would get nowhere.
            left = int(rng.integers(1, 8)) if name == HAND else 1
        left -= 1
        observation, reward, over, _, info = env.step(action)
        assert all(np.isfinite(values).all() for values in observation.values())
        assert env.observation_space.contains(observation)
        assert np.isfinite([reward, info["paper_margin"], info["effort"]]).all()
        truth = inner.world.truth
        if name == SCENE:
            assert np.all((truth.position >= 0) & (truth.position <= inner.view.size))
        else:
            tabletop = inner.world.tabletop
            assert tabletop.on_table(0.02).all()
            if tabletop.still and name != HAND:
                assert tabletop.on_table(ON_TABLE_M).all()
                assert tabletop.overlap() <= OVERLAP_M
        wrong, effort = max(wrong, info["wrong_labels"]), max(effort, info["effort"])
        if over:
            visits += 1
            observation, _ = env.reset()
    # It was no idle run.
    assert wrong >= 2
    assert effort > 0.05
    assert visits > 0
