"""Whether an environment keeps its contract."""

from __future__ import annotations

import importlib.util
import json
import pickle
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from farm_ar.envs import FarmToTableEnv, replay
from farm_ar.errors import OptionError
from farm_ar.testing.comparison import attempt, leaves, require
from farm_ar.testing.rollouts import action_mask, follow, go_on, random_action, require_equal, roll

Env = gym.Env[Any, Any]
MakeEnv = Callable[[], Env]


def check_environment(make_env: MakeEnv, seed: int = 0, steps: int = 60, *, render: bool = True) -> None:
    """Run every check on an environment: `FarmToTableEnv` with any options, a subclass of it, or wrapped.

    Args:
        make_env: makes it; every call must make an equal one.
        seed: of all randomness.
        steps: how many random steps a roll-out has.
        render: whether every render mode is tried, too.

    Raises:
        AssertionError: what broke.
    """
    check_values(make_env, seed, steps)
    check_determinism(make_env, seed, steps)
    check_pickling(make_env, seed, steps)
    check_spec(make_env, seed, steps)
    check_masks(make_env, seed, steps)
    if isinstance(make_env().unwrapped, FarmToTableEnv):
        check_reset_options(make_env, seed)
        check_trace(make_env, seed, steps)
    check_with_gymnasium(make_env, render=render)
    check_with_stable_baselines3(make_env)


def check_values(make_env: MakeEnv, seed: int = 0, steps: int = 60) -> None:
    """Bounds are finite; observations keep to them; rewards are finite, infos numbers or arrays.

    Some vectorized environments (TorchRL's `GymEnv`) put what is in `info` beside the observation, as arrays:
    no name may be in both.
    """
    env = make_env()
    for path, space in _spaces_in(env.observation_space, "observation_space"):
        if isinstance(space, spaces.Box):
            bounded = np.isfinite(space.low).all() and np.isfinite(space.high).all()
            require(bool(bounded), f"{path}: every bound must be finite")
    rollout = roll(env, seed, steps)
    for i, (observation, reward, terminated, truncated, info) in enumerate(rollout.given):
        _require_inside(observation, env.observation_space, f"call {i}: observation")
        require(type(reward) is float, f"call {i}: reward must be a float, is {type(reward).__name__}")
        require(bool(np.isfinite(reward)), f"call {i}: reward is {reward}")
        for name, value in (("terminated", terminated), ("truncated", truncated)):
            require(type(value) is bool, f"call {i}: {name} must be a bool, is {type(value).__name__}")
        _check_info(info, observation, f"call {i}: info")
    env.close()


def _check_info(info: dict[str, Any], observation: Any, path: str) -> None:
    """Every value is a number, of Python's own type and finite, or an array; no key is an observation's."""
    both = set(info) & set(observation) if isinstance(observation, Mapping) else set()
    require(not both, f"{path} has keys of the observation: {', '.join(sorted(both))}")
    for where, value in leaves(info, path):
        if isinstance(value, np.ndarray):
            require(value.dtype.kind in "biuf", f"{where} must be of numbers, is of {value.dtype}")
            continue
        python = isinstance(value, int | float) and not isinstance(value, np.generic)
        expected = "must be a number of Python's own type or an array"
        require(python, f"{where} {expected}, is {type(value).__name__}")
        require(bool(np.isfinite(value)), f"{where} is {value}")


def check_determinism(make_env: MakeEnv, seed: int = 0, steps: int = 60) -> None:
    """Two environments with one seed and the same actions give the same, bit by bit; so does one anew."""
    env = make_env()
    first = roll(env, seed, steps)
    require_equal(first, follow(make_env(), first.actions, seed), "two environments with one seed")
    require_equal(first, follow(env, first.actions, seed), "the same environment seeded once more")


def check_pickling(make_env: MakeEnv, seed: int = 0, steps: int = 60) -> None:
    """A copy by pickle, made before the first reset, after it or in mid-episode, goes on alike."""
    env = make_env()
    fresh = _pickled(env)
    rest = roll(env, seed, steps)
    require_equal(rest, follow(fresh, rest.actions, seed), "a pickled environment not yet reset")
    for taken in (0, 3):
        env = make_env()
        over = roll(env, seed, taken, one_episode=True).over
        copy = _pickled(env)
        rest = go_on(env, steps // 2, over=over)
        require_equal(rest, follow(copy, rest.actions), f"an environment pickled after {taken} steps")


def check_spec(make_env: MakeEnv, seed: int = 0, steps: int = 60) -> None:
    """The spec of a registered environment survives JSON, if its arguments are JSON values."""
    env = make_env()
    if env.spec is None:
        return
    if any(wrapper.kwargs is None for wrapper in env.spec.additional_wrappers):
        return  # a wrapper that does not record its arguments cannot be made again
    try:
        json.dumps(env.spec.kwargs)
    except TypeError:
        return
    what = "an environment made from its spec's JSON"
    with attempt(what):
        again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    first = roll(env, seed, steps // 2)
    require_equal(first, follow(again, first.actions, seed), what)


def check_masks(make_env: MakeEnv, seed: int = 0, steps: int = 60) -> None:
    """Masks fit the space; ending the turn is always allowed, objects only where they are in view."""
    env = make_env()
    inner = env.unwrapped
    env.reset(seed=seed)
    env.action_space.seed(seed)
    if action_mask(env) is None:
        return
    space = env.action_space
    assert isinstance(space, spaces.Discrete | spaces.MultiDiscrete)
    choices = space.nvec if isinstance(space, spaces.MultiDiscrete) else np.array([space.n])
    for i in range(steps):
        mask = action_mask(env)
        wanted = (int(choices.sum()),)
        require(mask.dtype == np.bool_ and mask.shape == wanted, f"step {i}: a mask must be {wanted} of bool")
        for k, part in enumerate(np.split(mask, np.cumsum(choices)[:-1])):
            require(bool(part.any()), f"step {i}: the mask leaves no choice in dimension {k}")
        if isinstance(inner, FarmToTableEnv) and inner.config.control != "hand":
            first, view = mask[: int(choices[0])], inner.view
            require(bool(first[-1]), f"step {i}: the mask forbids to end the turn")
            by_object = first[:-1].reshape(len(view.movable), -1).any(axis=1)
            in_view = view.in_view[view.movable]
            require(not np.any(by_object & ~in_view), f"step {i}: the mask allows what is out of view")
        action = random_action(env)
        require(
            space.contains(action), f"step {i}: the mask allows {action}, which is not in the action space"
        )
        *_, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()


def check_reset_options(make_env: MakeEnv, seed: int = 0) -> None:
    """`reset` sets layout and camera exactly, and refuses what it does not know."""
    env = make_env()
    inner = env.unwrapped
    assert isinstance(inner, FarmToTableEnv)
    env.reset(seed=seed)
    layout, camera = inner.world.truth, inner.world.camera
    as_objects = {"layout": layout, "camera": camera}
    as_values = {
        "layout": {"position": layout.position.tolist(), "yaw": layout.yaw.tolist()},
        "camera": {
            "position": camera.position.tolist(),
            "yaw": float(camera.yaw),
            "height": None if camera.height is None else float(camera.height),
            "pitch": float(camera.pitch),
            "fov": camera.fov,
        },
    }
    for options in (as_objects, as_values):
        env.reset(seed=seed + 1, options=options)
        truth, seen_by = inner.world.truth, inner.world.camera
        kept = np.array_equal(truth.position, layout.position) and np.array_equal(truth.yaw, layout.yaw)
        require(bool(kept), "reset(options={'layout': ...}) does not set the layout exactly")
        same = np.array_equal(seen_by.position, camera.position) and seen_by.yaw == camera.yaw
        require(bool(same), "reset(options={'camera': ...}) does not set the camera exactly")
        require(seen_by.fov == camera.fov, "reset(options={'camera': ...}) does not set the field of view")
    try:
        env.reset(options={"lay-out": layout})
    except OptionError:
        return
    raise AssertionError("reset takes an option that it does not know")


def check_trace(make_env: MakeEnv, seed: int = 0, steps: int = 60) -> None:
    """The trace of an episode, through JSON, plays again to the same hash; but not after one action less."""
    env, other = make_env().unwrapped, make_env().unwrapped
    assert isinstance(env, FarmToTableEnv)
    assert isinstance(other, FarmToTableEnv)
    roll(env, seed, steps, one_episode=True)
    try:
        trace = json.loads(json.dumps(env.trace()))
    except OptionError:  # an argument is an object, which has no name for a trace
        return
    with attempt("a trace that is played again"):
        digest = replay(trace, other)
    require(digest == trace["hash"], "a trace plays again to another hash")
    shorter = {**trace, "actions": trace["actions"][:-1]}
    require(replay(shorter, other) != trace["hash"], "the hash of a trace does not show a missing action")


def _pickled(env: Env) -> Env:
    with attempt("pickling"):
        copy: Env = pickle.loads(pickle.dumps(env))
    return copy


def _require_inside(observation: Any, space: spaces.Space[Any], path: str) -> None:
    if isinstance(space, spaces.Dict) and isinstance(observation, dict):
        keys = (list(observation), list(space.spaces))
        require(set(keys[0]) == set(keys[1]), f"{path} has keys {keys[0]}, its space {keys[1]}")
        for name, inner in space.spaces.items():
            _require_inside(observation[name], inner, f"{path}[{name!r}]")
        return
    if isinstance(observation, np.ndarray):
        require(bool(np.isfinite(observation).all()), f"{path} is not finite")
    require(space.contains(observation), f"{path} is not in {space}")


def _spaces_in(space: spaces.Space[Any], path: str) -> list[tuple[str, spaces.Space[Any]]]:
    if isinstance(space, spaces.Dict):
        inner = [(f"{path}[{name!r}]", one) for name, one in space.spaces.items()]
    elif isinstance(space, spaces.Tuple):
        inner = [(f"{path}[{i}]", one) for i, one in enumerate(space.spaces)]
    else:
        return [(path, space)]
    return [pair for name, one in inner for pair in _spaces_in(one, name)]


ALLOWED = (
    # What is to be checked may be a wrapper.
    "is different from the unwrapped version",
    # It need not be registered.
    "due to the environment not having a spec",
)
"""Parts of the warnings that say nothing against an environment."""


def check_with_gymnasium(make_env: Callable[[], Env], *, render: bool = True) -> None:
    """`gymnasium.utils.env_checker.check_env` passes without a warning, in every render mode if asked."""
    from gymnasium.utils.env_checker import check_env

    _silently("Gymnasium", lambda: check_env(make_env(), skip_render_check=not render))


def check_with_stable_baselines3(make_env: Callable[[], Env]) -> None:
    """`stable_baselines3.common.env_checker.check_env` passes without a warning, if it is installed."""
    if importlib.util.find_spec("stable_baselines3") is None:
        return
    from stable_baselines3.common.env_checker import check_env

    _silently("Stable-Baselines3", lambda: check_env(make_env(), warn=True))


def _silently(whose: str, check: Callable[[], None]) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with attempt(f"{whose}'s checker"):
            check()
    messages = [str(warning.message) for warning in caught]
    bad = [message for message in messages if not any(part in message for part in ALLOWED)]
    require(not bad, f"{whose}'s checker warns: {bad[0] if bad else ''}")
