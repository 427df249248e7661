"""The files that a script's film is made into: a video, a GIF, key frames, and what every snapshot said."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path

import cv2

from farm_ar.drawing.video import write_gif, write_mp4, write_png
from farm_ar.game_logic.tracker import ReidFactory, spatial_by_category
from farm_ar.scenes.fields import write_text
from farm_ar.showcases.film import FPS, Film, Image, Row, Screening
from farm_ar.showcases.script import Script

GIF_WIDTH = 640
GIF_EVERY = 5
"""One frame of the GIF stands for so many of the video."""


def film_script(
    script: Script,
    name: str,
    folder: Path,
    make_reid: ReidFactory = spatial_by_category,
    gif: bool = True,
) -> tuple[Film, list[Path]]:
    """Play a script and write NAME.mp4, NAME.gif, key frames as PNG, and two CSV tables.

    Args:
        script: what happens.
        name: of the files.
        folder: where they go; made if need be.
        make_reid: makes the re-identifier for the scene as it is believed to be.
        gif: whether the GIF is wanted.

    Returns:
        What was filmed, and the files.
    """
    screening = Screening(script, make_reid)
    small: list[Image] = []
    paths = [folder / f"{name}.mp4"]
    write_mp4(paths[0], _with_copies(screening, small, gif), FPS)
    film = screening.film
    if gif:
        paths.append(folder / f"{name}.gif")
        write_gif(paths[-1], small, FPS / GIF_EVERY, GIF_WIDTH)
    for key, image in film.key_frames.items():
        paths.append(folder / f"{name}-{key}.png")
        write_png(paths[-1], image)
    for table, rows in (("snapshots", film.detections), ("counters", film.counters)):
        paths.append(folder / f"{name}-{table}.csv")
        write_text(paths[-1], _as_csv(rows))
    return film, paths


def _with_copies(screening: Screening, small: list[Image], wanted: bool) -> Iterator[Image]:
    """The frames, of which every fifth is kept in small."""
    for number, frame in enumerate(screening.frames()):
        if wanted and number % GIF_EVERY == 0:
            size = (GIF_WIDTH, round(frame.shape[0] * GIF_WIDTH / frame.shape[1]))
            small.append(cv2.resize(frame, size, interpolation=cv2.INTER_AREA))  # type: ignore[arg-type]
        yield frame


def _as_csv(rows: list[Row]) -> str:
    text = io.StringIO()
    if rows:
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return text.getvalue()
