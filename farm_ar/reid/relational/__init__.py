"""Re-identification where objects may have moved together, or the frame of the camera may have drifted."""

from farm_ar.reid.relational.method import RelationalReid
from farm_ar.reid.relational.options import Relation, RelationalOptions

__all__ = ["Relation", "RelationalOptions", "RelationalReid"]
