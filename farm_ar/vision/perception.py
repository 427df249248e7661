"""How the game perceives from pixels: a picture of the table is taken, and poses are estimated from it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from farm_ar.arrays import IntArray
from farm_ar.drawing.game.pinhole import Pinhole
from farm_ar.drawing.game.real_things import CameraPicture
from farm_ar.game_logic.perception import Perceived
from farm_ar.game_logic.render_state import RenderState
from farm_ar.rendering import Intrinsics, Sensor, View
from farm_ar.scenes import Camera, Layout, Scene, Snapshot
from farm_ar.vision.base import Image, PoseEstimates, PoseEstimator
from farm_ar.vision.estimator import NetworkEstimator
from farm_ar.vision.frames import nearest_alike
from farm_ar.vision.meshes import meshes_of

SIZE = (640, 360)
"""Of a picture, pixels: a third of the HoloLens 2's."""


class PixelPerception:
    """Estimates poses from a picture of the table, by a sensor with noise and JPEG.

    The estimator is given the picture, its camera and the meshes of the scene's categories; the truth is
    drawn, and used besides only to say which thing each detection is of, for the referee.

    Args:
        scene: the table.
        estimator: of poses; by default the one that comes with the package.
        sensor: that takes the picture.

    Raises:
        MeshError: there is no model of a category of the scene.
    """

    def __init__(
        self, scene: Scene, estimator: PoseEstimator | None = None, sensor: Sensor | None = None
    ) -> None:
        self.scene, self._meshes = scene, meshes_of(scene)
        self._estimator = estimator or NetworkEstimator()
        self._sensor = sensor or Sensor()
        self._drawer = CameraPicture(scene, SIZE)

    def picture(self, truth: Layout, camera: Camera, rng: np.random.Generator) -> tuple[Image, View]:
        """What the headset's camera takes of the objects where they truly are, and its camera."""
        nothing = np.zeros(len(truth), bool)
        state = RenderState(self.scene, truth, truth, nothing, camera)
        return self._sensor.expose(self._drawer.draw(state), rng), view_of(camera)

    def look(
        self, truth: Layout, camera: Camera, rng: np.random.Generator
    ) -> tuple[PoseEstimates, Image, View]:
        """The estimates, the picture and its camera."""
        image, view = self.picture(truth, camera, rng)
        return self._estimator.estimate(image, view, self._meshes), image, view

    def perceive(self, truth: Layout, camera: Camera, rng: np.random.Generator) -> Perceived:
        """The snapshot that the camera takes of the objects where they truly are."""
        found = self.look(truth, camera, rng)[0].uncertain
        return Perceived(Snapshot(camera, found), source_of(found.category, found.position, truth))


def view_of(camera: Camera, size: tuple[int, int] = SIZE) -> View:
    """A scene's camera as that of its picture."""
    width, height = size
    pinhole = Pinhole.of(camera, width, height)
    column, row = pinhole.middle.tolist()
    lens = Intrinsics(pinhole.focal, pinhole.focal, column, row, width, height)
    return View(lens, pinhole.eye, pinhole.yaw, pinhole.pitch)


def source_of(
    category: tuple[str | None, ...], position: np.typing.NDArray[np.float64], truth: Layout
) -> IntArray:
    """(M,) index of the object that each of M detections really is of, -1 for a false one."""
    size = {name: truth.size[truth.category.index(name)] for name in truth.categories}
    names = tuple(str(name) for name in category)
    return nearest_alike(names, position, truth.category, truth.position, size)


@lru_cache(maxsize=4)
def pixel_perception(scene: Scene) -> PixelPerception:
    """The perception of a scene with the package's own estimator, made once."""
    return PixelPerception(scene)
