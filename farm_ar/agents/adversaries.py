"""The trained adversaries that come with farm-ar."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from farm_ar.agents.training.trained_player import TrainedPlayer


def load_adversary(name: str) -> TrainedPlayer:
    """An adversary of `FarmToTable-v0` that comes with farm-ar, a player like those of `agents.players`.

    Args:
        name: "farm-displacement" or "farm-slot", after the action that it takes.

    Raises:
        OptionError: there is none of that name.
        MissingPackageError: what training needs is not installed.
    """
    from farm_ar.agents.training.needed import need_training

    need_training()
    from farm_ar.agents.training.trained_player import load_shipped

    return load_shipped(name)
