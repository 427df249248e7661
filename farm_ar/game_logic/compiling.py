"""Compiling kernels that call one another across modules, and keeping them on disk while they hold."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])

_PACKAGE = Path(__file__).parents[1]
_KERNELS = (
    "game_logic/arc_length.py",
    "game_logic/arm.py",
    "game_logic/chipmunk.py",
    "game_logic/dodging.py",
    "game_logic/entering.py",
    "game_logic/guiding.py",
    "game_logic/nearness.py",
    "game_logic/plane.py",
    "game_logic/plane_parts.py",
    "game_logic/resting.py",
    "game_logic/running.py",
    "game_logic/sight.py",
    "game_logic/steering.py",
    "game_logic/ticking.py",
    "game_logic/wedges.py",
    "envs/hand_step.py",
    "envs/meeting.py",
    "envs/reading.py",
    "reid/kernels.py",
    "reid/margins.py",
)


def _stamp() -> tuple[tuple[str, int, int], ...]:
    """Name, time of change and size of every module whose kernels may be compiled into another's."""
    files = [_PACKAGE / name for name in _KERNELS]
    return tuple((file.name, file.stat().st_mtime_ns, file.stat().st_size) for file in files)


_STAMP = _stamp()


def compiled(function: Function) -> Function:
    """A function compiled by Numba and kept on disk until any module with kernels changes.

    Left to itself Numba looks at the function's own file only, and goes on with what it has compiled of
    another one.
    """
    fast: Any = numba.njit(cache=True, nogil=True)(function)
    cache: Any = getattr(fast, "_cache", None)
    kept: Any = getattr(cache, "_cache_file", None)
    if kept is not None and hasattr(kept, "_source_stamp"):
        kept._source_stamp = (kept._source_stamp, _STAMP)
    return fast  # type: ignore[no-any-return]
