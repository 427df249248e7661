"""How a stranger writes the world down changes no answer of `adaptive`."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.reid import AdaptiveReid
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot

SEEDS = st.integers(0, 10**6)


def world(seed):
    """Some things of two categories, moved somehow, and what a camera sees of them."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 9))
    category = tuple(rng.choice(["chair", "lamp"], n))
    position, yaw = rng.random((n, 2)) * (4.0, 3.0), rng.uniform(-np.pi, np.pi, n)
    size = np.exp(rng.normal(0, 0.05, (n, 3)))
    layout = Layout(tuple("abcdefgh"[:n]), category, position, yaw, size)
    seen = rng.permutation(n)[: int(rng.integers(1, n + 1))]
    detections = Detections(
        category=tuple(category[i] if rng.random() < 0.9 else None for i in seen),
        position=position[seen] + rng.normal(0, rng.choice([0.05, 0.5]), (len(seen), 2)),
        yaw=yaw[seen] + rng.normal(0, rng.choice([0.1, 1.0]), len(seen)),
        size=size[seen] * np.exp(rng.normal(0, 0.05, (len(seen), 3))),
    )
    camera = Camera(rng.random(2) * (4.0, 3.0), rng.uniform(-np.pi, np.pi), FieldOfView(1.0, 0.7, 3.0))
    return Scene("world", (4.0, 3.0), layout), Snapshot(camera, detections)


def rewritten(scene, snapshot, shift=(0.0, 0.0), turn=0.0, scale=1.0, mirror=False):
    """The same in another frame: mirrored, turned clockwise, scaled, then shifted."""
    side = -1.0 if mirror else 1.0
    cosine, sine = np.cos(turn), np.sin(turn)

    def place(position):
        x, z = side * position[..., 0], position[..., 1]
        return scale * np.stack([x * cosine + z * sine, z * cosine - x * sine], axis=-1) + np.asarray(shift)

    def poses(one):
        return {"position": place(one.position), "yaw": side * one.yaw + turn}

    def sized(one):
        return poses(one) | {"size": scale * one.size, "elevation": scale * one.elevation}

    fov = snapshot.camera.fov
    left, right = (fov.right, fov.left) if mirror else (fov.left, fov.right)
    camera = Camera(**poses(snapshot.camera), fov=FieldOfView(left, right, scale * fov.range_m))
    layout = replace(scene.layout, **sized(scene.layout))
    known = Scene(scene.name, (1e6, 1e6), layout)
    return known, Snapshot(camera, replace(snapshot.detections, **sized(snapshot.detections)))


def assert_same(first, second, confidence=1e-9):
    clear = np.nan_to_num(first.margin, nan=1.0) > 1e-9
    same = [a == b for a, b, sure in zip(first.labels, second.labels, clear, strict=True) if sure]
    assert all(same)
    np.testing.assert_allclose(second.probability, first.probability, rtol=0, atol=confidence)


@settings(max_examples=60, deadline=None)
@given(
    seed=SEEDS,
    shift=st.tuples(*2 * [st.floats(-1000, 1000)]),
    turn=st.floats(-7, 7),
    log_scale=st.floats(-3, 2.2),
    mirror=st.booleans(),
)
def test_origin_heading_unit_and_handedness_change_nothing(seed, shift, turn, log_scale, mirror):
    scene, snapshot = world(seed)
    scale = 10.0**log_scale
    away = tuple(5.0 * scale * x for x in shift)
    answer = AdaptiveReid(scene).identify(snapshot)
    known, seen = rewritten(scene, snapshot, away, turn, scale, mirror)
    assert_same(answer, AdaptiveReid(known).identify(seen))


@settings(max_examples=20, deadline=None)
@given(seed=SEEDS, log_scale=st.floats(-3, 3))
def test_any_unit_is_as_good(seed, log_scale):
    scene, snapshot = world(seed)
    known, seen = rewritten(scene, snapshot, scale=10.0**log_scale)
    assert_same(AdaptiveReid(scene).identify(snapshot), AdaptiveReid(known).identify(seen))


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS)
def test_the_order_of_detections_and_of_labels_tells_nothing(seed):
    scene, snapshot = world(seed)
    rng = np.random.default_rng(seed)
    seen = snapshot.detections
    order = rng.permutation(len(seen))
    shuffled = Detections(
        tuple(seen.category[i] for i in order), seen.position[order], seen.yaw[order], seen.size[order]
    )
    answer = AdaptiveReid(scene).identify(snapshot)
    other = AdaptiveReid(scene).identify(Snapshot(snapshot.camera, shuffled))
    np.testing.assert_allclose(other.probability, answer.probability[order], rtol=0, atol=1e-9)
    labels = rng.permutation(len(scene.layout))
    known = replace(scene, layout=scene.layout.subset(labels))
    other = AdaptiveReid(known).identify(snapshot)
    np.testing.assert_allclose(other.probability[:, :-1], answer.probability[:, labels], rtol=0, atol=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_no_trick_changes_what_is_believed(seed):
    """A far lamp out of view, a range beyond all that is in view, walls where nothing stands."""
    scene, snapshot = world(seed)
    layout, seen = scene.layout, snapshot.detections
    category = tuple("chair" if name is None else name for name in seen.category)
    fov = FieldOfView(np.pi, np.pi, 100.0)
    snapshot = Snapshot(replace(snapshot.camera, fov=fov), replace(seen, category=category))
    answer = AdaptiveReid(scene).identify(snapshot)
    more = Layout(
        (*layout.labels, "far"),
        (*layout.category, "beacon"),
        np.vstack([layout.position, [500.0, 700.0]]),
        np.append(layout.yaw, 0.0),
        np.vstack([layout.size, [3.0, 3.0, 3.0]]),
    )
    with_lamp = AdaptiveReid(replace(scene, layout=more)).identify(snapshot)
    farther = replace(snapshot, camera=replace(snapshot.camera, fov=FieldOfView(np.pi, np.pi, 1e4)))
    wider = replace(scene, size=(40.0, 30.0))
    others = [with_lamp, AdaptiveReid(scene).identify(farther), AdaptiveReid(wider).identify(snapshot)]
    for other in others:
        assert other.labels == answer.labels
        np.testing.assert_allclose(other.confidence, answer.confidence, rtol=0, atol=0.02)
