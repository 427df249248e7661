"""The Gymnasium environments. Importing `farm_ar` registers them."""

from farm_ar.envs.farm_to_table import FarmToTableEnv
from farm_ar.envs.trace import replay

__all__ = ["FarmToTableEnv", "replay"]
