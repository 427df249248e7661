"""The rigid motion from a snapshot's frame to the map's, where the two are not known to be one."""

from farm_ar.reid.alignment.method import Alignment, Alternative, align, moved
from farm_ar.reid.alignment.problem import Pose, spacing_of
from farm_ar.reid.alignment.units import other_unit

__all__ = ["Alignment", "Alternative", "Pose", "align", "moved", "other_unit", "spacing_of"]
