"""The headless renderer: meshes, cameras and a light in; colours, depth and ids of a picture out."""

from farm_ar.rendering.camera import HOLOLENS_2, Intrinsics, View
from farm_ar.rendering.light import Light
from farm_ar.rendering.mesh import Mesh, MeshError, read_mesh
from farm_ar.rendering.models import MODELS, model, with_open_gate
from farm_ar.rendering.renderer import Instance, Picture, Renderer
from farm_ar.rendering.sensor import Sensor

__all__ = [
    "HOLOLENS_2",
    "MODELS",
    "Instance",
    "Intrinsics",
    "Light",
    "Mesh",
    "MeshError",
    "Picture",
    "Renderer",
    "Sensor",
    "View",
    "model",
    "read_mesh",
    "with_open_gate",
]
