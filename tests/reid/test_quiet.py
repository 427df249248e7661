"""Where the check is said to have nothing to say, it has nothing to say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.arrays import FloatArray
from farm_ar.reid.plausibility import check, set_aside
from farm_ar.reid.plausibility.evidence import evidence_of_all
from farm_ar.reid.plausibility.evidence_bounds import evidence_at_most, evidence_of_nearest, highest_turn
from farm_ar.reid.plausibility.quiet import quiet
from farm_ar.reid.plausibility.quiet_places import Labels
from farm_ar.scenes import (
    BUILTIN,
    Bounds,
    Camera,
    Detections,
    FieldOfView,
    Layout,
    Scene,
    Snapshot,
    builtin_scene,
    visible,
)

WIDE = FieldOfView(np.pi, np.pi, 100.0)


def place_of(rng: np.random.Generator, scale: float, kinds: int, bounds: bool) -> Scene:
    """Things of some sizes anywhere, some without a size or a heading, at some scale and origin."""
    n = int(rng.integers(2, 20))
    size = rng.uniform(0.2, 0.6, (n, 3))
    size[rng.random(n) < 0.1] = np.nan
    yaw = np.where(rng.random(n) < 0.1, np.nan, rng.uniform(-4, 4, n))
    origin = rng.uniform(-3, 3, 2) * scale
    layout = Layout(
        labels=tuple(f"thing {i}" for i in range(n)),
        category=tuple(f"kind {i % kinds}" for i in range(n)),
        position=origin + rng.uniform(0, 6, (n, 2)) * scale,
        yaw=yaw,
        size=size * scale,
    )
    around = Bounds.rectangle(6 * scale, 6 * scale, origin, 0.0) if bounds else None
    return Scene(name="any", layout=layout, bounds=around, symmetry={"kind 0": np.pi})


def seen_in(scene: Scene, rng: np.random.Generator, scale: float, moved: float) -> Snapshot:
    """Some of the things, moved, a few with a category that is not known."""
    layout = scene.layout
    some = rng.permutation(len(layout))[: int(rng.integers(1, len(layout) + 1))]
    category = tuple(layout.category[i] if rng.random() < 0.9 else None for i in some)
    found = Detections(
        category=category,
        position=layout.position[some] + rng.normal(0, moved * scale, (len(some), 2)),
        yaw=layout.yaw[some] + rng.normal(0, moved, len(some)),
        size=layout.size[some] * np.exp(rng.normal(0, 0.1, (len(some), 3))),
        confidence=rng.uniform(0.3, 1, len(some)),
    )
    middle = layout.position.mean(axis=0) + rng.normal(0, scale, 2)
    fov = WIDE if rng.random() < 0.5 else FieldOfView(*rng.uniform(0.3, 3, 2), 5 * scale)
    return Snapshot(Camera(middle, np.asarray(rng.uniform(-3, 3)), fov), found)


def _with(snapshot: Snapshot, **changes: Any) -> Snapshot:
    return replace(snapshot, detections=replace(snapshot.detections, **changes))


def _one(snapshot: Snapshot, name: str, value: FloatArray | float) -> Snapshot:
    values = np.array(getattr(snapshot.detections, name))
    values[0] = value
    return _with(snapshot, **{name: values})


def _turned(snapshot: Snapshot, turn: float) -> Snapshot:
    c, s = np.cos(turn), np.sin(turn)
    there = snapshot.detections.position @ np.array([[c, -s], [s, c]]) + 0.5
    return _with(snapshot, position=there, yaw=snapshot.detections.yaw + turn)


FAULTS: dict[str, Callable[[Snapshot], Snapshot]] = {
    "none": lambda one: one,
    "mirrored": lambda one: _with(one, position=one.detections.position * [-1, 1], yaw=-one.detections.yaw),
    "exchanged": lambda one: _with(one, position=one.detections.position[:, ::-1]),
    "centimetres": lambda one: _with(one, position=one.detections.position * 100),
    "feet": lambda one: _with(one, position=one.detections.position / 0.3048),
    "degrees": lambda one: _with(one, yaw=np.deg2rad(one.detections.yaw)),
    "headings": lambda one: _with(one, yaw=np.pi / 2 - one.detections.yaw),
    "turned": lambda one: _turned(one, 1.1),
    "sizes": lambda one: _with(one, size=np.clip(one.detections.size * 2.2, 1e-5, 1e5)),
    "one size": lambda one: _one(one, "size", one.detections.size[0] * 6),
    "far": lambda one: _one(one, "position", one.detections.position[0] + 40),
    "at the camera": lambda one: _one(one, "position", one.camera.position),
    "at the origin": lambda one: _one(_one(one, "position", 0.0), "yaw", 0.0),
    "twice": lambda one: _one(one, "position", one.detections.position[-1] + 1e-3),
    "nearly twice": lambda one: _one(
        one, "position", one.detections.position[-1] + 0.3 * np.nan_to_num(one.detections.size[-1, ::2])
    ),
    "one above": lambda one: (
        _one(
            _one(one, "position", one.detections.position[-1] + 1e-3), "elevation", one.detections.size[-1, 1]
        )
        if np.isfinite(one.detections.size[-1, 1])
        else one
    ),
    "one pose": lambda one: _one(
        _one(one, "position", one.detections.position[-1]), "yaw", one.detections.yaw[-1]
    ),
    "turned camera": lambda one: replace(one, camera=replace(one.camera, yaw=one.camera.yaw + np.pi)),
}


@pytest.mark.parametrize("fault", FAULTS)
@given(seed=st.integers(0, 2**32 - 1))
def test_nothing_is_passed_over(fault: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    scale, moved = 10.0 ** rng.uniform(-2, 2), float(rng.choice([0.01, 0.1, 0.5]))
    scene = place_of(rng, scale, int(rng.integers(1, 4)), bool(rng.random() < 0.5))
    snapshot = FAULTS[fault](seen_in(scene, rng, scale, moved))
    nothing, aside = quiet(scene, snapshot), any(set_aside(scene, snapshot))
    if nothing.check:
        assert not check(scene, snapshot)
    if nothing.aside:
        assert not aside
    if quiet(scene, snapshot, checks=False).aside:
        assert not aside


@pytest.mark.parametrize("name", BUILTIN)
def test_most_snapshots_of_the_built_in_scenes_are_passed(name: str, rng: np.random.Generator) -> None:
    scene = builtin_scene(name)
    layout, passed, right = scene.layout, 0, 0
    for _ in range(20):
        position = layout.position + rng.normal(0, 0.02 * scene.diagonal, layout.position.shape)
        camera = Camera(layout.position.mean(axis=0), np.asarray(rng.uniform(-3, 3)), WIDE)
        some = np.flatnonzero(visible(layout, camera))[: int(rng.integers(3, 12))]
        found = Detections(
            tuple(layout.category[i] for i in some), position[some], layout.yaw[some], layout.size[some]
        )
        snapshot = Snapshot(camera, found)
        right += not check(scene, snapshot) and not any(set_aside(scene, snapshot))
        passed += all(quiet(scene, snapshot))
    assert passed >= 0.6 * right


def test_scales_of_shift_that_do_not_count_need_not_be_computed(rng: np.random.Generator) -> None:
    """The evidence of a variant does not depend on whether others of its place count more scales."""
    places, yaw = rng.uniform(0, 5, (1, 4, 2)), rng.uniform(-3, 3, (1, 4))
    labels = (rng.uniform(0, 5, (6, 2)), rng.uniform(-3, 3, 6), np.full(6, 2 * np.pi))
    share, widths = np.full((4, 6), 1 / 6), np.geomspace(0.03, 5, 7)
    both = np.zeros((2, 2), dtype=np.int64)
    alone = evidence_of_all((places, yaw, both[:1], np.array([True])), share, labels, widths, 0.3, 5.0)
    beside = evidence_of_all((places, yaw, both, np.array([True, False])), share, labels, widths, 0.3, 5.0)
    assert alone[0] == beside[0]


@given(seed=st.integers(0, 2**32 - 1))
def test_evidence_is_bounded_from_above_and_closely(seed: int) -> None:
    """Whatever the scale, the periods of the headings, and what is not known."""
    rng = np.random.default_rng(seed)
    n, m, scale = int(rng.integers(1, 17)), int(rng.integers(1, 40)), 10.0 ** rng.uniform(-3, 3)
    heading = np.where(rng.random(m) < 0.1, np.nan, rng.uniform(-7, 7, m))
    period = rng.choice([2 * np.pi, np.pi, np.pi / 2, 0.0], m)
    place = rng.uniform(0, 6, (m, 2)) * scale
    spacing, extent = 0.7 * scale, 8.0 * scale
    widths = np.geomspace(0.03 * spacing, extent, 7)
    lengths = (spacing, extent, 0.1, 0.1)
    known = Labels(place, heading, period, np.zeros(m, int), np.zeros(m), np.zeros((0, 2)), widths, lengths)
    allowed = rng.random((n, m)) < 0.7
    allowed[np.arange(n), rng.integers(0, m, n)] = True
    share = allowed / allowed.sum(axis=1, keepdims=True)
    where = rng.integers(0, m, n)
    places = place[where] + rng.normal(0, rng.choice([0.01, 0.3]) * scale, (3, n, 2))
    yaw = np.where(rng.random((2, n)) < 0.1, np.nan, heading[where] + rng.normal(0, 0.2, (2, n)))
    which = np.array([(p, y) for p in range(3) for y in range(2)])
    for close in (False, True):
        every = (places, yaw, which, np.full(6, close))
        exact = evidence_of_all(every, share, (place, heading, period), widths, 0.35 * spacing, extent)
        bound = evidence_at_most(places, yaw, which, share, known, close)
        assert (bound >= exact - 1e-9 * n).all()
        assert (bound <= exact + 1e-3 * n).all()
    factor = float(rng.choice([0.01, 0.3048, 1.0, 100.0]))
    exact = evidence_of_all(
        (places * factor, yaw, which, np.zeros(6, bool)), share, known[:3], widths, 0.0, extent
    )
    nearest = evidence_of_nearest(places[0], factor, share, known, highest_turn(period))
    assert (nearest >= exact[:2] - 1e-9 * n).all()
