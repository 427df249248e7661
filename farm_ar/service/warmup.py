"""Loading what the first requests would wait for: compiled kernels."""

from __future__ import annotations

from typing import Any

from farm_ar.reid.fusion import objects_of
from farm_ar.reid.plausibility import check, set_aside
from farm_ar.reid.session import Session
from farm_ar.scenes import Scene, Snapshot, builtin_scene
from farm_ar.scenes.files import degrees
from farm_ar.scenes.json_files import snapshot_from_dict, snapshot_to_dict
from farm_ar.service.methods import method_of


def warm_up() -> None:
    """Identify snapshots of all kinds, and align, by each method that is usual; check one whatever it is."""
    scene = builtin_scene("lab")
    still, moved, odd = _seen(scene, 0.0), _seen(scene, 0.1), _seen(scene, 0.1, size_whd=None, track_id="a")
    snapshot_to_dict(still)
    objects, _ = objects_of([still, moved])
    several = Snapshot(still.camera, objects)
    for name in ("spatial", "likelihood", "adaptive"):
        session = Session(scene, method_of(name, {})[0])
        for one in (still, moved, odd, _seen(scene, 0.1, category="a stranger"), still):
            _ = session.identify(one).margin
        session.identify(several, [still.camera, moved.camera])
        session.confirm()
        session.commit()
        session.align(moved)
    check(scene, still)  # of those before there was nothing to say, which is found out more quickly
    set_aside(scene, still)


def _seen(scene: Scene, shift: float, **first: Any) -> Snapshot:
    """All things, moved by metres and turned; the first one with other fields, left out where None."""
    layout = scene.layout
    seen = [
        {
            "category": layout.category[i],
            "x": x + shift * (i % 3),
            "z": z - shift * (i % 2),
            "yaw_deg": degrees(layout.yaw[i]) + 100 * shift * (i % 3),
            "size_whd": layout.size[i].tolist(),
        }
        for i, (x, z) in enumerate(layout.position.tolist())
    ]
    seen[0] = {name: value for name, value in (seen[0] | first).items() if value is not None}
    everything = {"fov_left_deg": 180, "fov_right_deg": 180, "range_m": 100}  # else the check ends early
    camera = {"x": 0.1, "z": 0.1, "yaw_deg": 45, **everything}
    snapshot: Snapshot = snapshot_from_dict({"camera": camera, "detections": seen})
    return snapshot
