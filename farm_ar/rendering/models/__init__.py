"""The models that come with the package, as glTF files; `farm_ar.rendering.modelling` makes them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from farm_ar.errors import known_name
from farm_ar.rendering.mesh import Mesh, read_mesh

MODELS = tuple(sorted(file.stem for file in Path(__file__).parent.glob("*.glb")))
"""Their names."""


@cache
def model(name: str) -> Mesh:
    """A model by name.

    Raises:
        OptionError: there is no such model.
    """
    return read_mesh(Path(__file__).parent / f"{known_name('model', name, MODELS)}.glb")
