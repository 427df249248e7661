"""Scripts of a game, in TOML: the scene, and the hand's moves in each visit."""

from __future__ import annotations

import os
import tomllib
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.arrays import POSITION, SECONDS, FloatArray
from farm_ar.errors import InputError
from farm_ar.game_logic.events import GATE, STAIRS, Parts
from farm_ar.game_logic.headset import FIELDS_OF_VIEW
from farm_ar.game_logic.live import UPDATES
from farm_ar.scenes import BUILTIN, Layout, Scene, builtin_scene, load_scene
from farm_ar.scenes.documents import Document, Listing, Object
from farm_ar.scenes.files import read_text
from farm_ar.scenes.kinds import DEGREES, Number, Numbers, Text, Whole, radians


class ScriptError(InputError):
    """A script that cannot be used."""


_POINT = Numbers(2, POSITION, "[x, z] in metres, from -1e6 to 1e6", default=None)

SCRIPT = Document(
    "game script",
    Object(
        {
            "title": Text(default=None, about="The file's name without its ending if left out."),
            "scene": Text(default="farm", about="farm, or a scene file beside this one with a fixed object."),
            "gaze": Text(default="sweep", about="The site that the player looks at, or sweep."),
            "visits": Listing(
                Object(
                    {
                        "moves": Listing(
                            Object(
                                {
                                    "building": Text(about="The label of what is carried."),
                                    "to": _POINT,
                                    "by": _POINT,
                                    "turn_deg": Number(DEGREES, default=0.0, about="Clockwise."),
                                    "caption": Text(default=None),
                                }
                            )
                        ),
                        "changes": Listing(
                            Object(
                                {
                                    "part": Text((GATE, STAIRS), about="What the hand changes."),
                                    "of": Text(about="Whose: the shed, or the label of a coop."),
                                    "to": Text(("open", "closed", "off", "on"), about="How it stands then."),
                                    "caption": Text(default=None),
                                }
                            ),
                            default=(),
                            about="What the hand opens, closes, takes off or puts back, after the moves.",
                        ),
                        "play_s": Number(SECONDS, default=4.0, about="Play before the hand comes."),
                    }
                )
            ),
            "seed": Whole(0, 2**63 - 1, default=0, about="Of the game's randomness."),
            "fov": Text(tuple(FIELDS_OF_VIEW), default="photo", about="The headset's field of view."),
            "gate": Text(("open", "closed"), default="open", about="The shed's at the start."),
            "ending_s": Number(SECONDS, default=5.0, about="Play after the last visit."),
            "update": Text(
                UPDATES, default="pause", about="pause: one look after a visit; live: all the time."
            ),
        },
        notes=True,
        about="A game: visits of the hand with its moves. TOML, in metres and degrees.",
    ),
    ScriptError,
)
"""What a script holds."""


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
class ScriptedChange:
    """A part of a real thing that the hand changes.

    Args:
        part: `GATE` or `STAIRS`.
        of: whose, a label.
        to: "open" or "closed" for a gate, "off" or "on" for stairs.
        caption: what is going on.
    """

    part: str
    of: str
    to: str
    caption: str = ""

    def done(self, parts: Parts, layout: Layout) -> Parts:
        """How the parts stand then."""
        index = layout.index(self.of)
        if self.part == GATE:
            return parts.with_gate(index, 1.0 if self.to == "open" else 0.0)
        return parts.with_stairs(index, self.to == "on")


@dataclass(frozen=True)
class ScriptedVisit:
    """Some play, then the hand's moves.

    Args:
        moves: in order.
        play: before the hand comes, seconds.
        changes: of parts, after the moves.
    """

    moves: tuple[ScriptedMove, ...]
    play: float = 4.0
    changes: tuple[ScriptedChange, ...] = ()


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
        update: when the game looks, one of `UPDATES`.
        gate: whether the shed's is "open" or "closed" at the start.
    """

    title: str
    scene: Scene
    gaze: str
    visits: tuple[ScriptedVisit, ...]
    seed: int = 0
    fov: str = "photo"
    ending: float = 5.0
    update: str = "pause"
    gate: str = "open"

    @property
    def watches_parts(self) -> bool:
        """Whether parts of real objects matter in it."""
        return self.gate != "open" or any(visit.changes for visit in self.visits)


def builtin_scripts() -> dict[str, Path]:
    """The scripts that come with farm-ar, by name."""
    folder = Path(str(files("farm_ar.showcases").joinpath("scripts")))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def _further_scripts() -> dict[str, Path]:
    """Scripts that come with farm-ar beside the paper's demonstrations, by name."""
    folder = Path(str(files("farm_ar.showcases").joinpath("scripts", "more")))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def load_script(path: str | os.PathLike[str]) -> Script:
    """Read a script: a TOML file, or the name of one that comes with farm-ar.

    Raises:
        ScriptError: it cannot be read, or a value in it cannot be used; names the file and the field.
        SceneError: its scene file cannot be used.
    """
    file = (builtin_scripts() | _further_scripts()).get(str(path), Path(path))
    if not file.exists():
        expected = f"must be a readable TOML file or one of {', '.join(builtin_scripts())}"
        raise ScriptError("script", expected, str(path))
    return parse_script(read_text(file, ScriptError, "TOML"), file.parent, file.name)


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
    except (ValueError, RecursionError) as problem:
        raise ScriptError("file", "must be TOML", str(problem), source) from None
    values = SCRIPT.read(data, source)
    scene = _scene(values["scene"], folder, source)
    gazes = ("sweep", *(site.name for site in scene.sites)) if scene.sites else ()
    if values["gaze"] not in gazes:
        expected = (
            f"must be one of {', '.join(gazes)}" if gazes else "must be a site, of which the scene has none"
        )
        raise SCRIPT.fail(("gaze",), expected, values["gaze"], source)
    visits = []
    for i, visit in enumerate(values["visits"]):
        moves = [_move(m, scene, ("visits", i, "moves", k), source) for k, m in enumerate(visit["moves"])]
        changes = [
            _change(c, scene, ("visits", i, "changes", k), source) for k, c in enumerate(visit["changes"])
        ]
        visits.append(ScriptedVisit(tuple(moves), visit["play_s"], tuple(changes)))
    return Script(
        title=values["title"] or Path(source).stem,
        scene=scene,
        gaze=values["gaze"],
        visits=tuple(visits),
        seed=values["seed"],
        fov=values["fov"],
        ending=values["ending_s"],
        update=values["update"],
        gate=values["gate"],
    )


def _scene(name: str, folder: Path, source: str) -> Scene:
    scene = builtin_scene(name) if name in BUILTIN else None
    if scene is None and name.endswith(".json"):
        scene = load_scene(folder / name)
    if scene is None or not scene.layout.fixed.any():
        expected = 'must be "farm" or a scene file with a fixed object for a shed'
        raise SCRIPT.fail(("scene",), expected, name, source)
    return scene


def _move(values: dict[str, Any], scene: Scene, place: tuple[str | int, ...], source: str) -> ScriptedMove:
    def fail(name: str, expected: str, got: object) -> InputError:
        return SCRIPT.fail((*place, name), expected, got, source)

    layout, building = scene.layout, values["building"]
    movable = [name for name, fixed in zip(layout.labels, layout.fixed, strict=True) if not fixed]
    if building not in movable:
        raise fail("building", f"must be one of {', '.join(movable)}", building)
    to, by, turn = values["to"], values["by"], radians(values["turn_deg"])
    if (to is None) == (by is None) and not (turn and to is None):
        raise fail("to", "must be given, or by, but not both", to)
    if to is not None and not all(0 <= v <= s for v, s in zip(to, scene.size, strict=True)):
        width, depth = scene.size
        expected = f"must lie on the table, x from 0 to {width:g} and z from 0 to {depth:g} metres"
        raise fail("to", expected, list(to))
    if to is None and by is None:
        by = (0.0, 0.0)
    return ScriptedMove(building, to, by, turn, values["caption"] or f"The hand moves {building}")


def _change(
    values: dict[str, Any], scene: Scene, place: tuple[str | int, ...], source: str
) -> ScriptedChange:
    layout, part, of, to = scene.layout, values["part"], values["of"], values["to"]
    names = {
        GATE: [name for name, fixed in zip(layout.labels, layout.fixed, strict=True) if fixed],
        STAIRS: [n for n, category in zip(layout.labels, layout.category, strict=True) if category == "coop"],
    }[part]
    states = ("open", "closed") if part == GATE else ("off", "on")
    if of not in names:
        raise SCRIPT.fail(
            (*place, "of"), f"must be one of {', '.join(names) or 'none that has any'}", of, source
        )
    if to not in states:
        raise SCRIPT.fail((*place, "to"), f"must be {' or '.join(states)} for {part}", to, source)
    return ScriptedChange(part, of, to, values["caption"] or f"{part} of {of}: {to}")
