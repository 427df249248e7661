"""How an episode begins: its scene, its layout, its camera, and the world they make."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.envs.options import EnvOptions
from farm_ar.envs.perceptions import UnsteadyHead, perception_of
from farm_ar.envs.reids import reid_factory
from farm_ar.envs.worlds import PlainScene, World
from farm_ar.errors import InputError, OptionError, known_name
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.game_logic.headset import random_camera
from farm_ar.game_logic.tracker import Tracker
from farm_ar.scenes import BUILTIN, Camera, FieldOfView, Layout, Scene, builtin_scene, load_scene

PLACES_ON_PATH = 200
"""How many places on a camera path a visit's camera is drawn from."""


def scene_of(scene: str | Scene, game: bool) -> Scene:
    """A scene from itself, the name of a built-in one, or a scene file.

    Raises:
        OptionError: it is none of these, or has nothing to move, or no fixed object for the game's shed.
        SceneError: the file cannot be used.
    """
    if isinstance(scene, str):
        found = load_scene(Path(scene)) if scene.endswith(".json") else _builtin(scene)
    elif isinstance(scene, Scene):
        found = scene
    else:
        raise OptionError("scene", "must be a Scene, the name of a built-in one, or a .json file", scene)
    if not found.layout.movable.any():
        raise OptionError("scene", "must hold something that can be moved", found.name)
    if game and not found.layout.fixed.any():
        raise OptionError("scene", "must hold a fixed object, the shed, to play the game", found.name)
    return found


def given_layout(scene: Scene, given: Layout | Mapping[str, Any]) -> Layout:
    """The layout asked for.

    Raises:
        OptionError: it is not an arrangement of the scene's objects.
    """
    try:
        if isinstance(given, Layout):
            if given.labels != scene.layout.labels:
                raise OptionError("labels", "must be the scene's", list(given.labels))
            given = {"position": given.position, "yaw": given.yaw}
        if given.keys() != {"position", "yaw"}:
            raise OptionError("keys", "must be position and yaw", list(given))
        layout = scene.layout.with_poses(*(_real(name, given[name]) for name in ("position", "yaw")))
        if layout.batch_shape:
            raise OptionError("position", f"must have shape ({len(layout)}, 2)", layout.position.shape)
        return layout
    except (InputError, AttributeError, TypeError, ValueError, OverflowError) as problem:
        expected = 'must be a Layout of the scene\'s objects or {"position": (N, 2), "yaw": (N,)}'
        raise OptionError("options.layout", f"{expected} ({problem})", type(given).__name__) from None


def given_camera(given: Camera | Mapping[str, Any], fov: FieldOfView) -> Camera:
    """The camera asked for.

    Args:
        given: it, or its fields.
        fov: what it sees if that is not given.

    Raises:
        OptionError: what was asked for is no camera.
    """
    try:
        if isinstance(given, Camera):
            camera = given
        else:
            values = {n: v if n == "fov" or v is None else _real(n, v) for n, v in given.items()}
            seen: Any = values.pop("fov", fov)
            camera = Camera(fov=FieldOfView(**seen) if isinstance(seen, Mapping) else seen, **values)
            if not isinstance(camera.fov, FieldOfView):
                raise OptionError("fov", "must be a FieldOfView or a mapping of its fields", camera.fov)
        if camera.batch_shape:
            raise OptionError("yaw", "must be one number", camera.yaw.tolist())
        return camera
    except (InputError, AttributeError, TypeError, ValueError, OverflowError) as problem:
        expected = 'must be one Camera or {"position", "yaw"} with "height", "pitch" and "fov" optional'
        raise OptionError("options.camera", f"{expected} ({problem})", type(given).__name__) from None


def _real(name: str, values: Any) -> FloatArray:
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
        raise OptionError(name, "must be real numbers", array.dtype.name)
    return array.astype(np.float64)


class VisitCameras:
    """The cameras of visits: a player's head at the table; on a plain scene poses on its camera path.

    Args:
        scene: the room. A plain one with a camera path has its own field of view.
        fov: the headset's.
        game: whether the game is played.
    """

    def __init__(self, scene: Scene, fov: FieldOfView, game: bool) -> None:
        path = None if game else scene.camera_path
        self.fov = fov if path is None else scene.fov
        self._scene = scene
        self._on_path = None if path is None else path.cameras(PLACES_ON_PATH, scene.fov)

    def draw(self, rng: np.random.Generator) -> Camera:
        """One at random."""
        if self._on_path is None:
            return random_camera(self._scene, self.fov, rng)
        return self._on_path.at(int(rng.integers(PLACES_ON_PATH)))


def new_world(
    scene: Scene, layout: Layout, camera: Camera, options: EnvOptions, rng: np.random.Generator
) -> World:
    """The game, or the plain scene, with everything where it starts."""
    make_reid, perception = reid_factory(options.reid), perception_of(options.perception)
    if options.head_noise_deg > 0:
        perception = UnsteadyHead(perception, float(np.deg2rad(options.head_noise_deg)))
    if options.game:
        return FarmGame(
            scene,
            camera,
            rng,
            layout,
            make_reid,
            perception,
            animals_a_second=options.animals_a_second,
        )
    return PlainScene(layout, camera, Tracker(scene, layout, make_reid, perception), rng)


def _builtin(name: str) -> Scene:
    return builtin_scene(known_name("scene", name, BUILTIN))
