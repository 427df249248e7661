"""Draws images/fig17.png and fig18.png: the headset's view before and after the paper's two demonstrations.

Run it from anywhere: python docs/make_figures_17_18.py
"""

from pathlib import Path

import numpy as np

from farm_ar.drawing.game.headset import HeadsetView
from farm_ar.drawing.video import write_png
from farm_ar.showcases import builtin_scripts, load_script
from farm_ar.showcases.film import ScriptRecorder

IMAGES = Path(__file__).parent / "images"
SIZE = (640, 480)


class States:
    """In place of pictures: the states themselves, of which two are drawn afterwards."""

    def frame(self, state):
        """The state."""
        return state


def main() -> None:
    """Play both scripts, and draw the key frames side by side."""
    for number, script in zip((17, 18), builtin_scripts(), strict=True):
        loaded = load_script(script)
        states = ScriptRecorder(loaded, make_pictures=lambda scene: States()).play().key_frames
        view = HeadsetView(loaded.scene, SIZE, header=False)
        gap = np.full((SIZE[1], 8, 3), 255, np.uint8)
        both = [view.draw(states["1-before"]), gap, view.draw(states["1-after"])]
        write_png(IMAGES / f"fig{number}.png", np.hstack(both))


if __name__ == "__main__":
    main()
