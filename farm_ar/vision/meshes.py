"""The meshes of a scene's categories."""

from __future__ import annotations

from farm_ar.rendering import MODELS, Mesh, MeshError, model
from farm_ar.scenes import Scene


def meshes_of(scene: Scene) -> dict[str, Mesh]:
    """The models of a scene's categories, each in the size that its first object has.

    Raises:
        MeshError: there is no model of a category.
    """
    found = {}
    for category, size in zip(scene.layout.category, scene.layout.size, strict=True):
        if category not in MODELS:
            expected = f"must be one of which there is a model: {', '.join(MODELS)}"
            raise MeshError("category", expected, category, scene.name)
        if category not in found:
            found[category] = model(category).fitted(*size.tolist())
    return found
