"""What `AdaptiveReid` assumes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from farm_ar.errors import OptionError
from farm_ar.reid.marginals import MOST_EXACT

Rate = tuple[float, float, float]


@dataclass(frozen=True)
class AdaptiveOptions:
    """What is assumed of how objects move and how they are seen; no length is.

    Args:
        confusion: probability that a known category is wrong; 0 keeps every known category.
        min_confidence: a label less probable than this is not given.
        most_exact: detections of one component up to which probabilities are exact.
        turn_sds: SDs of turns that are tried, radians, besides uninformative headings.
        turn_shares: prior share of each of these, the last of uninformative headings.
        fold_shares: share of objects that look the same turned by half, and by a quarter, among these.
        fold_sd: SD of their turns besides, radians.
        shared_sds: SDs of turns about one that all share, where all move together.
        shared_shares: prior share of each of these.
        anyone_sds: SDs of turns from the heading of any of the objects: headings do not identify it.
        anyone_shares: prior share of each of these.
        course_sd: least SD of a course about the mean heading, radians.
        outliers: share of turns of any size, whatever the SD.
        astray: share of courses in any direction.
        rates: prior share, rate of what is in view being missed or gone, and of detections without a label as
            a share of all. The one in the middle stands for all in the screening, and the last, at which most
            comes and goes.
        size_shares: prior share of each reliability of sizes, `reliabilities`.
        reliabilities: correlation of what is known and seen of a size, among look-alikes.
        usual_scale: scale of motion, in spacings, about which the prior is raised.
        usual_width: SD of its logarithm.
        usual_weight: by how much.

    Raises:
        OptionError: a value is out of its limits.
    """

    confusion: float = 0.0
    min_confidence: float = 0.0
    most_exact: int = MOST_EXACT
    turn_sds: tuple[float, ...] = tuple(float(np.deg2rad(sd)) for sd in (4.0, 12.0, 28.0, 60.0, 100.0))
    turn_shares: tuple[float, ...] = (0.15, 0.18, 0.18, 0.16, 0.13, 0.2)
    fold_shares: tuple[float, float] = (0.04, 0.02)
    fold_sd: float = float(np.deg2rad(5.0))
    shared_sds: tuple[float, ...] = (float(np.deg2rad(20.0)),)
    shared_shares: tuple[float, ...] = (0.15,)
    anyone_sds: tuple[float, ...] = tuple(float(np.deg2rad(sd)) for sd in (12.0, 40.0))
    anyone_shares: tuple[float, ...] = (0.07, 0.07)
    course_sd: float = float(np.deg2rad(8.0))
    outliers: float = 0.005
    astray: float = 0.05
    rates: tuple[Rate, ...] = (
        (0.84, 0.003, 0.006),
        (0.035, 0.05, 0.03),
        (0.025, 0.2, 0.01),
        (0.015, 0.45, 0.01),
        (0.02, 0.02, 0.12),
        (0.035, 0.15, 0.12),
        (0.015, 0.25, 0.25),
        (0.015, 0.45, 0.45),
    )
    size_shares: tuple[float, ...] = (0.3, 0.15, 0.2, 0.2, 0.15)
    reliabilities: tuple[float, ...] = (0.0, 0.6, 0.9, 0.99, 0.9999)
    usual_scale: float = 0.6
    usual_width: float = 1.0
    usual_weight: float = 12.0

    def __post_init__(self) -> None:
        if not 0 <= self.confusion < 1:
            raise OptionError("confusion", "must be from 0 to below 1", self.confusion)
        if not 0 <= self.min_confidence <= 1:
            raise OptionError("min_confidence", "must be from 0 to 1", self.min_confidence)
        if not 0 <= self.most_exact <= 20:
            raise OptionError("most_exact", "must be from 0 to 20", self.most_exact)
