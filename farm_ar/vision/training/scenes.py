"""Random scenes: objects on a table, apart and touching, among clutter and behind hands, and a camera."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.geometry.rectangles import separation
from farm_ar.rendering import Instance, Intrinsics, Light, Mesh, View, model
from farm_ar.rendering.shapes import Polygon, box, ellipsoid, mesh_of, prism, sideways, tube
from farm_ar.vision.base import size_of
from farm_ar.vision.canonical import FIELD_OF_VIEW, HEIGHT, WIDTH, on_plane
from farm_ar.vision.training.materials import Paintable, random_colour, surface, textured_quad

MOST_THINGS = 14
_GREY = (128, 128, 128)

SKINS = ((255, 219, 190), (234, 190, 150), (198, 145, 103), (141, 94, 62), (84, 54, 40))


@dataclass(frozen=True, eq=False)
class RandomScene:
    """What a random image shows.

    Args:
        view: the camera, canonical but for its focal length and a little roll.
        things: what is to be found, numbered from 0 on.
        category: of each, an index.
        rest: table, room, clutter and hands.
        light: on it all.
    """

    view: View
    things: list[Instance]
    category: list[int]
    rest: list[Instance]
    light: Light


class Stage:
    """Makes random scenes of some meshes.

    Args:
        meshes: of each category. What is as large as ten times the middle one or more stands at most once.
        oversampled: pixels of a scene's picture to one of the network's input, each way.
    """

    def __init__(self, meshes: Mapping[str, Mesh], oversampled: float = 1.5) -> None:
        self.names = tuple(sorted(meshes))
        self.sizes = np.array([size_of(meshes[name]) for name in self.names])
        self.span = float(np.median(self.sizes.max(axis=1))) / 0.1
        self._oversampled = oversampled
        self._paintable = [Paintable(meshes[name]) for name in self.names]
        base = np.prod(self.sizes[:, [0, 2]], axis=1)
        self._large = base > 2.5 * np.median(base)
        strangers = [name for name in ("chicken", "bunny", "shed") if name not in self.names]
        self._strangers = [Paintable(model(name)) for name in strangers]
        self._hands = [Paintable(model(name)) for name in ("hand-open", "hand-closed")]

    def scene(self, rng: np.random.Generator) -> RandomScene:
        """A scene."""
        view = self._camera(rng)
        place = self._places(rng, view)
        looks = [one.painted(rng) for one in self._paintable]
        alike = rng.random() < 0.6
        things = []
        for k, (category, x, z, yaw) in enumerate(place):
            mesh = looks[category] if alike else self._paintable[category].painted(rng)
            things.append(Instance(mesh, np.array([x, 0.0, z]), yaw, k))
        rest = self._room(rng, view) + self._clutter(rng, view, place) + self._arms(rng, view, place)
        return RandomScene(view, things, [int(one[0]) for one in place], rest, _light(rng))

    def _camera(self, rng: np.random.Generator) -> View:
        height = self.span * rng.uniform(0.3, 0.75)
        away = self.span * rng.uniform(0.4, 1.3)
        pitch = -np.arctan2(height, away) + rng.normal(0, 0.05)
        focal = WIDTH / 2 / np.tan(FIELD_OF_VIEW / 2) * rng.uniform(0.72, 1.15)
        if rng.random() < 0.7:
            focal = WIDTH / 2 / np.tan(FIELD_OF_VIEW / 2)
        more = self._oversampled
        lens = Intrinsics(focal, focal, (WIDTH - 1) / 2, (HEIGHT - 1) / 2, WIDTH, HEIGHT).resized(
            round(more * WIDTH), round(more * HEIGHT)
        )
        return View(
            lens, np.array([0.0, height, 0.0]), rng.uniform(-np.pi, np.pi), pitch, rng.normal(0, 0.008)
        )

    def _anywhere(self, rng: np.random.Generator, view: View) -> FloatArray | None:
        """(2,) a place on the plane that a random pixel shows."""
        lens = view.intrinsics
        pixel = np.array([rng.uniform(-0.05, 1.05) * lens.width, rng.uniform(-0.02, 1.1) * lens.height])
        place = on_plane(view, pixel)
        away = float(np.linalg.norm(place - view.eye[[0, 2]]))
        return place if 0.15 * self.span < away < 1.75 * self.span else None

    def _places(self, rng: np.random.Generator, view: View) -> list[tuple[int, float, float, float]]:
        """Category, x, z and yaw of objects that do not stand in one another."""
        found: list[tuple[int, float, float, float]] = []
        wanted = int(rng.integers(0, MOST_THINGS + 1)) if rng.random() < 0.93 else 0
        small = np.flatnonzero(~self._large)
        large = np.flatnonzero(self._large)
        chosen = [int(k) for k in large if rng.random() < 0.5]
        chosen += [int(rng.choice(small if len(small) else large)) for _ in range(wanted)]
        base, spread = rng.uniform(-np.pi, np.pi), rng.choice([0.3, 10.0])
        touching = rng.choice([0.0, 0.4, 0.8])
        for category in chosen:
            for _ in range(8):
                yaw = float(np.angle(np.exp(1j * (base + spread * rng.standard_normal()))))
                beside = found and rng.random() < touching
                near = found[int(rng.integers(len(found)))] if beside else None
                spot = self._beside(rng, near, category, yaw) if near else self._anywhere(rng, view)
                if spot is None:
                    continue
                x, z = spot.tolist()
                if all(self._gap(other, (category, x, z, yaw)) > 0 for other in found):
                    found.append((category, x, z, yaw))
                    break
        return found

    def _beside(
        self, rng: np.random.Generator, other: tuple[int, float, float, float], category: int, yaw: float
    ) -> FloatArray:
        """(2,) a place where something touches another, or nearly."""
        angle = rng.uniform(-np.pi, np.pi)
        way = np.array([np.sin(angle), np.cos(angle)])
        start, wanted = np.array(other[1:3]), rng.choice([0.0005, 0.004, 0.015]) * self.span
        low, high = 0.0, 2 * float(self.sizes[[other[0], category]].max(axis=1).sum())
        for _ in range(14):
            middle = (low + high) / 2
            x, z = (start + middle * way).tolist()
            low, high = (low, middle) if self._gap(other, (category, x, z, yaw)) > wanted else (middle, high)
        return np.asarray(start + high * way)

    def gap(self, scene: RandomScene, thing: int) -> float:
        """How far a thing of a scene is from the nearest other, metres."""
        rows = [
            (category, float(one.position[0]), float(one.position[2]), one.yaw)
            for category, one in zip(scene.category, scene.things, strict=True)
        ]
        others = (row for k, row in enumerate(rows) if k != thing)
        return min((self._gap(rows[thing], other) for other in others), default=np.inf)

    def _gap(self, one: tuple[int, float, float, float], two: tuple[int, float, float, float]) -> float:
        (w, _, d), (v, _, e) = self.sizes[one[0]].tolist(), self.sizes[two[0]].tolist()
        apart = separation(two[1] - one[1], two[2] - one[2], -one[3], -two[3], w / 2, d / 2, v / 2, e / 2)
        return float(apart[0])

    def _room(self, rng: np.random.Generator, view: View) -> list[Instance]:
        """A table on a floor between walls, or the floor alone."""
        far, span = 8 * self.span, self.span
        below = rng.choice([0.0005, 0.3, 0.75]) * span
        ahead = np.array([np.sin(view.yaw), np.cos(view.yaw)])
        middle = ahead * span * rng.uniform(0.5, 1.1)
        parts = []
        turn = view.yaw + rng.choice([0.0, 1.0]) * rng.uniform(-0.8, 0.8)
        right, on = np.array([np.cos(turn), -np.sin(turn)]), np.array([np.sin(turn), np.cos(turn)])
        w, d = span * rng.uniform(0.5, 1.6), span * rng.uniform(0.35, 1.4)
        if rng.random() < 0.15:
            w = d = far
        top = _level(middle, w * right, d * on, 0.0)
        parts.append(textured_quad(top, surface(rng), rng.choice([1.0, 1.0, 2.0, 4.0])))
        rim = mesh_of(box((-w, -0.03 * span, -d), (w, -0.0005 * span, d), _GREY))
        edge = Paintable(rim).painted(rng)
        floor = _level(middle, far * right, far * on, -below - 0.031 * span)
        parts.append(textured_quad(floor, surface(rng, 128), rng.choice([1.0, 4.0, 12.0])))
        back = span * rng.uniform(1.3, 5.0)
        for side, away in ((on, right), (right, on), (-right, on)):
            foot = middle + back * side
            ends = foot - far * away, foot + far * away
            levels = ((0, -span), (1, -span), (1, 3 * span), (0, 3 * span))
            corners = np.array([(ends[k][0], level, ends[k][1]) for k, level in levels])
            parts.append(textured_quad(corners, surface(rng, 128), rng.choice([1.0, 3.0, 6.0])))
        made = [Instance(part, np.zeros(3), 0.0, _OTHER, casts_shadow=False) for part in parts]
        foot = np.array([middle[0], 0.0, middle[1]])
        return [*made, Instance(edge, foot, turn, _OTHER, casts_shadow=False)]

    def _clutter(
        self, rng: np.random.Generator, view: View, place: list[tuple[int, float, float, float]]
    ) -> list[Instance]:
        """Solids of all sizes that are none of the objects, on the table; some stand before the camera."""
        made = []
        for _ in range(min(int(rng.poisson(rng.choice([0.0, 2.0, 6.0]))), 12)):
            spot = self._anywhere(rng, view)
            if spot is None:
                continue
            size = self.span * rng.uniform(0.2, 1.8) * rng.uniform(0.03, 0.1, 3)
            radius = float(np.hypot(size[0], size[2])) / 2
            if any(
                np.hypot(spot[0] - x, spot[1] - z) < radius + 0.3 * self.sizes[c].max()
                for c, x, z, _ in place
            ):
                continue
            if self._strangers and rng.random() < 0.15:
                mesh = self._strangers[int(rng.integers(len(self._strangers)))].painted(rng)
            else:
                mesh = Paintable(mesh_of(_solid(rng, size))).painted(rng)
            level = 0.0 if rng.random() < 0.85 else rng.uniform(0, 0.1) * self.span
            foot = np.array([spot[0], level, spot[1]])
            made.append(Instance(mesh, foot, rng.uniform(-np.pi, np.pi), _OTHER))
        return made

    def _arms(
        self, rng: np.random.Generator, view: View, place: list[tuple[int, float, float, float]]
    ) -> list[Instance]:
        """Hands with their forearms over the table, from the camera's side."""
        made = []
        for _ in range(int(rng.choice([0, 1, 2], p=[0.65, 0.27, 0.08]))):
            spot = self._anywhere(rng, view)
            if place and rng.random() < 0.5:
                spot = np.array(place[int(rng.integers(len(place)))][1:3]) + 0.05 * self.span * rng.normal(
                    size=2
                )
            if spot is None:
                continue
            hand = self._hands[int(rng.integers(2))].mesh
            skin = np.array(SKINS[int(rng.integers(len(SKINS)))]) * rng.uniform(0.85, 1.1)
            sleeve = random_colour(rng) if rng.random() < 0.6 else skin
            tones = np.array([sleeve if name == "sleeve" else skin for name in hand.parts])
            painted = Mesh(hand.corners * self.span, tones[hand.part].clip(0, 255), hand.part, hand.parts)
            foot = np.array([spot[0], self.span * rng.uniform(0.03, 0.2), spot[1]])
            made.append(Instance(painted, foot, view.yaw + rng.normal(0, 0.5), _OTHER))
        return made


_OTHER = 2**20
"""Number of everything that is not to be found."""


def _solid(rng: np.random.Generator, size: FloatArray) -> list[Polygon]:
    w, h, d = (size / 2).tolist()
    kind = rng.integers(6)
    if kind == 0:
        return ellipsoid((0, h, 0), (w, h, d), _GREY)
    if kind == 1:
        return tube((0, 0, 0), (0, 2 * h, 0), w, w * rng.choice([0.2, 0.7, 1.0]), _GREY, 14)
    if kind == 2:  # a house with another roof
        eave = rng.uniform(0.3, 0.8) * 2 * h
        faces = prism(
            [(-w, 0.0), (w, 0.0), (w, eave), (rng.uniform(-1, 1) * w, 2 * h), (-w, eave)], -d, d, _GREY
        )
        return sideways(faces) if rng.random() < 0.5 else faces
    if kind == 3:  # two blocks
        levels = sorted(rng.uniform(0.2, 1, 2))
        return [
            *box((-w, 0, -d), (w, 2 * h * levels[0], d), _GREY),
            *box((-0.7 * w, 2 * h * levels[0], -0.6 * d), (0.5 * w, 2 * h, 0.7 * d), _GREY),
        ]
    if kind == 4:  # lies along a line
        points = np.cumsum(
            np.concatenate([[np.zeros(3)], rng.uniform(-1, 1, (2, 3)) * size * [1.5, 0, 1.5]]), axis=0
        )
        points[:, 1] = 0.3 * h
        return [face for a, b in pairwise(points + 1e-4) for face in tube(a, b, 0.3 * h, 0.3 * h, _GREY, 8)]
    return box((-w, 0, -d), (w, 2 * h, d), _GREY)


def _level(middle: FloatArray, right: FloatArray, on: FloatArray, height: float) -> FloatArray:
    ends = [middle - right - on, middle + right - on, middle + right + on, middle - right + on]
    return np.array([(x, height, z) for x, z in ends])


def _light(rng: np.random.Generator) -> Light:
    angle, steep = rng.uniform(-np.pi, np.pi), rng.uniform(0.35, 2.0)
    toward = np.array([np.sin(angle), steep, np.cos(angle)])
    shadows = int(rng.choice([0, 96, 256, 640]))
    sun, sky = rng.uniform(0.0, 0.9), rng.uniform(0.3, 0.8)
    return Light(toward, sun, sky, sky * rng.uniform(0.2, 0.9), shadows)
