"""Certificates: how much effort any attack on a case needs at the least."""

from farm_ar.agents.certificates.bound import NO_BOUND, Bound
from farm_ar.agents.certificates.bounds import lower_bound

__all__ = ["NO_BOUND", "Bound", "lower_bound"]
