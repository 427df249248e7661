"""The farm of the Farm-to-Table game (section 4.3.1, Fig. 16), rebuilt on a table of 1.2 x 0.8 m."""

from __future__ import annotations

import numpy as np

from farm_ar.scenes.builtin.furniture import Model, Piece, Point, furnish
from farm_ar.scenes.camera import Camera, FieldOfView
from farm_ar.scenes.scene import Scene, Weights

TABLE = (1.2, 0.8)
"""Width and depth of the table top, metres."""

S1, S2, S3, S4 = (0.33, 0.45), (0.60, 1.10), (0.60, -0.30), (0.90, 0.45)
"""The sites: two on the table, one behind it, and S3, where the player stands."""

EYE_HEIGHT = 0.45
"""Height of the player's eyes above the table, metres."""

HEADSET_VIEW = FieldOfView.symmetric(np.deg2rad(64.7), 1.5)
"""The video camera of a HoloLens 2, 64.7 degrees wide; without a range in the paper, beyond the far edge."""

COOP, HUTCH = Model("coop", (0.10, 0.08, 0.09)), Model("hutch", (0.09, 0.07, 0.07))
SHED = Model("shed", (0.20, 0.14, 0.16))


def gaze(eye: Point, target: Point) -> Camera:
    """The player's camera at `eye`, level with the player's eyes and aimed at `target` on the table top."""
    dx, dz = target[0] - eye[0], target[1] - eye[1]
    pitch = -np.arctan2(EYE_HEIGHT, np.hypot(dx, dz))
    return Camera(np.array(eye), np.arctan2(dx, dz), HEADSET_VIEW, np.array(EYE_HEIGHT), pitch)


FACING_S1, FACING_S4 = gaze(S3, S1), gaze(S3, S4)
"""The two gazes of the paper's demonstrations (Figs. 17 and 18), from where the player stands.

Facing S1: the whole shed and the three coops and three hutches around S1. Facing S4: part of the shed and the
two coops and two hutches around S4.
"""


def farm() -> Scene:
    """Farm on a table: five coops and five hutches around two sites, and a fixed shed."""
    # Doors look away from the player, to where the animals come from.
    pieces = [
        Piece(COOP, 0.185, 0.26, 14.0, "yellow-coop"),
        Piece(COOP, 0.42, 0.345, -6.0, "blue-coop"),
        Piece(COOP, 0.15, 0.56, 21.0, "red-coop"),
        Piece(COOP, 0.815, 0.31, -17.0, "orange-coop"),
        Piece(COOP, 1.0, 0.575, -23.0, "green-coop"),
        Piece(HUTCH, 0.335, 0.21, 3.0, "cyan-hutch"),
        Piece(HUTCH, 0.26, 0.405, 18.0, "magenta-hutch"),
        Piece(HUTCH, 0.315, 0.55, 9.0, "purple-hutch"),
        Piece(HUTCH, 0.98, 0.37, -20.0, "white-hutch"),
        Piece(HUTCH, 0.845, 0.53, -12.0, "brown-hutch"),
        Piece(SHED, 0.46, 0.71, 180.0, "shed", fixed=True),
    ]
    return furnish("farm", TABLE, pieces, [S1, S2, S3, S4], fov=HEADSET_VIEW, weights=Weights(1.0, 1.0))
