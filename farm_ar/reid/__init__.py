"""Re-identification: which detection is which label."""

from farm_ar.reid.baselines import BASELINES, DistanceReid, LastKnownReid, NearestReid
from farm_ar.reid.costs import dimension_cost, rotation_cost, total_cost, translation_cost
from farm_ar.reid.identification import (
    Assurance,
    Certificate,
    Identification,
    IdentificationBatch,
    Reidentifier,
)
from farm_ar.reid.likelihood import LikelihoodReid, Posterior
from farm_ar.reid.likelihood_options import LikelihoodOptions
from farm_ar.reid.marginals import association_marginals
from farm_ar.reid.metrics import accuracy, batch_accuracy
from farm_ar.reid.motion_models import DetectionNoise, Motion, motion_log_density
from farm_ar.reid.noise_prior import NoisePrior, Rates
from farm_ar.reid.pruning import site_distance, site_probability, sites_by_probability, within_site
from farm_ar.reid.solvers import SOLVERS, UNASSIGNED, solve_assignment
from farm_ar.reid.spatial import TERMS, SpatialOptions, SpatialReid

__all__ = [
    "BASELINES",
    "SOLVERS",
    "TERMS",
    "UNASSIGNED",
    "Assurance",
    "Certificate",
    "DetectionNoise",
    "DistanceReid",
    "Identification",
    "IdentificationBatch",
    "LastKnownReid",
    "LikelihoodOptions",
    "LikelihoodReid",
    "Motion",
    "NearestReid",
    "NoisePrior",
    "Posterior",
    "Rates",
    "Reidentifier",
    "SpatialOptions",
    "SpatialReid",
    "accuracy",
    "association_marginals",
    "batch_accuracy",
    "dimension_cost",
    "motion_log_density",
    "rotation_cost",
    "site_distance",
    "site_probability",
    "sites_by_probability",
    "solve_assignment",
    "total_cost",
    "translation_cost",
    "within_site",
]
