"""A lower bound on the effort of every attack on one case, as far as a theorem covers the re-identifier."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.cases import Case
from farm_ar.agents.certificates.baselines import last_known_bound, nearest_bound
from farm_ar.agents.certificates.bound import NO_BOUND, Bound
from farm_ar.agents.certificates.spatial import is_covered, spatial_bound
from farm_ar.reid import LastKnownReid, NearestReid, Reidentifier, SpatialReid


def lower_bound(case: Case, reid: Reidentifier) -> Bound:
    """The bound of a case under a re-identifier that knows the case's layout.

    Args:
        case: the case.
        reid: made for `case.scene`.
    """
    if type(reid).identify is SpatialReid.identify and isinstance(reid, SpatialReid) and is_covered(reid):
        return spatial_bound(case, reid)
    if isinstance(reid, NearestReid):
        return nearest_bound(case, reid)
    if isinstance(reid, LastKnownReid):
        return last_known_bound(case, reid)
    return Bound(0.0, 0.0, 0.0, np.zeros(len(case.layout)), NO_BOUND)
