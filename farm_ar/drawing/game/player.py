"""The player: from above a head with a headset, a hand and a forearm; in space the hand and its arm."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import INK, SKIN, SLEEVE, Image, darker, lighter
from farm_ar.drawing.game.overlays import outline, tint_area
from farm_ar.drawing.game.shapes import Art, Part, box, disc, ellipse, stroke
from farm_ar.drawing.game.sprites import SHIFT, fixed_point, paste_art
from farm_ar.drawing.game.viewport import Viewport
from farm_ar.game_logic.physics.gripper import HandState
from farm_ar.rendering import Instance, model
from farm_ar.rendering.shapes import mesh_of, tube

_HAIR = (86, 60, 42)
_HEADSET = (44, 48, 56)
_VISOR = (104, 178, 224)

ELBOW_Z = -0.45
"""Where the forearm begins, on the player's side, metres."""

_LOW_M, _RAISED_M = 0.085, 0.15
"""How high above the table the hand is drawn."""


@lru_cache(maxsize=1)
def head() -> Art:
    """A head with its headset on, 10 cm across, its eyes at the middle of the drawing."""
    angle = np.linspace(-1.05, 1.05, 15)
    visor = np.stack([0.058 * np.sin(angle), -0.060 + 0.062 * np.cos(angle)], axis=1)
    parts = (
        ellipse(-0.058, -0.062, 0.011, 0.016, SKIN),
        ellipse(0.058, -0.062, 0.011, 0.016, SKIN),
        ellipse(0.0, -0.066, 0.056, 0.064, _HAIR),
        ellipse(-0.014, -0.078, 0.020, 0.028, lighter(_HAIR, 0.16), 0.4),
        stroke([(-0.056, -0.070), (0.0, -0.056), (0.056, -0.070)], _HEADSET, 0.014),
        stroke(visor, _HEADSET, 0.036),
        stroke(visor, _VISOR, 0.015),
    )
    return Art(parts, 0.004, INK, 0.012).scaled(0.85)


@lru_cache(maxsize=2)
def hand_art(closed: bool) -> Art:
    """A right hand from above, its fingers ahead; closed around something or open."""
    crease = darker(SKIN, 0.22)
    if closed:
        fingers = [stroke([(x, 0.012), (x, 0.031)], SKIN, 0.0135) for x in (-0.021, -0.007, 0.007, 0.021)]
        details = [stroke([(x, 0.008), (x, 0.026)], crease, 0.0018) for x in (-0.014, 0.0, 0.014)]
        thumb = stroke([(-0.022, -0.012), (-0.034, 0.006), (-0.026, 0.020)], SKIN, 0.0140)
    else:
        fingers, details = _open_fingers()
        thumb = stroke([(-0.020, -0.012), (-0.040, 0.006), (-0.048, 0.024)], SKIN, 0.0135)
    parts = (
        box(-0.021, -0.050, 0.021, -0.010, SKIN),
        *fingers,
        thumb,
        ellipse(0.0, 0.0, 0.030, 0.029, SKIN),
        *details,
        stroke([(-0.015, 0.004), (0.012, -0.010)], crease, 0.0014),
    )
    return Art(parts, 0.0030, darker(SKIN, 0.62), 0.010)


def _open_fingers() -> tuple[list[Part], list[Part]]:
    tips = ((-0.030, 0.052), (-0.011, 0.064), (0.010, 0.063), (0.029, 0.050))
    bases = ((-0.019, 0.014), (-0.007, 0.018), (0.007, 0.018), (0.019, 0.014))
    fingers = [stroke([base, tip], SKIN, 0.0125) for base, tip in zip(bases, tips, strict=True)]
    return fingers, [disc(x, z + 0.002, 0.0030, lighter(SKIN, 0.35)) for x, z in tips]


def draw_hand(image: Image, hand: HandState, viewport: Viewport) -> None:
    """The hand and the forearm that leads to it from the player's side."""
    grown = 1.10 if hand.raised else 1.0
    place = np.asarray(hand.position, dtype=np.float64)
    arm = _part_of_arm(place, -0.03, 0.021 * grown, 0.040 * grown)
    if hand.raised:
        tint_area(image, viewport.pixels(arm + np.array([0.03, -0.02])), (0, 0, 0), 0.22)
    for points, colour in ((arm, SKIN), (_part_of_arm(place, -0.20, 0.035 * grown, 0.050 * grown), SLEEVE)):
        pixels = viewport.pixels(points)
        cv2.fillConvexPoly(image, fixed_point(pixels), colour, cv2.LINE_AA, SHIFT)
        outline(image, pixels, darker(colour, 0.55), max(1, round(0.003 * viewport.scale)))
    x, y = viewport.pixels(place)
    scale = round(grown * viewport.scale, 3)
    paste_art(image, hand_art(hand.gripped is not None), float(x), float(y), scale, hand.yaw, step=2.5)


def hand_in_space(hand: HandState, number: int) -> list[Instance]:
    """The hand and the arm that leads to it from the player's side, above the buildings.

    Args:
        hand: where it is.
        number: what pictures call it.
    """
    x, z = (float(value) for value in hand.position)
    height = _RAISED_M if hand.raised else _LOW_M
    wrist = np.array([x, height + 0.012, z - 0.018])
    elbow = np.array([x + 0.04, height + 0.10, min(z - 0.30, ELBOW_Z)])
    cuff = wrist + 0.16 * (elbow - wrist) / np.linalg.norm(elbow - wrist)
    arm = tube(wrist, cuff, 0.022, 0.030, SKIN, 12)
    arm += tube(cuff - 0.1 * (cuff - wrist), elbow, 0.036, 0.052, SLEEVE, 12)
    fist = model("hand-closed" if hand.gripped is not None else "hand-open").only("hand")
    return [
        Instance(fist, np.array([x, height, z]), hand.yaw, number),
        Instance(mesh_of(arm), np.zeros(3), number=number),
    ]


def _part_of_arm(hand: FloatArray, begin: float, half_begin: float, half_end: float) -> FloatArray:
    """(4, 2) outline of the arm from `begin` behind the hand to the elbow, metres."""
    x, far = hand[0], hand[1] + begin
    near = min(far - 0.01, ELBOW_Z)
    return np.array(
        [(x - half_begin, far), (x + half_begin, far), (x + half_end, near), (x - half_end, near)]
    )
