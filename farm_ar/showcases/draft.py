"""A script while it is being written, line by line, as a player enters moves."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from farm_ar.arrays import number_in
from farm_ar.errors import InputError
from farm_ar.showcases.script import Script, parse_script

MOVES = "BUILDING to X Z [turn DEGREES], BUILDING by X Z [turn DEGREES] or BUILDING turn DEGREES"
"""What a line may say."""


class MoveError(InputError):
    """A line that says no move."""


class Draft:
    """The text of a script, to which moves are added; it is always one that can be played.

    Args:
        scene: a name of a built-in scene, or the path of a scene file.
        gaze: the site that the player looks at, or "sweep".
        seed: of the game's randomness.

    Raises:
        ScriptError: the scene or the gaze cannot be used.
    """

    def __init__(self, scene: str = "farm", gaze: str = "S1", seed: int = 0) -> None:
        place = scene if not scene.endswith(".json") else str(Path(scene).resolve())
        rows = ('title = "A game by hand"', f"scene = {json.dumps(place)}", f"gaze = {json.dumps(gaze)}")
        self._head = "\n".join((*rows, f"seed = {seed}", ""))
        self._visits: list[list[str]] = []
        self.script()

    @property
    def visits(self) -> int:
        """How many visits there are."""
        return len(self._visits)

    def begin_visit(self) -> None:
        """The next moves belong to a new visit."""
        self._visits.append([])

    def drop_visit(self) -> None:
        """Forget the last visit."""
        self._visits.pop()

    def add(self, line: str) -> None:
        """Add a move to the last visit.

        Args:
            line: as `MOVES` says.

        Raises:
            MoveError: it says no move.
            ScriptError: the move cannot be made; it is not added then.
        """
        self._visits[-1].append(_move(line))
        try:
            self.script()
        except InputError:
            self._visits[-1].pop()
            raise

    def text(self) -> str:
        """The script as TOML."""
        visits = [
            "\n[[visits]]\n" + ("".join(f"\n[[visits.moves]]\n{move}" for move in visit) or "moves = []\n")
            for visit in self._visits
        ]
        return self._head + ("".join(visits) or "visits = []\n")

    def script(self) -> Script:
        """What has been written so far."""
        return parse_script(self.text(), Path(), "the game")


def _move(line: str) -> str:
    """The TOML of one move."""
    building, *words = line.split()
    said: dict[str, list[float]] = {}
    while words:
        word, count = words[0], 1 if words[0] == "turn" else 2
        values = _numbers(words[1 : 1 + count])
        if word not in ("to", "by", "turn") or word in said or len(values) != count:
            raise MoveError("move", f"must be {MOVES}", line)
        said[word], words = values, words[1 + count :]
    if not said or {"to", "by"} <= said.keys():
        raise MoveError("move", f"must be {MOVES}", line)
    rows = [f"building = {json.dumps(building)}"]
    rows += [f"{word} = [{said[word][0]}, {said[word][1]}]" for word in ("to", "by") if word in said]
    rows += [f"turn_deg = {said['turn'][0]}" for word in said if word == "turn"]
    return "\n".join(rows) + "\n"


def _numbers(words: list[str]) -> list[float]:
    """The finite numbers with which words begin."""
    values = []
    for word in words:
        value = number_in(word)
        if value is None or not np.isfinite(value):
            break
        values.append(value)
    return values
