"""Re-identification: which detection is which label."""

from farm_ar.reid.adaptive import AdaptiveOptions, AdaptiveReid, Disorder
from farm_ar.reid.alignment import Alignment, Alternative, align
from farm_ar.reid.answers import Assurance, Certificate, Identification, IdentificationBatch
from farm_ar.reid.assignment import SOLVERS, UNASSIGNED, Assignment, k_best, solve_assignment
from farm_ar.reid.base import Reidentifier, as_reidentifier
from farm_ar.reid.baselines import (
    BASELINES,
    DistanceReid,
    LastKnownReid,
    NearestReid,
    SquaredDistanceReid,
)
from farm_ar.reid.certificates import solve_certified
from farm_ar.reid.checked import identify
from farm_ar.reid.costs import dimension_cost, rotation_cost, total_cost, translation_cost
from farm_ar.reid.explanations import Explanation, alternatives, explain
from farm_ar.reid.fusion.tracking import Tracking, Whereabouts, track
from farm_ar.reid.likelihood import LikelihoodReid, Posterior
from farm_ar.reid.likelihood.motions import DetectionNoise, Motion, NoisePrior, Rates, motion_log_density
from farm_ar.reid.likelihood.options import LikelihoodOptions
from farm_ar.reid.marginals import association_marginals
from farm_ar.reid.metrics import accuracy, batch_accuracy
from farm_ar.reid.pruning import site_distance, site_probability, sites_by_probability, within_site
from farm_ar.reid.registration import Registration, RigidMotion, register
from farm_ar.reid.registry import REIDENTIFIERS, ReidFactory, load_reid, reid_factory
from farm_ar.reid.relational.method import RelationalReid
from farm_ar.reid.relational.options import Relation, RelationalOptions
from farm_ar.reid.session import Session
from farm_ar.reid.spatial import SpatialReid
from farm_ar.reid.spatial_costs import TERMS, SpatialOptions

__all__ = [
    "BASELINES",
    "REIDENTIFIERS",
    "SOLVERS",
    "TERMS",
    "UNASSIGNED",
    "AdaptiveOptions",
    "AdaptiveReid",
    "Alignment",
    "Alternative",
    "Assignment",
    "Assurance",
    "Certificate",
    "DetectionNoise",
    "Disorder",
    "DistanceReid",
    "Explanation",
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
    "Registration",
    "ReidFactory",
    "Reidentifier",
    "Relation",
    "RelationalOptions",
    "RelationalReid",
    "RigidMotion",
    "Session",
    "SpatialOptions",
    "SpatialReid",
    "SquaredDistanceReid",
    "Tracking",
    "Whereabouts",
    "accuracy",
    "align",
    "alternatives",
    "as_reidentifier",
    "association_marginals",
    "batch_accuracy",
    "dimension_cost",
    "explain",
    "identify",
    "k_best",
    "load_reid",
    "motion_log_density",
    "register",
    "reid_factory",
    "rotation_cost",
    "site_distance",
    "site_probability",
    "sites_by_probability",
    "solve_assignment",
    "solve_certified",
    "total_cost",
    "track",
    "translation_cost",
    "within_site",
]
