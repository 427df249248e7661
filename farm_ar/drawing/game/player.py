"""The player from above: a head with a headset, a hand, a forearm."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.drawing.game.colours import INK, SKIN, SLEEVE, Colour, Image, darker, lighter
from farm_ar.drawing.game.overlays import outline, tint_area
from farm_ar.drawing.game.pinhole import Pinhole
from farm_ar.drawing.game.shapes import Art, Part, box, disc, ellipse, stroke
from farm_ar.drawing.game.sprites import SHIFT, fixed_point, paste_art
from farm_ar.drawing.game.viewport import Viewport
from farm_ar.game_logic.physics.gripper import HandState

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


def draw_hand_before_eyes(image: Image, hand: HandState, view: Pinhole) -> None:
    """The hand and the forearm as the player sees them, above the buildings."""
    x, z = (float(value) for value in hand.position)
    height = _RAISED_M if hand.raised else _LOW_M
    share = np.linspace(0.0, 1.0, 25)[:, None]
    elbow = np.array([x + 0.04, height + 0.06, min(z - 0.05, ELBOW_Z)])
    middle = np.array([x, height, z]) * (1 - share) + elbow * share
    frame = view.frame(middle)
    frame = frame[frame[:, 2] > 0.10]
    if len(frame) < 2:
        return
    along = np.linalg.norm(frame - frame[0], axis=1)
    pixels = view.pixels(frame)
    way = pixels[0] - pixels[1]
    way = way / max(float(np.hypot(*way)), 1e-9)
    _ribbon(image, view, frame, np.interp(along, [0.0, 0.3], [0.021, 0.040]), along > 0.025, SKIN)
    _ribbon(image, view, frame, np.interp(along, [0.2, 0.5], [0.036, 0.050]), along > 0.20, SLEEVE)
    scale = round(float(view.focal / frame[0, 2]), 1)
    yaw = float(np.arctan2(way[0], -way[1])) + hand.yaw
    column, row = pixels[0].tolist()
    paste_art(image, hand_art(hand.gripped is not None), column, row, scale, yaw, step=2.5)


def _ribbon(
    image: Image, view: Pinhole, frame: FloatArray, half: FloatArray, shown: BoolArray, colour: Colour
) -> None:
    """A round limb along points (P, 3) in the camera's axes, `half` as wide as (P,) metres."""
    if shown.sum() < 2:
        return
    pixels = view.pixels(frame[shown])
    reach = (half[shown] * view.focal / frame[shown, 2])[:, None]
    way = np.gradient(pixels, axis=0)
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    aside = reach * way[:, ::-1] * np.array([1.0, -1.0])
    limb = np.vstack([pixels + aside, (pixels - aside)[::-1]])
    cv2.fillPoly(image, [fixed_point(np.clip(limb, -4000, 4000))], colour, cv2.LINE_AA, SHIFT)
    outline(image, np.clip(limb, -4000, 4000), darker(colour, 0.55), max(1, round(image.shape[0] / 300)))


def _part_of_arm(hand: FloatArray, begin: float, half_begin: float, half_end: float) -> FloatArray:
    """(4, 2) outline of the arm from `begin` behind the hand to the elbow, metres."""
    x, far = hand[0], hand[1] + begin
    near = min(far - 0.01, ELBOW_Z)
    return np.array(
        [(x - half_begin, far), (x + half_begin, far), (x + half_end, near), (x - half_end, near)]
    )
