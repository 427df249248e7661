"""What a stress test is asked to do."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from farm_ar.agents.attacks import Learned, attack_named
from farm_ar.agents.stress.rules import make_reid
from farm_ar.envs.config import JITTERS
from farm_ar.envs.generator import scene_of
from farm_ar.errors import OptionError, known_name


@dataclass(frozen=True)
class StressOptions:
    """What a stress test is asked to do.

    Args:
        scene: a built-in scene's name, or a `.json` file.
        reids: names of re-identifiers, as `make_reid` takes them.
        attacks: names of attacks, as `attack_named` takes them.
        queries: snapshots that one attack may ask about in one case.
        cases: how many layouts and cameras.
        budget: effort that a perturbation may take, D summed over the objects.
        jitter: how far the layouts stray from the scene's own: none, easy, default or hard.
        seed: where all randomness comes from.
        noise_draws: draws of everyday disorder in each case.

    Raises:
        OptionError: a name is not known, a number out of its limits, or a player cannot play in the scene.
        MissingPackageError: players are asked for, and what training needs is not installed.
    """

    scene: str = "farm"
    reids: tuple[str, ...] = ("spatial",)
    attacks: tuple[str, ...] = ("ladder",)
    queries: int = 2000
    cases: int = 40
    budget: float = 1.0
    jitter: str = "default"
    seed: int = 0
    noise_draws: int = 200

    def __post_init__(self) -> None:
        object.__setattr__(self, "reids", tuple(self.reids))
        object.__setattr__(self, "attacks", tuple(self.attacks))
        scene = scene_of(self.scene, game=False)
        for what, names in (("reid", self.reids), ("attack", self.attacks)):
            if not names or len(set(names)) < len(names):
                raise OptionError(what, "must be one name or several different ones", list(names))
        for reid in self.reids:
            make_reid(reid, scene)
        for attack in self.attacks:
            found = attack_named(attack)
            if isinstance(found, Learned):
                found.check(scene)
        known_name("jitter", self.jitter, JITTERS)
        for name, lowest in (("queries", 1), ("cases", 1), ("seed", 0), ("noise_draws", 1)):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < lowest:
                raise OptionError(name, f"must be a whole number not below {lowest}", value)
        if not (np.isfinite(self.budget) and self.budget > 0):
            raise OptionError("budget", "must be a positive number", self.budget)

    def as_dict(self) -> dict[str, Any]:
        """The options as JSON values."""
        return {name: list(v) if isinstance(v, tuple) else v for name, v in asdict(self).items()}
