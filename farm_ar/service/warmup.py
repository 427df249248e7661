"""Loading what the first request would wait for: compiled kernels."""

from __future__ import annotations

from farm_ar.reid.session import Session
from farm_ar.scenes import Snapshot, builtin_scene
from farm_ar.scenes.json_files import snapshot_from_dict, snapshot_to_dict
from farm_ar.service.methods import method_of


def warm_up() -> None:
    """Identify and align once by each method that is usual."""
    scene = builtin_scene("lab")
    layout = scene.layout
    seen = [
        {"category": layout.category[i], "x": x, "z": z, "yaw_deg": 0, "size_whd": layout.size[i].tolist()}
        for i, (x, z) in enumerate(layout.position.tolist())
    ]
    everything = {"fov_left_deg": 180, "fov_right_deg": 180, "range_m": 100}  # else the check ends early
    camera = {"x": 0.1, "z": 0.1, "yaw_deg": 45, **everything}
    snapshot: Snapshot = snapshot_from_dict({"camera": camera, "detections": seen})
    snapshot_to_dict(snapshot)
    for name in ("spatial", "likelihood", "adaptive"):
        session = Session(scene, method_of(name, {})[0])
        _ = session.identify(snapshot).margin
        session.confirm()
        session.commit()
    session.align(snapshot)
