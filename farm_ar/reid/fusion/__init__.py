"""Fusion: several snapshots of a world that does not change between them, identified together."""

from farm_ar.reid.fusion.association import Association, associate
from farm_ar.reid.fusion.tracking import Tracking, Whereabouts, objects_of, track, track_all

__all__ = ["Association", "Tracking", "Whereabouts", "associate", "objects_of", "track", "track_all"]
