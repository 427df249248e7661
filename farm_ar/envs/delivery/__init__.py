"""A delivery robot that must find one of several identical chairs: `DeliverToChair-v0`."""

from farm_ar.envs.delivery.config import DeliveryConfig
from farm_ar.envs.delivery.courier import Courier, Goal
from farm_ar.envs.delivery.delivery import Delivery, Knowledge
from farm_ar.envs.delivery.env import DeliverToChairEnv
from farm_ar.envs.delivery.room import Room

__all__ = ["Courier", "DeliverToChairEnv", "Delivery", "DeliveryConfig", "Goal", "Knowledge", "Room"]
