"""How an episode begins: its scene, its starting layout, its cameras."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.envs.placement import Clearance, Placement, Strewing, strew
from farm_ar.errors import InputError, OptionError, known_name
from farm_ar.game_logic.headset import field_of_view, random_camera
from farm_ar.geometry import footprints_overlap
from farm_ar.scenes import BUILTIN, Camera, FieldOfView, Layout, Scene, builtin_scene, load_scene

if TYPE_CHECKING:
    from farm_ar.envs.config import EnvConfig

PLACES_ON_PATH = 200
"""How many places on a camera path a visit's camera is drawn from."""


def scene_of(scene: str | Scene, game: bool) -> Scene:
    """A scene from itself, the name of a built-in one, or a scene file, moved into the frame of its room.

    Raises:
        OptionError: it is none of these, or has nothing to move, or no fixed object for the game's shed.
        SceneError: the file cannot be used, the bounds are no rectangle, or a heading or a size is not known.
    """
    if isinstance(scene, str):
        found = load_scene(Path(scene)) if scene.endswith(".json") else _builtin(scene)
    elif isinstance(scene, Scene):
        found = scene
    else:
        raise OptionError("scene", "must be a Scene, the name of a built-in one, or a .json file", scene)
    found = found.in_room()
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


class Generator:
    """What episodes and visits begin with.

    Args:
        scene: the room.
        config: of the environment.
    """

    def __init__(self, scene: Scene, config: EnvConfig) -> None:
        self._scene = scene
        self._layouts = StartingLayouts(scene, config.jitter)
        self._cameras = VisitCameras(scene, field_of_view(config.fov), config.game)

    def begin(self, rng: np.random.Generator, options: Mapping[str, Any]) -> tuple[Layout, Camera]:
        """Layout and camera of an episode: those asked for, others at random, the layout first."""
        layout, camera = options.get("layout"), options.get("camera")
        return (
            self._layouts.draw(rng) if layout is None else given_layout(self._scene, layout),
            self.camera(rng) if camera is None else given_camera(camera, self._cameras.fov),
        )

    def camera(self, rng: np.random.Generator) -> Camera:
        """The camera of a visit."""
        return self._cameras.draw(rng)


def checked_options(options: Any) -> dict[str, Any]:
    """What `reset` was given.

    Raises:
        OptionError: it is no mapping of layout and camera.
    """
    if not isinstance(options, Mapping | None):
        raise OptionError("options", "must be a mapping with layout and camera, both optional", options)
    for name in options or {}:
        if name not in ("layout", "camera"):
            raise OptionError("options", "must hold layout and camera only", name)
    return dict(options or {})


def _builtin(name: str) -> Scene:
    return builtin_scene(known_name("scene", name, BUILTIN))


FARM_DIAGONAL_M = float(np.hypot(1.2, 0.8))
"""Lengths are given for the farm's table and scaled to the diagonal of other scenes."""

SPREADS = {"easy": (0.02, np.deg2rad(6.0)), "default": (0.05, np.deg2rad(15.0))}
"""SD of position, metres on the farm, and of yaw, radians."""

JITTERS = ("none", *SPREADS, "hard")
"""The ways to draw starting layouts."""

HARD_SEPARATION_M = 0.13
YAW_LIMIT = float(np.deg2rad(30.0))
GAP_M = 0.005
"""Room left between two footprints."""

TRIES = 50
"""Poses tried for an object before all are taken up and placed anew."""

RESTARTS = 100

ROOM_EACH = 0.6
"""Largest distance required between random places, in roots of the room that there is for each object."""


def unit_of(scene: Scene) -> float:
    """How much larger a scene is than the farm's table, by diagonal."""
    return scene.diagonal / FARM_DIAGONAL_M


class StartingLayouts:
    """A scene's layout with its movable objects strewn about.

    "none" leaves them; "easy" and "default" add normal noise to their places (SD .02 and .05 m) and headings
    (SD 6 and 15 degrees); "hard" draws places anywhere, .13 m apart or as far as there is room, and headings
    within 30 degrees of 0. All stay in the room. Objects whose footprints are apart in the scene's own layout
    stay so; where no such layout is found, it is the scene's own.

    Args:
        scene: the room.
        jitter: one of those names.

    Attributes:
        edge: (M, 2) how far from the edges of the room objects keep, metres.
        keeps_clear: (M, M) pairs whose footprints must not overlap.
        apart: distance required between random places at first, metres.
    """

    def __init__(self, scene: Scene, jitter: str) -> None:
        layout, unit = scene.layout, unit_of(scene)
        self._scene, self._jitter = scene, jitter
        self._movable = np.flatnonzero(layout.movable)
        diagonal = np.hypot(layout.size[:, 0], layout.size[:, 2])
        self.edge = np.minimum(diagonal[:, None] / 2, np.divide(scene.size, 2))
        place, turned = layout.position[:, None], layout.yaw[:, None]
        overlap = footprints_overlap(
            place, turned, layout.size[:, None], layout.position, layout.yaw, layout.size
        )
        self.keeps_clear = ~overlap | (jitter == "hard")
        room = scene.area / len(layout)
        self._size, (metres, radians) = layout.size.copy(), SPREADS.get(jitter, (0.0, 0.0))
        self._how = Strewing(
            jitter == "hard",
            layout.position.copy(),
            layout.yaw.copy(),
            self.edge,
            np.array(scene.size, dtype=np.float64),
            (metres * unit, float(radians)),
            YAW_LIMIT,
        )
        self.apart = min(HARD_SEPARATION_M * unit, ROOM_EACH * float(np.sqrt(room)))

    def draw(self, rng: np.random.Generator) -> Layout:
        """One at random."""
        layout = self._scene.layout
        if self._jitter == "none":
            return layout
        hard = self._jitter == "hard"
        for restart in range(RESTARTS):
            turns = rng.permutation(self._movable)
            shape = (len(turns), TRIES, 3)
            drawn = rng.random(shape) if hard else rng.normal(size=shape)
            apart = self.apart * 0.9 ** (restart // 10) if hard else 0.0
            so_far = Placement(layout.position.copy(), layout.yaw.copy(), layout.fixed.copy())
            room = Clearance(self._size, self.keeps_clear, GAP_M, apart)
            if strew(turns, drawn, self._how, so_far, room):
                return layout.placed(so_far.position, so_far.yaw)
        return layout
