"""How an action is drawn: an object first, then the label that it is to be taken for, then the rest."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.distributions import Categorical

from farm_ar.agents.training.object_network import NOWHERE, ObjectNetwork, Scores


class Pointing:
    """The distribution of actions in B moments.

    With `slot` the label is part of the action. With `displacement` it is not: the levels of x, z and turn
    are a mixture over the labels, so that they go together as one label's do.

    Args:
        network: gives the levels.
        scores: of the moments.
        which: (B, N + 1) logits of the objects that move, and of leaving.
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
