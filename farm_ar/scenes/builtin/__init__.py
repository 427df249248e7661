"""The scenes that come with farm-ar, each built by code from a short description.

L1, L2, M1, M2, H1 and H2 stand for the paper's six synthetic scenes and agree with its Table 1; pantry,
cafeteria and classroom stand for its real rooms and agree with its Table 4; lab and farm stand for its
showcases and its game. They are rebuilt from what the paper says of them, with spacing and clustering like
the originals', and are not the authors' layouts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType

from farm_ar.errors import known_name
from farm_ar.scenes.builtin import offices, restaurants, rooms
from farm_ar.scenes.builtin.farm import FACING_S1, FACING_S4, farm
from farm_ar.scenes.scene import Scene

__all__ = ["BUILTIN", "DESCRIPTIONS", "FACING_S1", "FACING_S4", "builtin_names", "builtin_scene"]

BUILTIN: Mapping[str, Callable[[], Scene]] = MappingProxyType(
    {
        "L1": restaurants.l1,
        "L2": offices.l2,
        "M1": offices.m1,
        "M2": restaurants.m2,
        "H1": restaurants.h1,
        "H2": offices.h2,
        "pantry": rooms.pantry,
        "cafeteria": rooms.cafeteria,
        "classroom": rooms.classroom,
        "lab": rooms.lab,
        "farm": farm,
    }
)
"""What builds each scene, in the order in which they are listed."""

DESCRIPTIONS: Mapping[str, str] = MappingProxyType(
    {name: (build.__doc__ or "").splitlines()[0] for name, build in BUILTIN.items()}
)
"""One line on each scene: the first of its builder's docstring."""


def builtin_names() -> tuple[str, ...]:
    """The names of the built-in scenes."""
    return tuple(BUILTIN)


def builtin_scene(name: str) -> Scene:
    """The built-in scene of that name; the same object at every call.

    Raises:
        OptionError: no built-in scene has that name; the message lists those that exist.
    """
    return _build(known_name("scene", name, BUILTIN))


@cache
def _build(name: str) -> Scene:
    return BUILTIN[name]()
