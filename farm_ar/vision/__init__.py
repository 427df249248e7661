"""Poses of things from images: what estimates them, and what trains it."""

from farm_ar.vision.base import PoseEstimates, PoseEstimator, check_question

__all__ = ["PoseEstimates", "PoseEstimator", "check_question"]
