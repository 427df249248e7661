"""A delivery as a picture: the room from above, with what the robot knows."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.sprites import Sprite
from farm_ar.drawing.game.text import BOLD, REGULAR, text_sprite, text_width
from farm_ar.envs.delivery.delivery import Delivery
from farm_ar.envs.delivery.robot import RADIUS_M
from farm_ar.geometry import direction, footprint_corners

Image = npt.NDArray[np.uint8]
Colour = tuple[int, int, int]

PIXELS_PER_M = 96
MARGIN = 16

FLOOR: Colour = (244, 242, 236)
TABLE: Colour = (206, 190, 164)
CHAIR: Colour = (150, 170, 198)
TARGET: Colour = (120, 196, 140)
KNOWN: Colour = (150, 150, 150)
ROBOT: Colour = (60, 62, 70)
VIEW: Colour = (214, 122, 170)
WAY: Colour = (31, 95, 139)
RIGHT: Colour = (20, 113, 58)
WRONG: Colour = (196, 22, 28)
INK: Colour = (34, 34, 34)


def picture(
    now: Delivery,
    way: FloatArray | None = None,
    goal: FloatArray | None = None,
    trail: FloatArray | None = None,
) -> Image:
    """The room from above: chairs with their own labels, and where the robot takes its target to be.

    Args:
        now: the delivery.
        way: (P, 2) that the robot means to go, metres.
        goal: (2,) where it is to go.
        trail: (P, 2) that it has gone.
    """
    width, depth = now.size
    image = np.full(
        (round(depth * PIXELS_PER_M) + 2 * MARGIN, round(width * PIXELS_PER_M) + 2 * MARGIN, 3), 255, np.uint8
    )
    corner = _at(now, np.array([[0.0, 0.0], [width, depth]]))
    cv2.rectangle(image, _pair(corner[0]), _pair(corner[1]), FLOOR, -1)
    cv2.rectangle(image, _pair(corner[0]), _pair(corner[1]), INK, 2)
    _wedge(image, now)
    for i, outline in enumerate(footprint_corners(now.things.position, now.things.yaw, now.things.size)):
        own = TABLE if i >= len(now.layout) else TARGET if i == now.target else CHAIR
        _polygon(image, now, outline, own, filled=True)
        if i < len(now.layout):
            _polygon(image, now, outline, INK, filled=False)
            _front(image, now, now.layout.position[i], float(now.layout.yaw[i]))
    known = now.scene.layout
    for outline in footprint_corners(known.position, known.yaw, known.size):
        _polygon(image, now, outline, KNOWN, filled=False)
    for line, colour in ((trail, ROBOT), (way, WAY)):
        if line is not None and len(line) > 1:
            cv2.polylines(image, [_at(now, line)], False, colour, 2, cv2.LINE_AA)
    if goal is not None:
        cv2.drawMarker(image, _pair(_at(now, goal[None])[0]), WAY, cv2.MARKER_TILTED_CROSS, 16, 2)
    _robot(image, now)
    _labels(image, now)
    return image


def _at(now: Delivery, points: FloatArray) -> npt.NDArray[np.int32]:
    """(P, 2) pixels of points (x, z)."""
    x, z = points[:, 0], now.size[1] - points[:, 1]
    return np.rint(MARGIN + PIXELS_PER_M * np.stack([x, z], axis=1)).astype(np.int32)


def _pair(point: npt.NDArray[np.int32]) -> tuple[int, int]:
    return int(point[0]), int(point[1])


def _polygon(image: Image, now: Delivery, outline: FloatArray, colour: Colour, filled: bool) -> None:
    points = _at(now, outline)
    if filled:
        cv2.fillConvexPoly(image, points, colour, cv2.LINE_AA)
    else:
        cv2.polylines(image, [points], True, colour, 1, cv2.LINE_AA)


def _front(image: Image, now: Delivery, place: FloatArray, yaw: float) -> None:
    tip = _at(now, np.array([place + 0.14 * direction(yaw), place + 0.24 * direction(yaw)]))
    cv2.line(image, _pair(tip[0]), _pair(tip[1]), INK, 2, cv2.LINE_AA)


def _wedge(image: Image, now: Delivery) -> None:
    """What the camera has in view."""
    here, camera = now.robot.truth, now.camera
    turn = here.yaw + np.linspace(-camera.across / 2, camera.across / 2, 24)
    outline = np.concatenate([here.place[None], here.place + camera.farthest * direction(turn)])
    inside = image.copy()
    cv2.fillPoly(inside, [_at(now, np.clip(outline, 0.0, now.size))], VIEW, cv2.LINE_AA)
    image[:] = cv2.addWeighted(inside, 0.16, image, 0.84, 0.0)


def _robot(image: Image, now: Delivery) -> None:
    here = now.robot.truth
    middle = _pair(_at(now, here.place[None])[0])
    cv2.circle(image, middle, round(RADIUS_M * PIXELS_PER_M), ROBOT, -1, cv2.LINE_AA)
    tip = _at(now, (here.place + RADIUS_M * direction(here.yaw))[None])[0]
    cv2.line(image, middle, _pair(tip), (255, 255, 255), 2, cv2.LINE_AA)


def _labels(image: Image, now: Delivery) -> None:
    """The chairs' own labels; beside each object that the robot has seen, what it takes it for."""
    for label, point in zip(now.layout.labels, _at(now, now.layout.position), strict=True):
        _text(image, label, point[0], point[1] + 6, 17, INK, BOLD)
    if now.tracking is None:
        return
    answer = now.tracking.identification
    objects = now.tracking.objects.position
    nearest = np.linalg.norm(objects[:, None] - now.layout.position, axis=-1).argmin(axis=1)
    for k, point in enumerate(_at(now, objects)):
        given, own = answer.labels[k], now.layout.labels[nearest[k]]
        sure = answer.confidence[k]
        said = "?" if given is None else given
        said += f" {sure:.0%}" if np.isfinite(sure) else ""
        _text(image, f"= {said}", point[0], point[1] + 38, 14, RIGHT if given == own else WRONG, REGULAR)


def _text(image: Image, text: str, x: int, y: int, pixels: int, colour: Colour, weight: int) -> None:
    """A line of text about a place."""
    sprite = text_sprite(text, pixels, colour, weight, (255, 255, 255))
    paste(image, sprite, int(x) - text_width(text, pixels, weight) // 2, int(y))


def paste(image: Image, sprite: Sprite, x: int, y: int) -> None:
    """Put a sprite where it belongs to a pixel; what lies beyond the edge is cut off."""
    left, top = x + sprite.left, y + sprite.top
    height, width = sprite.pixels.shape[:2]
    below = image[max(top, 0) : max(top + height, 0), max(left, 0) : max(left + width, 0)]
    ink = sprite.pixels[max(-top, 0) :, max(-left, 0) :][: below.shape[0], : below.shape[1]]
    shown = 1 - ink[..., 3:].astype(np.float64) / 255
    below[:] = np.rint(ink[..., :3] + shown * below).astype(np.uint8)
