"""How large a scene is and where its walls stand, however a stranger writes the world down.

No length here depends on the origin, heading, handedness or unit of the frame, nor on a lone object far away.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.geometry import wrap
from farm_ar.reid.registration import turned
from farm_ar.scenes import Bounds, Layout, Scene

USUAL_LENGTH_M = 7.0
"""Length of the paper's rooms, metres: what is assumed there in metres shrinks and grows with a scene's."""

_TO_USUAL = 2.8
"""Length of a scene by the mean of its look-alikes' spacing and extent: so the paper's rooms are usual."""

_SPACING_WEIGHT = 0.25
"""Weight of the spacing in that (geometric) mean."""

_FINE = 10.0
"""Spacings in the length by which small motions are measured; most of the paper's rooms are less long."""

_FOOTPRINTS = 3.5
"""Spacing and extent of objects of which nothing is known but their size, in diagonals of their footprint."""

_STRAIGHT = 1e-9
"""Cosine up to which two sides are at right angles."""


@dataclass(frozen=True)
class Lengths:
    """Lengths of a scene, metres, all positive.

    Args:
        spacing: median distance of an object to the nearest one that looks like it.
        extent: root mean square distance of two objects that look alike.
        middle: (x, z) mean of their places.
    """

    spacing: float
    extent: float
    middle: tuple[float, float]

    @property
    def scene(self) -> float:
        """The one length by which what is assumed in metres is measured; about 7 m in the paper's rooms."""
        return _TO_USUAL * math.exp(
            _SPACING_WEIGHT * math.log(self.spacing) + (1 - _SPACING_WEIGHT) * math.log(self.extent)
        )

    @property
    def fine(self) -> float:
        """The same for what is assumed of small motions: at most `_FINE` spacings."""
        return min(self.scene, _FINE * self.spacing)


def lengths_of(scene: Scene) -> Lengths:
    """The lengths of a scene.

    They are those of the look-alikes. Where no two objects look alike, or they stand in one place, they are
    as many footprints as usual; where no size is known, those of all objects, or the diagonal of the scene.
    """
    layout = scene.layout
    alike, footprint = look_alikes(scene), _footprint(layout)
    code = np.where(alike, layout.category_code, -1)
    if not alike.any():
        code[:] = 0
    nearest: list[float] = []
    squares, pairs = 0.0, 0
    for category in np.unique(code[code >= 0]):
        place = layout.position[code == category]
        place = place - place.mean(axis=0)
        if len(place) > 1:
            nearest += np.asarray(cKDTree(place).query(place, k=2)[0])[:, 1].tolist()
            squares += len(place) * float((place**2).sum())
            pairs += len(place) * (len(place) - 1) // 2
    middle = layout.position[code >= 0].mean(axis=0)
    apart = [distance for distance in nearest if distance > 0]
    if footprint is not None and not (apart and alike.any()):
        spacing = extent = _FOOTPRINTS * footprint
    elif not apart:
        spacing = extent = scene.diagonal
    else:
        spacing, extent = float(np.median(apart)), float(np.sqrt(squares / pairs))
    return Lengths(spacing, extent, (float(middle[0]), float(middle[1])))


def _footprint(layout: Layout) -> float | None:
    """Diagonal of the footprint of a usual object, metres: the lower median; None where no size is known."""
    every = np.sort(np.hypot(layout.size[:, 0], layout.size[:, 2]))
    known = every[np.isfinite(every)]
    return float(known[(len(known) - 1) // 2]) if len(known) else None


def look_alikes(scene: Scene) -> BoolArray:
    """(M,) which labels have others of their category."""
    code = scene.layout.category_code
    alike: BoolArray = np.bincount(code, minlength=1)[code] > 1
    return alike


def stacked(layout: Layout) -> bool:
    """Whether look-alikes stand above one another: nearer on the plane than half a footprint, and higher."""
    if not np.ptp(layout.elevation) > 0:
        return False
    footprint, tall = np.hypot(layout.size[:, 0], layout.size[:, 2]), layout.size[:, 1]
    apart = np.linalg.norm(layout.position[:, None] - layout.position, axis=-1)
    higher = layout.elevation[:, None] - layout.elevation
    above = (apart <= np.nan_to_num(footprint) / 2) & (higher > np.nan_to_num(tall) / 2) & (higher > 0)
    alike = layout.category_code[:, None] == layout.category_code
    return bool((above & alike).any())


@dataclass(frozen=True, eq=False)
class Room:
    """A rectangle that nothing leaves, and its own frame: from one of its corners, along its sides.

    Args:
        corner: (2,) metres.
        yaw: of the side that is its depth, radians.
        size: width and depth, metres.
    """

    corner: FloatArray
    yaw: float
    size: tuple[float, float]

    @property
    def plain(self) -> bool:
        """Whether its frame is the world's."""
        return self.yaw == 0.0 and not self.corner.any()

    def position(self, place: FloatArray) -> FloatArray:
        """(..., 2) places of the world in the room's frame, metres."""
        return place if self.plain else turned(place - self.corner, np.asarray(-self.yaw))

    def heading(self, yaw: FloatArray) -> FloatArray:
        """(...) headings of the world in the room's frame, radians."""
        return yaw if self.yaw == 0.0 else yaw - self.yaw

    def shift(self, shift: FloatArray) -> FloatArray:
        """(..., 2) shifts in the room's frame in the world's, metres."""
        return shift if self.plain else turned(shift, np.asarray(self.yaw))

    def world(self, place: FloatArray) -> FloatArray:
        """(..., 2) places of the room's frame in the world's, metres."""
        return place if self.plain else self.corner + self.shift(place)


def room_of(bounds: Bounds | None) -> Room | None:
    """The room of bounds that are a rectangle, however it is turned; other polygons have no walls here."""
    if bounds is None or len(bounds.corners) != 4:
        return None
    if bounds.room is not None:
        return Room(np.zeros(2), 0.0, bounds.room)
    corner, second, opposite, last = bounds.corners
    across, along = second - corner, last - corner
    width, depth = float(np.hypot(*across)), float(np.hypot(*along))
    off = float(np.abs(corner + across + along - opposite).max())
    if abs(float(across @ along)) > _STRAIGHT * width * depth or off > _STRAIGHT * (width + depth):
        return None
    if across[0] * along[1] - across[1] * along[0] < 0:  # listed the other way round
        across, along, width, depth = along, across, depth, width
    return Room(np.array(corner), float(wrap(np.arctan2(along[0], along[1]))), (width, depth))
