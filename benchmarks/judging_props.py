"""Materials, shapes, rooms and arms that no training saw, as meshes in the world's frame."""

from __future__ import annotations

import colorsys
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.player import hand_in_space
from farm_ar.game_logic.physics.gripper import HandState
from farm_ar.rendering import Mesh
from farm_ar.scenes.builtin import builtin_scene

FARM = builtin_scene("farm")
RIM_M, BOARD_M, TABLE_M, ROOM_M = 0.016, 0.03, 0.74, 2.5

Building = tuple[str, FloatArray, float, FloatArray]
"""Category, (x, z), heading and size."""

Lamp = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""A shining parallelogram: a corner, both sides from there, and its radiance."""

SKIN = ((243, 214, 190), (226, 178, 142), (196, 136, 98), (142, 90, 60), (86, 54, 38))
SKIN_OF_MODEL, HAND = (232, 184, 148), 1000
"""The colour of the hand's model, and what pictures call the hand and its arm."""


PATTERNS = ("plain", "grain", "speckle", "planks", "weave", "blotches")


@dataclass(frozen=True)
class Paint:
    """A surface: its average colour, the pattern on it, how fine that is and how it shines.

    Args:
        colour: (3,) red, green, blue as a screen shows them, 0 to 255.
        pattern: a name of `PATTERNS`.
        contrast: of the pattern, as a share.
        period: of the pattern, metres.
        rough: of its gloss; 0 for a matt surface.
        seed: of the pattern.
    """

    colour: tuple[float, ...]
    pattern: str = "plain"
    contrast: float = 0.0
    period: float = 0.05
    rough: float = 0.0
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Thing:
    """A mesh in the world and what it is made of.

    Args:
        mesh: whose corners are in the world's frame, metres.
        number: what the truth's ids call it; 0 for what nobody asks for.
        paint: by the mesh's own colours, what each is painted with.
        local: (F, 3, 3) the corners in the thing's own frame, where its texture is fixed; metres.
    """

    mesh: Mesh
    number: int
    paint: dict[tuple[int, ...], Paint]
    local: FloatArray


def standing(
    mesh: Mesh, foot: Any, yaw: float, number: int, paint: dict[tuple[int, ...], Paint] | Paint
) -> Thing:
    cosine, sine = np.cos(yaw), np.sin(yaw)
    turn = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    corners = mesh.corners @ turn.T + np.asarray(foot, dtype=np.float64)
    if isinstance(paint, Paint):
        paint = {tuple(colour): paint for colour in colours_of(mesh)}
    return Thing(Mesh(corners, mesh.colour, mesh.part, mesh.parts), number, paint, mesh.corners)


def colours_of(mesh: Mesh) -> list[tuple[int, ...]]:
    return [tuple(int(v) for v in row) for row in np.unique(np.rint(mesh.colour), axis=0)]


def repainted(mesh: Mesh, rng: np.random.Generator) -> dict[tuple[int, ...], Paint]:
    """Other materials for a model: each colour weathered, and now and then another paint altogether."""
    paint = {}
    hue, light, strong = rng.normal(0, 0.02), rng.uniform(0.7, 1.2), rng.uniform(0.6, 1.4)
    for colour in colours_of(mesh):
        own = shifted(
            colour,
            hue + rng.normal(0, 0.01),
            strong * rng.uniform(0.85, 1.2),
            light * rng.uniform(0.85, 1.15),
        )
        if rng.random() < 0.08:
            own = shifted((200, 60, 60), rng.random(), rng.uniform(0.2, 1.0), rng.uniform(0.4, 1.1))
        paint[colour] = surface_of(own, rng, (0.008, 0.04))
    return paint


def surface_of(colour: tuple[float, ...], rng: np.random.Generator, period: tuple[float, float]) -> Paint:
    return Paint(
        colour,
        str(rng.choice(PATTERNS, p=[0.2, 0.25, 0.15, 0.15, 0.1, 0.15])),
        float(rng.uniform(0.05, 0.45)),
        float(np.exp(rng.uniform(*np.log(period)))),
        float(rng.choice([0.0, 0.0, rng.uniform(0.1, 0.4)])),
        int(rng.integers(1 << 30)),
    )


def shifted(colour: Any, hue: float, strong: float, light: float) -> tuple[float, ...]:
    """A colour with another hue (turns), saturation and brightness (factors)."""
    h, s, v = colorsys.rgb_to_hsv(*(np.asarray(colour) / 255.0))
    rgb = colorsys.hsv_to_rgb((h + hue) % 1.0, min(s * strong, 1.0), min(v * light, 1.0))
    return tuple(255.0 * channel for channel in rgb)


def any_colour(rng: np.random.Generator) -> tuple[float, ...]:
    """Of clutter: woods, pinks and skins among them."""
    kind = rng.random()
    if kind < 0.35:
        return shifted((178, 132, 84), rng.normal(0, 0.015), rng.uniform(0.5, 1.3), rng.uniform(0.5, 1.3))
    if kind < 0.5:
        return shifted((236, 150, 160), rng.normal(0, 0.02), rng.uniform(0.6, 1.4), rng.uniform(0.8, 1.1))
    if kind < 0.6:
        return shifted(SKIN[rng.integers(5)], rng.normal(0, 0.01), 1.0, rng.uniform(0.9, 1.1))
    return shifted((200, 60, 60), rng.random(), rng.uniform(0.1, 1.0), rng.uniform(0.3, 1.2))


def any_primitive(rng: np.random.Generator, extent: float) -> Mesh:
    """A trimesh primitive on the ground, at most so large."""
    a, b, c = extent * rng.uniform(0.3, 1.0, 3)
    create = trimesh.creation
    solid = [
        lambda: create.box((a, b, c)),
        lambda: create.cylinder(a / 2, b, sections=24),
        lambda: create.icosphere(2, a / 2),
        lambda: create.cone(a / 2, b, sections=24),
        lambda: create.capsule(b, a / 3, count=[12, 12]),
        lambda: create.torus(a / 2.6, a / 8, major_sections=24, minor_sections=10),
        lambda: create.annulus(a / 4, a / 2, b, sections=24),
    ][rng.integers(7)]()
    solid.apply_transform(
        trimesh.transformations.random_rotation_matrix(rng.random(3))
        if rng.random() < 0.3
        else trimesh.transformations.rotation_matrix(rng.choice([0, np.pi / 2]), [1, 0, 0])
    )
    corners = np.asarray(solid.triangles, dtype=np.float64) * [-1.0, 1.0, 1.0]
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    corners = (corners - [(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2]) * min(
        1.0, extent / np.ptp(corners[..., 1])
    )
    return plain_mesh(corners)


def plain_mesh(corners: FloatArray) -> Mesh:
    count = len(corners)
    return Mesh(corners, np.full((count, 3), 180.0), np.zeros(count, np.int64))


def clutter_beside(objects: list[Building], rng: np.random.Generator) -> list[Thing]:
    """Things on the table that nobody asks for, clear of the buildings."""
    found: list[Thing] = []
    taken = [(place, float(np.hypot(size[0], size[2])) / 2) for _, place, _, size in objects]
    for _ in range(int(rng.integers(0, 9))):
        mesh = any_primitive(rng, float(rng.uniform(0.02, 0.10)))
        radius = float(np.linalg.norm(mesh.corners[..., [0, 2]], axis=-1).max())
        for _ in range(20):
            place = rng.uniform(0.0, 1.0, 2) * FARM.size
            if all(np.linalg.norm(place - other) > radius + reach + 0.003 for other, reach in taken):
                taken.append((place, radius))
                paint = surface_of(any_colour(rng), rng, (0.01, 0.05))
                found.append(standing(mesh, (place[0], 0.0, place[1]), rng.uniform(-np.pi, np.pi), 0, paint))
                break
    return found


def solid_box(low: Any, high: Any) -> Mesh:
    low, high = np.asarray(low, float), np.asarray(high, float)
    solid = trimesh.creation.box(high - low)
    corners = np.asarray(solid.triangles, dtype=np.float64)[:, ::-1] + (low + high) / 2
    return plain_mesh(corners)


def table_under(rng: np.random.Generator) -> list[Thing]:
    (w, d), rim = FARM.size, RIM_M
    wood = shifted((170, 120, 76), rng.normal(0, 0.01), rng.uniform(0.5, 1.2), rng.uniform(0.5, 1.3))
    grass = shifted((110, 160, 80), rng.normal(0, 0.03), rng.uniform(0.5, 1.2), rng.uniform(0.5, 1.2))
    cloth = any_colour(rng)
    top = [wood, grass, cloth][rng.choice(3, p=[0.35, 0.35, 0.3])]
    edge = top if rng.random() < 0.4 else wood
    things = [
        (solid_box((0, -0.002, 0), (w, 0.0, d)), surface_of(top, rng, (0.02, 0.3))),
        (solid_box((-rim, -BOARD_M, -rim), (w + rim, -0.0006, d + rim)), surface_of(edge, rng, (0.02, 0.2))),
    ]
    for x in (0.06 * w, 0.94 * w):
        for z in (0.08 * d, 0.92 * d):
            things.append(
                (solid_box((x - 0.02, -TABLE_M, z - 0.02), (x + 0.02, -BOARD_M, z + 0.02)), things[1][1])
            )
    return [standing(mesh, (0, 0, 0), 0.0, 0, paint) for mesh, paint in things]


def room_around(rng: np.random.Generator) -> tuple[list[Thing], list[Lamp]]:
    """Walls, furniture and lamps around the table."""
    left, right = -rng.uniform(0.5, 2.5), FARM.size[0] + rng.uniform(0.5, 2.5)
    back, front = -rng.uniform(1.2, 2.5), FARM.size[1] + rng.uniform(0.3, 2.5)
    low, high, thick = -TABLE_M, ROOM_M - TABLE_M, 0.1
    walls = [
        solid_box((left, low - thick, back), (right, low, front)),
        solid_box((left, high, back), (right, high + thick, front)),
        solid_box((left - thick, low, back), (left, high, front)),
        solid_box((right, low, back), (right + thick, high, front)),
        solid_box((left, low, back - thick), (right, high, back)),
        solid_box((left, low, front), (right, high, front + thick)),
    ]
    white = shifted((226, 222, 214), rng.random(), rng.uniform(0.2, 2.5), rng.uniform(0.7, 1.1))
    paints = [surface_of(any_colour(rng), rng, (0.1, 0.8)), Paint((235.0, 235.0, 232.0))]
    paints += [
        surface_of(white if rng.random() < 0.7 else any_colour(rng), rng, (0.1, 0.8)) for _ in range(4)
    ]
    things = [standing(mesh, (0, 0, 0), 0.0, 0, paint) for mesh, paint in zip(walls, paints, strict=True)]
    for _ in range(int(rng.integers(2, 9))):  # furniture, along the walls and beyond the table
        mesh = any_primitive(rng, float(rng.uniform(0.2, 1.1)))
        place = np.array([rng.uniform(left, right), rng.uniform(FARM.size[1] + 0.15, front)])
        if rng.random() < 0.4:
            place = np.array([rng.choice([left, right]) * 0.95 + 0.03, rng.uniform(0.0, front)])
        reach = float(np.abs(mesh.corners[..., [0, 2]]).max())
        if (
            np.all(place + reach < -0.05)
            or place[1] - reach > FARM.size[1] + 0.05
            or abs(place[0] - 0.6) - reach > 0.7
        ):
            paint = surface_of(any_colour(rng), rng, (0.03, 0.4))
            things.append(standing(mesh, (place[0], low, place[1]), rng.uniform(-np.pi, np.pi), 0, paint))
    lamps = []
    for _ in range(int(rng.integers(1, 4))):
        size = rng.uniform(0.15, 1.0, 2)
        corner = np.array(
            [rng.uniform(left, right - size[0]), high - 0.02, rng.uniform(back, front - size[1])]
        )
        warm = (
            np.array([1.0, rng.uniform(0.75, 1.0), rng.uniform(0.5, 1.0)])
            * rng.uniform(4, 14)
            / np.prod(size)
        )
        lamps.append((corner, np.array([size[0], 0, 0]), np.array([0, 0, size[1]]), warm))
    if rng.random() < 0.6:  # a window
        x = left + 0.01 if rng.random() < 0.5 else right - 0.01
        corner = np.array([x, rng.uniform(0.0, 0.5), rng.uniform(back, front - 1.0)])
        sky = np.array([rng.uniform(0.7, 1.0), rng.uniform(0.85, 1.0), 1.0]) * rng.uniform(3, 16)
        lamps.append((corner, np.array([0, 1.0, 0]), np.array([0, 0, rng.uniform(0.6, 1.4)]), sky))
    return things, lamps


def arm_over(objects: list[Building], rng: np.random.Generator) -> list[Thing]:
    """A hand over the table and its arm, bare or in a sleeve."""
    place = rng.uniform([0.05, 0.0], [FARM.size[0] - 0.05, FARM.size[1] - 0.1])
    gripped = None
    if rng.random() < 0.5:
        gripped = int(rng.integers(1, len(objects)))
        place = objects[gripped][1]
    hand = HandState(place, float(rng.uniform(-0.7, 0.7)), np.zeros(2), gripped, bool(gripped is None))
    tone = shifted(
        SKIN[rng.integers(len(SKIN))], rng.normal(0, 0.004), rng.uniform(0.9, 1.1), rng.uniform(0.92, 1.06)
    )
    skin = Paint(
        tone,
        "blotches",
        float(rng.uniform(0.03, 0.12)),
        0.03,
        float(rng.choice([0.0, 0.35])),
        int(rng.integers(1 << 30)),
    )
    bare = rng.random() < 0.5
    sleeve = (
        skin
        if bare
        else surface_of(
            shifted((200, 60, 60), rng.random(), rng.uniform(0.0, 1.0), rng.uniform(0.15, 1.2)),
            rng,
            (0.004, 0.03),
        )
    )
    things = []
    for part in hand_in_space(hand, HAND):
        mesh = Mesh(part.corners, part.mesh.colour, part.mesh.part, part.mesh.parts)
        paint = {colour: skin if colour == SKIN_OF_MODEL else sleeve for colour in colours_of(mesh)}
        things.append(Thing(mesh, HAND, paint, mesh.corners))
    return things
