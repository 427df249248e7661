"""Ways around obstacles: a grid of what is known to stand where, and A* on it."""

from __future__ import annotations

from heapq import heappop, heappush

import cv2
import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs.delivery.robot import RADIUS_M
from farm_ar.geometry import footprint_corners
from farm_ar.kernels import compiled
from farm_ar.scenes import Layout

CELL_M = 0.05

KEEP_M = RADIUS_M + 0.06
"""A middle of the robot nearer to an obstacle than this is not allowed."""

LIKE_M = RADIUS_M + 0.25
"""Nearer than this a way costs up to `DEAR` times as much."""

DEAR = 6.0

LEAVE_M = 0.25
"""So near to where the robot stands already what is not allowed only costs more: it must get away."""

FORBIDDEN = 1e9


class Grid:
    """What a robot knows to stand in the way, cell by cell.

    Args:
        size: width and depth of the room, metres.

    Attributes:
        taken: (X, Z) whether something stands there.
    """

    def __init__(self, size: tuple[float, float]) -> None:
        self.taken = np.zeros(tuple(int(np.ceil(side / CELL_M)) for side in size), dtype=np.uint8)
        self._clear: FloatArray | None = None

    def add_boxes(self, things: Layout) -> None:
        """Footprints stand there."""
        for corners in footprint_corners(things.position, things.yaw, things.size):
            polygon = np.round(corners[:, ::-1] / CELL_M - 0.5).astype(np.int32)
            cv2.fillConvexPoly(self.taken, polygon, 1)
        self._clear = None

    def add_points(self, points: FloatArray) -> None:
        """(P, 2) points at which something was met."""
        inside, cells = self._inside(points)
        if inside.any():
            self.taken[cells[inside, 0], cells[inside, 1]] = 1
            self._clear = None

    @property
    def clearance(self) -> FloatArray:
        """(X, Z) from the middle of each cell to the nearest one taken or to the wall, metres."""
        if self._clear is None:
            walled = np.pad(1 - self.taken, 1)
            self._clear = CELL_M * cv2.distanceTransform(walled, cv2.DIST_L2, 5)[1:-1, 1:-1].astype(
                np.float64
            )
            self._clear -= CELL_M / 2
        return self._clear

    def clearance_at(self, point: FloatArray) -> float:
        """The clearance at a point, metres; 0 outside."""
        inside, cells = self._inside(point[None])
        return float(self.clearance[tuple(cells[0])]) if inside[0] else 0.0

    def way(self, start: FloatArray, goal: FloatArray, reach: float) -> FloatArray | None:
        """The cheapest way to a place from which the goal is within reach.

        Args:
            start: (2,) metres.
            goal: (2,) metres.
            reach: metres.

        Returns:
            (P, 2) points of it, the start first; None where there is none.
        """
        clear = self.clearance
        close = np.clip((LIKE_M - clear) / (LIKE_M - KEEP_M), 0.0, 1.0)
        price = np.where(clear >= KEEP_M, 1 + (DEAR - 1) * close**2, FORBIDDEN)
        middle = (np.indices(clear.shape) + 0.5) * CELL_M
        away = np.hypot(middle[0] - start[0], middle[1] - start[1])
        price = np.where((price == FORBIDDEN) & (away < LEAVE_M), 4 * DEAR, price)
        left = np.maximum(np.hypot(middle[0] - goal[0], middle[1] - goal[1]) - reach, 0.0)
        first = self._cell(start)
        left[(price == FORBIDDEN) | ((clear < KEEP_M) & (left == 0))] += CELL_M  # no place to stop at
        cells = astar(price, left, first[0], first[1])
        if not len(cells):
            return None
        points = (cells[::-1] + 0.5) * CELL_M
        points[0] = start
        return points

    def _inside(self, points: FloatArray) -> tuple[BoolArray, IntArray]:
        cells = np.floor(np.asarray(points) / CELL_M).astype(np.int64)
        inside: BoolArray = np.all((cells >= 0) & (cells < self.taken.shape), axis=-1)
        return inside, cells

    def _cell(self, point: FloatArray) -> tuple[int, int]:
        i, k = np.clip(np.floor(point / CELL_M), 0, np.array(self.taken.shape) - 1).astype(int).tolist()
        return i, k


def length_of(way: FloatArray) -> float:
    """Of a way (P, 2), metres."""
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


@compiled
def astar(price: FloatArray, left: FloatArray, first: int, second: int) -> FloatArray:
    """A* over the eight neighbours of each cell, without cutting the corner of what is forbidden.

    Args:
        price: (X, Z) of a metre through each cell, at least 1; `FORBIDDEN` and above for no way.
        left: (X, Z) a lower bound of the way left, metres; 0 where the goal is reached.
        first: row of the start.
        second: column of the start.

    Returns:
        (P, 2) cells from the goal back to the start; none where there is no way.
    """
    rows, columns = price.shape
    cost = np.full((rows, columns), np.inf)
    came = np.full((rows, columns), -1, dtype=np.int64)
    done = np.zeros((rows, columns), dtype=np.bool_)
    cost[first, second] = 0.0
    queue = [(left[first, second], first * columns + second)]
    while len(queue):
        _, cell = heappop(queue)
        i, k = cell // columns, cell % columns
        if done[i, k]:
            continue
        done[i, k] = True
        if left[i, k] <= 0.0:
            count, at = 1, cell
            while came[at // columns, at % columns] >= 0:
                at = came[at // columns, at % columns]
                count += 1
            way = np.empty((count, 2))
            at = cell
            for step in range(count):
                way[step, 0], way[step, 1] = at // columns, at % columns
                at = came[at // columns, at % columns]
            return way
        for di in range(-1, 2):
            for dk in range(-1, 2):
                a, b = i + di, k + dk
                if (di == 0 and dk == 0) or a < 0 or b < 0 or a >= rows or b >= columns:
                    continue
                if price[a, b] >= FORBIDDEN or price[i, b] >= FORBIDDEN or price[a, k] >= FORBIDDEN:
                    continue
                step_m = CELL_M * np.sqrt(float(di * di + dk * dk))
                through = cost[i, k] + step_m * (price[i, k] + price[a, b]) / 2
                if through < cost[a, b]:
                    cost[a, b] = through
                    came[a, b] = cell
                    heappush(queue, (through + left[a, b], a * columns + b))
    return np.empty((0, 2))
