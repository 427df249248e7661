"""The best assignment to many labels from the nearest alone is the best of all."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.reid import SpatialOptions, SpatialReid
from farm_ar.reid.assignment import nearest, solve_lsap
from farm_ar.scenes import Camera, Detections, Layout, Scene, Snapshot

CERTIFIED = SpatialOptions(certify=True)


def crowd(rng, m, names=("box", "drum"), scale=1.0, origin=(0.0, 0.0)):
    """M labels of several categories and sizes, as dense as one a square `scale`."""
    side = scale * np.sqrt(m)
    layout = Layout(
        labels=tuple(f"label {j}" for j in range(m)),
        category=tuple(names[j % len(names)] for j in range(m)),
        position=rng.uniform(0, side, (m, 2)) + origin,
        yaw=np.where(rng.random(m) < 0.1, np.nan, rng.uniform(-np.pi, np.pi, m)),
        size=scale * rng.choice([0.2, 0.3, 0.5], (m, 3)),
    )
    return Scene("crowd", None, layout)


def seen_of(scene, rng, n, shift, anywhere=0.1):
    """A snapshot of n objects near one another, moved by `shift`, some of them anywhere."""
    layout = scene.layout
    low, high = layout.position.min(axis=0), layout.position.max(axis=0)
    middle = rng.uniform(low, high)
    some = np.linalg.norm(layout.position - middle, axis=1).argsort()[:n]
    position = layout.position[some] + rng.normal(0, shift, (n, 2))
    lost = rng.random(n) < anywhere
    position[lost] = rng.uniform(low, high, (lost.sum(), 2))
    known = [None if rng.random() < 0.1 else layout.category[j] for j in some]
    yaw = np.where(rng.random(n) < 0.1, np.nan, layout.yaw[some] + rng.normal(0, 0.5, n))
    seen = Detections(tuple(known), position, yaw, layout.size[some])
    return Snapshot(Camera(middle, np.asarray(0.0)), seen)


def least_of_all(scene, snapshot):
    """The least total cost by a solver that is given all costs."""
    cost, _ = SpatialReid(scene).problem(snapshot)
    column = solve_lsap(np.where(np.isfinite(cost), cost, 1e6))
    return cost[np.arange(len(cost)), column].sum()


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    m=st.sampled_from([5, 40, 400, 1500]),
    share=st.floats(0.05, 1.0),
    shift=st.sampled_from([0.0, 0.25, 1.0, 4.0]),
    scale=st.sampled_from([0.01, 1.0, 300.0]),
)
def test_the_answer_is_the_optimum_over_all_labels(seed, m, share, shift, scale):
    rng = np.random.default_rng(seed)
    scene = crowd(rng, m, scale=scale, origin=rng.uniform(-300, 300, 2))
    snapshot = seen_of(scene, rng, max(1, min(60, int(share * m))), shift * scale)
    found = SpatialReid(scene, CERTIFIED).identify(snapshot)
    assert None not in found.labels
    assert len(set(found.labels)) == len(found.labels)
    assert found.total == pytest.approx(least_of_all(scene, snapshot), rel=1e-9, abs=1e-12)
    place = [scene.layout.labels.index(label) for label in found.labels]
    costs, _ = SpatialReid(scene).problem(snapshot)
    assert found.cost == pytest.approx(costs[np.arange(len(costs)), place])


def test_two_hundred_among_ten_thousand_are_the_optimum_from_few_of_them():
    rng = np.random.default_rng(5)
    scene = crowd(rng, 10_000)
    reid = SpatialReid(scene, CERTIFIED)
    for _ in range(2):
        snapshot = seen_of(scene, rng, 200, 0.25)
        found = reid.identify(snapshot)
        assert found.total == pytest.approx(least_of_all(scene, snapshot), rel=1e-9)
        assert len(found.candidates) < 3000


def test_where_many_want_the_same_labels_more_are_tried_until_it_is_proven(monkeypatch):
    rng = np.random.default_rng(1)
    scene = crowd(rng, 600)
    layout = scene.layout
    n = 80  # all at one spot, so that the sixteen nearest labels are far from enough
    seen = Detections((None,) * n, np.tile(layout.position[7], (n, 1)), np.zeros(n), np.full((n, 3), 0.3))
    snapshot = Snapshot(Camera(np.zeros(2), np.asarray(0.0)), seen)
    found = SpatialReid(scene, CERTIFIED).identify(snapshot)
    assert found.total == pytest.approx(least_of_all(scene, snapshot), rel=1e-9)
    assert len(found.candidates) >= n
    monkeypatch.setattr(nearest, "FIRST", 1)
    again = SpatialReid(scene, CERTIFIED).identify(snapshot)
    assert again.total == pytest.approx(found.total, rel=1e-9)


def test_more_detections_than_labels_leave_the_dearest_without():
    rng = np.random.default_rng(3)
    scene = crowd(rng, 6, names=("box",))
    snapshot = seen_of(scene, rng, 6, 0.1, anywhere=0.0)
    seen = snapshot.detections
    twice = Detections(
        ("box",) * 12,
        np.vstack([seen.position, seen.position + 5]),
        np.tile(seen.yaw, 2),
        np.tile(seen.size, (2, 1)),
    )
    found = SpatialReid(scene, CERTIFIED).identify(Snapshot(snapshot.camera, twice))
    plain = SpatialReid(scene).identify(Snapshot(snapshot.camera, twice))
    assert found.labels == plain.labels
    assert found.labels.count(None) == 6


def test_margins_are_over_all_labels():
    rng = np.random.default_rng(4)
    scene = crowd(rng, 300)
    snapshot = seen_of(scene, rng, 12, 0.5)
    found, plain = (SpatialReid(scene, one).identify(snapshot) for one in (CERTIFIED, SpatialOptions()))
    assert found.labels == plain.labels
    assert found.margin == pytest.approx(plain.margin)
    assert found.runner_up == plain.runner_up
