import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import OptionError, SceneError, SnapshotError
from farm_ar.reid import (
    BASELINES,
    DistanceReid,
    Identification,
    LastKnownReid,
    NearestReid,
    Reidentifier,
    SpatialOptions,
    SpatialReid,
    SquaredDistanceReid,
    accuracy,
)
from farm_ar.scenes import (
    Camera,
    Detections,
    Layout,
    LayoutNoise,
    Scene,
    Snapshot,
    builtin_scene,
    observe_many,
)

METHODS: list[Callable[[Scene], Reidentifier]] = [SpatialReid, *BASELINES.values()]
SIDE = 5 / np.sqrt(2)  # of a square room whose diagonal is 5 m
SIZE = (0.4, 0.8, 0.5)


def row_of_chairs(*x: float) -> Scene:
    """Chairs "0", "1", ... at the given x and z = 0, all facing +z."""
    n = len(x)
    layout = Layout(
        labels=tuple(str(i) for i in range(n)),
        category=("chair",) * n,
        position=np.array([(value, 0.0) for value in x]).reshape(n, 2),
        yaw=np.zeros(n),
        size=np.array([SIZE] * n).reshape(n, 3),
    )
    return Scene("row", (SIDE, SIDE), layout)


def seen_at(*x: float, yaw: float = 0.0, category: str | None = "chair") -> Snapshot:
    n = len(x)
    position = np.array([(value, 0.0) for value in x]).reshape(n, 2)
    size = np.array([SIZE] * n).reshape(n, 3)
    return Snapshot(Camera([0.0, 0.0], 0.0), Detections((category,) * n, position, np.full(n, yaw), size))


@pytest.mark.parametrize("method", METHODS)
def test_every_method_is_a_reidentifier(method: Callable[[Scene], Reidentifier]) -> None:
    assert isinstance(method(row_of_chairs(0.0)), Reidentifier)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_identifies_what_has_not_moved(method: Callable[[Scene], Reidentifier]) -> None:
    scene = builtin_scene("classroom")
    assert scene.camera_path is not None
    batch = observe_many(scene.layout, scene.camera_path.cameras(20, scene.fov))
    for b in np.flatnonzero(batch.count):
        found = method(scene).identify(batch.snapshot(b))
        assert accuracy(found, batch.true_labels(b, scene.layout.labels)) == 1


@pytest.mark.parametrize("method", METHODS)
def test_every_method_has_an_empty_answer_to_an_empty_snapshot(
    method: Callable[[Scene], Reidentifier],
) -> None:
    found = method(row_of_chairs(0.0, 1.0)).identify(seen_at())
    assert (found.labels, found.cost.shape, found.total) == ((), (0,), 0.0)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_refuses_a_scene_without_labels(method: Callable[[Scene], Reidentifier]) -> None:
    with pytest.raises(SceneError, match=r"^objects: must be at least one, got 0$"):
        method(row_of_chairs())


@pytest.mark.parametrize("method", METHODS)
def test_every_method_refuses_a_category_that_the_scene_does_not_declare(
    method: Callable[[Scene], Reidentifier],
) -> None:
    reid = method(row_of_chairs(0.0, 1.0))
    message = r"^detections\[0\]\.category: must be null or one of chair, got 'sofa'$"
    with pytest.raises(SnapshotError, match=message):
        reid.identify(seen_at(0.0, category="sofa"))
    assert reid.identify(seen_at(0.0, category=None)).labels == ("0",)


def test_the_simpler_methods_are_known_by_name() -> None:
    named = {"nearest": NearestReid, "distance": DistanceReid, "last-known": LastKnownReid}
    assert {**named, "squared-distance": SquaredDistanceReid} == BASELINES


@given(st.integers(0, 10_000), st.integers(0, 5), st.integers(1, 5))
def test_squares_of_distances_sum_to_the_least_of_all_assignments_within_categories(
    seed: int, detections: int, labels: int
) -> None:
    rng = np.random.default_rng(seed)
    scene, seen = row_of_chairs(*rng.uniform(0, 3, labels)), seen_at(*rng.uniform(0, 3, detections))
    kinds = np.array(["chair", "stool"])
    layout = replace(scene.layout, category=tuple(kinds[rng.integers(2, size=labels)]))
    declared = [*layout.category, None]
    asked = tuple(declared[i] for i in rng.integers(len(declared), size=detections))
    seen = replace(seen, detections=replace(seen.detections, category=asked))
    found = SquaredDistanceReid(replace(scene, layout=layout)).identify(seen)
    spare = [None] * detections
    ways = set(itertools.permutations([*range(labels), *spare], detections))
    x, z = seen.detections.position[:, 0], layout.position[:, 0]
    best = min(
        (way.count(None), sum((x[i] - z[j]) ** 2 for i, j in enumerate(way) if j is not None))
        for way in ways
        if all(j is None or asked[i] in (None, layout.category[j]) for i, j in enumerate(way))
    )
    assert found.labels.count(None) == best[0]
    assert found.total * 25 == pytest.approx(best[1])


def test_nearest_gives_the_nearest_label_even_twice() -> None:
    found = NearestReid(row_of_chairs(0.0, 1.0, 2.0)).identify(seen_at(0.9, 1.2, 5.0))
    assert found.labels == ("1", "1", "2")
    np.testing.assert_allclose(found.cost, [0.1 / 5, 0.2 / 5, 3.0 / 5])
    assert found.candidates == ("0", "1", "2")


def mixed_row() -> Scene:
    """Chair "0" at 0 m, table "1" at 1 m, chair "2" at 3 m."""
    scene = row_of_chairs(0.0, 1.0, 3.0)
    return replace(scene, layout=replace(scene.layout, category=("chair", "table", "chair")))


@pytest.mark.parametrize("method", [NearestReid, DistanceReid, SquaredDistanceReid])
def test_simpler_methods_keep_categories_apart_by_default(
    method: Callable[..., Reidentifier],
) -> None:
    chairs, unknown = seen_at(1.1, 2.9), seen_at(1.1, 2.9, category=None)
    found = method(mixed_row()).identify(chairs)
    assert found.labels == ("0", "2")
    power = 2 if method is SquaredDistanceReid else 1
    np.testing.assert_allclose(found.cost, np.power([1.1 / 5, 0.1 / 5], power))
    assert method(mixed_row(), gate_categories=False).identify(chairs).labels == ("1", "2")
    assert method(mixed_row()).identify(unknown).labels == ("1", "2")


def test_nearest_has_a_runner_up_of_the_category_only() -> None:
    found = NearestReid(mixed_row()).identify(seen_at(1.1, category="table"))
    assert (found.labels, found.runner_up, found.margin.tolist()) == (("1",), (None,), [np.inf])
    found = NearestReid(mixed_row()).identify(seen_at(1.1))
    assert (found.labels, found.runner_up) == (("0",), ("2",))
    assert found.margin.tolist() == pytest.approx([(1.9 - 1.1) / 5])


def test_distance_gives_each_label_once_at_the_least_total_distance() -> None:
    # Nearest to both is label 1. Giving it to the second costs 0.9 + 0.2, to the first 0.1 + 0.8.
    found = DistanceReid(row_of_chairs(0.0, 1.0, 2.0)).identify(seen_at(0.9, 1.2))
    assert found.labels == ("1", "2")
    np.testing.assert_allclose(found.cost, [0.1 / 5, 0.8 / 5])


def test_distance_does_not_look_at_the_heading_nor_at_the_scenes_weights() -> None:
    scene = row_of_chairs(0.0, 1.0)
    expected = DistanceReid(scene).identify(seen_at(0.4))
    turned = DistanceReid(scene).identify(seen_at(0.4, yaw=3.0))
    assert turned.labels == expected.labels == ("0",)
    np.testing.assert_allclose(turned.cost, [0.4 / 5])


@given(seed=st.integers(0, 2**32 - 1))
def test_no_method_comes_nearer_in_all_than_distance(make_scene: Any, make_batch: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene = make_scene(rng, objects=9)
    snapshot = make_batch(rng, scene, snapshots=2).snapshot(1)

    def moved(found: Identification) -> float:
        places = scene.layout.position[[scene.layout.index(str(label)) for label in found.labels]]
        return float(np.linalg.norm(places - snapshot.detections.position, axis=1).sum())

    ungated = SpatialReid(scene, SpatialOptions(gate_categories=False))
    found = DistanceReid(scene, gate_categories=False).identify(snapshot)
    assert found.total * scene.diagonal == pytest.approx(moved(found))
    assert moved(found) <= moved(ungated.identify(snapshot)) + 1e-9
    assert moved(NearestReid(scene, gate_categories=False).identify(snapshot)) <= moved(found) + 1e-9


def test_distance_breaks_ties_at_random_on_request() -> None:
    reid = DistanceReid(row_of_chairs(0.0, 1.0), np.random.default_rng(0))
    assert {reid.identify(seen_at(0.5)).labels[0] for _ in range(30)} == {"0", "1"}


def test_last_known_leaves_what_has_moved_unidentified() -> None:
    found = LastKnownReid(row_of_chairs(0.0, 1.0, 2.0)).identify(seen_at(1.005, 1.5, 2.02))
    assert found.labels == ("1", None, None)
    np.testing.assert_allclose(found.cost, [0.001, np.nan, np.nan], atol=1e-12)
    assert found.total == pytest.approx(0.001)


def test_last_known_can_be_more_tolerant() -> None:
    snapshot = seen_at(1.005, 1.5, 2.02)
    assert LastKnownReid(row_of_chairs(0.0, 1.0, 2.0), 0.05).identify(snapshot).labels == ("1", None, "2")
    assert LastKnownReid(row_of_chairs(0.0, 1.0, 2.0), 0.0).identify(seen_at(1.0)).labels == ("1",)


@pytest.mark.parametrize("tolerance", [-0.1, float("nan")])
def test_last_known_refuses_a_tolerance_below_nothing(tolerance: float) -> None:
    with pytest.raises(OptionError, match=r"^tolerance_m: must not be negative, got "):
        LastKnownReid(row_of_chairs(0.0), tolerance)


def test_the_papers_method_beats_the_simpler_ones_in_its_own_scenes(rng: np.random.Generator) -> None:
    scene = builtin_scene("M1")
    assert scene.camera_path is not None
    noisy = LayoutNoise.of(0.3, 30).disturb(scene.layout, scene.size, rng, (5, 1))
    batch = observe_many(noisy, scene.camera_path.cameras(40, scene.fov))
    ungated = SpatialOptions(gate_categories=False)
    methods = {
        "spatial": SpatialReid(scene, ungated),
        "pruned": SpatialReid(scene, replace(ungated, threshold=0.0)),
        "nearest": NearestReid(scene, gate_categories=False),
        "distance": DistanceReid(scene, gate_categories=False),
        "last": LastKnownReid(scene),
    }
    mean = {
        name: np.mean(
            [
                accuracy(method.identify(batch.snapshot(b)), batch.true_labels(b, scene.layout.labels))
                for b in np.flatnonzero(batch.count)
            ]
        )
        for name, method in methods.items()
    }
    assert mean["spatial"] > max(mean["nearest"], mean["distance"], mean["pruned"])
    assert mean["last"] < 0.1


def test_nearest_says_which_label_is_next_and_by_how_much() -> None:
    layout = Layout(
        ("a", "b"), ("chair",) * 2, np.array([[0.0, 0.0], [3.0, 4.0]]), np.zeros(2), np.ones((2, 3))
    )
    scene = Scene("two", (3.0, 4.0), layout)
    seen = Detections(("chair",), np.array([[0.0, 1.0]]), np.zeros(1), np.ones((1, 3)))
    found = NearestReid(scene).identify(Snapshot(Camera(np.zeros(2), np.array(0.0)), seen))
    assert found.labels == ("a",)
    assert found.runner_up == ("b",)
    assert found.margin.tolist() == pytest.approx([(np.hypot(3, 3) - 1) / 5])
    alone = NearestReid(Scene("one", (3.0, 4.0), layout.subset([0])))
    found = alone.identify(Snapshot(Camera(np.zeros(2), np.array(0.0)), seen))
    assert found.margin.tolist() == [np.inf]
    assert found.runner_up == (None,)
