"""The room of a delivery: chairs that were moved, tables that were not, and where a robot can stand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import OptionError
from farm_ar.geometry import deepest_overlap, footprint_corners
from farm_ar.scenes import Layout, LayoutNoise, Scene

TABLE = (0.6, 0.72, 0.6)
"""Width, height and depth of the table at every site, metres: our choice, the scenes do not say."""

GAP_M = 0.02
"""Room left between two objects that stand in a room."""

ATTEMPTS = 500
"""Draws of a thing's place before the whole layout is drawn anew."""

LAYOUTS = 200
"""Layouts that are begun before a room counts as too full."""


@dataclass(frozen=True, eq=False)
class Room:
    """A room with tables at its sites.

    Args:
        scene: its layout is where the chairs were last known.

    Attributes:
        tables: the tables, fixed, category "table".

    Raises:
        OptionError: it has no rectangular bounds, or nothing that can be moved.
    """

    scene: Scene

    def __post_init__(self) -> None:
        if self.scene.size is None:
            raise OptionError("scene", "must have a width and a depth", self.scene.name)
        if not self.scene.layout.movable.any():
            raise OptionError("scene", "must hold something that can be moved", self.scene.name)

    @property
    def tables(self) -> Layout:
        """A table at every site that lies within the room."""
        width, depth = self.scene.size
        sites = [s for s in self.scene.sites if 0 <= s.x <= width and 0 <= s.z <= depth]
        return Layout(
            labels=tuple(f"table {site.name}" for site in sites),
            category=("table",) * len(sites),
            position=np.array([(site.x, site.z) for site in sites]),
            yaw=np.zeros(len(sites)),
            size=np.tile(TABLE, (len(sites), 1)),
            fixed=np.ones(len(sites), dtype=bool),
        )

    def furnished(self, chairs: Layout) -> Layout:
        """Chairs, then tables, as one layout."""
        tables = self.tables
        return Layout(
            labels=chairs.labels + tables.labels,
            category=chairs.category + tables.category,
            position=np.concatenate([chairs.position, tables.position]),
            yaw=np.concatenate([chairs.yaw, tables.yaw]),
            size=np.concatenate([chairs.size, tables.size]),
            elevation=np.concatenate([chairs.elevation, tables.elevation]),
            fixed=np.concatenate([chairs.fixed, tables.fixed]),
        )

    def rearranged(self, noise: LayoutNoise, rng: np.random.Generator) -> Layout:
        """The chairs after somebody moved them: the noise, on condition that nothing overlaps or leaves.

        Args:
            noise: of every chair that can be moved.
            rng: where the randomness comes from.

        Raises:
            OptionError: there is no room for them.
        """
        known = self.scene.layout
        for _ in range(LAYOUTS):
            drawn = self._drawn(noise, rng)
            if drawn is not None:
                return drawn
        raise OptionError(
            "scene", f"must have room for {len(known)} chairs among its tables", self.scene.name
        )

    def _drawn(self, noise: LayoutNoise, rng: np.random.Generator) -> Layout | None:
        """One chair after the other, each where it fits."""
        known = self.scene.layout
        position, yaw = known.position.copy(), known.yaw.copy()
        tables = self.tables
        placed = [i for i in range(len(known)) if known.fixed[i]]
        for i in np.flatnonzero(known.movable).tolist():
            for _ in range(ATTEMPTS):
                one = noise.disturb(known.subset([i]), None, rng)
                position[i], yaw[i] = one.position[0], one.yaw[0]
                near = [*placed, i]
                if self._fits(
                    np.concatenate([position[near], tables.position]),
                    np.concatenate([yaw[near], tables.yaw]),
                    np.concatenate([known.size[near], tables.size]),
                    len(near) - 1,
                ):
                    placed.append(i)
                    break
            else:
                return None
        return known.placed(position, yaw)

    def _fits(self, position: FloatArray, yaw: FloatArray, size: FloatArray, which: int) -> bool:
        corners = footprint_corners(position[which], yaw[which], size[which])
        if not np.all((corners >= 0) & (corners <= self.scene.size)):
            return False
        grown = size + np.array([GAP_M, 0.0, GAP_M])
        others = [k for k in range(len(yaw)) if k != which]
        return all(
            deepest_overlap(position[[k, which]], yaw[[k, which]], grown[[k, which]]) == 0 for k in others
        )
