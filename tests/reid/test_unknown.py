"""A heading or a size that is not known tells nothing, to any method: it is never taken for zero."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.reid import REIDENTIFIERS, SpatialReid, explain, identify, track
from farm_ar.reid.costs import dimension_cost, rotation_cost
from farm_ar.scenes import NO_CATEGORY, Camera, Detections, Layout, Scene, Snapshot, SnapshotBatch

METHODS = ["spatial", "distance", "nearest", "likelihood", "relational"]


def world(seed: int, n: int = 5) -> tuple[Scene, Snapshot]:
    """Look-alikes far apart, each seen a little moved, in another order."""
    rng = np.random.default_rng(seed)
    position = np.stack([2.0 * np.arange(n), rng.uniform(0, 3, n)], axis=1)
    yaw, size = rng.uniform(-3, 3, n), rng.uniform(0.3, 0.9, (n, 3))
    layout = Layout(tuple(f"chair {i}" for i in range(n)), ("chair",) * n, position, yaw, size)
    order = rng.permutation(n)
    seen = Detections(
        ("chair",) * n,
        position[order] + rng.normal(0, 0.05, (n, 2)),
        yaw[order] + rng.normal(0, 0.1, n),
        size[order],
        ids=tuple(layout.labels[i] for i in order),
    )
    return Scene("row", (2.0 * n, 4.0), layout), Snapshot(Camera([n, -3.0], 0.0), seen)


def without(record, which, *names):
    """A layout or detections of which some headings or sizes are not known."""
    changes = {}
    for name in names:
        values = getattr(record, name).copy()
        values[which] = np.nan
        changes[name] = values
    return replace(record, **changes)


def forgetful(scene, snapshot, labels, seen, *names):
    layout = without(scene.layout, labels, *names)
    return replace(scene, layout=layout), replace(
        snapshot, detections=without(snapshot.detections, seen, *names)
    )


SOME = st.lists(st.booleans(), min_size=5, max_size=5).map(np.array)


@pytest.mark.parametrize("method", METHODS)
@given(st.integers(0, 1000), SOME, SOME, st.sampled_from([("yaw",), ("size",), ("yaw", "size")]))
def test_what_is_not_known_changes_no_clear_label(method, seed, labels, seen, names):
    scene, snapshot = forgetful(*world(seed), labels, seen, *names)
    found = REIDENTIFIERS[method](scene).identify(snapshot)
    assert found.labels == snapshot.detections.ids
    assert np.isfinite(found.cost).all()
    many = REIDENTIFIERS[method](scene).identify_many(SnapshotBatch.stack([snapshot, snapshot]))
    assert [many.labels[j] for j in many.label[1]] == list(found.labels)


@given(st.integers(0, 1000), SOME, SOME)
def test_the_kernel_and_the_equations_agree_where_something_is_not_known(seed, labels, seen):
    scene, snapshot = forgetful(*world(seed), labels, seen, "yaw", "size")
    reid, detections = SpatialReid(scene), snapshot.detections
    found, cost = reid.identify(snapshot), reid.cost_matrix(snapshot.detections)
    rows = np.arange(5)
    columns = [scene.layout.index(label) for label in found.labels]
    assert found.cost == pytest.approx(cost[rows, columns])
    terms = {"move": np.linalg.norm(detections.position[:, None] - scene.layout.position, axis=-1)}
    weights = reid.costs.weights
    for i in range(5):
        for j in range(5):
            turn = abs(np.sin((detections.yaw[i] - scene.layout.yaw[j]) / 2))
            turn = 0.0 if seen[i] or labels[j] else turn
            one, other = np.sort(detections.size[i]), np.sort(scene.layout.size[j])
            ratio = 1.0 if seen[i] or labels[j] else np.exp(abs(np.log(one / other)).sum())
            wanted = weights.translation * terms["move"][i, j] / scene.diagonal + weights.rotation * turn
            assert cost[i, j] == pytest.approx(ratio * wanted)


def test_terms_that_are_not_known_cost_nothing():
    assert rotation_cost(np.array([np.nan, 0.0]), np.array([1.0, np.nan])).tolist() == [
        *([0.0, 0.0], [np.sin(0.5), 0.0])
    ]
    unknown = np.full((1, 3), np.nan)
    assert dimension_cost(unknown, np.ones((1, 3))) == dimension_cost(np.ones((1, 3)), unknown) == 1


@pytest.mark.parametrize("method", ["likelihood", "relational"])
def test_all_alike_unknown_says_as_much_as_headings_that_carry_nothing(method):
    scene, snapshot = world(3)
    blind = forgetful(scene, snapshot, slice(None), slice(None), "yaw")
    free = replace(scene, symmetry={"chair": 0.0})
    a = REIDENTIFIERS[method](blind[0]).identify(blind[1])
    b = REIDENTIFIERS[method](free).identify(snapshot)
    assert a.labels == b.labels
    assert a.confidence == pytest.approx(b.confidence, abs=1e-9)


@pytest.mark.parametrize("method", ["spatial", "likelihood"])
def test_an_explanation_says_no_turn_where_it_is_not_known(method):
    scene, snapshot = forgetful(*world(1), [0], [0], "yaw", "size")
    for i in range(5):
        words = explain(REIDENTIFIERS[method](scene), snapshot, i).words()
        assert "nan" not in words


def test_a_proof_is_given_where_no_heading_is_known_and_withheld_where_some_are():
    scene, snapshot = world(2)
    blind = forgetful(scene, snapshot, slice(None), slice(None), "yaw")
    assert SpatialReid(blind[0]).identify(blind[1]).certified is not None
    mixed = forgetful(scene, snapshot, [0], [], "yaw")
    assert SpatialReid(mixed[0]).identify(mixed[1]).certified is None


def test_snapshots_fuse_what_one_of_them_knows():
    scene, snapshot = world(4)
    blind = replace(snapshot, detections=without(snapshot.detections, [0, 1], "yaw", "size"))
    fused = track(SpatialReid(scene), [blind, snapshot, blind])
    assert len(fused.objects) == 5
    assert np.isfinite(fused.objects.yaw).all()
    assert np.isfinite(fused.objects.size).all()
    assert [found.labels for found in fused.identifications] == [snapshot.detections.ids] * 3


@pytest.mark.parametrize("method", sorted(REIDENTIFIERS))
def test_categories_of_detections_tell_nothing_where_the_scene_names_none(method):
    scene, snapshot = world(5)
    unnamed = replace(scene, layout=replace(scene.layout, category=(NO_CATEGORY,) * 5))
    names = ("chair", "lamp", None, "chair", "sofa")
    named = replace(snapshot, detections=replace(snapshot.detections, category=names))
    wanted = REIDENTIFIERS[method](scene).identify(snapshot)
    assert REIDENTIFIERS[method](unnamed).identify(named).labels == wanted.labels
    many = REIDENTIFIERS[method](unnamed).identify_many(SnapshotBatch.stack([named]))
    assert many.label[0].tolist() == [-1 if x is None else scene.layout.index(x) for x in wanted.labels]
    found = identify(unnamed, named, method)
    assert found.labels == wanted.labels
    assert not any("the scene has no" in warning for warning in found.warnings)
