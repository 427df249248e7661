"""The scenery of the farm, which is only drawn: animals that graze, drink and wander, and props.

None of it is in the physics, and all of it follows from the scene and the time played: while the game is
frozen, that time stands still and so do they.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game import animals, props
from farm_ar.drawing.game.ground import is_farm
from farm_ar.drawing.game.shapes import Thing
from farm_ar.geometry import footprint_corners, heading
from farm_ar.scenes import Layout, Scene

_SPACING = 0.012
"""Between objects, metres."""

_TO_TROUGH = np.array([0.03, 0.0])
_DOG_SPEED = 0.07
_PETALS = ((250, 250, 250), (250, 214, 90), (240, 140, 180), (170, 130, 220), (236, 96, 84))


@dataclass(frozen=True, eq=False)
class Placed:
    """Something at a place.

    Args:
        thing: what it is.
        position: (2,) where, metres.
        yaw: its heading, radians.
    """

    thing: Thing
    position: FloatArray
    yaw: float


class Scenery:
    """What is drawn around a farm's buildings; nothing in a scene without coops or hutches.

    It keeps to the table's edges, where no building stands at the start.

    Args:
        scene: the table.

    Attributes:
        static: what never moves.
    """

    def __init__(self, scene: Scene) -> None:
        self.static: list[Placed] = []
        self._living: list[Callable[[float], Placed]] = []
        self._then: tuple[float, list[Placed]] = (np.nan, [])
        if not is_farm(scene):
            return
        self._ground = _Ground(scene)
        self._furnish()
        self._settle_animals(scene)
        self._plant()

    def living(self, seconds: float) -> list[Placed]:
        """The environmental animals after some time of play."""
        if self._then[0] != seconds:
            self._then = seconds, [where(seconds) for where in self._living]
        return self._then[1]

    def _furnish(self) -> None:
        wood = props.wood_stack()
        for thing, spot, yaw in (
            (props.silo(), (0.955, 0.93), 0.0),
            (props.tractor(), (0.83, 0.91), 1.2),
            (wood, (0.06, 0.93), 0.15),
            (props.hay_trough(), (0.56, 0.19), 0.0),
            (wood, (0.95, 0.21), -0.2),
        ):
            place = self._ground.take(spot, thing.radius)
            if place is not None:
                self.static.append(Placed(thing, place, yaw))

    def _settle_animals(self, scene: Scene) -> None:
        drinks = self._ground.take((0.60, 0.93), 0.075)
        if drinks is not None:
            self.static.append(Placed(props.water_trough(), drinks + _TO_TROUGH, np.pi / 2))
            self._living.append(
                partial(_drinking, animals.cow(True), animals.cow(False), drinks - _TO_TROUGH)
            )
        goats = animals.goat(True), animals.goat(False)
        for k, spot in enumerate([(0.05, 0.50), (0.05, 0.19), (0.22, 0.93), (0.78, 0.20), (0.96, 0.42)]):
            home = self._ground.take(spot, 0.045)
            if home is not None:
                self._living.append(partial(_grazing, goats, home, 1.7 * k))
        way = self._ground.free_way(scene)
        self._living.append(partial(_wandering, [animals.dog(k) for k in range(4)], way))

    def _plant(self) -> None:
        rng = np.random.default_rng(2024)
        flowers, tuft = [props.flower(petal) for petal in _PETALS], props.tuft()
        for k in range(70):
            thing = tuft if k % 5 < 3 else flowers[k % len(flowers)]
            place = self._ground.take(rng.uniform(0.01, 0.99, size=2).tolist(), thing.radius, reach=0.0)
            if place is not None:
                self.static.append(Placed(thing, place, rng.uniform(-0.5, 0.5)))


class _Ground:
    """Which places on the table are still free, near its edges."""

    def __init__(self, scene: Scene) -> None:
        self._size = np.array(scene.size)
        self._layout = scene.layout
        self._taken: list[tuple[FloatArray, float]] = []
        steps = np.linspace(0.0, 1.0, 61)
        self._grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * self._size
        self._grid_clearance = _clearance(self._grid, self._layout)

    def take(self, spot: Sequence[float], radius: float, reach: float = 0.18) -> FloatArray | None:
        """Take the free place nearest to a spot, in parts of the table's sides; None if none is near."""
        wanted = np.array(spot) * self._size
        if self._room(wanted[None], _clearance(wanted[None], self._layout))[0] >= radius:
            return self._taking(wanted, radius)
        away = np.linalg.norm(self._grid - wanted, axis=1)
        near = away <= reach
        near[near] = self._room(self._grid[near], self._grid_clearance[near]) >= radius
        if not near.any():
            return None
        return self._taking(self._grid[np.argmin(np.where(near, away, np.inf))], radius)

    def _taking(self, place: FloatArray, radius: float) -> FloatArray:
        self._taken.append((place, radius))
        return place

    def free_way(self, scene: Scene) -> FloatArray:
        """(2, 2) ends of the longest free stretch along the near edge, metres."""
        z = 0.055 * scene.size[1]
        line = np.stack([np.linspace(0.04, 0.96, 93) * scene.size[0], np.full(93, z)], axis=1)
        free = self._room(line, _clearance(line, self._layout)) > 0.03
        best, start = (0, 0), 0
        for k in range(94):
            if k == 93 or not free[k]:
                best = max(best, (start, k - 1), key=lambda stretch: stretch[1] - stretch[0])
                start = k + 1
        ends: FloatArray = line[[best[0], max(best)]]
        return ends

    def _room(self, places: FloatArray, clearance: FloatArray) -> FloatArray:
        """(P,) distance to the nearest edge, building (P,) or thing."""
        edge = np.minimum(places, self._size - places).min(axis=1)
        room = np.minimum(edge + 0.02, clearance - _SPACING)
        for place, radius in self._taken:
            room = np.minimum(room, np.linalg.norm(places - place, axis=1) - radius - _SPACING)
        return np.asarray(room, dtype=np.float64)


def _clearance(places: FloatArray, layout: Layout) -> FloatArray:
    """(P,) distance to the nearest footprint, 0 inside one, metres."""
    corners = footprint_corners(layout.position, layout.yaw, layout.size)
    axes = np.stack([corners[:, 0] - corners[:, 1], corners[:, 1] - corners[:, 2]], axis=1)
    half = np.linalg.norm(axes, axis=-1) / 2
    unit = axes / (2 * half[..., None])
    offset = places[:, None] - layout.position
    along = np.abs(np.einsum("pnk,nak->pna", offset, unit))
    outside = np.maximum(along - half, 0.0)
    distance: FloatArray = np.linalg.norm(outside, axis=-1)
    nearest: FloatArray = distance.min(axis=1)
    return nearest


def _grazing(poses: tuple[Thing, Thing], home: FloatArray, phase: float, seconds: float) -> Placed:
    """A goat: grazes a while, looks up, takes a few steps."""
    time = 0.55 * seconds + phase
    slow = time - 0.8 * np.sin(time)  # stands still, then walks, again and again
    offset = 0.014 * np.array([np.sin(slow), np.sin(0.7 * slow + phase)])
    looks_up = np.sin(0.9 * seconds + 2.1 * phase) > 0.55
    return Placed(poses[int(looks_up)], home + offset, float(0.5 * np.sin(0.5 * slow) + 1.9 * phase))


def _drinking(low: Thing, high: Thing, place: FloatArray, seconds: float) -> Placed:
    """Cattle at the trough: drinks, and now and then looks up."""
    return Placed(
        high if (seconds % 7.0) > 5.2 else low, place, np.pi / 2 + 0.06 * float(np.sin(0.8 * seconds))
    )


def _wandering(poses: list[Thing], way: FloatArray, seconds: float) -> Placed:
    """A dog that trots to and fro along a way, not quite straight."""
    length = float(np.linalg.norm(way[1] - way[0]))
    period = 2 * max(length, 1e-6) / _DOG_SPEED
    ahead = _dog_at(way, seconds / period + 1e-3) - _dog_at(way, seconds / period)
    return Placed(poses[int(seconds * 8) % 4], _dog_at(way, seconds / period), float(heading(ahead)))


def _dog_at(way: FloatArray, laps: float) -> FloatArray:
    share = (1 - np.cos(2 * np.pi * laps)) / 2
    aside = 0.016 * np.sin(2 * np.pi * laps) + 0.006 * np.sin(10 * np.pi * laps)
    place: FloatArray = way[0] + share * (way[1] - way[0]) + np.array([0.0, aside])
    return place
