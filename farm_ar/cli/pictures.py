"""The pictures that the commands write."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.patches import Circle

from farm_ar.agents.design import Design
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


def picture_of_identification(scene: Scene, snapshot: Snapshot, found: Identification, path: Path) -> None:
    """Draw which detection is which label.

    Raises:
        OptionError: the file cannot be written.
    """
    figure, axes = new_picture(scene.size)
    draw_identification(axes, scene, snapshot, found)
    with writing("--plot", path):
        save_picture(figure, path)


def picture_of_design(found: Design, path: Path) -> None:
    """Draw a placement, and around each object how far it may move, unturned, without being mistaken.

    Raises:
        OptionError: the file cannot be written.
    """
    figure, axes = new_picture(found.scene.size)
    draw_scene(axes, found.scene, path=False, cells=False)
    layout = found.scene.layout
    code = layout.category_code
    for i, place in enumerate(layout.position):
        if np.isfinite(found.metres) and np.count_nonzero(code == code[i]) > 1:
            ring = Circle((float(place[0]), float(place[1])), found.metres, fill=False, linewidth=0.6)
            ring.set_edgecolor("#059669")
            ring.set_linestyle((0, (4, 3)))
            axes.add_patch(ring)
    with writing("--plot", path):
        save_picture(figure, path)
