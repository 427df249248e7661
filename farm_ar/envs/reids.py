"""The re-identifiers that the headset of an environment may use, by name."""

from __future__ import annotations

from typing import Any

from farm_ar.errors import OptionError, known_name
from farm_ar.game_logic.tracker import ReidFactory, spatial_by_category
from farm_ar.reid import REIDENTIFIERS

REIDS: dict[str, ReidFactory] = {**REIDENTIFIERS, "spatial": spatial_by_category}
"""The re-identifiers by name."""


def reid_factory(reid: Any) -> ReidFactory:
    """The re-identifier of a name, or the function from a `Scene` to a `Reidentifier` itself.

    Raises:
        OptionError: it is neither.
    """
    if isinstance(reid, str):
        return REIDS[known_name("reid", reid, REIDS)]
    if not callable(reid):
        expected = f"must be one of {', '.join(sorted(REIDS))}, or a function from a Scene to a Reidentifier"
        raise OptionError("reid", expected, reid)
    factory: ReidFactory = reid
    return factory
