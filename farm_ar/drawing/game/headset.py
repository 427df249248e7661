"""The game through the headset: the table in perspective, with the virtual animals and floating labels."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import cv2
import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game import creatures, ground
from farm_ar.drawing.game.building_solids import solid
from farm_ar.drawing.game.colours import Image, category_colour, label_colours
from farm_ar.drawing.game.floating_labels import draw_floating_labels
from farm_ar.drawing.game.header import draw_header, header_height
from farm_ar.drawing.game.overlays import freeze, ice_block
from farm_ar.drawing.game.perspective import draw_solid, upright_scales
from farm_ar.drawing.game.pinhole import Pinhole
from farm_ar.drawing.game.player import draw_hand_before_eyes
from farm_ar.drawing.game.rooms import draw_table_edges, draw_table_shadow, draw_walls
from farm_ar.drawing.game.scenery import Scenery
from farm_ar.drawing.game.shapes import Art
from farm_ar.drawing.game.sprites import paste_art
from farm_ar.game_logic.moment import Moment
from farm_ar.scenes import Camera, Layout, Scene

_TEXTURE_PX = 640
_HOPS = 160.0
"""Radians of a hop for each metre run: an animal that stands still does not hop."""

_ICE = ice_block(0.55 * creatures.LENGTH_M, 0.45 * creatures.LENGTH_M)
"""The ice around an animal, seen from the side."""

Item = tuple[float, Callable[[Image], None]]
"""How far something is away, and what draws it."""


class HeadsetView:
    """Draws moments of a game as the headset's camera sees them; equal moments give equal bytes.

    It shows what the player sees: labels float where the game believes them, right or wrong.

    Args:
        scene: the table.
        size: width and height of the pictures, pixels; the view's left and right limits are those of the
            picture.
        header: whether a bar at the top tells phase, caption and time.
    """

    def __init__(self, scene: Scene, size: tuple[int, int] = (480, 480), header: bool = True) -> None:
        self.scene = scene
        self.size = size
        self._header = header_height(size[1]) if header else 0
        self._colours = label_colours(scene.layout.labels)
        self._scenery = Scenery(scene)
        self._farm = ground.is_farm(scene)
        height = round(_TEXTURE_PX * min(2.0, scene.size[1] / scene.size[0]))
        self._top = ground.table_top(scene, _TEXTURE_PX, height)
        light = np.linspace(0.86, 1.08, size[1])[:, None, None]
        self._floor = np.clip(light * np.array(ground.FLOOR), 0, 255).astype(np.uint8)

    def draw(self, moment: Moment) -> Image:
        """The picture of a moment, (H, W, 3) red, green, blue."""
        width, height = self.size
        image = np.empty((height, width, 3), np.uint8)
        view = Pinhole.of(moment.camera, width, height)
        frozen = moment.phase == "hand"
        self._draw_room(image, view)
        items = self._things(moment.truth, view) + self._upright(moment, view, frozen)
        for _, draw in sorted(items, key=lambda item: -item[0]):
            draw(image)
        if frozen:
            freeze(image)
        if moment.hand is not None:
            draw_hand_before_eyes(image, moment.hand, view)
        _dim_outside(image, moment.camera, view)
        draw_floating_labels(image, moment, view, self._colours, self._header)
        if self._header:
            draw_header(image, moment)
        return image

    def _draw_room(self, image: Image, view: Pinhole) -> None:
        """Wall, floor and the table top; in a room its four walls."""
        height = image.shape[0]
        horizon = int(np.clip(np.floor(view.horizon), 0, height))
        image[:] = self._floor
        image[:horizon] = ground.WALL
        width_m, depth_m = self.scene.size
        if self._farm:
            draw_table_shadow(image, view, self.scene.size)
            draw_table_edges(image, view, self.scene.size)
        if horizon == height:
            return
        rows, columns = self._top.shape[:2]
        to_metres = np.array([[width_m / columns, 0, 0], [0, -depth_m / rows, depth_m], [0, 0, 1.0]])
        below = np.array([[1.0, 0, 0], [0, 1.0, -horizon], [0, 0, 1.0]])
        part = image[horizon:]
        cv2.warpPerspective(
            self._top,
            below @ view.plane @ to_metres,
            (part.shape[1], part.shape[0]),
            dst=part,
            flags=cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_TRANSPARENT,
        )
        if not self._farm:
            draw_walls(image, view, self.scene.size)

    def _things(self, layout: Layout, view: Pinhole) -> list[Item]:
        """Buildings and other things."""
        items: list[Item] = []
        feet = np.insert(layout.position, 1, layout.elevation, axis=1)
        away = view.frame(feet)[:, 2]
        for i in np.flatnonzero(away > -layout.size.max(axis=1)):
            colour = category_colour(layout.category[i], layout.categories)
            shape = solid(layout.category[i], colour, *layout.size[i].tolist())
            draw = partial(draw_solid, view=view, solid=shape, yaw=float(layout.yaw[i]), foot=feet[i])
            items.append((float(away[i]), draw))
        return items

    def _upright(self, moment: Moment, view: Pinhole, frozen: bool) -> list[Item]:
        """What always faces the eye: scenery and animals."""
        arts, feet = self._figures(moment, view, frozen)
        if not arts:
            return []
        frame = view.frame(feet)
        scales = upright_scales(view, frame[:, 2])
        pixels = view.pixels(frame)
        near = (pixels > -200).all(axis=1) & (pixels < np.array(self.size) + 200).all(axis=1) & (scales > 0)
        away, places, sizes = frame[:, 2].tolist(), pixels.tolist(), scales.tolist()
        return [
            (away[k], partial(paste_art, art=arts[k], x=places[k][0], y=places[k][1], scale=sizes[k]))
            for k in np.flatnonzero(near)
        ]

    def _figures(self, moment: Moment, view: Pinhole, frozen: bool) -> tuple[list[Art], FloatArray]:
        """The drawings of scenery and animals, and (F, 3) where they stand, metres."""
        arts, places, lifts = [], [], []
        for placed in self._scenery.standing + self._scenery.living(moment.seconds):
            leftwards = np.sin(placed.yaw - view.yaw) < 0
            arts.append(placed.thing.side_left if leftwards else placed.thing.side)
            places.append(placed.position)
            lifts.append(0.0)
        hop = np.abs(np.sin(_HOPS / 2 * moment.animal.sum(axis=1)))
        leftwards_all = (np.sin(moment.animal_heading - view.yaw) < 0).tolist()
        for k, goal in enumerate(moment.animal_goal.tolist()):
            bunny = self.scene.layout.category[goal] == "hutch"
            make = creatures.bunny_side if bunny else creatures.chicken_side
            animal = make(self._colours[goal], leftwards_all[k])
            for art in (animal, _ICE) if frozen else (animal,):
                arts.append(art)
                places.append(moment.animal[k])
                lifts.append(float(hop[k]) * (0.010 if bunny else 0.003))
        return arts, np.insert(np.array(places).reshape(-1, 2), 1, lifts, axis=1)


def _dim_outside(image: Image, camera: Camera, view: Pinhole) -> None:
    """Darken what lies above and below the view's own limits."""
    if camera.fov.up is None or camera.fov.down is None:
        return
    above, below = (view.focal * np.tan(min(angle, 1.5)) for angle in (camera.fov.up, camera.fov.down))
    top = int(np.clip(view.middle[1] - above, 0, len(image)))
    bottom = int(np.clip(view.middle[1] + below, 0, len(image)))
    image[:top] //= 3
    image[bottom:] //= 3
