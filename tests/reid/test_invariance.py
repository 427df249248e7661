"""How a stranger writes the world down changes no answer: origin, heading, handedness and unit.

`spatial` as published weighs metres, so it is exempt from scaling; `box="world"`, which `spatial-unity` has,
from turning.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from farm_ar.arrays import FloatArray
from farm_ar.reid import (
    REIDENTIFIERS,
    Identification,
    LikelihoodReid,
    RelationalReid,
    SpatialOptions,
    SpatialReid,
    track,
)
from farm_ar.scenes import Bounds, Camera, Detections, FieldOfView, Layout, Scene, Snapshot

SEEDS = st.integers(0, 2**32 - 1)
PER_METRE = {"spatial", "spatial-ungated", "spatial-unity", "spatial-3d"}
ALONG_THE_AXES = {"spatial-unity"}
NAMES = sorted(REIDENTIFIERS)
SAME = 1e-9


@dataclass(frozen=True)
class Writing:
    """Another way to write a world down: mirrored, turned clockwise, scaled, then shifted by extents."""

    shift: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    scale: float = 1.0
    mirror: bool = False

    def place(self, position: FloatArray) -> FloatArray:
        side, cosine, sine = -1.0 if self.mirror else 1.0, np.cos(self.turn), np.sin(self.turn)
        x, z = side * position[..., 0], position[..., 1]
        turned = np.stack([x * cosine + z * sine, z * cosine - x * sine], axis=-1)
        return self.scale * (turned + 5.0 * np.asarray(self.shift))

    def poses(self, one: Layout | Detections) -> dict[str, FloatArray]:
        return {
            "position": self.place(one.position),
            "yaw": self.heading(one.yaw),
            "size": self.scale * one.size,
            "elevation": self.scale * one.elevation,
        }

    def heading(self, yaw: FloatArray) -> FloatArray:
        return (-1.0 if self.mirror else 1.0) * yaw + self.turn

    def scene(self, scene: Scene) -> Scene:
        bounds = None if scene.bounds is None else Bounds(self.place(scene.bounds.corners))
        layout = replace(scene.layout, **self.poses(scene.layout))
        return Scene(scene.name, None, layout, symmetry=scene.symmetry, bounds=bounds)

    def snapshot(self, snapshot: Snapshot) -> Snapshot:
        camera, fov = snapshot.camera, snapshot.camera.fov
        left, right = (fov.right, fov.left) if self.mirror else (fov.left, fov.right)
        moved = replace(
            camera,
            position=self.place(camera.position),
            yaw=self.heading(camera.yaw),
            fov=replace(fov, left=left, right=right, range_m=self.scale * fov.range_m),
            height=None if camera.height is None else self.scale * camera.height,
        )
        return Snapshot(moved, replace(snapshot.detections, **self.poses(snapshot.detections)))


def world(seed: int) -> tuple[Scene, Snapshot]:
    """Some things of two categories, moved somehow, in a room or in none, and what a camera sees of them."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 9))
    category = tuple(rng.choice(["chair", "lamp"], n).tolist())
    position = rng.random((n, 2)) * (4.0, 3.0)
    position[: n // 3, 0] = 0.0  # against a wall
    yaw, size = rng.uniform(-np.pi, np.pi, n), np.exp(rng.normal(-1, 0.05, (n, 3)))
    layout = Layout(
        tuple("abcdefgh"[:n]),
        category,
        position,
        yaw,
        size,
        elevation=rng.choice([0.0, 0.7], n) * rng.integers(2),
        fixed=rng.random(n) < 0.15,
    )
    seen = rng.permutation(n)[: int(rng.integers(1, n + 1))]
    off = np.where(layout.fixed[seen], 0.0, 1.0)
    moved = position[seen] + off[:, None] * rng.normal(0, rng.choice([0.05, 0.5]), (len(seen), 2))
    detections = Detections(
        category=tuple(category[i] if rng.random() < 0.9 else None for i in seen),
        position=np.clip(moved, 0.0, [4.0, 3.0]),
        yaw=yaw[seen] + off * rng.normal(0, rng.choice([0.1, 1.0]), len(seen)),
        size=size[seen] * np.exp(rng.normal(0, 0.03, (len(seen), 3))),
        elevation=layout.elevation[seen],
    )
    tall = rng.random() < 0.5
    camera = Camera(
        rng.random(2) * (4.0, 3.0),
        rng.uniform(-np.pi, np.pi),
        FieldOfView(1.0, 0.7, 3.0, *((0.5, 0.9) if tall else ())),
        height=1.6 if tall else None,
        pitch=-0.3 if tall else 0.0,
    )
    bounds = Bounds.rectangle(4.0, 3.0) if rng.random() < 0.7 else None
    symmetry = {"lamp": float(rng.choice([0.0, np.pi]))} if rng.random() < 0.5 else {}
    return Scene("world", None, layout, symmetry=symmetry, bounds=bounds), Snapshot(camera, detections)


def assert_same(first: Identification, second: Identification, scale: float = 1.0) -> None:
    clear = np.nan_to_num(first.margin, nan=1.0, posinf=1.0) > SAME
    assert [a for a, sure in zip(first.labels, clear, strict=True) if sure] == [
        b for b, sure in zip(second.labels, clear, strict=True) if sure
    ]
    np.testing.assert_allclose(second.confidence[clear], first.confidence[clear], rtol=0, atol=SAME)
    proofs = first.certified, second.certified
    assert (proofs[0] is None) == (proofs[1] is None)
    if proofs[0] is not None and proofs[1] is not None:
        assert proofs[1].radius == pytest.approx(proofs[0].radius, rel=1e-9)
        assert proofs[1].metres == pytest.approx(scale * proofs[0].metres, rel=1e-9)
        assert proofs[1].degrees == pytest.approx(proofs[0].degrees, abs=1e-6)


@pytest.mark.parametrize("name", NAMES)
@settings(deadline=None)
@example(seed=13, shift=(300.0, -40.0), turn=2.0, log_scale=-1.0, mirror=False)  # a fit ends in the same step
@example(seed=116, shift=(3.0, 4.0), turn=1.0, log_scale=0.8, mirror=True)  # a motion as far as any may be
@given(
    seed=SEEDS,
    shift=st.tuples(*2 * [st.floats(-1000, 1000)]),
    turn=st.floats(-7, 7),
    log_scale=st.floats(-3, 3),
    mirror=st.booleans(),
)
def test_origin_heading_unit_and_handedness_change_nothing(
    name: str, seed: int, shift: tuple[float, float], turn: float, log_scale: float, mirror: bool
) -> None:
    scene, snapshot = world(seed)
    scale = 1.0 if name in PER_METRE else 10.0**log_scale
    turn = 0.0 if name in ALONG_THE_AXES else turn
    most = 9e5 / (5.0 * scale)  # positions end at a million metres
    shift = (min(max(shift[0], -most), most), min(max(shift[1], -most), most))
    other = Writing(shift, turn, scale, mirror)
    make = REIDENTIFIERS[name]
    found = make(other.scene(scene)).identify(other.snapshot(snapshot))
    assert_same(make(scene).identify(snapshot), found, scale)


@pytest.mark.parametrize("name", ["spatial", "likelihood", "adaptive"])
@settings(deadline=None, max_examples=settings().max_examples // 3)
@given(
    seed=SEEDS,
    shift=st.tuples(*2 * [st.floats(-1000, 1000)]),
    turn=st.floats(-7, 7),
    log_scale=st.floats(-3, 3),
    mirror=st.booleans(),
)
def test_what_several_snapshots_say_together_does_not_change_either(
    name: str, seed: int, shift: tuple[float, float], turn: float, log_scale: float, mirror: bool
) -> None:
    scene, first = world(seed)
    rng = np.random.default_rng(seed)
    snapshots = [first]
    for _ in range(2):
        n, seen = len(first.detections), first.detections
        again = replace(
            seen,
            position=seen.position + rng.normal(0, 0.01, (n, 2)),
            yaw=seen.yaw + rng.normal(0, 0.03, n),
        )
        camera = replace(first.camera, position=rng.random(2) * (4.0, 3.0), yaw=rng.uniform(-3, 3))
        snapshots.append(Snapshot(camera, again))
    scale = 1.0 if name in PER_METRE else 10.0**log_scale
    most = 9e5 / (5.0 * scale)
    other = Writing((min(max(shift[0], -most), most), min(max(shift[1], -most), most)), turn, scale, mirror)
    make = REIDENTIFIERS[name]
    plain = track(make(scene), snapshots)
    found = track(make(other.scene(scene)), [other.snapshot(one) for one in snapshots])
    assert [one.tolist() for one in found.object_of] == [one.tolist() for one in plain.object_of]
    np.testing.assert_allclose(found.position_sd, scale * plain.position_sd, rtol=1e-9)
    assert_same(plain.identification, found.identification, scale)


@settings(deadline=None)
@given(seed=SEEDS, shift=st.tuples(*2 * [st.floats(-100, 100)]), log_scale=st.floats(-3, 3))
def test_boxes_along_the_axes_bear_shifts_and_a_scale_free_weight_units(
    seed: int, shift: tuple[float, float], log_scale: float
) -> None:
    scene, snapshot = world(seed)
    options = SpatialOptions(box="world", weights="scale-free")
    other = Writing(shift, scale=10.0**log_scale)
    found = SpatialReid(other.scene(scene), options).identify(other.snapshot(snapshot))
    assert_same(SpatialReid(scene, options).identify(snapshot), found, other.scale)


@pytest.mark.parametrize("make", [LikelihoodReid, RelationalReid])
@settings(deadline=None)
@given(seed=SEEDS)
def test_a_far_lamp_a_longer_range_and_wider_bounds_change_next_to_nothing(
    make: type[LikelihoodReid], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    scene, snapshot = world(seed)
    layout, seen = scene.layout, snapshot.detections
    category = tuple(layout.category[0] if name is None else name for name in seen.category)
    camera = Camera([2.0, -1.5], 0.0, FieldOfView(np.pi, np.pi, 100.0))
    snapshot = Snapshot(camera, replace(seen, category=category))
    scene = replace(scene, bounds=Bounds.rectangle(24.0, 23.0, (-10.0, -10.0)))
    found = make(scene).identify(snapshot)
    more = Layout(
        (*layout.labels, "far"),
        (*layout.category, "beacon"),
        np.vstack([layout.position, rng.uniform(200, 400, 2)]),
        np.append(layout.yaw, 0.0),
        np.vstack([layout.size, [1.0, 1.0, 1.0]]),
        elevation=np.append(layout.elevation, 0.0),
        fixed=np.append(layout.fixed, False),
    )
    farther = replace(camera, fov=FieldOfView(np.pi, np.pi, 1e4))
    for known, taken in (
        (replace(scene, layout=more), snapshot),
        (scene, replace(snapshot, camera=farther)),
        (replace(scene, bounds=Bounds.rectangle(240.0, 230.0, (-100.0, -100.0))), snapshot),
    ):
        other = make(known).identify(taken)
        assert other.labels == found.labels
        np.testing.assert_allclose(other.confidence, found.confidence, rtol=0, atol=0.02)
