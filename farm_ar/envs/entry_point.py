"""Where Gymnasium enters: what it makes when a registered id is asked for."""

from __future__ import annotations

from typing import Any, ClassVar

from farm_ar.envs.farm_to_table import FarmToTableEnv


class EntryPoint:
    """Makes `FarmToTableEnv` for `gymnasium.make`.

    Left to itself Gymnasium would put a window of its own before an environment that is asked for
    `render_mode="human"`, which needs another package and a display, and complain in its own words where
    either is missing. The names below have it leave that mode to the environment, which says what there is.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array", "human"], "render_fps": 4}

    def __call__(self, **arguments: Any) -> FarmToTableEnv:
        """The environment, with the arguments of the id and those that `make` was given."""
        return FarmToTableEnv(**arguments)


make_farm_to_table = EntryPoint()
"""Makes an environment; every registered id names it."""
