"""Two agents at one table, for PettingZoo: an adversary's visit, then a helper's (extra `pettingzoo`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.error import ResetNeeded

from farm_ar.envs.env import FarmToTableEnv
from farm_ar.errors import MissingPackageError, OptionError

try:
    from pettingzoo import AECEnv
except ImportError as problem:  # pragma: no cover - of a core without extras
    raise MissingPackageError("this needs pettingzoo: pip install 'farm-ar[pettingzoo]'") from problem

AGENTS = ADVERSARY, HELPER = "adversary_0", "helper_0"

OWN_OPTIONS = ("layout", "camera")
"""Options of a reset that are the table's; PettingZoo asks that others are put up with."""


FIXED: dict[str, Any] = {
    "control": "move",
    "action": "discrete",
    "observation": "flat",
    "reward": "identity",
    "sign": 1,
}
"""Arguments of the table that are not to be chosen."""


class AdversaryAndHelperEnv(AECEnv):  # type: ignore[misc]  # PettingZoo has no type information
    """`FarmToTableDiscrete-v0` for two: in turn each has a visit, at whose end the headset looks.

    What the adversary gains the helper loses: the rise of the number of wrong labels in any step. Each pays
    for its own effort. Both observe the table; `infos[agent]["action_mask"]` has choices only for whose turn
    it is.

    Args:
        rounds: visits of each in an episode.
        arguments: of `FarmToTableEnv`, other than `control`, `action`, `observation`, `visits`, `reward` and
            `sign`.

    Raises:
        OptionError: an argument is wrong, or is one of those.
    """

    metadata = {"render_modes": ["rgb_array"], "name": "adversary_and_helper_v0", "is_parallelizable": False}  # noqa: RUF012  # PettingZoo's own form

    def __init__(self, rounds: int = 1, **arguments: Any) -> None:
        super().__init__()
        for name in (*FIXED, "visits"):
            if name in arguments:
                raise OptionError(name, "must be left out, as two players share the table", arguments[name])
        if isinstance(rounds, bool) or not isinstance(rounds, int) or not 1 <= rounds <= 1000:
            raise OptionError("rounds", "must be a whole number from 1 to 1000", rounds)
        self.table = FarmToTableEnv(**arguments, **FIXED, visits=2 * rounds)
        self.render_mode = self.table.render_mode
        self.possible_agents = list(AGENTS)
        self.agents: list[str] = []
        choices = self.table.action_space
        assert isinstance(choices, spaces.Discrete)
        self.observation_spaces = dict.fromkeys(AGENTS, self.table.observation_space)
        self.action_spaces = {agent: spaces.Discrete(int(choices.n)) for agent in AGENTS}

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """What an agent observes."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """What it chooses from."""
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        """Begin an episode; of the options `layout` and `camera` count, as in `FarmToTableEnv`."""
        if not isinstance(options, Mapping | None):
            raise OptionError("options", "must be a mapping with layout and camera, both optional", options)
        own = {name: value for name, value in (options or {}).items() if name in OWN_OPTIONS}
        self._seen, info = self.table.reset(seed=seed, options=own)
        self.agents = list(AGENTS)
        self.rewards = dict.fromkeys(AGENTS, 0.0)
        self._cumulative_rewards = dict.fromkeys(AGENTS, 0.0)
        self.terminations = dict.fromkeys(AGENTS, False)
        self.truncations = dict.fromkeys(AGENTS, False)
        self.agent_selection = AGENTS[0]
        self._tell(info)

    def observe(self, agent: str) -> npt.NDArray[np.float32]:
        """The table as it is.

        Raises:
            gymnasium.error.ResetNeeded: no episode has begun.
        """
        if not hasattr(self, "_seen"):
            raise ResetNeeded("there is nothing to look at before reset()")
        seen: npt.NDArray[np.float32] = self._seen.copy()
        return seen

    def step(self, action: int | None) -> None:
        """The choice of the one whose turn it is.

        Raises:
            gymnasium.error.ResetNeeded: no episode has begun, or both have left the last one.
        """
        if not self.agents:
            raise ResetNeeded("step() needs reset() first")
        agent = self.agent_selection
        if self.terminations[agent] or self.truncations[agent]:
            self._was_dead_step(action)
            return
        self._cumulative_rewards[agent] = 0.0
        visits = self.table.visits_left
        self._seen, _, over, _, info = self.table.step(action)
        harm, effort = info["reward/identity"], info["reward/effort"]
        self.rewards = {ADVERSARY: harm, HELPER: -harm}
        self.rewards[agent] += effort
        self.terminations = dict.fromkeys(AGENTS, over)
        if over or self.table.visits_left < visits:
            self.agent_selection = AGENTS[1 - AGENTS.index(agent)]
        self._tell(info)
        self._accumulate_rewards()

    def _tell(self, info: dict[str, Any]) -> None:
        mask = info["action_mask"].astype(np.int8)
        choices = {one: mask if one == self.agent_selection else np.zeros_like(mask) for one in AGENTS}
        self.infos = {one: {**info, "action_mask": choices[one]} for one in AGENTS}

    def render(self) -> Any:
        """The table, as `FarmToTableEnv` draws it."""
        return self.table.render()

    def close(self) -> None:
        """End what shows it."""
        self.table.close()


def env(**arguments: Any) -> AdversaryAndHelperEnv:
    """The environment, as PettingZoo's modules call it."""
    return AdversaryAndHelperEnv(**arguments)
