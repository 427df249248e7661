"""The files of a script's film: a video, a GIF, key frames, and the identification of every snapshot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import cv2

from farm_ar.drawing.video import write_gif, write_mp4, write_png
from farm_ar.game_logic.perception import OraclePerception, Perception
from farm_ar.reid import ReidFactory, SpatialReid
from farm_ar.scenes import Scene
from farm_ar.scenes.files import csv_table, write_text
from farm_ar.showcases.film import FPS, Film, Image, ScriptRecorder
from farm_ar.showcases.script import Script

GIF_WIDTH = 640
GIF_EVERY = 5
"""One frame of the GIF stands for so many of the video."""

_SHARE_FILMED = 0.8
"""Share of the time that filming takes where a GIF is made afterwards."""

Report = Callable[[str, float], None]


def film_script(
    script: Script,
    name: str,
    folder: Path,
    make_reid: ReidFactory = SpatialReid,
    gif: bool = True,
    report: Report = lambda what, share: None,
    make_perception: Callable[[Scene], Perception] = lambda scene: OraclePerception(),
) -> tuple[Film, list[Path]]:
    """Play a script and write NAME.mp4, NAME.gif, key frames as PNG, and two CSV tables.

    Args:
        script: what happens.
        name: of the files.
        folder: where they go; made if need be.
        make_reid: makes the re-identifier for the scene as it is believed to be.
        gif: whether the GIF is wanted.
        report: called from time to time with the current task and about which share of it is done, 0 to 1.
        make_perception: makes what takes the snapshots, for the scene; from true poses by default.

    Returns:
        What was filmed, and the files.
    """
    share_filmed = _SHARE_FILMED if gif else 1.0
    screening = ScriptRecorder(
        script,
        make_reid,
        report=lambda share: report(f"Filming {name}", share_filmed * share),
        make_perception=make_perception,
    )
    small: list[Image] = []
    paths = [folder / f"{name}.mp4"]
    write_mp4(paths[0], _with_copies(screening, small, gif), FPS)
    film = screening.film
    if gif:
        report(f"Making a GIF of {name}", share_filmed)
        paths.append(folder / f"{name}.gif")
        write_gif(paths[-1], small, FPS / GIF_EVERY, GIF_WIDTH)
    for key, image in film.key_frames.items():
        paths.append(folder / f"{name}-{key}.png")
        write_png(paths[-1], image)
    for table, rows in (("snapshots", film.detections), ("counters", film.counters)):
        paths.append(folder / f"{name}-{table}.csv")
        write_text(paths[-1], csv_table(rows[0], rows) if rows else "")
    report(f"Filmed {name}", 1.0)
    return film, paths


def _with_copies(screening: ScriptRecorder, small: list[Image], wanted: bool) -> Iterator[Image]:
    """The frames, of which every fifth is kept in small."""
    for number, frame in enumerate(screening.frames()):
        if wanted and number % GIF_EVERY == 0:
            size = (GIF_WIDTH, round(frame.shape[0] * GIF_WIDTH / frame.shape[1]))
            small.append(cv2.resize(frame, size, interpolation=cv2.INTER_AREA))  # type: ignore[arg-type]
        yield frame
