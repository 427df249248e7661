"""Light and shadow (paper, section 5.1): virtual objects throw shadows where their buildings stand now."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import label_colours
from farm_ar.drawing.game.text import BOLD, text_sprite
from farm_ar.drawing.video import write_png
from farm_ar.envs.delivery.picture import paste
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.game_logic.headset import field_of_view, look_at
from farm_ar.geometry import direction
from farm_ar.rendering import Instance, Intrinsics, Light, Mesh, Renderer, View, model
from farm_ar.rendering.shapes import Colour, box, mesh_of, tube
from farm_ar.scenes import Camera, Scene, builtin_scene
from farm_ar.showcases.result import Image, Report, Shown

SUN = Light(toward=np.array([-0.75, 0.8, -0.25]), shadows=2048)
"""A low sun from the left and from before, so that shadows are long."""

PANE = (560, 360)
MOVED, BY = "blue-coop", (0.16, -0.12)
"""What the hand moves, and how far, metres."""

GRASS: Colour = (150, 176, 116)
POLE: Colour = (120, 96, 70)
FLAG_M = 0.16
"""Height of a flag, metres."""

VIRTUAL = 100
"""Numbers of virtual objects in pictures begin here; those of real ones are their indices."""


def flag(colour: Colour) -> Mesh:
    """A pole with a cloth: what marks a building whose colour is virtual."""
    parts = tube((0, 0, 0), (0, FLAG_M, 0), 0.0025, 0.0025, POLE, 6)
    parts += box((0.0, FLAG_M - 0.04, -0.001), (0.05, FLAG_M, 0.001), colour)
    return mesh_of(parts)


def real_instances(game: FarmGame) -> list[Instance]:
    """What stands on the table."""
    layout = game.truth
    things = zip(layout.category, layout.size.tolist(), layout.position, layout.yaw.tolist(), strict=True)
    return [
        Instance(model(category).fitted(*size), _at(place), yaw, i)
        for i, (category, size, place, yaw) in enumerate(things)
    ]


def virtual_instances(game: FarmGame) -> list[Instance]:
    """A flag beside every building, where the game believes it to be, and the animals."""
    believed, found = game.believed, list[Instance]()
    colours = label_colours(believed.labels)
    for i in np.flatnonzero(believed.movable).tolist():
        beside = believed.position[i] + 0.065 * direction(believed.yaw[i] + np.pi / 2)
        found.append(Instance(flag(colours[i]), _at(beside), 0.0, VIRTUAL + i))
    names = {"coop": "chicken", "hutch": "bunny"}
    animals = zip(game.flock.position, game.flock.heading.tolist(), game.flock.goal.tolist(), strict=True)
    for place, yaw, goal in animals:
        animal = names.get(believed.category[goal])
        if animal is not None:
            found.append(Instance(model(animal), _at(place), yaw, VIRTUAL + 50 + goal))
    return found


def picture(game: FarmGame, virtual: Sequence[Instance]) -> Image:
    """The table with real and virtual objects in one light: each throws its shadow on all others."""
    scene = game.scene
    renderer = Renderer([*table(scene), *real_instances(game)], SUN, (204, 216, 226), True, shaded_box(scene))
    view = View.of(camera(), Intrinsics.of_view(*PANE, np.deg2rad(50.0)))
    return renderer.draw(view, virtual).rgb


def table(scene: Scene) -> list[Instance]:
    """The table's top."""
    width, depth = scene.size
    board = mesh_of(box((0.0, -0.03, 0.0), (width, 0.0, depth), GRASS))
    return [Instance(board, np.zeros(3), number=99, casts_shadow=False)]


def shaded_box(scene: Scene) -> FloatArray:
    """The box in which shadows fall: everything on the table, with room for its flags."""
    width, depth = scene.size
    return np.array([(-0.2, 0.0, -0.2), (width + 0.2, 0.25, depth + 0.2)])


def camera() -> Camera:
    """The headset's."""
    return look_at(np.array([0.42, -0.42]), np.array([0.42, 0.33]), field_of_view("photo"), 0.5)


def game_before() -> FarmGame:
    """The game before the hand comes."""
    return FarmGame(builtin_scene("farm"), camera(), np.random.default_rng(0))


def move_building(game: FarmGame) -> None:
    """The hand moves one building, and one snapshot is taken."""
    game.begin_visit()
    game.move(game.truth.index(MOVED), np.array(BY), 0.5)
    game.end_visit()


def show_shadows(out: Path, layouts: int, seed: int, film: bool, report: Report) -> Shown:
    """Write the picture: before, and after, the shadows following."""
    game = game_before()
    before = picture(game, virtual_instances(game))
    left = virtual_instances(game)
    move_building(game)
    stale, after = picture(game, left), picture(game, virtual_instances(game))
    captions = ("before", "after: virtual things left as they were", "after one snapshot: they follow")
    page = np.full((PANE[1] + 34, 3 * PANE[0] + 16, 3), 255, np.uint8)
    for k, (pane, caption) in enumerate(zip((before, stale, after), captions, strict=True)):
        x = k * (PANE[0] + 8)
        page[34:, x : x + PANE[0]] = pane
        paste(page, text_sprite(caption, 18, (34, 34, 34), BOLD), x + 6, 24)
    path = out / "shadows.png"
    write_png(path, page)
    said = (
        f"The hand moves {MOVED} by {BY[0]} and {BY[1]} m. Flags and animals are virtual, buildings are real."
    )
    return Shown("Shadows before and after a building is moved", [], [said], [path])


def _at(place: FloatArray) -> FloatArray:
    return np.array([place[0], 0.0, place[1]])
