"""The table of the game from above: true poses, the game's belief, the headset's view."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.drawing.game import animals, ground
from farm_ar.drawing.game.atlas import Atlas
from farm_ar.drawing.game.buildings_above import roof
from farm_ar.drawing.game.colours import PAPER, Colour, Image, category_colour, darker, label_colours
from farm_ar.drawing.game.header import draw_header, draw_legend, draw_score, header_height
from farm_ar.drawing.game.label_placement import (
    LabelPlacement,
    box_size,
    box_text,
    draw_label_box,
    draw_leaders,
    place_boxes,
)
from farm_ar.drawing.game.marks import HEAD_RADIUS_M, CameraMark, draw_beliefs
from farm_ar.drawing.game.overlays import freeze, ice_block, outline
from farm_ar.drawing.game.pixel_observation import PixelObservation
from farm_ar.drawing.game.pixels import paste
from farm_ar.drawing.game.player import draw_hand
from farm_ar.drawing.game.scenery import Scenery
from farm_ar.drawing.game.sprites import paste_art
from farm_ar.drawing.game.text import BOLD, text_sprite
from farm_ar.drawing.game.viewport import Viewport, viewport_on
from farm_ar.game_logic.animals.routes import door
from farm_ar.game_logic.render_state import RenderState
from farm_ar.geometry import direction, footprint_corners, voronoi_cells
from farm_ar.scenes import Camera, Layout, Scene

_STRIP = 0.46
"""How much of the floor before a game's table is shown, in depths of the table: there the player stands."""

_CROWD_STEP_M = 0.045
"""Side of the squares before the shed's door that labels leave to the animals, metres."""

_SITES_COUNT = 3
"""The name of a site counts as so many objects that labels should not cover."""

_CELL_LINES: Colour = (168, 158, 142)

_LETTER_PX = 11.3
"""Height of the letters of labels in a picture 480 high."""


class TableFromAbove:
    """Draws states of a game on one scene, seen from above: x to the right, z up, the player at the bottom.

    Equal states give equal bytes.

    Args:
        scene: the table.
        size: width and height of the pictures, pixels.
        header: whether a bar at the top shows phase, caption and time.
    """

    def __init__(self, scene: Scene, size: tuple[int, int] = (640, 480), header: bool = True) -> None:
        self.scene = scene
        self.size = size
        width, height = size
        self.unit = height / 480
        self._header = header_height(height) if header else 0
        near = _STRIP * scene.size[1] if ground.is_farm(scene) else 0.0
        self.viewport: Viewport = viewport_on(scene.size, width, height, self._header, near)
        self._letter = max(9, round(_LETTER_PX * self.unit))
        self._colours = label_colours(scene.layout.labels)
        self._camera = CameraMark(self.viewport)
        self._arranged: tuple[object, LabelPlacement] | None = None

    def draw(
        self, state: RenderState, labels: bool = True, beliefs: bool = True, out: Image | None = None
    ) -> Image:
        """The picture of a state.

        Args:
            state: of this drawer's scene.
            labels: whether anything is written: labels, the bar at the top, the score.
            beliefs: whether it shows what the game believes: labels stand where it believes them to be,
                outlines where that is not so, and what is wrong is red. Otherwise labels stand by the truth.
            out: to draw on; a new picture by default.

        Returns:
            (H, W, 3) red, green, blue.
        """
        image = np.empty_like(self._background) if out is None else out
        np.copyto(image, self._background)
        frozen = state.phase == "hand"
        self._draw_things(image, state, frozen)
        if frozen:
            freeze(image)
        self._camera.draw(image, state.camera)
        self._name_sites(image, state.camera)
        if beliefs:
            draw_beliefs(image, state, self.viewport, self._colours)
        if state.hand is not None:
            draw_hand(image, state.hand, self.viewport)
        if labels:
            self._draw_labels(image, state, beliefs)
        return image

    @cached_property
    def scenery(self) -> Scenery:
        """What is drawn around the buildings."""
        return Scenery(self.scene)

    @cached_property
    def _background(self) -> Image:
        return self._draw_background()

    @cached_property
    def _pixel_observation(self) -> PixelObservation:
        return PixelObservation(self.scene, self.size)

    def draw_pixel_observation(self, state: RenderState, beliefs: bool) -> Image:
        """The picture of a state in the same size, without words, as `PixelObservation` draws it."""
        return self._pixel_observation.draw(state, beliefs)

    def label_placement(self, state: RenderState, beliefs: bool = True) -> LabelPlacement:
        """Where the label boxes lie that `draw` would draw."""
        layout = state.believed if beliefs else state.truth
        index = [int(i) for i in np.flatnonzero(layout.movable)]
        sizes = [box_size(state, i, self._letter, beliefs) for i in index]
        key = (layout.position.tobytes(), layout.yaw.tobytes(), tuple(sizes))
        if self._arranged is None or self._arranged[0] != key:
            self._arranged = key, self._arrange(layout, index, sizes)
        return self._arranged[1]

    def _arrange(self, layout: Layout, index: list[int], sizes: list[tuple[int, int]]) -> LabelPlacement:
        corners = self.viewport.pixels(footprint_corners(layout.position, layout.yaw, layout.size))
        low, high = corners.min(axis=1), corners.max(axis=1)
        width, height = self.size
        bounds = np.array([2, self._header + 2, width - 2, height - 2], dtype=np.float64)
        avoid = np.vstack([np.hstack([low, high])[layout.fixed], self._crowded(layout), self._site_boxes()])
        anchor = self.viewport.pixels(layout.position[index])
        boxes = place_boxes(np.array(sizes), anchor, ((high - low) / 2)[index], avoid, bounds)
        return LabelPlacement(index, boxes, anchor)

    def _crowded(self, layout: Layout) -> FloatArray:
        """(C, 4) left, top, right, bottom of where animals crowd: before the doors that they come from.

        In small boxes, so that what is small counts as much as what is large.
        """
        if not ground.is_farm(self.scene):
            return np.zeros((0, 4))
        fixed = layout.fixed
        gate = door(layout.position[fixed], layout.yaw[fixed], layout.size[fixed])
        out = direction(layout.yaw[fixed])
        ahead, aside = (
            _CROWD_STEP_M * np.array(steps) for steps in ((0.5, 1.5, 2.5, 3.5), (-1.5, -0.5, 0.5, 1.5))
        )
        across = out[:, ::-1] * np.array([1.0, -1.0])
        places = (
            gate[:, None, None]
            + ahead[:, None, None] * out[:, None, None]
            + aside[:, None] * across[:, None, None]
        )
        half = _CROWD_STEP_M / 2 * self.viewport.scale * np.array([-1.0, -1.0, 1.0, 1.0])
        return np.tile(self.viewport.pixels(places.reshape(-1, 2)), 2) + half

    def _site_boxes(self) -> FloatArray:
        """(S, 4) left, top, right, bottom of the marks and names of the sites."""
        places = self.viewport.pixels(self.scene.site_positions).reshape(-1, 2)
        around = np.array([-5.0, -14.0, 20.0, 5.0]) * self.unit
        return np.repeat(np.tile(places, 2) + around, _SITES_COUNT, axis=0)

    def _draw_background(self) -> Image:
        width, height = self.size
        viewport = self.viewport
        image = ground.floor(width, height)
        left, bottom = viewport.pixels(np.zeros(2))
        right, top = viewport.pixels(np.array(self.scene.size))
        x0, y0, x1, y1 = (round(float(value)) for value in (left, top, right, bottom))
        ground.draw_rim(image, x0, y0, x1, y1, max(3, round(7 * self.unit)))
        image[y0:y1, x0:x1] = ground.table_top(self.scene, x1 - x0, y1 - y0)
        self._draw_cells(image)
        for placed in self.scenery.static:
            x, y = viewport.pixels(placed.position)
            paste_art(image, placed.thing.above, float(x), float(y), viewport.scale, placed.yaw)
        return image

    def _draw_cells(self, image: Image) -> None:
        if not self.scene.sites:
            return
        tone = (232, 240, 214) if ground.is_farm(self.scene) else _CELL_LINES
        ink, _ = self._site_colours
        for cell in voronoi_cells(self.scene.site_positions, self.scene.size):
            if len(cell):
                outline(image, self.viewport.pixels(cell), tone, 1)
        for site in self.scene.sites:
            x, y = (float(value) for value in self.viewport.pixels(np.array([site.x, site.z])))
            reach = 3 * self.unit
            for dx, dy in ((reach, reach), (reach, -reach)):
                ends = np.array([(x - dx, y - dy), (x + dx, y + dy)])
                outline(image, ends, ink, 1, closed=False)

    def _name_sites(self, image: Image, camera: Camera) -> None:
        """Write the sites' names over whatever stands there; beside the player's head if that is on one."""
        ink, halo = self._site_colours
        for site in self.scene.sites:
            words = text_sprite(site.name, max(8, round(10 * self.unit)), ink, BOLD, halo)
            x, y = self.viewport.pixels(np.array([site.x, site.z])).tolist()
            head = np.hypot(*(camera.position - (site.x, site.z))) < HEAD_RADIUS_M
            aside, up = (32, 10) if head else (4, 2)
            paste(image, words.pixels, round(x + aside * self.unit), round(y - up * self.unit) + words.top)

    @cached_property
    def _site_colours(self) -> tuple[Colour, Colour]:
        """Of the letters, and around them."""
        if ground.is_farm(self.scene):
            return PAPER, (72, 104, 52)
        return darker(_CELL_LINES, 0.45), ground.ROOM

    def _draw_things(self, image: Image, state: RenderState, frozen: bool) -> None:
        """What is alive around the buildings, the animals, in ice if they are frozen, and the buildings."""
        living = self.scenery.living(state.seconds)
        around = [self._atlas.number(placed.thing.above) for placed in living]
        numbers, place, yaw = self._animals[state.animal_goal], state.animal, state.animal_heading
        if frozen:
            numbers = np.stack([numbers, np.full_like(numbers, self._ice)], axis=1).reshape(-1)
            place = np.repeat(place, 2, axis=0)
            yaw = np.stack([yaw, np.zeros_like(yaw)], axis=1).reshape(-1)
        order, truth = self._large_first, state.truth
        art = np.concatenate([np.array(around, np.int64), numbers, self._roofs])
        places = np.concatenate(
            [np.array([p.position for p in living]).reshape(-1, 2), place, truth.position[order]]
        )
        yaws = np.concatenate([[p.yaw for p in living], yaw, truth.yaw[order]])
        step = np.repeat([7.5, 1.0], [len(art) - len(order), len(order)])
        self._atlas.paste(image, art, self.viewport.pixels(places), yaws, step)

    @cached_property
    def _atlas(self) -> Atlas:
        return Atlas(lambda size: self.viewport.scale)

    @cached_property
    def _animals(self) -> IntArray:
        """(N,) the drawing of an animal of each label."""
        kinds = zip(self._colours, self.scene.layout.category, strict=True)
        arts = [
            animals.bunny(colour) if kind == "hutch" else animals.chicken(colour) for colour, kind in kinds
        ]
        return np.array([self._atlas.number(art) for art in arts], dtype=np.int64)

    @cached_property
    def _ice(self) -> int:
        return self._atlas.number(ice_block(0.6 * animals.LENGTH_M))

    @cached_property
    def _large_first(self) -> IntArray:
        """(N,) the order in which things are drawn: what is large lies below what is small."""
        size = self.scene.layout.size
        return np.argsort(-size[:, 0] * size[:, 2], kind="stable")

    @cached_property
    def _roofs(self) -> IntArray:
        """(N,) the drawings of objects, the large ones first."""
        layout, arts = self.scene.layout, []
        for i in self._large_first:
            width, _, depth = layout.size[i].tolist()
            colour = category_colour(layout.category[i], layout.categories)
            arts.append(self._atlas.number(roof(layout.category[i], colour, width, depth)))
        return np.array(arts, dtype=np.int64)

    def _draw_labels(self, image: Image, state: RenderState, beliefs: bool) -> None:
        placement = self.label_placement(state, beliefs)
        draw_leaders(image, placement, [self._colours[i] for i in placement.index], self.unit)
        for i, box in zip(placement.index, placement.box, strict=True):
            wrong = beliefs and bool(state.wrong[i])
            draw_label_box(image, box_text(state, i), box, self._colours[i], self._letter, wrong)
        draw_score(image, state, beliefs, self.unit)
        if beliefs and ground.is_farm(self.scene):
            draw_legend(image, self.unit)
        if self._header:
            draw_header(image, state)
