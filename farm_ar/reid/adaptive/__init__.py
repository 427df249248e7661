from farm_ar.reid.adaptive.method import AdaptiveReid
from farm_ar.reid.adaptive.options import AdaptiveOptions
__all__ = ["AdaptiveOptions", "AdaptiveReid"]
