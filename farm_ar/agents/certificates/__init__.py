"""Certificates: how much distance any attack on a case needs at the least."""

from __future__ import annotations

import numpy as np

from farm_ar.agents.cases import Case
from farm_ar.agents.certificates.base import NO_BOUND, Bound, Certificate
from farm_ar.agents.certificates.baselines import LastKnownCertificate, NearestCertificate
from farm_ar.agents.certificates.spatial import SpatialCertificate
from farm_ar.reid import Reidentifier

CERTIFICATES: tuple[Certificate, ...] = (SpatialCertificate(), NearestCertificate(), LastKnownCertificate())
"""The certificates; of several that cover a re-identifier the first counts."""


def lower_bound(case: Case, reid: Reidentifier) -> Bound:
    """The bound on the distance of every attack on a case, as far as a theorem covers the re-identifier.

    Args:
        case: the case.
        reid: made for `case.scene`.
    """
    for certificate in CERTIFICATES:
        if certificate.covers(reid):
            return certificate.bound(case, reid)
    return Bound(0.0, 0.0, 0.0, np.zeros(len(case.layout)), NO_BOUND)


__all__ = ["CERTIFICATES", "NO_BOUND", "Bound", "Certificate", "lower_bound"]
