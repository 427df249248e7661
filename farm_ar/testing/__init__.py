"""Conformance tests for environments, re-identifiers and pose estimators: those of this package and your own.

Each check raises an `AssertionError` that says what broke.
"""

from farm_ar.testing.environments import check_environment
from farm_ar.testing.pose_estimators import check_pose_estimator
from farm_ar.testing.reidentifiers import check_reidentifier

__all__ = ["check_environment", "check_pose_estimator", "check_reidentifier"]
