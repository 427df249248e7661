"""The optimizer with which the policy that points at objects learns."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import torch
from torch import Tensor
from torch.optim import Adam, Muon, Optimizer

LEAST_SIDE = 12
"""Matrices with fewer rows or columns are left to Adam."""

ADAM_SHARE = 0.15
"""Adam's learning rate, as a share of Muon's."""


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
        self._muon = Muon(matrices, lr, weight_decay=0.0, momentum=momentum)
        self._adam = Adam([p for p in given if id(p) not in taken], lr * ADAM_SHARE, eps=1e-5)

    @torch.no_grad()
    def step(self, closure: Any = None) -> None:  # type: ignore[override]
        """Make a step, with the learning rate that the first group has now."""
        assert closure is None, "it makes a step once the gradients are there"
        rate = self.param_groups[0]["lr"]
        for part, own in ((self._muon, rate), (self._adam, rate * ADAM_SHARE)):
            for group in part.param_groups:
                group["lr"] = own
            part.step()  # type: ignore[no-untyped-call]

    def state_dict(self) -> dict[str, Any]:
        """Both parts' states."""
        return {"muon": self._muon.state_dict(), "adam": self._adam.state_dict()}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""
        self._muon.load_state_dict(state_dict["muon"])
        self._adam.load_state_dict(state_dict["adam"])
