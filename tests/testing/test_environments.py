"""The conformance test of environments finds what is broken, and says what."""

import itertools
import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces

from farm_ar.envs import FarmToTableEnv
from farm_ar.errors import OptionError
from farm_ar.testing import check_environment, environments
from farm_ar.testing.comparison import difference
from farm_ar.testing.environments import check_with_gymnasium, check_with_stable_baselines3

QUICK = {"play_seconds": 0.0, "moves": 3}


class Sound(FarmToTableEnv):
    """Nothing is wrong with it."""

    def __init__(self):
        super().__init__(**QUICK)


class BeyondItsBounds(Sound):
    def reset(self, **arguments):
        observation, info = super().reset(**arguments)
        return {**observation, "margin": observation["margin"] + 5}, info


class NotANumber(Sound):
    def step(self, action):
        observation, *rest = super().step(action)
        return ({**observation, "cost": np.full_like(observation["cost"], np.nan)}, *rest)


class NumpyReward(Sound):
    def step(self, action):
        observation, reward, *rest = super().step(action)
        return observation, np.float64(reward), *rest


class NumpyInfo(Sound):
    def step(self, action):
        *rest, info = super().step(action)
        return *rest, {**info, "accuracy": np.float64(info["accuracy"])}


class Speaking(Sound):
    def step(self, action):
        *rest, info = super().step(action)
        return *rest, {**info, "phase": "hand"}


class Repeating(Sound):
    def reset(self, **arguments):
        observation, info = super().reset(**arguments)
        return observation, {**info, "margin": 0.5}


class NumpyEnd(Sound):
    def step(self, action):
        observation, reward, over, *rest = super().step(action)
        return observation, reward, np.bool_(over), *rest


class Unbounded(Sound):
    def __init__(self):
        super().__init__()
        inner = dict(self.observation_space.spaces)
        inner["camera"] = spaces.Box(-np.inf, np.inf, (4,), np.float32)
        self.observation_space = spaces.Dict(inner)


class Moody(Sound):
    moods = itertools.count()

    def step(self, action):
        observation, reward, *rest = super().step(action)
        return observation, reward + 1e-9 * next(self.moods), *rest


class Forgetful(Sound):
    def __setstate__(self, state):
        super().__setstate__({**state, "trace": None})
        if state["trace"] is not None:
            self.reset(seed=99)


class Ungovernable(Sound):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=seed, options=None)


class Unreplayable(Sound):
    def trace(self):
        trace = super().trace()
        return {**trace, "actions": [[0, 0, 0, 0], *trace["actions"][1:]]}


class Endless(Sound):
    def trace(self):
        trace = super().trace()
        return {**trace, "actions": trace["actions"] * 9}


class Brittle(Sound):
    def step(self, action):
        return super().step([int(part) // int(action[1]) for part in action])


class Trapped(Sound):
    def action_masks(self):
        mask = super().action_masks()
        mask[10] = False
        return mask


class SeesThroughWalls(Sound):
    def action_masks(self):
        return np.ones_like(super().action_masks())


class WronglyMasked(Sound):
    def action_masks(self):
        return super().action_masks()[:-1]


BROKEN = [
    (BeyondItsBounds, environments.check_values, r"observation\['margin'\] is not in Box"),
    (NotANumber, environments.check_values, r"call 1: observation\['cost'\] is not finite"),
    (NumpyReward, environments.check_values, "call 1: reward must be a float, is float64"),
    (
        NumpyInfo,
        environments.check_values,
        r"call 1: info\['accuracy'\] must be a number of Python's own type or an array, is float64",
    ),
    (Speaking, environments.check_values, r"call 1: info\['phase'\] must be a number .* or an array, is str"),
    (Repeating, environments.check_values, r"call 0: info has keys of the observation: margin"),
    (NumpyEnd, environments.check_values, "call 1: terminated must be a bool, is bool"),
    (Unbounded, environments.check_values, r"observation_space\['camera'\]: every bound must be finite"),
    (Moody, environments.check_determinism, r"two environments with one seed: reward differs after call \d+"),
    (Forgetful, environments.check_pickling, "an environment pickled after 0 steps: .* differs"),
    (Ungovernable, environments.check_reset_options, "does not set the layout exactly"),
    (Unreplayable, environments.check_trace, "a trace plays again to another hash"),
    (Endless, environments.check_trace, "a trace that is played again raised ResetNeeded"),
    (Brittle, environments.check_values, r"step \d+ raised ZeroDivisionError: integer division"),
    (Trapped, environments.check_masks, "step 0: the mask forbids to end the turn"),
    (SeesThroughWalls, environments.check_masks, "step 0: the mask allows what is out of view"),
    (WronglyMasked, environments.check_masks, r"step 0: a mask must be \(32,\) of bool"),
]


@pytest.mark.parametrize(
    ("broken", "check", "message"), BROKEN, ids=lambda value: getattr(value, "__name__", "")
)
def test_what_is_broken_is_found_and_named(broken, check, message):
    check(Sound, seed=2)
    with pytest.raises(AssertionError, match=message) as caught:
        check(broken, seed=2)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("broken", [case[0] for case in BROKEN])
def test_the_whole_check_fails_where_one_of_its_parts_does(broken):
    with pytest.raises(AssertionError):
        check_environment(broken, seed=2, steps=20, render=False)


def test_a_sound_subclass_passes():
    check_environment(Sound, seed=2, steps=20, render=False)


def test_a_wrapper_is_checked_as_it_is_and_what_it_breaks_is_found():
    def doubled():
        return gym.wrappers.TransformReward(FarmToTableEnv(**QUICK), twice)

    def halved():
        return gym.wrappers.TransformReward(FarmToTableEnv(**QUICK), half)

    def nameless():
        return gym.wrappers.TransformReward(FarmToTableEnv(**QUICK), lambda reward: reward)

    check_environment(doubled, steps=12, render=False)
    with pytest.raises(AssertionError, match="reward must be a float, is float32"):
        check_environment(halved, steps=12, render=False)
    with pytest.raises(AssertionError, match="pickling raised AttributeError: Can't"):
        check_environment(nameless, steps=12, render=False)


def twice(reward):
    return 2 * reward


def half(reward):
    return np.float32(reward / 2)


def test_an_environment_of_another_kind_is_checked_as_far_as_that_goes():
    check_environment(lambda: gym.make("MountainCar-v0"), steps=12, render=False)


def test_warnings_of_the_checkers_are_failures():
    class Grumbling(Sound):
        def reset(self, *, seed=None, options=None):
            warnings.warn("I would rather not", UserWarning, stacklevel=1)
            return super().reset(seed=seed, options=options)

    with pytest.raises(AssertionError, match="Gymnasium's checker warns: I would rather not"):
        check_with_gymnasium(Grumbling, render=False)


def test_stable_baselines3_dislikes_what_it_cannot_flatten():
    pytest.importorskip("stable_baselines3")

    class Matrix(Sound):
        def __init__(self):
            super().__init__()
            inner = dict(self.observation_space.spaces)
            inner["margin"] = spaces.Box(0, 1, (11, 1), np.float32)
            self.observation_space = spaces.Dict(inner)

        def reset(self, **arguments):
            observation, info = super().reset(**arguments)
            return {**observation, "margin": observation["margin"].reshape(11, 1)}, info

        def step(self, action):
            observation, *rest = super().step(action)
            return ({**observation, "margin": observation["margin"].reshape(11, 1)}, *rest)

    with pytest.raises(AssertionError, match="Stable-Baselines3's checker warns: Your observation margin"):
        check_with_stable_baselines3(Matrix)


def test_a_spec_that_makes_something_else_is_found():
    class Other(FarmToTableEnv):
        def __init__(self, **arguments):
            super().__init__(**QUICK, jitter="none")

    def make():
        env = gym.make("FarmToTable-v0", **QUICK)
        other = Other()
        other.spec = env.spec
        return other

    with pytest.raises(AssertionError, match=r"an environment made from its spec's JSON: .* differs"):
        environments.check_spec(make)


def test_an_option_that_is_not_known_must_be_refused():
    class Lenient(Sound):
        def reset(self, *, seed=None, options=None):
            known = {name: value for name, value in (options or {}).items() if name in ("layout", "camera")}
            return super().reset(seed=seed, options=known)

    with pytest.raises(AssertionError, match="reset takes an option that it does not know"):
        environments.check_reset_options(Lenient)


@pytest.mark.parametrize(
    ("first", "second", "where"),
    [
        ({"a": [1, 2.0]}, {"a": [1, 2.0]}, None),
        ({"a": [1, 2.0]}, {"a": [1, 2]}, "x['a'][1]"),
        ({"a": 1, "b": 2}, {"b": 2, "a": 1}, "x"),
        ((0.0,), (-0.0,), "x[0]"),
        ([np.zeros(2)], [np.zeros(2, dtype=np.float32)], "x[0]"),
        (np.array([np.nan]), np.array([np.nan]), None),
        (float("nan"), float("nan"), None),
        ((1, 2), (1,), "x"),
        (True, 1, "x"),
    ],
)
def test_differences_are_found_to_the_bit(first, second, where):
    assert difference(first, second, "x") == where


def test_the_sound_one_is_sound_in_the_tests_own_eyes():
    env = Sound()
    env.reset(seed=1)
    assert pickle.loads(pickle.dumps(env)).state_hash() == env.state_hash()
    with pytest.raises(OptionError):
        env.reset(options={"x": 1})
