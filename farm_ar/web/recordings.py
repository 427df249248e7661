"""Recordings that a page plays with a scrubber: demonstrations, and episodes from their traces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from farm_ar.drawing.game.colours import Image
from farm_ar.envs import FarmToTableEnv
from farm_ar.errors import OptionError
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.game_logic.render_state import RenderState
from farm_ar.reid import ReidFactory, SpatialReid
from farm_ar.scenes import Layout, Scene
from farm_ar.showcases import Film, ScriptRecorder, builtin_scripts, load_script
from farm_ar.showcases.film import Row
from farm_ar.web.messages import FRAMES_PER_SECOND, Json, told_answers, told_moment, told_scene

MOST_FRAMES = 6000
"""Of a recording; a longer game keeps its first ten minutes."""

_NO_PICTURE: Image = np.zeros((1, 1, 3), dtype=np.uint8)


def demonstrations() -> dict[str, str]:
    """The demonstrations that come with farm-ar: their names, and what they are called."""
    return {name: load_script(name).title for name in builtin_scripts()}


def recorded_script(name: str, make_reid: ReidFactory = SpatialReid) -> Json:
    """A demonstration, as JSON values.

    Raises:
        ScriptError: there is none of that name.
    """
    script = load_script(name)
    collector = _Collector(script.scene.layout)
    recorder = ScriptRecorder(script, make_reid, lambda scene: collector)
    collector.film = recorder.film
    recorder.play()
    return {**_recording(script.scene, collector.frames), "title": script.title}


class _Collector:
    """Keeps moments in place of drawing them, a third of them, and the answers of snapshots with them.

    Args:
        layout: of the objects.
    """

    def __init__(self, layout: Layout) -> None:
        self.film: Film | None = None
        self.frames: list[Json] = []
        self._layout, self._seen, self._said = layout, 0, 0

    def frame(self, moment: RenderState) -> Image:
        if self._seen % (30 // FRAMES_PER_SECOND) == 0 and len(self.frames) < MOST_FRAMES:
            self.frames.append(told_moment(moment))
            rows = [] if self.film is None else self.film.detections[self._said :]
            if rows:
                self._said += len(rows)
                self.frames[-1]["snapshot"] = self._answers(rows)
        self._seen += 1
        return _NO_PICTURE

    def _answers(self, rows: list[Row]) -> Json:
        return {
            "kind": "snapshot",
            "number": rows[0]["visit"],
            "detections": [
                {
                    "object": -1 if row["truth"] is None else self._layout.index(str(row["truth"])),
                    "label": row["given"],
                    "confidence": None,
                    "right": row["given"] == row["truth"],
                }
                for row in rows
            ],
        }


def recorded_trace(trace: Mapping[str, Any]) -> Json:
    """An episode of an environment with the game, as JSON values.

    Args:
        trace: as `FarmToTableEnv.trace` gives it.

    Raises:
        OptionError: it is of an environment without the game.
    """
    env = FarmToTableEnv(**trace["arguments"])
    if not env.config.game:
        raise OptionError("game", "must be True to be shown", False)
    env.np_random.bit_generator.state = trace["generator"]
    env.reset(options=trace["options"])
    frames, every = [_moment(env, [], 0)], 1
    if env.config.control == "hand":
        every = max(1, env.config.steps_per_second // FRAMES_PER_SECOND)
    said = 0
    for step, action in enumerate(trace["actions"], start=1):
        env.step(np.asarray(action))
        if step % every == 0 and len(frames) < MOST_FRAMES:
            frames.append(_moment(env, frames, said))
            said = len(_game(env).sightings)
    return {**_recording(_game(env).scene, frames), "title": f"{len(trace['actions'])} steps"}


def _game(env: FarmToTableEnv) -> FarmGame:
    world = env.world
    assert isinstance(world, FarmGame)
    return world


def _moment(env: FarmToTableEnv, frames: list[Json], said: int) -> Json:
    """A moment, with the answers of a snapshot that has come since the last one."""
    game = _game(env)
    moment = told_moment(game.render_state())
    if len(game.sightings) > said:
        moment["snapshot"] = told_answers(game.sightings[-1], game.truth.labels, len(game.sightings))
    return moment


def _recording(scene: Scene, frames: list[Json]) -> Json:
    return {"kind": "recording", "rate": FRAMES_PER_SECOND, **told_scene(scene), "frames": frames}
