"""What may enter is bounded, and up to the bounds every re-identifier answers, without a warning."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from farm_ar.arrays import ANGLE, POSITION, SIDE
from farm_ar.reid import (
    REIDENTIFIERS,
    LikelihoodReid,
    RelationalReid,
    SpatialOptions,
    SpatialReid,
    alternatives,
    explain,
    register,
    track,
)
from farm_ar.scenes import Camera, Detections, Layout, Scene, Site, Snapshot, SnapshotBatch

EXTREMES = {
    "position": np.array([POSITION.low, -1.0, 0.0, 1e-300, 0.3, POSITION.high]),
    "yaw": np.array([ANGLE.low, -1e-300, 0.0, 1.0, np.pi, ANGLE.high]),
    "size": np.array([SIDE.low, 0.1, 1.0, SIDE.high]),
}


def poses(rng: np.random.Generator, n: int) -> dict[str, Any]:
    return {
        "position": rng.choice(EXTREMES["position"], (n, 2)),
        "yaw": rng.choice(EXTREMES["yaw"], n),
        "size": rng.choice(EXTREMES["size"], (n, 3)),
    }


def extreme_scene(rng: np.random.Generator) -> Scene:
    n = int(rng.integers(2, 6))
    layout = Layout(
        labels=tuple(f"o{i}" for i in range(n)),
        category=tuple(rng.choice(["a", "b"], n).tolist()),
        fixed=rng.random(n) < 0.3,
        **poses(rng, n),
    )
    room = tuple(rng.choice(EXTREMES["size"], 2).tolist())
    sites = tuple(Site(f"S{k}", *rng.uniform(-1e6, 1e6, 2)) for k in range(2))
    return Scene("extreme", room, layout, sites=sites)


def extreme_snapshot(rng: np.random.Generator, scene: Scene) -> Snapshot:
    n = int(rng.integers(0, 6))
    seen = Detections(tuple(rng.choice(list(scene.layout.category), n).tolist()), **poses(rng, n))
    camera = Camera(rng.choice(EXTREMES["position"], 2), rng.choice(EXTREMES["yaw"]))
    return Snapshot(camera, seen)


@pytest.mark.parametrize("name", sorted(REIDENTIFIERS))
@pytest.mark.filterwarnings("error")
def test_every_reidentifier_answers_at_the_limits_of_what_may_enter(name: str) -> None:
    rng = np.random.default_rng(sorted(REIDENTIFIERS).index(name))
    for _ in range(4 if name == "relational" else 30):
        scene = extreme_scene(rng)
        reid = REIDENTIFIERS[name](scene)
        snapshots = [extreme_snapshot(rng, scene) for _ in range(3)]
        for snapshot in snapshots:
            found = reid.identify(snapshot)
            assert len(found.labels) == len(snapshot.detections)
            assert np.isfinite(found.cost[[label is not None for label in found.labels]]).all()
            assert found.margin.shape == found.confidence.shape == found.cost.shape
        fused = track(reid, snapshots)
        assert [len(one.labels) for one in fused.identifications] == [len(s.detections) for s in snapshots]
        if isinstance(reid, SpatialReid | LikelihoodReid):
            batch = reid.identify_many(SnapshotBatch.stack(snapshots))
            for b, snapshot in enumerate(snapshots):
                # Costs so far apart, 1e-16 to 1e50, leave no digits to tell which sum of them is the least.
                given = len(snapshot.detections) - reid.identify(snapshot).labels.count(None)
                if isinstance(reid, SpatialReid):
                    assert np.isfinite(batch.cost[b]).sum() == given
                assert alternatives(reid, snapshot, 2)
                for i in range(len(snapshot.detections)):
                    assert explain(reid, snapshot, i).words()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("options", [{"threshold": 0.5}, {"certify": True}, {"box": "world"}], ids=str)
def test_every_option_of_the_papers_rule_holds_at_the_limits(options: dict[str, Any]) -> None:
    rng = np.random.default_rng(3)
    for _ in range(30):
        scene = extreme_scene(rng)
        snapshot = extreme_snapshot(rng, scene)
        found = SpatialReid(scene, SpatialOptions(**options)).identify(snapshot)
        assert len(found.labels) == len(snapshot.detections)


def test_no_number_that_slips_through_makes_a_kernel_read_beyond_its_tables() -> None:
    rng = np.random.default_rng(4)
    scene, camera = extreme_scene(rng), Camera(np.zeros(2), np.array(0.0))
    calm = Detections(scene.layout.category[:2], np.zeros((2, 2)), np.zeros(2), np.ones((2, 3)))
    for reid in (LikelihoodReid(scene), RelationalReid(scene)):
        for yaw in (1e308, -1e308):
            object.__setattr__(calm, "yaw", np.array([yaw, 0.0]))
            with np.errstate(all="ignore"):
                assert len(reid.identify(Snapshot(camera, calm)).labels) == 2


@pytest.mark.filterwarnings("error")
def test_registration_holds_at_the_limits() -> None:
    rng = np.random.default_rng(5)
    for _ in range(100):
        source, target = (rng.choice(EXTREMES["position"], (5, 2)) for _ in range(2))
        found = register(
            source, target, rng.choice([1e-12, 1.0, 1e12], 5), target[0], rng.normal(size=5), np.ones(5)
        )
        assert np.isfinite([*found.motion.shift, found.motion.turn, found.shift_information]).all()
