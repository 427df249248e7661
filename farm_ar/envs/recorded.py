"""An environment whose episodes are recorded: traced, hashed, and pickled by being played again."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import gymnasium as gym

from farm_ar.envs.config import EnvConfig
from farm_ar.envs.observations import Left
from farm_ar.envs.trace import Trace, state_digest
from farm_ar.envs.worlds import World


class RecordedEnv(gym.Env[Any, Any]):
    """An environment that is its arguments, its generator and what was done in it."""

    _config: EnvConfig
    _trace: Trace | None
    _mine: set[str]

    @abstractmethod
    def _make(self, arguments: dict[str, Any]) -> None:
        """Make the environment of its arguments, without those of a subclass."""

    @property
    @abstractmethod
    def world(self) -> World:
        """The game, or the plain scene, on which the episode plays."""

    @abstractmethod
    def _left(self) -> Left:
        """What is left of metres, radians, moves (or time) and visits, as shares."""

    def trace(self) -> dict[str, Any]:
        """The episode so far as JSON values: what `farm_ar.envs.replay` plays again to the same hash.

        Raises:
            gymnasium.error.ResetNeeded: there is no episode.
            OptionError: an argument of the environment is an object, which has no name to be found by.
        """
        return self.trace_so_far()()

    def trace_so_far(self) -> Callable[[], dict[str, Any]]:
        """What makes the trace of the episode up to now, also later and in another thread.

        Raises:
            gymnasium.error.ResetNeeded: there is no episode.
        """
        digest = self.state_hash()
        assert self._trace is not None
        kept = replace(self._trace, actions=list(self._trace.actions))
        arguments, again = self._config.arguments(), type(self).__new__(type(self))

        def make() -> dict[str, Any]:
            again._make(arguments)
            return kept.as_json(arguments, digest, again)

        return make

    def state_hash(self) -> str:
        """A digest of all that may change in an episode; two equal ones mean equal states.

        Raises:
            gymnasium.error.ResetNeeded: there has been no episode yet.
        """
        return state_digest(self.world.state(), self._left(), self.np_random)

    def __getstate__(self) -> dict[str, Any]:
        return {
            "arguments": self._config.arguments(),
            "spec": self.spec,
            "spaces": (self.action_space, self.observation_space),
            "generator": (self._np_random, self._np_random_seed),
            "trace": self._trace,
            "own": {name: value for name, value in vars(self).items() if name not in self._mine},
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._make(state["arguments"])
        vars(self).update(state["own"])
        self.spec = state["spec"]
        self.action_space, self.observation_space = state["spaces"]
        self._np_random, self._np_random_seed = state["generator"]
        if state["trace"] is not None:
            state["trace"].play_in(self)

    def _require_reset(self) -> None:
        if self._trace is None:
            raise gym.error.ResetNeeded("there is nothing to look at before reset()")
