"""Identities where it is unknown how far objects move: the method `adaptive`."""

from farm_ar.reid.adaptive.disorder import Disorder
from farm_ar.reid.adaptive.method import AdaptiveReid
from farm_ar.reid.adaptive.options import AdaptiveOptions

__all__ = ["AdaptiveOptions", "AdaptiveReid", "Disorder"]
