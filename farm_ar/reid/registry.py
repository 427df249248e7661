"""The identification rules by name: the one place where a name becomes a rule."""

from __future__ import annotations

from collections.abc import Callable

from farm_ar.reid.baselines import BASELINES
from farm_ar.reid.identification import Reidentifier
from farm_ar.reid.likelihood import LikelihoodReid
from farm_ar.reid.relational import RelationalReid
from farm_ar.reid.spatial import SpatialReid
from farm_ar.scenes import Scene

REIDENTIFIERS: dict[str, Callable[[Scene], Reidentifier]] = {
    "spatial": SpatialReid,
    "likelihood": LikelihoodReid,
    "relational": RelationalReid,
    **BASELINES,
}
"""Makes each rule for a scene, with its default options."""
