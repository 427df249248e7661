"""Scripts of a game, in TOML: who is where, and what the hand does on each visit."""

from __future__ import annotations

import os
import tomllib
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import InputError
from farm_ar.game_logic.headset import FIELDS_OF_VIEW, gaze_target
from farm_ar.scenes import BUILTIN, Layout, Scene, builtin_scene, load_scene
from farm_ar.scenes.fields import NOTHING, Fields


class ScriptError(InputError):
    """A script that cannot be used."""


@dataclass(frozen=True)
class ScriptedMove:
    """One pick-and-place.

    Args:
        building: the label of what is moved.
        to: x and z where it goes, metres; None where `by` says how far.
        by: how far it goes in x and z, metres; None where `to` says where.
        turn: clockwise, radians.
        caption: what is going on.
    """

    building: str
    to: tuple[float, float] | None
    by: tuple[float, float] | None
    turn: float = 0.0
    caption: str = ""

    def displacement(self, layout: Layout) -> FloatArray:
        """(2,) metres from where the building is in a layout."""
        if self.by is not None:
            return np.array(self.by)
        here: FloatArray = layout.position[layout.index(self.building)]
        return np.array(self.to) - here


@dataclass(frozen=True)
class ScriptedVisit:
    """Some play, then the hand's moves.

    Args:
        moves: in order.
        play: before the hand comes, seconds.
    """

    moves: tuple[ScriptedMove, ...]
    play: float = 4.0


@dataclass(frozen=True)
class Script:
    """A game from its beginning to its end.

    Args:
        title: its name.
        scene: the table.
        gaze: the site that the player looks at, or "sweep".
        visits: in order.
        seed: of the game's randomness.
        fov: the headset's field of view, a name in `FIELDS_OF_VIEW`.
        ending: play after the last visit, seconds.
    """

    title: str
    scene: Scene
    gaze: str
    visits: tuple[ScriptedVisit, ...]
    seed: int = 0
    fov: str = "photo"
    ending: float = 5.0


def builtin_scripts() -> dict[str, Path]:
    """The scripts that come with farm-ar, by name."""
    folder = Path(str(files("farm_ar.showcases").joinpath("scripts")))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def load_script(path: str | os.PathLike[str]) -> Script:
    """Read a script: a TOML file, or the name of one that comes with farm-ar.

    Raises:
        ScriptError: it cannot be read, or a value in it cannot be used; names the file and the field.
        SceneError: its scene file cannot be used.
    """
    file = builtin_scripts().get(str(path), Path(path))
    try:
        text = file.read_text(encoding="utf-8")
    except OSError as problem:
        known = ", ".join(builtin_scripts())
        expected = f"must be a readable TOML file or one of {known}"
        raise ScriptError("script", expected, str(path)) from problem
    except UnicodeDecodeError as problem:
        raise ScriptError("file", "must be TOML", str(problem), file.name) from None
    return parse_script(text, file.parent, file.name)


def parse_script(text: str, folder: Path, source: str) -> Script:
    """A script from its text.

    Args:
        text: TOML.
        folder: where scene files are looked for.
        source: what errors call it; without its ending, the title where the text has none.

    Raises:
        ScriptError: it is not TOML, or a value in it cannot be used; names the source and the field.
        SceneError: its scene file cannot be used.
    """
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        raise ScriptError("file", "must be TOML", str(problem), source) from None
    fields = Fields(data, ScriptError, source)
    scene = _scene(fields, folder)
    script = Script(
        title=fields.text("title", Path(source).stem),
        scene=scene,
        gaze=_name(fields, "gaze", ("sweep", *(site.name for site in scene.sites)), "sweep"),
        visits=tuple(_visit(item, scene) for item in fields.children("visits")),
        seed=_whole(fields, "seed", 0),
        fov=_name(fields, "fov", tuple(FIELDS_OF_VIEW), "photo"),
        ending=_not_negative(fields, "ending_s", 5.0),
    )
    fields.finish()
    gaze_target(scene, script.gaze)
    return script


def _scene(fields: Fields, folder: Path) -> Scene:
    name = fields.text("scene", "farm")
    scene = builtin_scene(name) if name in BUILTIN else None
    if scene is None and name.endswith(".json"):
        scene = load_scene(folder / name)
    if scene is None or not scene.layout.fixed.any():
        expected = 'must be "farm" or a scene file with a fixed object for a shed'
        raise fields.fail("scene", expected, name)
    return scene


def _visit(fields: Fields, scene: Scene) -> ScriptedVisit:
    moves = tuple(_move(item, scene) for item in fields.children("moves"))
    visit = ScriptedVisit(moves, _not_negative(fields, "play_s", 4.0))
    fields.finish()
    return visit


def _move(fields: Fields, scene: Scene) -> ScriptedMove:
    layout = scene.layout
    movable = tuple(name for name, fixed in zip(layout.labels, layout.fixed, strict=True) if not fixed)
    building = _name(fields, "building", movable)
    places = {name: _point(fields, name) if fields.has(name) else None for name in ("to", "by")}
    turn = float(np.deg2rad(fields.number("turn_deg", 0.0)))
    if (places["to"] is None) == (places["by"] is None) and not (turn and places["to"] is None):
        raise fields.fail("to", "must be given, or by, but not both", places["to"])
    if places["to"] is not None and not all(
        0 <= v <= s for v, s in zip(places["to"], scene.size, strict=True)
    ):
        width, depth = scene.size
        expected = f"must lie on the table, x from 0 to {width:g} and z from 0 to {depth:g} metres"
        raise fields.fail("to", expected, list(places["to"]))
    if places["to"] is None and places["by"] is None:
        places["by"] = (0.0, 0.0)
    caption = fields.text("caption", f"The hand moves {building}")
    fields.finish()
    return ScriptedMove(building, places["to"], places["by"], turn, caption)


def _point(fields: Fields, name: str) -> tuple[float, float]:
    value = fields.raw(name)
    numbers = isinstance(value, list) and all(
        isinstance(v, int | float) and not isinstance(v, bool) and np.isfinite(v) for v in value
    )
    if not (numbers and len(value) == 2):
        raise fields.fail(name, "must be [x, z] in metres", value)
    return float(value[0]), float(value[1])


def _name(fields: Fields, name: str, known: tuple[str, ...], default: object = NOTHING) -> str:
    value = fields.text(name, default)
    if value not in known:
        raise fields.fail(name, f"must be one of {', '.join(known)}", value)
    return value


def _not_negative(fields: Fields, name: str, default: float) -> float:
    value = fields.number(name, default)
    if value < 0:
        raise fields.fail(name, "must not be negative", value)
    return value


def _whole(fields: Fields, name: str, default: int) -> int:
    _not_negative(fields, name, default)
    value = fields.raw(name, default)
    if value != int(value):
        raise fields.fail(name, "must be a whole number", value)
    return int(value)
