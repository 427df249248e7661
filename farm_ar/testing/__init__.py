"""Conformance tests for environments and re-identifiers: for those of this package, and for your own.

Each check raises an `AssertionError` that says what broke.
"""

from farm_ar.testing.environments import check_environment
from farm_ar.testing.reidentifiers import check_reidentifier

__all__ = ["check_environment", "check_reidentifier"]
