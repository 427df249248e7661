"""The virtual animals in the headset: models seen from all around and above, as sprites kept in an atlas.

A model as a sprite costs nothing once it has been drawn from a side, at a size: so hundreds of them can run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.drawing.game.colours import INK, Colour, darker, mixed
from farm_ar.drawing.game.pinhole import Pinhole
from farm_ar.drawing.game.sprites import PHASES, Sprite
from farm_ar.rendering import Instance, Intrinsics, Light, Mesh, Renderer, View, model

TURN_DEG = 15.0
"""Steps of the direction from which a figure is seen."""

_TILT = np.deg2rad(10.0)
TILTS = 9
"""How steeply from above, from 0 to 80 degrees."""

_LARGER = 1.7
"""How many times larger than life: large enough to distinguish them."""

_FINER = 4
_AWAY_M = 0.6
_OUTLINE_M = 0.0011


@dataclass(frozen=True, eq=False)
class Figure:
    """A model in its colours, seen more or less from above.

    Args:
        mesh: the model, its foot at the origin.
        tilt: by how much it is seen from above, radians.
        ink: colour of the line around it.
    """

    mesh: Mesh
    tilt: float
    ink: Colour = INK

    def sprite(self, scale: float, heading: float, phase_x: int, phase_y: int) -> Sprite:
        """The figure at a scale, in pixels a metre; a heading in degrees away from the eye; and a place."""
        fine = scale * _FINER
        reach = int(np.ceil(fine * 1.2 * float(np.abs(self.mesh.corners).max()) / _FINER)) * _FINER
        foot = reach + (np.array([phase_x, phase_y]) + 0.5) * _FINER / PHASES - 0.5
        focal, (column, row) = fine * _AWAY_M, foot.tolist()
        lens = Intrinsics(focal, focal, column, row, 2 * reach, 2 * reach)
        eye = _AWAY_M * np.array([0.0, np.sin(self.tilt), -np.cos(self.tilt)])
        thing = Instance(self.mesh, np.zeros(3), float(np.deg2rad(heading)), 1)
        picture = Renderer([thing], _LIGHT).draw(View(lens, eye, 0.0, -self.tilt))
        opacity = (picture.ids == 1).astype(np.uint8)
        width = max(3, 2 * round(fine * _OUTLINE_M) + 1)
        around = np.asarray(cv2.dilate(opacity, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width))))
        colour = (
            np.where(opacity[..., None] > 0, picture.rgb, np.array(self.ink, np.uint8)) * around[..., None]
        )
        whole = np.dstack([colour, 255 * around])
        size = (2 * reach // _FINER, 2 * reach // _FINER)
        pixels = np.asarray(cv2.resize(whole, size, interpolation=cv2.INTER_AREA), np.uint8)
        shown = pixels[..., 3] > 0
        rows, columns = (np.flatnonzero(shown.any(axis=axis)) for axis in (1, 0))
        part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        corner = reach // _FINER
        return Sprite(np.ascontiguousarray(pixels[part]), int(columns[0]) - corner, int(rows[0]) - corner)


_LIGHT = Light(np.array([-0.5, 0.9, -0.5]), sun=0.5, sky=0.62, ground=0.38, shadows=0)


@lru_cache(maxsize=128)
def animal(kind: str, colour: Colour) -> tuple[Figure, ...]:
    """A chicken or a bunny in a label's colour, by `TILTS`."""
    mesh = model(kind)
    coat = mesh.part == mesh.parts.index("coat")
    tones = np.where(coat[:, None], np.array(colour, dtype=np.float64), mesh.colour)
    painted = replace(mesh, colour=tones, corners=_LARGER * mesh.corners)
    ink = mixed(INK, darker(colour, 0.6), 0.4)
    return tuple(Figure(painted, k * _TILT, ink) for k in range(TILTS))


@lru_cache(maxsize=32)
def figures_of(solid: str, without: tuple[str, ...]) -> tuple[Figure, ...]:
    """A model in its own colours without some of its parts, by `TILTS`."""
    mesh = model(solid).without(*without)
    return tuple(Figure(mesh, k * _TILT) for k in range(TILTS))


def directions(view: Pinhole, places: FloatArray, heading: FloatArray) -> tuple[IntArray, FloatArray]:
    """From where objects on the table are seen.

    Args:
        view: the camera.
        places: (A, 2) where they stand, metres.
        heading: (A,) radians.

    Returns:
        (A,) which of the `TILTS`, and (A,) their headings away from the eye, radians.
    """
    offset = places - view.eye[[0, 2]]
    away = np.hypot(offset[:, 0], offset[:, 1])
    tilt = np.arctan2(view.eye[1], np.maximum(away, 1e-6))
    step = np.clip(np.rint(tilt / _TILT), 0, TILTS - 1).astype(np.int64)
    return step, heading - np.arctan2(offset[:, 0], offset[:, 1])
