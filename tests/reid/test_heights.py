"""Heights tell look-alikes apart that stand above one another, and change nothing where none do."""

from dataclasses import replace

import numpy as np
import pytest

from farm_ar.reid import REIDENTIFIERS, SpatialOptions, SpatialReid, explain
from farm_ar.reid.spatial import HEIGHTS_COUNT
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot, SnapshotBatch

SIDE = 0.2


def shelf(levels: list[float]) -> Scene:
    """Boxes above one another, and one beside them on the floor."""
    n = len(levels) + 1
    layout = Layout(
        tuple("abcd"[:n]),
        ("box",) * n,
        np.array([[1.0, 1.0]] * (n - 1) + [[1.6, 1.2]]),
        np.zeros(n),
        np.full((n, 3), SIDE),
        elevation=np.array([*levels, 0.0]),
    )
    return Scene("shelf", (2.0, 2.0), layout)


def seen(scene: Scene, order: list[int], off: float = 0.0, height: float = 0.0) -> Snapshot:
    rng = np.random.default_rng(len(order))
    layout = scene.layout
    detections = Detections(
        ("box",) * len(order),
        layout.position[order] + rng.normal(0, off, (len(order), 2)),
        np.zeros(len(order)),
        layout.size[order],
        elevation=layout.elevation[order] + rng.normal(0, height, len(order)),
    )
    return Snapshot(Camera([1.0, -1.0], 0.0, FieldOfView.symmetric(1.7, 4.0)), detections)


@pytest.mark.parametrize("name", ["spatial", "spatial-scale-free", "likelihood", "relational"])
@pytest.mark.parametrize("order", [[0, 1, 2, 3], [2, 0, 3, 1], [1, 2]])
def test_boxes_above_one_another_are_told_apart_by_their_heights(name: str, order: list[int]) -> None:
    scene = shelf([0.0, 0.5, 1.0])
    snapshot = seen(scene, order, off=0.03, height=0.01)
    reid = REIDENTIFIERS[name](scene)
    found = reid.identify(snapshot)
    assert found.labels == tuple(scene.layout.labels[i] for i in order)
    many = reid.identify_many(SnapshotBatch.stack([snapshot, snapshot]))
    assert many.label[0].tolist() == order
    if name.startswith("spatial"):
        assert HEIGHTS_COUNT in found.warnings
        assert found.certified is None
    else:
        assert found.confidence.min() > 0.8


def test_labels_that_are_chosen_cost_what_they_cost_among_all() -> None:
    scene, chosen = shelf([0.0, 0.5, 1.0]), np.array([2, 1])
    detections, costs = seen(scene, [2, 0]).detections, SpatialReid(scene).costs
    np.testing.assert_allclose(
        costs.matrix(detections, chosen), costs.matrix(detections)[:, chosen], rtol=1e-13
    )


def test_a_proven_answer_counts_heights_too() -> None:
    scene = shelf([0.0, 0.5, 1.0])
    snapshot = seen(scene, [2, 0, 1], off=0.03, height=0.01)
    plain = SpatialReid(scene).identify(snapshot)
    proven = SpatialReid(scene, SpatialOptions(certify=True)).identify(snapshot)
    assert proven.labels == plain.labels == ("c", "a", "b")
    np.testing.assert_allclose(proven.cost, plain.cost)


def test_a_difference_in_height_costs_what_a_shift_as_long_does() -> None:
    scene = shelf([0.0, 0.5])
    snapshot = seen(scene, [0, 1])
    reid = SpatialReid(scene)
    weight = reid.costs.weights.translation / scene.diagonal
    assert reid.cost_terms(snapshot)["distance"][0] == pytest.approx(
        weight * np.array([0.0, 0.5, np.hypot(0.6, 0.2)])
    )
    away = [np.hypot(0.6, 0.2), np.sqrt(0.6**2 + 0.2**2 + 0.5**2)]  # it is the box beside them instead
    assert reid.identify(snapshot).margin == pytest.approx(weight * np.array(away))
    assert explain(reid, snapshot, 1).margin == pytest.approx(weight * away[1])


@pytest.mark.parametrize("name", ["spatial", "likelihood", "relational"])
def test_heights_change_nothing_where_no_look_alikes_differ_in_theirs_or_none_is_told(name: str) -> None:
    level, stacked = shelf([0.0, 0.0]), shelf([0.0, 0.5])
    snapshot = seen(level, [0, 2], off=0.05)
    raised = replace(snapshot.detections, elevation=np.array([0.4, 0.1]))
    reid = REIDENTIFIERS[name](level)
    one, other = reid.identify(snapshot), reid.identify(replace(snapshot, detections=raised))
    assert one.labels == other.labels
    np.testing.assert_array_equal(one.cost, other.cost)
    assert HEIGHTS_COUNT not in (*one.warnings, *other.warnings)
    untold = REIDENTIFIERS[name](stacked).identify(snapshot)
    np.testing.assert_allclose(untold.cost, one.cost, atol=1e-12)
