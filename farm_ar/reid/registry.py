"""The re-identifiers by name: the one place where a name becomes a re-identifier."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from functools import partial
from importlib import import_module
from inspect import signature
from pathlib import Path
from types import ModuleType
from typing import Any

from farm_ar.errors import OptionError
from farm_ar.reid.base import Reidentifier, as_reidentifier
from farm_ar.reid.baselines import BASELINES
from farm_ar.reid.likelihood.method import LikelihoodReid
from farm_ar.reid.partly_named import make_adaptive
from farm_ar.reid.relational.method import RelationalReid
from farm_ar.reid.spatial import SpatialReid
from farm_ar.reid.spatial_costs import SpatialOptions
from farm_ar.reid.spatial_space import SpatialSpaceReid
from farm_ar.reid.spatial_unity import SpatialUnityReid
from farm_ar.scenes import Scene

ReidFactory = Callable[[Scene], Reidentifier]
"""Makes the re-identifier for a scene, whose layout is what was last known."""

REIDENTIFIERS: dict[str, ReidFactory] = {
    "spatial": SpatialReid,
    "spatial-unity": SpatialUnityReid,
    "spatial-3d": SpatialSpaceReid,
    "spatial-ungated": partial(SpatialReid, options=SpatialOptions(gate_categories=False)),
    "spatial-scale-free": partial(SpatialReid, options=SpatialOptions(weights="scale-free")),
    "likelihood": LikelihoodReid,
    "relational": RelationalReid,
    "adaptive": make_adaptive,
    **BASELINES,
}
"""Makes each re-identifier for a scene, with its default options."""


MOST_PAIRS = {"likelihood": 1_000_000, "relational": 40_000, "adaptive": 200_000}
"""Largest number of labels times detections in commands and the service, by method; a gigabyte."""


def reid_factory(reid: Any, field: str = "reid") -> ReidFactory:
    """What makes a re-identifier: the one of a name, or the function from a `Scene` that is given itself.

    Args:
        reid: a name in `REIDENTIFIERS`, or the function.
        field: what the error calls it.

    Raises:
        OptionError: it is neither.
    """
    if isinstance(reid, str) and reid in REIDENTIFIERS:
        return REIDENTIFIERS[reid]
    if isinstance(reid, str) or not callable(reid):
        known = ", ".join(sorted(REIDENTIFIERS))
        expected = f"must be one of {known}, or a function from a Scene to a Reidentifier"
        raise OptionError(field, f"must be one of {known}" if isinstance(reid, str) else expected, reid)
    factory: ReidFactory = reid
    return factory


def load_reid(name: str, field: str = "reid") -> ReidFactory:
    """What makes the re-identifier of a name on the command line: a built-in one, or a user's class.

    Args:
        name: one in `REIDENTIFIERS`, or `module:Class` of something that is called with the scene. The module
            is found as `python -m` finds it, in the working folder too; importing it runs it.
        field: what the error calls it.

    Raises:
        OptionError: there is no such name or class; from what is returned, if it gives something without
            `identify`.
    """
    if name in REIDENTIFIERS:
        return REIDENTIFIERS[name]
    make = imported(name, field, REIDENTIFIERS)
    return partial(_made, make, name, field)


def _classes_of(module: ModuleType) -> str:
    """The classes that a module defines, as a hint."""
    own = [
        key
        for key, value in vars(module).items()
        if isinstance(value, type) and value.__module__ == module.__name__ and not key.startswith("_")
    ]
    return f", one of {', '.join(own)}" if own else ", which defines none"


def imported(name: str, field: str, known: Iterable[str]) -> Callable[..., Any]:
    """What `module:Class` of the user's own names; importing the module runs it.

    Args:
        name: what a person typed.
        field: what the error calls it.
        known: names that would have done, too.

    Raises:
        OptionError: there is no such class.
    """
    module, _, attribute = name.partition(":")
    if not (module and attribute):
        expected = f"must be one of {', '.join(sorted(known))}, or module:Class of your own"
        raise OptionError(field, expected, name)
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.append(here)
    try:
        found = import_module(module)
    except ImportError as missing:
        if missing.name is None or not (module + ".").startswith(missing.name + "."):
            raise
        expected = f"must name a module in this folder or on PYTHONPATH: there is no {missing.name}"
        raise OptionError(field, expected, name) from None
    make = getattr(found, attribute, None)
    if not callable(make):
        raise OptionError(field, f"must name a class at the top of {module}{_classes_of(found)}", name)
    return make  # type: ignore[no-any-return]


def _made(make: Callable[[Scene], Any], name: str, field: str, scene: Scene) -> Reidentifier:
    """What a class of the user's own gives for a scene."""
    try:
        signature(make).bind(scene)
    except TypeError:
        raise OptionError(field, "must take a scene, and need nothing else", name) from None
    except ValueError:  # something built in, which does not say what it takes
        pass
    made = make(scene)
    if not isinstance(made, Reidentifier):
        raise OptionError(field, "must be called with a scene and give something with identify()", name)
    return as_reidentifier(made, scene)
