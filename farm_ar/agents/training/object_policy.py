"""A policy that points at an object first and then says what to do with it, for MaskablePPO."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy
from stable_baselines3.common.torch_layers import CombinedExtractor
from stable_baselines3.common.type_aliases import Schedule
from torch import Tensor
from torch.optim import Adam, Optimizer

from farm_ar.agents.training.muon_adam import MuonAdam
from farm_ar.agents.training.object_network import NOWHERE, ObjectNetwork, Scores, ranks, sizes
from farm_ar.agents.training.pointing import Pointing
from farm_ar.errors import known_name

OPTIMIZERS: dict[str, type[Optimizer]] = {"muon": MuonAdam, "adam": Adam}

SLOT_CHOICES = 3
"""How many choices the action `slot` has; `displacement` has one more."""

SENSES = (1, 3)
"""The choices of `displacement` whose sense changes in a mirror: x, and the turn."""


class ObjectPolicy(MaskableActorCriticPolicy):
    """Actor and critic on an `ObjectNetwork`, for the actions `displacement` and `slot`.

    Args:
        observation_space: of `observation="state"`.
        action_space: which object, or leaving, and the rest.
        lr_schedule: learning rate.
        width: of what is known of an object.
        pair_width: of what is known of a pair of objects.
        rounds: how often the objects look at one another.
        optimizer: "muon" or "adam", whose learning rates are of different sizes.
        kwargs: those of Stable-Baselines3's policies.

    Raises:
        OptionError: the optimizer is another.
    """

    def __init__(
        self,
        observation_space: spaces.Dict,
        action_space: spaces.MultiDiscrete,
        lr_schedule: Schedule,
        width: int = 64,
        pair_width: int = 32,
        rounds: int = 2,
        optimizer: str = "muon",
        **kwargs: Any,
    ) -> None:
        known_name("policy_kwargs.optimizer", optimizer, OPTIMIZERS)
        self._shape = {"width": width, "pair_width": pair_width, "rounds": rounds}
        kwargs |= {"features_extractor_class": CombinedExtractor, "optimizer_class": OPTIMIZERS[optimizer]}
        super().__init__(observation_space, action_space, lr_schedule, **kwargs)

    def _build(self, lr_schedule: Schedule) -> None:
        observations: Any = self.observation_space
        actions: Any = self.action_space
        lengths = {name: space.shape[0] for name, space in observations.spaces.items()}
        first, *others = (int(n) for n in actions.nvec)
        self._movable = first - 1
        self._slots = others.pop(0) if len(actions.nvec) == SLOT_CHOICES else 0
        self.senses = () if self._slots else SENSES
        self.network = ObjectNetwork(sizes(lengths, lengths["in_view"]), others, **self._shape)
        self.renew_optimizer(lr_schedule(1))

    def renew_optimizer(self, rate: float) -> None:
        """Have an optimizer for which earlier gradients do not count.

        Args:
            rate: its learning rate.
        """
        optimizer: Any = self.optimizer_class
        self.optimizer = optimizer(self.network.parameters(), lr=rate, **self.optimizer_kwargs)

    def forward(
        self, obs: Any, deterministic: bool = False, action_masks: Any = None
    ) -> tuple[Tensor, Tensor, Tensor]:
        """(B, ...) actions, (B, 1) values and (B,) logarithms of the actions' probabilities."""
        distribution, values = self.outlook(obs, action_masks)
        actions = distribution.get_actions(deterministic)
        return actions, values, distribution.log_prob(actions)

    def evaluate_actions(
        self, obs: Any, actions: Tensor, action_masks: Any = None
    ) -> tuple[Tensor, Tensor, Tensor]:
        """(B, 1) values, (B,) logarithms of the actions' probabilities, (B,) entropies."""
        distribution, values = self.outlook(obs, action_masks)
        return values, distribution.log_prob(actions), distribution.entropy(actions)

    def get_distribution(self, obs: Any, action_masks: Any = None) -> Any:
        """How the action is drawn."""
        return self.outlook(obs, action_masks)[0]

    def predict_values(self, obs: Any) -> Tensor:
        """(B, 1) values."""
        scores: Scores = self.network(obs)
        return scores.value

    def outlook(self, obs: Any, action_masks: Any = None, apart: bool = False) -> tuple[Pointing, Tensor]:
        """How the action is drawn, and (B, 1) values; `apart` as in `ObjectNetwork.forward`."""
        scores: Scores = self.network(obs, apart)
        n = self._movable
        which = torch.cat([scores.which[:, :n], scores.leave], dim=-1)
        if action_masks is not None:
            allowed = torch.as_tensor(np.asarray(action_masks), dtype=torch.bool, device=which.device)
            which = which.masked_fill(~allowed.reshape(len(which), -1)[:, : n + 1], NOWHERE)
        place = None
        if self._slots:
            place = torch.nn.functional.one_hot(ranks(scores.same.float()), scores.same.shape[1])
            place = place[..., : self._slots]
        return Pointing(self.network, scores, which, place), scores.value
