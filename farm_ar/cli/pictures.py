"""The pictures that the commands write."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from farm_ar.cli.places import writing
from farm_ar.drawing import draw_identification, draw_scene, new_picture, save_picture
from farm_ar.reid import Identification
from farm_ar.scenes import Camera, Scene, Snapshot


def picture_of_scene(scene: Scene, camera: Camera | None, path: Path) -> None:
    """Draw a scene, and a camera in it if there is one.

    Raises:
        OptionError: the file cannot be written.
    """
    figure, axes = new_picture(scene.size)
    draw_scene(axes, scene, camera=camera)
    with writing("--out", path):
        save_picture(figure, path)


def picture_of_identification(
    scene: Scene,
    snapshot: Snapshot,
    found: Identification,
    path: Path,
    truth: Sequence[str | None] | None = None,
) -> None:
    """Draw which detection is which label, and which it really is where that is known.

    Raises:
        OptionError: the file cannot be written.
    """
    figure, axes = new_picture(scene.size)
    draw_identification(axes, scene, snapshot, found, truth)
    with writing("--plot", path):
        save_picture(figure, path)
