"""The static layer of the headset's view: room, table, scenery and buildings."""

from __future__ import annotations

import cv2
import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game import ground
from farm_ar.drawing.game.atlas import Atlas, paste_one_in_space
from farm_ar.drawing.game.background import draw_table_edges, draw_table_shadow, draw_walls
from farm_ar.drawing.game.building_solids import solid
from farm_ar.drawing.game.colours import Image, category_colour
from farm_ar.drawing.game.perspective import Block, solid_sprites, upright_places
from farm_ar.drawing.game.pinhole import Pinhole
from farm_ar.drawing.game.pixels import Distances
from farm_ar.drawing.game.scenery import Placed
from farm_ar.drawing.game.sprites import Sprite
from farm_ar.scenes import Camera, Layout, Scene

_TEXTURE_PX = 640


class StaticLayer:
    """Draws the static layer with the distance of each pixel, and keeps the last picture.

    While neither the head nor a building moves, a picture is a copy of the one before.

    Args:
        scene: the table.
        size: width and height of the pictures, pixels.
        scenery: what stands around the buildings.
        atlas: of upright drawings.
    """

    def __init__(self, scene: Scene, size: tuple[int, int], scenery: list[Placed], atlas: Atlas) -> None:
        self.scene, self.size = scene, size
        self._scenery, self._atlas = scenery, atlas
        self._farm = ground.is_farm(scene)
        width, height = size
        rows = round(_TEXTURE_PX * min(2.0, scene.size[1] / scene.size[0]))
        self._top = ground.table_top(scene, _TEXTURE_PX, rows)
        light = np.linspace(0.86, 1.08, height)[:, None, None]
        floor = np.clip(light * np.array(ground.FLOOR), 0, 255).astype(np.uint8)
        self._floor = np.repeat(floor, width, axis=1)
        self._wall = np.empty_like(self._floor)
        self._wall[:] = ground.WALL
        self._feet = np.array([placed.position for placed in scenery]).reshape(-1, 2)
        self._key: tuple[bytes, ...] | None = None
        self._sprites: dict[int, Sprite | None] = {}
        self._drawn: Layout | None = None
        self._room, self._image = np.zeros_like(self._floor), np.zeros_like(self._floor)
        self._away: Distances = np.zeros((height, width), np.float32)

    def draw(self, image: Image, camera: Camera, view: Pinhole, truth: Layout) -> Distances:
        """Draw the picture; (H, W) how far away what it shows is, metres, infinite for the room.

        Args:
            image: (H, W, 3) to draw on.
            camera: the headset's.
            view: the same as a pinhole.
            truth: where everything really is.
        """
        head = _bytes_of(camera)
        key = (*head, truth.position.tobytes(), truth.yaw.tobytes())
        if key != self._key:
            if self._key is None or self._key[: len(head)] != head:
                self._draw_room(view)
                self._drawn = None
            self._draw_things(view, truth)
            self._key = key
        np.copyto(image, self._image)
        return self._away

    def _draw_room(self, view: Pinhole) -> None:
        """Wall, floor and the table top; in a room its four walls."""
        image = self._room
        np.copyto(image, self._floor)
        height = image.shape[0]
        horizon = int(np.clip(np.floor(view.horizon), 0, height))
        image[:horizon] = self._wall[:horizon]
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

    def _draw_things(self, view: Pinhole, layout: Layout) -> None:
        """The room with buildings, other things and scenery in it."""
        image, away = self._image, self._away
        np.copyto(image, self._room)
        away.fill(np.inf)
        feet = np.insert(layout.position, 1, layout.elevation, axis=1)
        distance = view.frame(feet)[:, 2]
        self._draw_moved(view, layout, feet)
        for i in np.argsort(-distance, kind="stable").tolist():
            sprite = self._sprites[i]
            if sprite is not None and distance[i] > -layout.size[i].max():
                paste_one_in_space(image, away, sprite, float(distance[i]))
        if self._scenery:
            self._draw_scenery(image, away, view)

    def _draw_moved(self, view: Pinhole, layout: Layout, feet: FloatArray) -> None:
        """Draw anew what does not stand where it stood when it was drawn last."""
        if self._drawn is None:
            moved = np.arange(len(layout))
        else:
            moved = np.flatnonzero(
                (layout.position != self._drawn.position).any(axis=1) | (layout.yaw != self._drawn.yaw)
            )
        blocks = []
        for i in moved.tolist():
            colour = category_colour(layout.category[i], layout.categories)
            shape = solid(layout.category[i], colour, *layout.size[i].tolist())
            blocks.append(Block(shape, float(layout.yaw[i]), feet[i]))
        fresh = solid_sprites(view, blocks, self.size)
        self._sprites.update(zip(moved.tolist(), fresh, strict=True))
        self._drawn = layout

    def _draw_scenery(self, image: Image, away: Distances, view: Pinhole) -> None:
        art = np.array([upright_number(self._atlas, placed, view) for placed in self._scenery], np.int64)
        place, size, distance, near = upright_places(view, np.insert(self._feet, 1, 0.0, axis=1), self.size)
        self._atlas.paste_in_space(image, away, art[near], place[near], size[near], distance[near], True)


def upright_number(atlas: Atlas, placed: Placed, view: Pinhole) -> int:
    """The number of the drawing of a thing as seen from the side to which it turns."""
    leftwards = np.sin(placed.yaw - view.yaw) < 0
    return atlas.number(placed.thing.side_left if leftwards else placed.thing.side)


def _bytes_of(camera: Camera) -> tuple[bytes, ...]:
    """All that a picture depends on of a camera."""
    numbers = (camera.yaw, camera.pitch, np.nan if camera.height is None else camera.height)
    fov = camera.fov
    limits = (fov.left, fov.right)
    return camera.position.tobytes(), np.array([*map(float, numbers), *limits]).tobytes()
