"""The optimizer with which the policy that points at objects learns."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import torch
from torch import Tensor
from torch.optim import Adam, Muon, Optimizer

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
