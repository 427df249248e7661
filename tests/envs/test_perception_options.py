"""Environments that perceive from pixels, or with noise as measured there."""

import gymnasium as gym
import numpy as np
import pytest

import farm_ar.envs  # noqa: F401  # registers
from farm_ar.envs.config import EnvConfig
from farm_ar.errors import OptionError
from farm_ar.testing.comparison import difference

KINDS = [{"perception": "pixels"}, {"oracle_noise": "measured"}]


def episode(**options):
    env = gym.make("FarmToTableLayout-v0", **options)
    observation, _ = env.reset(seed=3)
    action = np.random.default_rng(0).uniform(-0.5, 0.5, env.action_space.shape).astype(np.float32)
    return observation, env.step(action)


@pytest.mark.parametrize("options", KINDS)
def test_an_episode_repeats_byte_for_byte_and_differs_from_the_oracles(options):
    first, second = episode(**options), episode(**options)
    assert difference(first, second) is None
    assert difference(first[1], episode()[1]) is not None


def test_the_noise_is_the_oracles():
    with pytest.raises(OptionError, match="oracle_noise: must be none where the perception"):
        EnvConfig(perception="pixels", oracle_noise="measured")
    with pytest.raises(OptionError, match="oracle_noise: must be one of measured, none"):
        EnvConfig(oracle_noise="loud")
    assert "oracle_noise" not in EnvConfig().arguments()
    assert EnvConfig(oracle_noise="measured").arguments()["oracle_noise"] == "measured"


def test_a_scene_of_things_without_meshes_cannot_be_seen_in_pixels():
    env = gym.make("SceneLayout-v0", scene="L1", perception="pixels")
    with pytest.raises(ValueError, match="must be one of which there is a model"):
        env.reset(seed=0)
