"""The physics of the tabletop: boxes that slide on a plane between edges."""

from __future__ import annotations

import weakref

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.game_logic import plane
from farm_ar.game_logic import plane_parts as parts
from farm_ar.game_logic.plane import TICK, Addresses

__all__ = ["TICK", "Plane"]


class Plane:
    """Boxes on a plane without gravity, where what slides comes to rest, and a hand that is not there yet.

    Everything is made in the order of the arguments, so that the same calls give the same bytes. The objects
    are Chipmunk's own: pymunk's Python objects take a hundred times as long to make.

    Args:
        position: (N, 2) centres of the boxes, metres.
        angle: (N,) their angles, radians.
        size: (N, 3) width, height and depth, metres.
        fixed: (N,) boxes that nothing moves.
        height: (N,) how high their pivots are, metres.
        extent: width and depth of the plane [0, width] x [0, depth], metres.

    Attributes:
        handle: addresses of Chipmunk's objects, as `plane` names them.
        state: numbers that change, likewise.
        box: (N, `COLUMNS`) the boxes, likewise.
    """

    def __init__(
        self,
        position: FloatArray,
        angle: FloatArray,
        size: FloatArray,
        fixed: BoolArray,
        height: FloatArray,
        extent: tuple[float, float],
    ) -> None:
        n = len(angle)
        self.handle: Addresses = np.zeros(plane.FIRST + n, dtype=np.int64)
        self.state, self.box = np.zeros(plane.STATES), np.zeros((n, plane.COLUMNS))
        self.state[plane.WIDTH], self.state[plane.DEPTH] = extent
        self.state[plane.GRIPPED] = -1.0
        parts.set_out(self.box, position, angle, size, fixed, height)
        shape: Addresses = np.zeros(n + parts.EDGES + 1, dtype=np.int64)
        parts.make_parts(self.handle, shape, parts.edge_corners(extent), self.box)
        # Freed with it; not when Python ends, which may have taken the kernel away by then.
        weakref.finalize(self, parts.free_parts, self.handle, shape).atexit = False
