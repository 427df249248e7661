"""The game through the headset: the table in perspective, with the virtual animals and floating labels."""

from __future__ import annotations

import cv2
import numpy as np

from farm_ar.drawing.game import animals
from farm_ar.drawing.game.atlas import Atlas
from farm_ar.drawing.game.colours import Colour, Image, darker, label_colours
from farm_ar.drawing.game.figures import animal, directions, figures_of
from farm_ar.drawing.game.floating_labels import FloatingLabels
from farm_ar.drawing.game.header import draw_header, header_height
from farm_ar.drawing.game.marks import displaced
from farm_ar.drawing.game.overlays import freeze, ice_block, tint_area
from farm_ar.drawing.game.pinhole import Pinhole, before_camera, upright_places, upright_scale
from farm_ar.drawing.game.pixels import Distances
from farm_ar.drawing.game.real_things import RealThings
from farm_ar.drawing.game.scenery import Scenery
from farm_ar.drawing.game.sprites import SHIFT, fixed_point
from farm_ar.game_logic.render_state import RenderState
from farm_ar.geometry import footprint_corners
from farm_ar.scenes import Camera, Scene

_HOPS = 160.0
"""Radians of a hop for each metre run: an animal that stands still does not hop."""

_ICE = ice_block(0.55 * animals.LENGTH_M, 0.45 * animals.LENGTH_M)
"""The ice around an animal, seen from the side."""


class HeadsetView:
    """Draws states of a game as the headset's camera sees them; equal states give equal bytes.

    It shows what the player sees: labels float where the game believes them, right or wrong. Besides, for
    whoever watches, where an object is not where its label is believed, its outline stands there.

    Args:
        scene: the table.
        size: width and height of the pictures, pixels; the view's left and right limits are those of the
            picture.
        header: whether a bar at the top shows phase, caption and time.
        scenery: of the scene, where another drawer has it already.
    """

    def __init__(
        self,
        scene: Scene,
        size: tuple[int, int] = (480, 480),
        header: bool = True,
        scenery: Scenery | None = None,
    ) -> None:
        self.scene = scene
        self.size = size
        self._header = header_height(size[1]) if header else 0
        self._colours = label_colours(scene.layout.labels)
        self._scenery = scenery or Scenery(scene)
        self._labels = FloatingLabels(self._colours, self._header)
        self._atlas = Atlas(upright_scale)
        self._static = RealThings(scene, size, self._scenery.static, self._atlas)
        self._bunny = np.array([category == "hutch" for category in scene.layout.category])
        self._animals = np.array([self._figures(i) for i in range(len(self._colours))], np.int64)
        self._ice = self._atlas.number(_ICE)

    def draw(self, state: RenderState, out: Image | None = None, truth: bool = False) -> Image:
        """The picture of a state, (H, W, 3) red, green, blue.

        Args:
            state: of this drawer's scene.
            out: to draw on; a new picture by default.
            truth: whether labels that are on the wrong object are marked, which the player does not see.
        """
        width, height = self.size
        image = np.empty((height, width, 3), np.uint8) if out is None else out
        view = Pinhole.of(state.camera, width, height)
        frozen = state.phase == "hand"
        away, hand = self._static.draw(image, state, view)
        skin = image if hand is None else image[hand]
        self._draw_figures(image, away, state, view, frozen)
        if frozen:
            freeze(image)
        draw_belief_overlay(image, state, view, self._colours)
        if hand is not None:
            image[hand] = skin  # before all that is virtual
        _dim_outside(image, state.camera, view)
        self._labels.draw(image, state, view, truth)
        if self._header:
            draw_header(image, state)
        return image

    def _figures(self, label: int) -> list[int]:
        """The numbers of an animal of a label, seen more and more from above."""
        kind = "bunny" if self._bunny[label] else "chicken"
        return [self._atlas.number(figure) for figure in animal(kind, self._colours[label])]

    def _draw_figures(
        self, image: Image, away: Distances, state: RenderState, view: Pinhole, frozen: bool
    ) -> None:
        """What moves of itself: the scenery's animals and the game's."""
        living = self._scenery.living(state.seconds)
        around = np.array([placed.position for placed in living]).reshape(-1, 2)
        heading = np.concatenate([[placed.yaw for placed in living], state.animal_heading])
        where = np.concatenate([around, state.animal])
        tilt, turn = directions(view, where, heading)
        bunny = self._bunny[state.animal_goal]
        hop = np.abs(np.sin(_HOPS / 2 * state.animal.sum(axis=1))) * np.where(bunny, 0.010, 0.003)
        lift = np.concatenate([np.zeros(len(living)), hop])
        grazing = [
            self._atlas.number(figures_of(placed.thing.solid, placed.thing.without)[step])
            for placed, step in zip(living, tilt.tolist(), strict=False)
        ]
        running = self._animals[state.animal_goal, tilt[len(living) :]]
        art = np.concatenate([grazing, running]).astype(np.int64)
        if frozen:
            ice = len(state.animal)
            art = np.concatenate([art, np.full(ice, self._ice)])
            where, lift = np.concatenate([where, state.animal]), np.concatenate([lift, hop])
            turn = np.concatenate([turn, np.zeros(ice)])
        feet = np.insert(where, 1, lift, axis=1)
        places, size, distance, near = upright_places(view, feet, self.size)
        self._atlas.paste_in_space(
            image, away, art[near], places[near], size[near], distance[near], False, turn[near]
        )


def _dim_outside(image: Image, camera: Camera, view: Pinhole) -> None:
    """Darken what lies above and below the view's own limits."""
    if camera.fov.up is None or camera.fov.down is None:
        return
    above, below = (view.focal * np.tan(min(angle, 1.5)) for angle in (camera.fov.up, camera.fov.down))
    top = int(np.clip(view.middle[1] - above, 0, len(image)))
    bottom = int(np.clip(view.middle[1] + below, 0, len(image)))
    image[:top] //= 3
    image[bottom:] //= 3


_GLASS = 0.22
_FARTHEST_PX = 4000.0


def draw_belief_overlay(image: Image, state: RenderState, view: Pinhole, colours: tuple[Colour, ...]) -> None:
    """Outline every object that is not where its label is believed to be, in the label's colour, there.

    Args:
        image: to draw on.
        state: what is true and what is believed; whether a label is wrong does not show.
        view: the camera.
        colours: of the labels.
    """
    believed = state.believed
    index = np.flatnonzero(displaced(state))
    if not len(index):
        return
    thick = max(1, round(1.1 * image.shape[0] / 480))
    feet = np.insert(
        footprint_corners(believed.position, believed.yaw, believed.size)[index],
        1,
        believed.elevation[index, None],
        axis=2,
    )
    roofs = feet + believed.size[index, None, 1, None] * np.array([0.0, 1.0, 0.0])
    for i, foot, roof in zip(index, view.frame(feet), view.frame(roofs), strict=True):
        walls = [np.stack([foot[k], foot[k - 1], roof[k - 1], roof[k]]) for k in range(4)]
        seen = [
            np.clip(view.pixels(before_camera(side)), -_FARTHEST_PX, _FARTHEST_PX)
            for side in (foot, roof, *walls)
        ]
        if len(seen[0]) > 2:
            tint_area(image, seen[0], colours[i], _GLASS)
        lines = [fixed_point(polygon) for polygon in seen if len(polygon) > 2]
        for tone, width in ((darker(colours[i], 0.6), thick + 1), (colours[i], thick)):
            cv2.polylines(image, lines, True, tone, width, cv2.LINE_AA, SHIFT)
