"""The answers of every re-identifier on fixed snapshots of all scenes."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.reid import (
    REIDENTIFIERS,
    LikelihoodOptions,
    LikelihoodReid,
    RelationalOptions,
    RelationalReid,
    SpatialOptions,
    SpatialReid,
    track,
)
from farm_ar.scenes import (
    BUILTIN,
    Camera,
    Detector,
    FieldOfView,
    Gaussian,
    LayoutNoise,
    Scene,
    Snapshot,
    Weights,
    builtin_scene,
    load_scene,
    observe,
    observe_many,
)

DETECTORS = (
    Detector(),
    Detector(occlusion=True, position_sd=0.02, yaw_sd=0.1, size_sd=0.05, miss_rate=0.1),
    Detector(false_rate=2.0, unknown_rate=0.3),
    Detector(false_rate=20.0),
)
SPATIAL: dict[str, dict[str, Any]] = {
    "threshold": {"threshold": 0.6},
    "own site": {"threshold": 0.0},
    "weights": {"weights": Weights(3.0, 1.0)},
    "paper weights": {"weights": "paper"},
    "terms": {"terms": ("translation", "dimension")},
    "gated": {"gate_categories": True},
    "gated threshold": {"gate_categories": True, "threshold": 0.6},
    "world": {"box": "world"},
    "mip": {"solver": "mip"},
    "certify": {"threshold": 0.5, "certify": True},
}
MAKERS: dict[str, Callable[[Scene], Any]] = {
    **{
        name: make
        for name, make in REIDENTIFIERS.items()
        if name not in ("adaptive", "spatial-3d", "squared-distance")
    },
    **{
        f"spatial {name}": lambda scene, options=options: SpatialReid(
            scene, SpatialOptions(**{"gate_categories": False, **options})
        )
        for name, options in SPATIAL.items()
    },
    "likelihood careful": lambda scene: LikelihoodReid(
        scene, LikelihoodOptions(min_confidence=0.6, occlusion=True, walls=False)
    ),
    "relational drift": lambda scene: RelationalReid(scene, RelationalOptions(drift=0.5, group=0.0)),
}


def scenes() -> dict[str, Callable[[], Scene]]:
    """What makes each scene: the built-in ones, and the authors' where there are any."""
    found: dict[str, Callable[[], Scene]] = {name: partial(builtin_scene, name) for name in BUILTIN}
    folder = os.environ.get("FARM_AR_PAPER_SCENES")
    if folder:
        found |= {f"paper-{f.stem}": partial(load_scene, f) for f in sorted(Path(folder).glob("*.json"))}
    return found


@cache
def snapshots(name: str) -> tuple[Snapshot, ...]:
    """Twelve snapshots of a scene: four detectors under three amounts of disorder."""
    scene = scenes()[name]()
    rng = np.random.default_rng(7)
    share = float(np.hypot(*scene.size))
    taken = []
    for metres, radians in ((0.01, 0.1), (0.03, 0.5), (0.1, 2.0)):
        for detector in DETECTORS:
            noise = LayoutNoise(Gaussian(0.0, metres * share), Gaussian(0.0, radians))
            layout = noise.disturb(scene.layout, scene.size, rng)
            taken.append(observe(layout, _camera(scene, rng), detector, rng)[0])
    return tuple(taken)


def _camera(scene: Scene, rng: np.random.Generator) -> Camera:
    if scene.camera_path is not None:
        return scene.camera_path.cameras(50, scene.fov).at(int(rng.integers(50)))
    middle = np.divide(scene.size, 2)
    place = middle + rng.uniform(-0.5, 0.5, 2) * scene.size
    return Camera(place, np.arctan2(*(middle - place)), FieldOfView(0.6, 0.6, 9.0))


def answer(scene_name: str, make: Callable[[Scene], Any]) -> dict[str, Any]:
    """What a re-identifier says of the snapshots of a scene."""
    rule = make(scenes()[scene_name]())
    found = [rule.identify(snapshot) for snapshot in snapshots(scene_name)]
    numbers = {
        name: np.concatenate([getattr(f, name) for f in found]) for name in ("cost", "margin", "confidence")
    }
    return numbers | {
        "labels": [list(f.labels) for f in found],
        "runners up": [list(f.runner_up) for f in found],
        "candidates": [len(f.candidates) for f in found],
        "sites": [list(f.sites) for f in found],
        "widened": [bool(f.widened) for f in found],
        "warnings": [len(f.warnings) for f in found],
        "certified": np.array(
            [[np.nan] * 3 if (c := f.certified) is None else [c.radius, c.metres, c.degrees] for f in found]
        ),
    }


def batch(scene_name: str, make: Callable[[Scene], Any]) -> dict[str, Any]:
    """What `identify_many` says of sixty snapshots, if there is one."""
    scene = scenes()[scene_name]()
    rng = np.random.default_rng(8)
    noise = LayoutNoise(Gaussian(0.0, 0.03 * float(np.hypot(*scene.size))), Gaussian(0.0, 0.4))
    seen = observe_many(
        noise.disturb(scene.layout, scene.size, rng, (60,)),
        scene.camera_path.cameras(60, scene.fov) if scene.camera_path else _camera(scene, rng),
        DETECTORS[2],
        rng,
    )
    found = make(scene).identify_many(seen)
    return {"label": np.array(found.label), "cost": found.cost, "candidates": np.array(found.candidates)}


def tracked(scene_name: str, make: Callable[[Scene], Any]) -> dict[str, Any]:
    """What several snapshots of one disorder say together."""
    scene = scenes()[scene_name]()
    rng = np.random.default_rng(9)
    noise = LayoutNoise(Gaussian(0.0, 0.03 * float(np.hypot(*scene.size))), Gaussian(0.0, 0.4))
    layout = noise.disturb(scene.layout, scene.size, rng)
    found = track(make(scene), [observe(layout, _camera(scene, rng))[0] for _ in range(3)])
    return {
        "labels": [list(one.labels) for one in found.identifications],
        "objects": found.objects.position,
        "position_sd": found.position_sd,
    }


SLOW = ("relational", "relational drift")


def cases() -> dict[str, Callable[[], dict[str, Any]]]:
    """All cases by name."""
    few, many = ("L1", "M2", "farm"), ("spatial", "spatial gated threshold", "likelihood", "distance")
    found = {
        f"answers {scene} {name}": partial(answer, scene, make)
        for scene in scenes()
        for name, make in MAKERS.items()
        if name not in SLOW or scene in ("L1", "M1", "farm", "lab", "paper-M1")
    }
    found |= {f"batch {s} {name}": partial(batch, s, MAKERS[name]) for s in few for name in many}
    return found | {
        f"track {s} {name}": partial(tracked, s, MAKERS[name]) for s in few for name in (*many, "relational")
    }
