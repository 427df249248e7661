"""What can be batched, and what takes single environments instead."""

from __future__ import annotations

import numpy as np

from farm_ar.envs.config import EnvConfig
from farm_ar.errors import OptionError
from farm_ar.game_logic.physics.chipmunk import BRIDGED
from farm_ar.scenes import Scene

ONLY: dict[str, tuple[object, ...]] = {
    "control": ("move", "layout"),
    "action": ("displacement", "slot", "continuous", "offsets", "discrete"),
    "observation": ("state", "flat"),
    "reward": ("identity", "margin", "clutter", "miscount", "endpoint", "shaped"),
    "reid": ("spatial", "distance"),
    "session": ("off",),
    "perception": ("oracle",),
    "oracle_noise": ("none",),
    "update": ("pause",),
    "render_mode": (None,),
}
"""The values that can be batched of options that have others."""

LARGEST_M = 1000.0
"""On a larger scene a hand may be on its way for longer than it may."""


def obstacle(config: EnvConfig, scene: Scene) -> tuple[str, str, object] | None:
    """What of a configuration cannot be batched: the option, what it would have to be, what it is."""
    for name, values in ONLY.items():
        value = getattr(config, name)
        if not isinstance(value, str | None) or value not in values:
            return name, f"must be {' or '.join(map(str, values))} in a batch", value
    if config.game and config.carry != "lift":
        return "carry", "must be lift in a batch", config.carry
    layout = scene.layout
    if np.ptp(layout.elevation) > 0 or layout.tilt is not None:
        return "scene", "must have everything upright at one height in a batch", scene.name
    if not layout.names_categories:
        return "scene", "must name categories in a batch", scene.name
    if not scene.diagonal <= LARGEST_M:
        return "scene", f"must be no larger than {LARGEST_M:g} m in a batch", scene.diagonal
    if not BRIDGED:
        return "platform", "must be 64-bit x86 or ARM, and not Windows, for a batch", "another"
    return None


def check_batched(config: EnvConfig, scene: Scene) -> None:
    """See that a configuration can be batched.

    Raises:
        OptionError: it cannot.
    """
    found = obstacle(config, scene)
    if found is not None:
        raise OptionError(*found)
