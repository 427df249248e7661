"""A batch with the interface of Stable-Baselines3, and a learner on it."""

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.batched.sb3 import BatchedVecEnv
from farm_ar.errors import OptionError

ARGUMENTS = {"carry": "lift", "moves": 2, "action": "slot", "play_seconds": 0.5}


def same_infos(one, other):
    """See that infos of all environments are the same; a batch gives Python's numbers, too."""
    for first, second in zip(one, other, strict=True):
        assert set(first) == set(second)
        for name, value in second.items():
            if name == "episode":
                assert {**first[name], "t": 0} == {**value, "t": 0}
            elif name == "terminal_observation":
                for part in value:
                    np.testing.assert_array_equal(first[name][part], value[part])
            else:
                np.testing.assert_array_equal(first[name], value)
                assert type(first[name]) is type(value)


def test_it_gives_what_single_environments_give():
    batch = BatchedVecEnv.of("FarmToTable-v0", 3, monitor=True, **ARGUMENTS)
    alone = DummyVecEnv([lambda: Monitor(FarmToTableEnv(**ARGUMENTS))] * 3)
    assert (batch.observation_space, batch.action_space) == (alone.observation_space, alone.action_space)
    assert batch.seed(7) == alone.seed(7)
    one, other = batch.reset(), alone.reset()
    batch.action_space.seed(0)
    ends = 0
    for _ in range(12):
        for name in other:
            np.testing.assert_array_equal(one[name], other[name])
        same_infos(batch.reset_infos, alone.reset_infos)
        actions = np.array([batch.action_space.sample() for _ in range(3)])
        (one, *mine), (other, *theirs) = batch.step(actions), alone.step(actions)
        for first, second in zip(mine[:2], theirs[:2], strict=True):
            assert first.dtype == second.dtype
            np.testing.assert_array_equal(first, second)
        same_infos(mine[2], theirs[2])
        ends += int(mine[1].sum())
        masks = batch.env_method("action_masks", indices=[2, 0])
        np.testing.assert_array_equal(masks, alone.env_method("action_masks", indices=[2, 0]))
    assert ends > 3


def test_attributes_are_given_and_set_by_index():
    batch = BatchedVecEnv(4, control="layout", game=False, scene="L1")
    assert batch.render_mode is None
    assert batch.has_attr("config")
    assert not batch.has_attr("level")
    batch.set_attr("level", 3, indices=[1, 2])
    assert batch.get_attr("level") == [None, 3, 3, None]
    assert batch.env_is_wrapped(gym.Wrapper, indices=2) == [False]
    assert len(batch.get_images()) == 4
    batch.set_options({"camera": {"position": [0.0, 0.0], "yaw": 0.5}})
    np.testing.assert_allclose(batch.reset()["camera"][:, 2], np.sin(0.5))
    batch.set_options([{}, {}, {}, {"camera": None}])
    with pytest.raises(OptionError, match="same for all"):
        batch.reset()
    batch.close()


def test_an_id_that_cannot_be_batched_is_refused():
    with pytest.raises(OptionError, match="env_id"):
        BatchedVecEnv.of("DeliverToChair-v0", 2)
    with pytest.raises(OptionError, match="carry"):
        BatchedVecEnv.of("FarmToTable-v0", 2)


def test_ppo_learns_on_it():
    """One move that turns a label wrong is found: far more is earned than by choosing at random."""
    arguments = {
        "action": "slot",
        "carry": "lift",
        "play_seconds": 0.0,
        "jitter": "easy",
        "budget_m": 1.5,
        "budget_rad": 6.0,
    }
    envs = VecMonitor(BatchedVecEnv.of("FarmToTable-v0", 64, **arguments))
    model = PPO(
        "MultiInputPolicy",
        envs,
        n_steps=16,
        batch_size=256,
        n_epochs=4,
        gamma=0.98,
        learning_rate=1e-3,
        seed=0,
        device="cpu",
    )
    random = mean_return(BatchedVecEnv.of("FarmToTable-v0", 64, **arguments), None)
    model.learn(25_000)
    assert mean_return(BatchedVecEnv.of("FarmToTable-v0", 64, **arguments), model) > random + 0.5
    assert isinstance(VecNormalize(envs), VecNormalize)


def mean_return(envs, model):
    """Of some hundred episodes, by a model or at random."""
    envs.seed(1000)
    envs.action_space.seed(0)
    seen, total, ended = envs.reset(), 0.0, 0
    for _ in range(40):
        actions = (
            model.predict(seen)[0]
            if model
            else np.array([envs.action_space.sample() for _ in range(envs.num_envs)])
        )
        seen, reward, over, _ = envs.step(actions)
        total, ended = total + reward.sum(), ended + over.sum()
    return total / ended
