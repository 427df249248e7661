"""The checkers of Gymnasium and of Stable-Baselines3, with their warnings made failures."""

from __future__ import annotations

import importlib.util
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium as gym

from farm_ar.testing.comparing import attempt, require

Env = gym.Env[Any, Any]

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
