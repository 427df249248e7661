"""The models that come with the package, as glTF files; `farm_ar.rendering.modelling` makes them.

Parts named `gate-left` and `gate-right` are leaves of a gate, hung at their outer edges.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from farm_ar.errors import known_name
from farm_ar.rendering.mesh import Mesh, read_mesh

MODELS = tuple(sorted(file.stem for file in Path(__file__).parent.glob("*.glb")))
"""Their names."""

_WIDE_OPEN = np.deg2rad(110.0)


@cache
def model(name: str) -> Mesh:
    """A model by name.

    Raises:
        OptionError: there is no such model.
    """
    return read_mesh(Path(__file__).parent / f"{known_name('model', name, MODELS)}.glb")


def with_open_gate(mesh: Mesh, share: float) -> Mesh:
    """A mesh with its gate open by a share of 110 degrees, 0 to 1; the same if it has no gate."""
    for part, side, hinge in (("gate-left", -1.0, 0), ("gate-right", 1.0, 1)):
        if share and part in mesh.parts:
            bounds = mesh.only(part).bounds
            mesh = mesh.turned(
                part, np.array([bounds[hinge, 0], 0.0, bounds[0, 2]]), side * share * _WIDE_OPEN
            )
    return mesh
