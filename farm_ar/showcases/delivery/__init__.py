"""The delivery robot (paper, section 4.3.3 and appendix C)."""

from farm_ar.showcases.delivery.film import film_delivery
from farm_ar.showcases.delivery.trials import METHODS, Trial, deliver, show_deliveries

__all__ = ["METHODS", "Trial", "deliver", "film_delivery", "show_deliveries"]
