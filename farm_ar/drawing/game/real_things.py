"""What is real in the headset's view: room, table, buildings, scenery and the player's hand."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.drawing.game import ground
from farm_ar.drawing.game.atlas import Atlas
from farm_ar.drawing.game.colours import Colour, Image, category_colour, darker, lighter
from farm_ar.drawing.game.pinhole import Pinhole, upright_places, upright_scale
from farm_ar.drawing.game.pixels import Distances
from farm_ar.drawing.game.player import hand_in_space
from farm_ar.drawing.game.scenery import Placed
from farm_ar.game_logic.physics.gripper import HandState
from farm_ar.game_logic.render_state import RenderState
from farm_ar.rendering import MODELS, Instance, Intrinsics, Light, Mesh, Renderer, View, model, with_open_gate
from farm_ar.rendering.shapes import box, mesh_of, pane
from farm_ar.scenes import Camera, Scene

_TEXTURE_PX = 640
_BOARD_M, _RIM_M, _TABLE_HEIGHT_M, _WALL_M, _SKIRTING_M = 0.03, 0.016, 0.74, 2.6, 0.08
_FLOOR_M = 6.0
"""How far the floor reaches around a table."""

_HAND = 1
"""Number of the hand in pictures; all else is 0."""


class RealThings:
    """Draws what is real with the distance of each pixel, and keeps the last picture.

    While neither the head nor anything real moves, a picture is a copy of the one before.

    Args:
        scene: the table.
        size: width and height of the pictures, pixels.
        scenery: what stands around the buildings.
        atlas: of upright drawings.
        shadow_pixels: of the shadow map, each way.
    """

    def __init__(
        self,
        scene: Scene,
        size: tuple[int, int],
        scenery: list[Placed],
        atlas: Atlas,
        shadow_pixels: int = 640,
    ) -> None:
        self.scene, self.size = scene, size
        self._plants, self._atlas = [placed for placed in scenery if placed.thing.side], atlas
        farm = ground.is_farm(scene)
        self._light = Light(shadows=shadow_pixels)
        if not farm:
            self._light = Light(sun=0.45, sky=0.66, ground=0.5, shadows=shadow_pixels)
        self._room = _table(scene) if farm else [_top(scene, 0.0)]
        self._room += [
            Instance(placed.thing.mesh, np.insert(placed.position, 1, 0.0), placed.yaw)
            for placed in scenery
            if placed.thing.solid
        ]
        self._walls = [] if farm else _walls(scene.size)
        (w, d), high = scene.size, 0.2 * scene.diagonal
        self._shaded = np.array([(0.0, 0.0, 0.0), (w, high, d)])
        self._feet = np.array([placed.position for placed in self._plants]).reshape(-1, 2)
        self._standing: tuple[tuple[bytes, ...], Renderer] | None = None
        self._key: tuple[bytes, ...] | None = None
        self._image: Image = np.empty((size[1], size[0], 3), np.uint8)
        self._away: Distances = np.empty((size[1], size[0]), np.float32)
        self._hand: BoolArray | None = None

    def draw(self, image: Image, state: RenderState, view: Pinhole) -> tuple[Distances, BoolArray | None]:
        """Draw the picture.

        Args:
            image: (H, W, 3) to draw on.
            state: whose camera sees it.
            view: that camera as a pinhole.

        Returns:
            (H, W) how far away what it shows is, metres, infinite for nothing; and which show the hand.
        """
        key = (*_bytes_of(state.camera), *_standing_bytes(state), _hand_bytes(state.hand))
        if key != self._key:
            self._draw_things(view, state)
            self._key = key
        np.copyto(image, self._image)
        return self._away, self._hand

    def _draw_things(self, view: Pinhole, state: RenderState) -> None:
        hand = state.hand
        width, height = self.size
        column, row = view.middle.tolist()
        lens = Intrinsics(view.focal, view.focal, column, row, width, height)
        buildings = _buildings(state)
        held = None if hand is None else hand.gripped
        moving = [] if held is None else [buildings.pop(held)]
        if hand is not None:
            moving += hand_in_space(hand, _HAND)
        picture = self._renderer(view, state, held, buildings).draw(
            View(lens, view.eye, view.yaw, view.pitch), moving
        )
        np.copyto(self._image, picture.rgb)
        np.copyto(self._away, picture.depth)
        self._hand = None if hand is None else picture.ids == _HAND
        if self._plants:
            self._draw_plants(view)

    def _renderer(
        self, view: Pinhole, state: RenderState, held: int | None, buildings: list[Instance]
    ) -> Renderer:
        """Of all but the hand and what it holds; kept while nothing moves and the same walls are seen."""
        truth = state.truth
        standing = np.arange(len(truth)) != held
        walls = [wall for wall, foot, inwards in self._walls if (view.eye - foot) @ inwards > 0]
        key = (
            *_standing_bytes(state, standing),
            standing.tobytes(),
            str([id(wall) for wall in walls]).encode(),
        )
        if self._standing is None or self._standing[0] != key:
            things = [*self._room, *walls, *buildings]
            self._standing = key, Renderer(things, self._light, ground.WALL, True, self._shaded)
        return self._standing[1]

    def _draw_plants(self, view: Pinhole) -> None:
        sides = [placed.thing.side for placed in self._plants]
        art = np.array([self._atlas.number(side) for side in sides if side is not None])
        place, size, distance, near = upright_places(view, np.insert(self._feet, 1, 0.0, axis=1), self.size)
        self._atlas.paste_in_space(
            self._image, self._away, art[near], place[near], size[near], distance[near], True
        )


class CameraPicture:
    """Draws states of a game as the headset's camera takes them: nothing virtual, no scenery.

    Args:
        scene: the table.
        size: width and height of the pictures, pixels; the view's left and right are those of the picture.
    """

    def __init__(self, scene: Scene, size: tuple[int, int]) -> None:
        self._size = size
        self._things = RealThings(scene, size, [], Atlas(upright_scale), shadow_pixels=256)

    def draw(self, state: RenderState) -> Image:
        """The picture of a state, (H, W, 3) red, green, blue."""
        width, height = self._size
        image = np.empty((height, width, 3), np.uint8)
        view = Pinhole.of(state.camera, width, height)
        self._things.draw(image, state, view)
        return image


def _buildings(state: RenderState) -> list[Instance]:
    """What really stands there: models where there are some, else boxes."""
    things, layout = [], state.truth
    for i, category in enumerate(layout.category):
        colour = category_colour(category, layout.categories)
        foot = np.array([layout.position[i, 0], layout.elevation[i], layout.position[i, 1]])
        mesh = _building(category, colour, *layout.size[i].tolist())
        mesh = with_open_gate(mesh.without(*state.missing.get(i, ())), state.open_gates.get(i, 0.0))
        things.append(Instance(mesh, foot, float(layout.yaw[i])))
    return things


@lru_cache(maxsize=512)
def _building(category: str, colour: Colour, width: float, height: float, depth: float) -> Mesh:
    """A category's model, stretched to a size; where there is none, a box with an arrow to its front."""
    if category in MODELS:
        return model(category).fitted(width, height, depth)
    w, d = width / 2, depth / 2
    faces = box((-w, 0.0, -d), (w, height, d), colour)
    arrow = [
        (-0.55 * w, height * 1.002, -0.5 * d),
        (0.0, height * 1.002, 0.8 * d),
        (0.55 * w, height * 1.002, -0.5 * d),
    ]
    return mesh_of(faces + pane(arrow, (0, 1, 0), darker(colour, 0.5)))


def _table(scene: Scene) -> list[Instance]:
    """A table with a wooden rim, its legs, and the floor that it stands on."""
    (w, d), rim = scene.size, _RIM_M
    board = mesh_of(box((-rim, -_BOARD_M, -rim), (w + rim, 0.0, d + rim), ground.EDGE))
    legs = []
    for x in (0.04 * w, 0.96 * w):
        for z in (0.05 * d, 0.95 * d):
            legs += box(
                (x - 0.02, -_TABLE_HEIGHT_M, z - 0.02),
                (x + 0.02, -_BOARD_M, z + 0.02),
                darker(ground.EDGE, 0.3),
            )
    far, low = _FLOOR_M, -_TABLE_HEIGHT_M
    floor = pane(
        [(-far, low, -far), (w + far, low, -far), (w + far, low, d + far), (-far, low, d + far)],
        (0, 1, 0),
        ground.FLOOR,
    )
    return [
        _top(scene, 0.0005),
        Instance(board, np.zeros(3)),
        Instance(mesh_of(legs), np.zeros(3)),
        Instance(mesh_of(floor), np.zeros(3), casts_shadow=False),
    ]


def _top(scene: Scene, level: float) -> Instance:
    """The painted top of a table, or the floor of a room."""
    w, d = scene.size
    texture = ground.table_top(scene, _TEXTURE_PX, round(_TEXTURE_PX * min(2.0, d / w)))
    corners = np.array([(0.0, level, 0.0), (w, level, 0.0), (w, level, d), (0.0, level, d)])
    place = np.array([(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)])
    faces = [[0, 1, 2], [0, 2, 3]]
    mesh = Mesh(corners[faces], np.zeros((2, 3)), np.zeros(2, np.int64), ("top",), texture, place[faces])
    return Instance(mesh, np.zeros(3), casts_shadow=False)


def _walls(size: tuple[float, float]) -> list[tuple[Instance, FloatArray, FloatArray]]:
    """The walls of a room, each with a corner of its foot and the direction inwards."""
    w, d = size
    foot = np.array([(0.0, 0.0, 0.0), (w, 0.0, 0.0), (w, 0.0, d), (0.0, 0.0, d)])
    found = []
    for k in range(4):
        side = foot[[k, (k + 1) % 4]]
        along = side[1] - side[0]
        inwards = np.array([-along[2], 0.0, along[0]]) / np.linalg.norm(along)
        up = np.array([0.0, 1.0, 0.0])
        faces = pane(
            [*side, *(side[::-1] + _WALL_M * up)], inwards, lighter(ground.WALL, 0.10 * (k % 2) + 0.30)
        )
        near = side + 0.002 * inwards
        faces += pane([*near, *(near[::-1] + _SKIRTING_M * up)], inwards, lighter(ground.WALL, 0.62))
        found.append((Instance(mesh_of(faces), np.zeros(3), casts_shadow=False), side[0], inwards))
    return found


def _bytes_of(camera: Camera) -> tuple[bytes, ...]:
    """All that a picture depends on of a camera."""
    numbers = (camera.yaw, camera.pitch, np.nan if camera.height is None else camera.height)
    fov = camera.fov
    limits = (fov.left, fov.right)
    return camera.position.tobytes(), np.array([*map(float, numbers), *limits]).tobytes()


def _standing_bytes(state: RenderState, standing: BoolArray | slice = slice(None)) -> tuple[bytes, ...]:
    """All that a picture depends on of what stands there."""
    parts = repr((sorted(state.missing.items()), sorted(state.open_gates.items()))).encode()
    return state.truth.position[standing].tobytes(), state.truth.yaw[standing].tobytes(), parts


def _hand_bytes(hand: HandState | None) -> bytes:
    if hand is None:
        return b""
    return np.array([*hand.position, hand.yaw, hand.gripped is None, hand.raised], np.float64).tobytes()
