"""What a wrong answer does to the game: animals that go wrong, and labels that lie."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from farm_ar.agents.cases import Case
from farm_ar.arrays import FloatArray
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.game_logic.tracker import ReidFactory, Tracker

PLAY_SECONDS = 8.0
"""How long the game is played on after the snapshot."""


class Harm(NamedTuple):
    """What a snapshot does to the game.

    Args:
        endpoint_error_m: from where labels are believed to be to where their own objects are, summed, metres.
        miscounts: animals in the seconds after it that did not get into the building of their colour, or None
            in a scene without the game's shed.
    """

    endpoint_error_m: float
    miscounts: int | None


def harm_of(
    case: Case, make: ReidFactory, position: FloatArray, yaw: FloatArray, rng: np.random.Generator
) -> Harm:
    """What becomes of a game in which objects were moved, unseen, to other poses, and a snapshot was taken.

    Args:
        case: where everything is known to be, and the camera.
        make: makes the re-identifier.
        position: (N, 2) where the objects then are, metres.
        yaw: (N,) how they are then turned.
        rng: where the game's randomness comes from.
    """
    truth = case.layout.with_poses(position, yaw)
    if not case.layout.fixed.any():
        tracker = Tracker(case.scene, case.layout, make)
        tracker.look(truth, case.camera, rng)
        return Harm(float(tracker.belief.endpoint_error(truth).sum()), None)
    game = FarmGame(case.scene, case.camera, rng, case.layout, make)
    game.rearrange(truth)
    before = game.miscounts
    game.end_visit()
    game.play(PLAY_SECONDS)
    error = float(game.tracker.belief.endpoint_error(truth).sum())
    return Harm(error, int(game.miscounts - before))
