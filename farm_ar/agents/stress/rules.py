"""The re-identifiers that can be put to the test, by name: those built in, and anybody's own class."""

from __future__ import annotations

import sys
from pathlib import Path

from farm_ar.envs.reids import REIDS
from farm_ar.errors import OptionError
from farm_ar.game_logic.tracker import ReidFactory
from farm_ar.reid import LikelihoodReid, Reidentifier
from farm_ar.scenes import Scene
from farm_ar.sweeps.functions import load_function

RULES: dict[str, ReidFactory] = {"likelihood": LikelihoodReid, **REIDS}
"""The re-identifiers by name; `spatial` is the paper's rule as its game uses it, categories apart."""


def make_reid(name: str, scene: Scene) -> Reidentifier:
    """A re-identifier that knows a scene.

    Args:
        name: one of `RULES`, or `module:Class` of something that is called with the scene. Modules are found
            as `python -m` finds them, in the working folder too.
        scene: whose layout it knows.

    Raises:
        OptionError: there is no such name, or what is called has no `identify`.
    """
    if name in RULES:
        return RULES[name](scene)
    if ":" not in name:
        known = ", ".join(sorted(RULES))
        raise OptionError("reid", f"must be one of {known}, or module:Class of your own", name)
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.append(here)
    try:
        make = load_function(name)
    except OptionError as problem:
        expected = "must be module:Class, of a class at the top of a module in this folder or on PYTHONPATH"
        raise OptionError("reid", expected, name) from problem
    made = make(scene)
    if not isinstance(made, Reidentifier):
        raise OptionError("reid", "must be called with a scene and give something with identify()", name)
    return made
