"""Re-identification: which detection is which label."""

from farm_ar.reid.baselines import BASELINES, DistanceReid, LastKnownReid, NearestReid
from farm_ar.reid.costs import dimension_cost, rotation_cost, total_cost, translation_cost
from farm_ar.reid.identification import Identification, IdentificationBatch, Reidentifier
from farm_ar.reid.metrics import accuracy, batch_accuracy
from farm_ar.reid.pruning import site_distance, site_probability, sites_by_probability, within_site
from farm_ar.reid.solvers import SOLVERS, UNASSIGNED, solve_assignment
from farm_ar.reid.spatial import TERMS, SpatialOptions, SpatialReid

__all__ = [
    "BASELINES",
    "SOLVERS",
    "TERMS",
    "UNASSIGNED",
    "DistanceReid",
    "Identification",
    "IdentificationBatch",
    "LastKnownReid",
    "NearestReid",
    "Reidentifier",
    "SpatialOptions",
    "SpatialReid",
    "accuracy",
    "batch_accuracy",
    "dimension_cost",
    "rotation_cost",
    "site_distance",
    "site_probability",
    "sites_by_probability",
    "solve_assignment",
    "total_cost",
    "translation_cost",
    "within_site",
]
