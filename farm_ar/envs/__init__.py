"""The Gymnasium environments. Importing `farm_ar` registers them."""

from farm_ar.envs.delivery import DeliverToChairEnv
from farm_ar.envs.env import FarmToTableEnv
from farm_ar.envs.registration import make_deliver_to_chair, make_farm_to_table
from farm_ar.envs.trace import TraceError, first_difference, load_trace, replay, save_trace

__all__ = [
    "DeliverToChairEnv",
    "FarmToTableEnv",
    "TraceError",
    "first_difference",
    "load_trace",
    "make_deliver_to_chair",
    "make_farm_to_table",
    "replay",
    "save_trace",
]
