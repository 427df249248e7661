"""What is believed of noise that was not told: the motion models and rates that `LikelihoodReid` averages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from farm_ar.errors import OptionError
from farm_ar.reid.motion_models import Motion

USUAL_DIAGONAL_M = 7.0
"""Diagonal of a room, metres, from which on the shifts to be expected no longer grow with it."""

FEW_MOVED = 0.2
"""Share of the objects that move where most things stay."""

STAYED = ((0.02, 3.0), (0.1, 10.0))
"""SDs, metres and degrees, of those that stay."""

MOVED_FAR = ((0.8, 60.0), (1.6, 90.0))
"""SDs, metres and degrees, of those that move."""

Mixture = tuple[Motion, ...]


@dataclass(frozen=True)
class NoisePrior:
    """A weak prior over how much things move: all of them somewhat, or few of them far.

    In a room smaller than usual all metres shrink with its diagonal.

    Args:
        translation_m: least and greatest SD of x and of z, metres.
        rotation_deg: least and greatest SD of the heading, degrees.
        levels: how many SDs of each are tried, evenly spaced by ratio.
        few_move_far: probability that most things stay and few move far.

    Raises:
        OptionError: a value is out of its limits.
    """

    translation_m: tuple[float, float] = (0.07, 1.4)
    rotation_deg: tuple[float, float] = (10.0, 140.0)
    levels: tuple[int, int] = (6, 5)
    few_move_far: float = 0.3

    def __post_init__(self) -> None:
        for name in ("translation_m", "rotation_deg"):
            least, greatest = getattr(self, name)
            if not 0 < least <= greatest < np.inf:
                raise OptionError(name, "must be two positive numbers, the smaller first", (least, greatest))
        if len(self.levels) != 2 or min(self.levels) < 1:
            raise OptionError("levels", "must be two whole numbers from 1 on", self.levels)
        if not 0 <= self.few_move_far <= 1:
            raise OptionError("few_move_far", "must be a probability", self.few_move_far)

    def models(self, diagonal: float) -> list[tuple[float, Mixture]]:
        """The probability of each motion model, and its components, in a room of a diagonal, metres."""
        scale = min(1.0, diagonal / USUAL_DIAGONAL_M)
        shifts = scale * np.geomspace(*self.translation_m, self.levels[0])
        turns = np.deg2rad(np.geomspace(*self.rotation_deg, self.levels[1]))
        all_move: list[Mixture] = [(Motion(1.0, float(s), float(t)),) for s in shifts for t in turns]
        few_move: list[Mixture] = [
            (
                Motion(1 - FEW_MOVED, scale * stay_m, float(np.deg2rad(stay_deg))),
                Motion(FEW_MOVED, scale * far_m, float(np.deg2rad(far_deg))),
            )
            for stay_m, stay_deg in STAYED
            for far_m, far_deg in MOVED_FAR
        ]
        families = ((1 - self.few_move_far, all_move), (self.few_move_far, few_move))
        return [(share / len(some), one) for share, some in families if share > 0 for one in some]


@dataclass(frozen=True)
class Rates:
    """How often what is in view is missed, and how often what is detected has no label: new, or not there.

    Args:
        probability: of these rates, where several are thought possible.
        miss_rate: probability that what is in view is not detected, 0 to below 1.
        none_rate: expected detections a snapshot of what has no label, not negative.

    Raises:
        OptionError: a value is out of its limits.
    """

    probability: float = 1.0
    miss_rate: float = 0.0
    none_rate: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.probability <= 1:
            raise OptionError("probability", "must be above 0 and at most 1", self.probability)
        if not 0 <= self.miss_rate < 1:
            raise OptionError("miss_rate", "must be from 0 to below 1", self.miss_rate)
        if not 0 <= self.none_rate < np.inf:
            raise OptionError("none_rate", "must be a number not below 0", self.none_rate)


MOSTLY_RELIABLE: Sequence[Rates] = (Rates(0.95, 0.02, 0.005), Rates(0.05, 0.15, 0.6))
"""A detector that is most probably good, and may be poor: what is assumed if nothing is said."""
