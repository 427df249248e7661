"""The actions, by control and name: a class owns its space, its meaning, its mask and its mirror image."""

from collections.abc import Mapping

from farm_ar.envs.actions.base import Action, HandAction, Move, MoveAction, checked_action
from farm_ar.envs.actions.discrete import DiscreteAction, ExchangeAction
from farm_ar.envs.actions.hand import SteeringAction, VelocityAction
from farm_ar.envs.actions.moves import ContinuousAction, DisplacementAction, OffsetsAction, SlotAction

MOVE_ACTIONS: dict[str, type[MoveAction]] = {
    "displacement": DisplacementAction,
    "slot": SlotAction,
    "continuous": ContinuousAction,
    "discrete": DiscreteAction,
}
"""The actions of control `move`, by name; the first is its default."""

LAYOUT_ACTIONS: dict[str, type[MoveAction]] = {"offsets": OffsetsAction, "discrete": ExchangeAction}
"""Those of control `layout`."""

HAND_ACTIONS: dict[str, type[HandAction]] = {"velocity": VelocityAction, "discrete": SteeringAction}
"""Those of control `hand`."""

ACTIONS: dict[str, Mapping[str, type[Action]]] = {
    "move": MOVE_ACTIONS,
    "hand": HAND_ACTIONS,
    "layout": LAYOUT_ACTIONS,
}
"""The actions of each control."""

__all__ = [
    "ACTIONS",
    "HAND_ACTIONS",
    "LAYOUT_ACTIONS",
    "MOVE_ACTIONS",
    "Action",
    "ContinuousAction",
    "DiscreteAction",
    "DisplacementAction",
    "ExchangeAction",
    "HandAction",
    "Move",
    "MoveAction",
    "OffsetsAction",
    "SlotAction",
    "SteeringAction",
    "VelocityAction",
    "checked_action",
]
