"""A policy that points at an object, then says what to do with it; its distribution and its optimizer."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy
from stable_baselines3.common.torch_layers import CombinedExtractor
from stable_baselines3.common.type_aliases import Schedule
from torch import Tensor
from torch.distributions import Categorical
from torch.optim import Adam, Muon, Optimizer

from farm_ar.agents.training.object_network import NOWHERE, ObjectNetwork, Scores, ranks, sizes
from farm_ar.envs.actions import DisplacementAction, MoveAction, SlotAction
from farm_ar.errors import OptionError, known_name

LEAST_SIDE = 12
"""Matrices with fewer rows or columns, which have few directions, are left to Adam. (3 did no worse.)"""

ADAM_SHARE = 0.15
"""Adam's learning rate, as a share of Muon's: .003 and .02 were the best of those tried."""


class MuonAdam(Optimizer):
    """Muon for the matrices, Adam for all else.

    Muon (Jordan et al. 2024, "Muon: an optimizer for hidden layers in neural networks") makes a step as large
    in every direction of a matrix, the rarely needed ones too.

    Args:
        params: what is learnt.
        lr: learning rate of Muon; Adam's is a fixed share of it.
        momentum: of Muon.
    """

    def __init__(self, params: Iterable[Tensor], lr: float, momentum: float = 0.9) -> None:
        super().__init__(params, {"lr": lr})
        given = [p for group in self.param_groups for p in group["params"]]
        matrices = [p for p in given if p.ndim == 2 and min(p.shape) >= LEAST_SIDE]
        taken = {id(p) for p in matrices}
        others = [p for p in given if id(p) not in taken]
        self._parts: list[tuple[Optimizer, float]] = []
        if matrices:
            self._parts.append((Muon(matrices, lr, weight_decay=0.0, momentum=momentum), 1.0))
        if others:
            self._parts.append((Adam(others, lr, eps=1e-5), ADAM_SHARE))

    @torch.no_grad()
    def step(self, closure: Any = None) -> None:  # type: ignore[override]
        """Make a step, with the learning rate that the first group has now."""
        assert closure is None, "it makes a step once the gradients are there"
        for part, share in self._parts:
            for group in part.param_groups:
                group["lr"] = self.param_groups[0]["lr"] * share
            part.step()

    def state_dict(self) -> dict[str, Any]:
        """The learning rate, and the states of both."""
        return {"lr": self.param_groups[0]["lr"], "parts": [part.state_dict() for part, _ in self._parts]}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave.

        Raises:
            ValueError: it is the state of another optimizer.
        """
        if state_dict.keys() != {"lr", "parts"}:
            raise ValueError("the state must be that of a MuonAdam")
        self.param_groups[0]["lr"] = state_dict["lr"]
        for (part, _), state in zip(self._parts, state_dict["parts"], strict=True):
            part.load_state_dict(state)

    def __getstate__(self) -> dict[str, Any]:
        return {**super().__getstate__(), "_parts": self._parts}


class PointerDistribution:
    """The distribution of actions in B moments.

    With `slot` the label is part of the action. With `displacement` it is not: the levels of x, z and turn
    are a mixture over the labels, so that they go together as one label's do.

    Args:
        network: gives the levels.
        scores: of the moments.
        which: (B, N + 1) logits of the objects that move, and of ending the turn.
        place: (B, M, K) whether an object is the k-th of its kind; None where the action has no label.
    """

    def __init__(self, network: ObjectNetwork, scores: Scores, which: Tensor, place: Tensor | None) -> None:
        self._network, self._scores, self._place = network, scores, place
        self._which = torch.log_softmax(which, dim=-1)
        self._leave = which.shape[-1] - 1

    def get_actions(self, deterministic: bool = False) -> Tensor:
        """(B, ...) a draw, or the likeliest choice one after the other."""
        which = _choose(self._which, deterministic)
        stays, label, levels = self._given(which)
        chosen = _choose(label, deterministic)
        rest = [_choose(_row(part, chosen), deterministic) for part in levels]
        if self._place is not None:
            rest.insert(0, _row(self._place, chosen).argmax(dim=-1))
        return torch.stack([which, *(torch.where(stays, 0, part) for part in rest)], dim=-1)

    def log_prob(self, actions: Tensor) -> Tensor:
        """(B,) logarithm of the probability of actions."""
        which = actions[..., 0].long()
        stays, label, levels = self._given(which)
        return self._joint(actions.long(), stays, label, levels)

    def log_probs(self, actions: Tensor) -> Tensor:
        """(B, K) logarithms of the probabilities of K actions in each moment."""
        count = actions.shape[1]
        which = actions[..., 0].long()
        stays = which == self._leave
        affinity, levels = self._network.given_any(self._scores)
        rows, own = torch.arange(len(which), device=which.device)[:, None], torch.where(stays, 0, which)
        label = torch.log_softmax(affinity, dim=-1)[rows, own].flatten(0, 1)
        parts = [torch.log_softmax(part, dim=-1)[rows, own].flatten(0, 1) for part in levels]
        joint = self._joint(actions.long().flatten(0, 1), stays.flatten(), label, parts, count)
        return joint.reshape(which.shape)

    def _joint(
        self, actions: Tensor, stays: Tensor, label: Tensor, levels: list[Tensor], count: int = 1
    ) -> Tensor:
        """(B x count,) logarithms of probabilities, `count` actions of a moment after one another."""
        which, *rest = actions.unbind(-1)
        if self._place is None:
            joint = label
        else:
            slot, *rest = rest
            kind = label > NOWHERE / 2
            place = self._place.repeat_interleave(count, dim=0)
            meant = place.gather(-1, slot[:, None, None].expand(-1, label.shape[1], 1)).squeeze(-1)
            joint = label.masked_fill(~(kind & (meant > 0)), NOWHERE)
        for part, choice in zip(levels, rest, strict=True):
            joint = joint + _at(part, choice[:, None].expand(-1, part.shape[1]))
        first = _at(self._which.repeat_interleave(count, dim=0), which)
        return first + torch.where(stays, 0.0, torch.logsumexp(joint, dim=-1))

    def entropy(self, actions: Tensor) -> Tensor:
        """(B,) of the whole action, the part that comes after the object taken for the one that was chosen.

        With a mixture it is an upper bound: that of the label and the levels together.
        """
        stays, label, levels = self._given(actions[:, 0].long())
        rest = _entropy(label) + (label.exp() * sum(_entropy(part) for part in levels)).sum(-1)
        return _entropy(self._which) + torch.where(stays, 0.0, rest)

    def _given(self, which: Tensor) -> tuple[Tensor, Tensor, list[Tensor]]:
        """(B,) whether nothing is taken, (B, M) labels' and [(B, M, levels)] levels' log-probabilities."""
        stays = which == self._leave
        affinity, levels = self._network.given(self._scores, torch.where(stays, 0, which))
        return (
            stays,
            torch.log_softmax(affinity, dim=-1),
            [torch.log_softmax(part, dim=-1) for part in levels],
        )


def _choose(log_probability: Tensor, deterministic: bool) -> Tensor:
    if deterministic:
        return log_probability.argmax(dim=-1)
    drawn: Tensor = Categorical(logits=log_probability, validate_args=False).sample()  # type: ignore[no-untyped-call]
    return drawn


def _at(log_probability: Tensor, choice: Tensor) -> Tensor:
    return log_probability.gather(-1, choice[..., None]).squeeze(-1)


def _row(values: Tensor, index: Tensor) -> Tensor:
    """(B, ...) of each batch member's values the row at its index."""
    return values[torch.arange(len(values), device=values.device), index]


def _entropy(log_probability: Tensor) -> Tensor:
    return -(log_probability.exp() * log_probability).sum(-1)


OPTIMIZERS: dict[str, type[Optimizer]] = {"muon": MuonAdam, "adam": Adam}


def encoding_of(space: spaces.MultiDiscrete) -> tuple[type[MoveAction], int]:
    """Which of the actions `slot` and `displacement` a space is of, and how many slots it has.

    Raises:
        OptionError: it is of neither.
    """
    objects, *others = (int(n) for n in space.nvec)
    if others == [len(DisplacementAction.LEVELS)] * 3:
        return DisplacementAction, 0
    if len(others) == 2 and others[1] == len(SlotAction.SHARES) and others[0] < objects:
        return SlotAction, others[0]
    raise OptionError("policy", "must be another one: ObjectPolicy plays slot and displacement", space)


class ObjectPolicy(MaskableActorCriticPolicy):
    """Actor and critic on an `ObjectNetwork`, for the actions `displacement` and `slot`.

    Args:
        observation_space: of `observation="state"`.
        action_space: which object, or the end of the turn, and the rest.
        lr_schedule: learning rate.
        width: of what is known of an object.
        pair_width: of what is known of a pair of objects.
        rounds: how often the objects look at one another.
        optimizer: "muon" or "adam", whose learning rates are of different sizes.
        kwargs: those of Stable-Baselines3's policies.

    Raises:
        OptionError: the optimizer is another, or the space is of another action.
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
        encoding, self._slots = encoding_of(actions)
        others = others[1:] if self._slots else others
        self.encoding: MoveAction = encoding(self._movable, self._slots, 1.0)
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

    def outlook(
        self, obs: Any, action_masks: Any = None, apart: bool = False
    ) -> tuple[PointerDistribution, Tensor]:
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
        return PointerDistribution(self.network, scores, which, place), scores.value
