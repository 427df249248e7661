"""Routes: the curves on which animals run, out of the shed's door, past other buildings, to their own.

The door of a building, the shed included, is the middle of its front side, where its yaw points. A curve ends
at the building's centre, not at its door, so that whoever runs to the end of it has entered the footprint.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.game_logic.animals.obstacle_avoidance import (
    CLEARANCE_M,
    Buildings,
    avoid,
    avoid_with,
    kept_clear_of,
)
from farm_ar.geometry import direction, heading
from farm_ar.kernels import compiled
from farm_ar.scenes import Layout
from farm_ar.structs import Struct, Structs, new_structs

__all__ = ["CLEARANCE_M", "ROUTES", "Route", "Routes", "clear_curve", "door", "running_curve"]

ROUTES = 4
"""Routes to each label."""

PATH_SPREAD_M = 0.03
"""How far to the side of one another animals of one colour run, standard deviation."""

# Distance of each inner control point from its end, as a part of the way between the ends.
_HANDLE = 0.3

# How far curves may bow out, left and right by turns, as parts of the table's diagonal.
_BOWS = np.array([0.0] + [side * 0.015 * k for k in range(1, 21) for side in (1, -1)])

# Both inner control points moved by this much move the middle of a curve by 1.
_PULL = 4 / 3


class Route(Struct):
    """A curve that animals of a label take, one after the other."""

    goal: int
    """The label."""
    into: int
    """The building where it ends, `NOWHERE` for none."""
    length: float
    """How far it is up to there, metres."""
    curve: Annotated[FloatArray, (4, 2)]
    """Control points, metres."""


class Routes:
    """Routes from the shed to where each label is believed to be, side by side.

    Args:
        goals: (n,) the labels that send animals.
        shed: the building from whose door they come.
        rng: where the routes' spread comes from.

    Attributes:
        all: (n, ROUTES) as kernels want them.
    """

    def __init__(self, goals: IntArray, shed: int, rng: np.random.Generator) -> None:
        self._shed = shed
        self._spread = PATH_SPREAD_M * rng.normal(size=(len(goals), ROUTES))
        self.all = new_structs(Route, (len(goals), ROUTES))
        self.all["goal"] = goals[:, None]

    def lead_to(self, believed: Layout, table: tuple[float, float]) -> None:
        """Lead to where the labels are believed to be now, past other buildings, on a table of that size."""
        # Copies, because read-only arrays would have the kernel compiled once more.
        buildings = Buildings(
            believed.position.copy(), believed.yaw.copy(), believed.size.copy(), believed.movable.copy()
        )
        lead(self.all, self._spread, self._shed, buildings, *_room(table))


@compiled
def lead(
    routes: Structs[Route],
    spread: FloatArray,
    shed: int,
    buildings: Buildings,
    bows: FloatArray,
    table: FloatArray,
) -> None:
    """Lead routes from the shed's door to buildings, as `running_curve` and `clear_curve` do.

    Args:
        routes: (n, L) whose curves are filled in.
        spread: (n, L) how far each bows out to the right, metres.
        shed: index of the shed.
        buildings: where they are believed to be.
        bows: (C,) by how much curves may be bowed, in order of preference, metres.
        table: (2,) width and depth of the table, metres.
    """
    position, yaw, size = buildings.position, buildings.yaw, buildings.size
    obstacles = kept_clear_of(buildings)
    sine, cosine = np.sin(yaw[shed]), np.cos(yaw[shed])
    start_x = position[shed, 0] + size[shed, 2] / 2 * sine
    start_z = position[shed, 1] + size[shed, 2] / 2 * cosine
    for k in range(routes.shape[0]):
        goal = routes[k, 0].goal
        way_x, way_z = position[goal, 0] - start_x, position[goal, 1] - start_z
        way = np.sqrt(way_x * way_x + way_z * way_z)
        handle = _HANDLE * way
        right_x, right_z = (way_z / way, -way_x / way) if way > 0 else (1.0, 0.0)
        end_sine, end_cosine = np.sin(yaw[goal]), np.cos(yaw[goal])
        for i in range(routes.shape[1]):
            bow, curve = _PULL * spread[k, i], routes[k, i].curve
            curve[0, 0], curve[0, 1] = start_x, start_z
            curve[1, 0] = start_x + handle * sine + bow * right_x
            curve[1, 1] = start_z + handle * cosine + bow * right_z
            curve[2, 0] = position[goal, 0] + handle * end_sine + bow * right_x
            curve[2, 1] = position[goal, 1] + handle * end_cosine + bow * right_z
            curve[3, 0], curve[3, 1] = position[goal, 0], position[goal, 1]
            avoid_with(curve, right_x, right_z, bows, goal, obstacles, table)


def bows_on(table: tuple[float, float]) -> FloatArray:
    """(C,) by how much curves may be bowed on a table of that size, in order of preference, metres."""
    return _PULL * float(np.hypot(*table)) * _BOWS


@lru_cache(maxsize=16)
def _room(table: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """How far curves may bow out on a table of that size, and the size; not to be written to."""
    return bows_on(table), np.array(table, dtype=np.float64)


def door(position: FloatArray, yaw: float | FloatArray, size: FloatArray) -> FloatArray:
    """Where animals come out of buildings: the middle of the front side.

    Args:
        position: (..., 2) centres, metres.
        yaw: (...) headings, radians.
        size: (..., 3) width, height, depth, metres.

    Returns:
        (..., 2) points, metres.
    """
    return np.asarray(position) + np.asarray(size)[..., 2, None] / 2 * direction(yaw)


def running_curve(
    start: FloatArray,
    start_yaw: float | FloatArray,
    end: FloatArray,
    end_yaw: float | FloatArray,
    spread: float | FloatArray = 0.0,
) -> FloatArray:
    """Curves that leave one building straight out of its door and come up to another from its front.

    Args:
        start: (..., 2) where they begin, the `door` of the shed, metres.
        start_yaw: (...) heading of the shed, radians.
        end: (..., 2) where they end, the middle of a building, metres.
        end_yaw: (...) heading of that building, radians.
        spread: (...) how far they bow out to the right of that, halfway, metres: with different ones animals
            do not run in single file. It turns the ends of the curve, too.

    Returns:
        (..., 4, 2) control points, metres.
    """
    start, end = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    way = end - start
    handle = _HANDLE * np.hypot(way[..., 0], way[..., 1])[..., None]
    bow = _PULL * np.asarray(spread, dtype=np.float64)[..., None] * direction(heading(way) + np.pi / 2)
    first_control = start + handle * direction(start_yaw) + bow
    second_control = end + handle * direction(end_yaw) + bow
    return np.stack(np.broadcast_arrays(start, first_control, second_control, end), axis=-2)


def clear_curve(
    curve: FloatArray,
    goal: IntArray,
    position: FloatArray,
    yaw: FloatArray,
    size: FloatArray,
    obstacles: BoolArray,
    table: tuple[float, float],
) -> FloatArray:
    """Bow curves out as little as needed for none to lead through a building that is not its goal.

    They also keep to the table, out of the shed, and `CLEARANCE_M` from other buildings, where that is
    possible. A curve that no bow would get past the others is left as it is.

    Args:
        curve: (K, 4, 2) control points, metres.
        goal: (K,) the building that each leads to.
        position: (N, 2) centres of the buildings where they are believed to be, metres.
        yaw: (N,) headings of the buildings there, radians.
        size: (N, 3) width, height, depth of the buildings, metres.
        obstacles: (N,) buildings that an animal can enter; not the shed.
        table: width and depth of the table, metres.

    Returns:
        (K, 4, 2) control points, metres.
    """
    bowed = np.array(curve, np.float64, order="C")
    place, turned, sides = (np.array(values, np.float64, order="C") for values in (position, yaw, size))
    buildings = Buildings(place, turned, sides, np.array(obstacles, dtype=np.bool_))
    aside = direction(heading(bowed[:, 3] - bowed[:, 0]) + np.pi / 2)
    bows, room = _room(table)
    avoid(bowed, aside, bows, np.array(goal, dtype=np.int64), kept_clear_of(buildings), room)
    return bowed
