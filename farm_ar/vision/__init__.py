"""Poses of objects from images: what estimates them, and what trains it."""

from farm_ar.vision.base import PoseEstimates, PoseEstimator, check_question
from farm_ar.vision.camera_refinement import Landmarks, refine_camera
from farm_ar.vision.estimator import NetworkEstimator
from farm_ar.vision.meshes import meshes_of

__all__ = [
    "Landmarks",
    "NetworkEstimator",
    "PoseEstimates",
    "PoseEstimator",
    "check_question",
    "meshes_of",
    "refine_camera",
]
