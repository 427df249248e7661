"""Whether a page can be opened to look at, and opening it: `render_mode="human"`."""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
from typing import Protocol

from farm_ar.game_logic.render_state import RenderState
from farm_ar.scenes import Scene

NEEDED = ("fastapi", "uvicorn", "websockets")
"""Packages of the extra `web`."""


class Window(Protocol):
    """A page that shows moments of the game."""

    def show(self, moment: RenderState) -> None:
        """Show a moment from now on."""
        ...

    def close(self) -> None:
        """The page is not served any more."""
        ...


def has_packages() -> bool:
    """Whether the packages of the extra `web` are installed."""
    return all(importlib.util.find_spec(name) is not None for name in NEEDED)


def has_display() -> bool:
    """Whether a browser can be seen here."""
    if sys.platform in ("darwin", "win32"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def open_window(scene: Scene, frames_per_second: float) -> Window:
    """Serve a page on this machine, and open a browser there.

    Args:
        scene: what is shown.
        frames_per_second: how many moments are shown in a second at most; `show` waits for that.
    """
    # The pages stand above the environments, which know them by name only.
    window: Window = importlib.import_module("farm_ar.web.window").PageWindow(scene, frames_per_second)
    return window
