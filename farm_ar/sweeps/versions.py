"""The version of the code that a unit runs: results of changed code are never taken for those of the new."""

from __future__ import annotations

import sys
from functools import lru_cache
from hashlib import sha256
from importlib import metadata, util
from pathlib import Path

from farm_ar import __version__

BY_HAND = "by hand: "
"""How a version begins that somebody vouches for."""

NUMBERS_FROM = (
    "numpy",
    "scipy",
    "numba",
    "ortools",
    "pymunk",
    "gymnasium",
    "torch",
    "opencv-python-headless",
)
"""Distributions of which another version may give other numbers."""


@lru_cache(maxsize=64)
def code_version(function: str) -> str:
    """Version of what the function `module:function` may run.

    It changes with any file of farm-ar and any file of the function's own package (or its one file, if it is
    in no package), with the version of Python (3.11, 3.12) and of the libraries that the numbers come from.
    The whole package counts, not only what the function imports, for much is found by name: environments,
    solvers, scenes.
    """
    parts = sha256()
    for top in sorted({"farm_ar", function.partition(":")[0].partition(".")[0]}):
        for name, content in _files(top):
            parts.update(f"{name} {len(content)}\n".encode())
            parts.update(content)
    parts.update(_surroundings().encode())
    return f"{__version__}+{parts.hexdigest()[:16]}"


def _files(top: str) -> list[tuple[str, bytes]]:
    """Name and content of each file of a package or module that is part of its code."""
    spec = util.find_spec(top)
    if spec is None:
        return []
    if spec.submodule_search_locations is None:
        return [(top, Path(spec.origin).read_bytes())] if spec.origin else []
    folders = [Path(folder) for folder in spec.submodule_search_locations]
    return [
        (f"{top}/{file.relative_to(folder).as_posix()}", file.read_bytes())
        for folder in folders
        for file in sorted(folder.rglob("*"))
        if file.is_file() and "__pycache__" not in file.parts and not file.name.startswith(".")
    ]


def _surroundings() -> str:
    versions = [f"python {sys.version_info.major}.{sys.version_info.minor}"]
    for name in NUMBERS_FROM:
        try:
            versions.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            versions.append(f"{name} none")
    return "; ".join(versions)
