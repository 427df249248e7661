"""Episodes of every registered id under every option in turn: spaces, observations, rewards, infos, hash."""

from __future__ import annotations

import hashlib
import json
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.errors import InputError
from farm_ar.scenes import builtin_scene

IDS = ("FarmToTable-v0", "FarmToTableHand-v0", "FarmToTableLayout-v0", "SceneLayout-v0")

OPTIONS: tuple[dict[str, Any], ...] = (
    {},
    *({"action": name} for name in ("displacement", "slot", "continuous", "velocity", "offsets", "none")),
    *({"observation": name} for name in ("pixels", "nonsense")),
    *({"knowledge": name} for name in ("black-box", "nonsense")),
    *({"reward": name} for name in ("margin", "clutter", "miscount", "endpoint", "nonsense")),
    *({"sign": value} for value in (-1, 0, 2)),
    *({"effort_weight": value} for value in (0.0, 1.0, -1.0)),
    *({"reid": name} for name in ("likelihood", "relational", "nearest", "distance", "last-known", "none")),
    {"perception": "nonsense"},
    *({"budget_m": value} for value in (0.1, 0.0)),
    *({"budget_rad": value} for value in (0.2, float("nan"))),
    *({"budget": value} for value in (0.1, -1.0)),
    *({"visits": value} for value in (2, 0)),
    *({"moves": value} for value in (2, 1.5)),
    *({"hand_seconds": value} for value in (2.0, -1.0)),
    *({"animals_a_second": value} for value in (3.0, float("inf"))),
    *({"jitter": name} for name in ("none", "easy", "hard", "nonsense")),
    *({"play_seconds": value} for value in (0.0, "long")),
    *({"head_noise_deg": value} for value in (5.0, -5.0)),
    *({"fov": name} for name in ("display", "nonsense")),
    *({"game": value} for value in (False, 1)),
    *({"scene": name} for name in ("farm", "lab", "H1", "nonsense")),
    *({"render_mode": name} for name in ("rgb_array", "human")),
    {"observation": "pixels", "knowledge": "black-box"},
    {"reward": "margin", "visits": 2, "sign": -1},
    {"reward": "endpoint", "head_noise_deg": 5.0, "reid": "distance"},
    {"reset": {"camera": {"position": [0.6, -0.3], "yaw": 0.1}}},
    {"reset": {"layout": "shifted"}},
    {"reset": {"layout": "nonsense"}},
    {"reset": {"nonsense": 1}},
)
INFO = (("accuracy",), ("wrong_labels",), ("paper_margin", "margin"), ("effort",), ("miscounts",), ("phase",))
"""What is kept of the infos, by its names, the present one first."""

PHASES = {"play": 0, "hand": 1}
"""What the phase was when it was a word."""

SEEDS = {"FarmToTableHand-v0": 2, "FarmToTable-v0": 5}
STEPS, HAND_STEPS, EVERY = 16, 55, 6
"""Steps of an episode at most; of one of the hand, of which every sixth observation is kept."""


def episode(env_id: str, options: dict[str, Any]) -> dict[str, Any]:
    """A few seeded episodes; or what the error names."""
    given = {name: value for name, value in options.items() if name != "reset"}
    try:
        env = gym.make(env_id, disable_env_checker=True, **given)
        env.reset(seed=0, options=_reset(options, env_id))
    except InputError as problem:
        return {"refused": [type(problem).__name__, problem.field, repr(problem.got)]}
    values: dict[str, Any] = {"action space": str(env.action_space)}
    space = env.observation_space
    parts = dict(space) if isinstance(space, gym.spaces.Dict) else {"": space}
    values |= {f"space {name}": str(part) for name, part in parts.items()}
    hand = "Hand" in env_id
    for seed in range(SEEDS.get(env_id, 6)):
        rollout = _play(env, seed, hand, _reset(options, env_id))
        values |= {f"{seed} {name}": value for name, value in rollout.items() if name != "rewards"}
        values["rewards"] = np.concatenate([values.get("rewards", []), rollout["rewards"]])
    return values


def _reset(options: dict[str, Any], env_id: str) -> Any:
    reset = options.get("reset")
    if reset != {"layout": "shifted"}:
        return reset
    layout = builtin_scene("L1" if "Scene" in env_id else "farm").layout
    return {"layout": {"position": layout.position + 0.01, "yaw": layout.yaw - 0.1}}


def _play(env: gym.Env[Any, Any], seed: int, hand: bool, reset: Any) -> dict[str, Any]:
    rng = np.random.default_rng([seed, 99])
    seen, info = env.reset(seed=seed, options=reset)
    observations, infos, rewards, masks, pictures, over, steps = [seen], [info], [], [], [], False, 0
    held = rng.uniform(-1, 1, 4)
    while not over and steps < (HAND_STEPS if hand else STEPS):
        if isinstance(env.action_space, gym.spaces.MultiDiscrete):
            mask = env.get_wrapper_attr("action_masks")()
            masks.append(mask)
            action = _allowed(env.action_space.nvec, mask, rng)
        else:
            action = rng.uniform(-1, 1, env.action_space.shape)
            if hand:
                held, action = _steered(seen, held, steps, rng), held
            action = np.asarray(action, dtype=np.float32)
        seen, reward, over, _, info = env.step(action)
        steps += 1
        rewards.append(reward)
        infos.append(info)
        if not hand or steps % EVERY == 0 or over:
            observations.append(seen)
        if env.render_mode is not None and (over or steps == 1):
            pictures.append(_digest(env.render()))
    values = {f"info {names[0]}": _numbers([_first(info, names) for info in infos]) for names in INFO}
    if isinstance(observations[0], dict):
        values |= {f"seen {name}": np.array([o[name] for o in observations]) for name in observations[0]}
    else:
        values["seen"] = [_digest(o) for o in observations]
    values |= {"rewards": np.array(rewards), "over": over, "steps": steps, "masks": np.array(masks)}
    values |= {"pictures": pictures, "hash": env.unwrapped.state_hash()}
    return values


def _steered(seen: Any, held: np.ndarray, step: int, rng: np.random.Generator) -> np.ndarray:
    """The hand goes to the nearest object in view, takes it somewhere, lets go, and leaves in the end."""
    if step % 14 < 5 and isinstance(seen, dict) and seen["in_view"].any():
        places = seen["position"].reshape(-1, 2)[(seen["in_view"] > 0) & (seen["fixed"] == 0)]
        if len(places):
            way = places - seen["hand"][:2]
            nearest = way[np.argmin(np.linalg.norm(way, axis=1))]
            return np.array([*np.clip(4 * nearest, -1, 1), 0.0, -1.0])
    if step % 14 == 5:
        return np.array([*rng.uniform(-0.5, 0.5, 3), 1.0])
    return np.array([0.3, -1.0, 0.0, -1.0]) if step > 35 or step % 14 > 11 else held


def _allowed(sizes: np.ndarray, mask: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A choice in each dimension that the mask allows."""
    parts = np.split(mask, np.cumsum(sizes)[:-1])
    return np.array([rng.choice(np.flatnonzero(part)) for part in parts])


def _first(info: dict[str, Any], names: tuple[str, ...]) -> Any:
    value = next((info[name] for name in names if name in info), "none")
    return PHASES.get(value, value) if isinstance(value, str) else value


def _numbers(values: list[Any]) -> Any:
    """Numbers, or arrays of one shape, as an array; anything else as it is."""
    if all(isinstance(value, int | float | np.ndarray) for value in values):
        return np.array(values, dtype=np.float64)
    return [str(value) for value in values]


def _digest(array: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16]


CASES = {
    f"episode {env_id} {json.dumps(options)}": partial(episode, env_id, options)
    for env_id in IDS
    for options in OPTIONS
}
