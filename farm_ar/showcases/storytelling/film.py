"""A film of a story: the naive way beside ours."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.text import BOLD, text_sprite, text_width
from farm_ar.drawing.video import write_gif, write_mp4, write_png
from farm_ar.envs.delivery.picture import paste
from farm_ar.geometry import direction, heading, wrap
from farm_ar.rendering import Instance, Intrinsics, Renderer, View
from farm_ar.rendering.interior import SEAT_M, person
from farm_ar.scenes import Layout
from farm_ar.showcases.interior import LAMP, chair_instances, fixed_instances, raised
from farm_ar.showcases.result import Image
from farm_ar.showcases.storytelling.story import CHARACTERS, Seat, Story, seats_of, viewer

FPS = 12
PANE = (480, 330)
"""Width and height of each pane, pixels."""

SHIRTS = ((58, 104, 176), (190, 72, 96))
PASSER_BY = (120, 128, 120)
CAPTION: tuple[int, int, int] = (34, 34, 34)
WHITE: tuple[int, int, int] = (255, 255, 255)

_BEFORE_S, _MOVE_S, _LOOK_S, _WALK_S, _AFTER_S = 1.5, 1.1, 0.8, 1.5, 2.0


class StoryFilm:
    """Draws moments of a story from the viewer's eyes.

    Args:
        story: the lab and the snapshot.
    """

    def __init__(self, story: Story) -> None:
        self._story = story
        self._renderer = Renderer(fixed_instances(story.room), light=LAMP, smooth=True, shaded=self._box())
        self._view = View.of(viewer(), Intrinsics.of_view(*PANE, np.deg2rad(64.7)))

    def frame(
        self, chairs: Layout, seats: tuple[Seat, ...], passer_by: FloatArray | None = None, yaw: float = 0.0
    ) -> Image:
        """A picture of the room.

        Args:
            chairs: where they stand.
            seats: where the characters are; one that waits stands where it is.
            passer_by: (2,) where somebody walks, metres; None for nobody.
            yaw: where he looks, radians.
        """
        moving = chair_instances(chairs)
        heads: list[FloatArray] = []
        for k, (label, seat) in enumerate(zip(CHARACTERS, seats, strict=True)):
            sits = seat.place is not None
            place, facing = self._waiting(label) if seat.place is None else (np.array(seat.place), seat.yaw)
            moving.append(Instance(person(SHIRTS[k], sits), raised(place), facing, 50 + k))
            heads.append(raised(place, SEAT_M + 1.05 if sits else 1.8))
        if passer_by is not None:
            moving.append(Instance(person(PASSER_BY, sitting=False), raised(passer_by), yaw, 60))
        image = self._renderer.draw(self._view, moving).rgb
        for label, head in zip(CHARACTERS, heads, strict=True):
            x, y = self._view.pixels(head).tolist()
            if 0 <= x < PANE[0] and 0 <= y < PANE[1]:
                said = f"of chair {label}"
                sprite = text_sprite(said, 13, CAPTION, BOLD, WHITE)
                paste(image, sprite, round(x) - text_width(said, 13, BOLD) // 2, round(y))
        return image

    def _waiting(self, label: str) -> tuple[FloatArray, float]:
        """Where a character waits: before its old place, so as to stand on the floor and in nobody's way."""
        known = self._story.scene.layout
        i = known.index(label)
        yaw = float(known.yaw[i])
        free: FloatArray = known.position[i] + 0.6 * direction(yaw)
        away = np.linalg.norm(self._story.moved.position - free, axis=1)
        if away.min() < 0.45:
            free = free + 0.45 * direction(yaw)
        return free, float(wrap(yaw + np.pi))

    def _box(self) -> FloatArray:
        width, depth = self._story.scene.size
        return np.array([[0.0, 0.0, 0.0], [width, 2.0, depth]])


def frames_of(story: Story, method: str, least: float) -> Iterator[Image]:
    """The frames of a story, naive on the left and a method on the right."""
    film, known = StoryFilm(story), story.scene.layout
    start, end = seats_of(story, "naive"), seats_of(story, method, least)
    beginning = film.frame(known, start)
    yield from [_side_by_side(beginning, beginning, "A story on chairs 1 and 2", method)] * _count(_BEFORE_S)
    chairs = known
    for i in np.flatnonzero(np.linalg.norm(story.moved.position - known.position, axis=1) > 0.05).tolist():
        if len(known) > 3 and known.labels[i] not in CHARACTERS and not _visible(story, i):
            chairs = _with(chairs, i, story.moved.position[i], float(story.moved.yaw[i]))
            continue
        way = story.moved.position[i] - known.position[i]
        for share in _shares(_MOVE_S):
            place = known.position[i] + share * way
            turn = float(known.yaw[i] + share * wrap(story.moved.yaw[i] - known.yaw[i]))
            chairs = _with(chairs, i, place, turn)
            beside = place - 0.55 * way / max(float(np.linalg.norm(way)), 1e-9)
            one = film.frame(chairs, start, beside, float(heading(way)))
            yield _side_by_side(one, one, "Somebody passes and moves chairs", method)
    left = film.frame(story.moved, start)
    flash: Image = np.full_like(left, 255)
    yield _side_by_side(flash, flash, "One snapshot", method)
    yield from [_side_by_side(left, left, "One snapshot", method)] * _count(_LOOK_S)
    for share in _shares(_WALK_S):
        between = tuple(_between(a, b, share) for a, b in zip(start, end, strict=True))
        yield _side_by_side(
            left, film.frame(story.moved, between), "The characters follow their chairs", method
        )
    last = _side_by_side(left, film.frame(story.moved, end), "After one snapshot", method)
    yield from [last] * _count(_AFTER_S)


def film_story(out: Path, story: Story, method: str, least: float, name: str) -> list[Path]:
    """Film a story: NAME.mp4, NAME.gif, and its end as NAME.png."""
    frames = list(frames_of(story, method, least))
    paths = [out / f"{name}{ending}" for ending in (".mp4", ".gif", ".png")]
    write_mp4(paths[0], frames, FPS)
    write_gif(paths[1], frames[::3], FPS / 3, 720, 96)
    write_png(paths[2], frames[-1])
    return paths


def _visible(story: Story, chair: int) -> bool:
    return chair in story.source


def _with(chairs: Layout, i: int, place: FloatArray, yaw: float) -> Layout:
    position, headings = chairs.position.copy(), chairs.yaw.copy()
    position[i], headings[i] = place, yaw
    return chairs.placed(position, headings)


def _between(start: Seat, end: Seat, share: float) -> Seat:
    """On the way from one seat to another."""
    if end.place is None or start.place is None:
        return end
    place = np.array(start.place) + share * (np.array(end.place) - start.place)
    turn = start.yaw + share * float(wrap(end.yaw - start.yaw))
    return Seat((float(place[0]), float(place[1])), turn)


def _count(seconds: float) -> int:
    return round(seconds * FPS)


def _shares(seconds: float) -> list[float]:
    """Smoothly from 0 to 1."""
    steps = np.arange(1, _count(seconds) + 1) / _count(seconds)
    shares: list[float] = ((1 - np.cos(np.pi * steps)) / 2).tolist()
    return shares


def _side_by_side(left: Image, right: Image, caption: str, method: str) -> Image:
    """Two panes under a caption."""
    page = np.full((PANE[1] + 58, 2 * PANE[0] + 8, 3), 255, np.uint8)
    page[58:, : PANE[0]], page[58:, PANE[0] + 8 :] = left, right
    paste(page, text_sprite(caption, 17, CAPTION, BOLD), 8, 22)
    paste(page, text_sprite("naive: they stay where they were", 14, CAPTION), 8, 48)
    paste(page, text_sprite(f"{method}: they follow their chairs", 14, CAPTION), PANE[0] + 16, 48)
    return page
