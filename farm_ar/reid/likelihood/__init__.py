"""Re-identification by likelihood: how probable each label is, averaged over how objects may have moved."""

from farm_ar.reid.likelihood.method import LikelihoodReid, Posterior
from farm_ar.reid.likelihood.motions import (
    MOSTLY_RELIABLE,
    DetectionNoise,
    Motion,
    NoisePrior,
    Rates,
    motion_log_density,
)
from farm_ar.reid.likelihood.options import LikelihoodOptions

__all__ = [
    "MOSTLY_RELIABLE",
    "DetectionNoise",
    "LikelihoodOptions",
    "LikelihoodReid",
    "Motion",
    "NoisePrior",
    "Posterior",
    "Rates",
    "motion_log_density",
]
