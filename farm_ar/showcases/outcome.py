"""The state after a script, without a film of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from farm_ar.game_logic.render_state import RenderState
from farm_ar.reid import ReidFactory, SpatialReid
from farm_ar.showcases.film import FPS, Film, Image, ScriptRecorder
from farm_ar.showcases.script import Script

_NOTHING: Image = np.zeros((1, 1, 3), np.uint8)


class _Last:
    """In place of pictures: the last state."""

    state: RenderState

    def frame(self, state: RenderState) -> Image:
        self.state = state
        return _NOTHING


def outcome(
    script: Script, make_reid: ReidFactory = SpatialReid, to_the_end: bool = False
) -> tuple[Film, RenderState]:
    """Play a script and draw nothing.

    Args:
        script: what happens.
        make_reid: makes the re-identifier for the scene as it is believed to be.
        to_the_end: whether the play after the last visit is played too, and not one frame of it only.

    Returns:
        What was noted, and the last state.
    """
    last = _Last()
    ending = script.ending if to_the_end else 1 / FPS
    film = ScriptRecorder(replace(script, ending=ending), make_reid, lambda scene: last).play()
    return film, last.state
