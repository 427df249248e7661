"""What `RelationalReid` assumes, and what it says of motions that objects shared."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from farm_ar.errors import OptionError
from farm_ar.reid.likelihood.options import LikelihoodOptions


@dataclass(frozen=True)
class RelationalOptions:
    """What is assumed of motions that objects share.

    Args:
        alone: how each label moves, whether or not it also moved with others.
        drift: probability that the frame in which cameras and detections are given has drifted.
        drift_m: SD of the drift's shift in x and z, metres; None for a fifth of the look-alikes' spacing.
        drift_deg: SD of its turn, degrees: about the camera, or about the middle of the scene.
        group: probability that a group of labels has moved as one.
        group_m: SD of the group's shift in x and z, metres; None for a third of the look-alikes' extent.
        group_deg: SD of its turn, degrees.
        reach_m: how far a group reaches, as SD, metres; None for 1.8 times the usual distance of a label to
            the nearest other one.
        tried: how many motions of groups are fitted at most, the most promising of all.

    Raises:
        OptionError: a value is out of its limits.
    """

    alone: LikelihoodOptions = field(default_factory=LikelihoodOptions)
    drift: float = 0.15
    drift_m: float | None = None
    drift_deg: float = 2.5
    group: float = 0.15
    group_m: float | None = None
    group_deg: float = 35.0
    reach_m: float | None = None
    tried: int = 6

    def __post_init__(self) -> None:
        for name in ("drift", "group"):
            if not 0 <= getattr(self, name) < 1:
                raise OptionError(name, "must be from 0 to below 1", getattr(self, name))
        for name in ("drift_m", "drift_deg", "group_m", "group_deg", "reach_m"):
            value = getattr(self, name)
            if value is not None and not 0 < value < np.inf:
                raise OptionError(name, "must be a positive number", value)
        if self.tried < 0:
            raise OptionError("tried", "must not be negative", self.tried)


@dataclass(frozen=True)
class Relation:
    """A motion that objects may have shared, and how probable it is.

    Args:
        kind: "alone" if there was none; "drift" of the frame; or that of a "group".
        probability: of it, and of motions like it.
        pivot: what it turns about, metres.
        shift: of the pivot, metres.
        turn: radians.
        label: what the group is around; None if it is not a group.
    """

    kind: str
    probability: float
    pivot: tuple[float, float] = (0.0, 0.0)
    shift: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    label: str | None = None
