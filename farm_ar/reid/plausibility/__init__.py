"""What cannot be right in a scene and a snapshot of it, before anything is identified."""

from farm_ar.reid.plausibility.check import check
from farm_ar.reid.plausibility.finding import Finding, some
from farm_ar.reid.plausibility.setting_aside import set_aside

__all__ = ["Finding", "check", "set_aside", "some"]
