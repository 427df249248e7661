"""Policies of the environments, attacks on re-identifiers, certificates, and the stress test made of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from farm_ar.agents.policies.trained import TrainedPolicy

__all__ = ["load_adversary"]


def load_adversary(name: str) -> TrainedPolicy:
    """An adversary of `FarmToTable-v0` that comes with farm-ar, a policy like those of `agents.policies`.

    Args:
        name: "farm-displacement" or "farm-slot", after the action that it takes.

    Raises:
        OptionError: there is none of that name.
        MissingPackageError: what training needs is not installed.
    """
    from farm_ar.agents.packages import need_training

    need_training()
    from farm_ar.agents.policies.trained import load_shipped

    return load_shipped(name)
