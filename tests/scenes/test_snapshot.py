"""Snapshots: what was detected, one at a time and many as arrays."""

import dataclasses
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import SnapshotError
from farm_ar.scenes import UNKNOWN, Camera, Detections, FieldOfView, Snapshot, SnapshotBatch
from farm_ar.scenes.uncertainty import Uncertainty

ARRAYS = ("position", "yaw", "size", "elevation")


def detections(n: int, seed: int = 0, category: tuple[str | None, ...] | None = None) -> Detections:
    rng = np.random.default_rng(seed)
    kinds = tuple(["chair", None, "table"][int(k)] for k in rng.integers(3, size=n))
    return Detections(
        kinds if category is None else category,
        rng.random((n, 2)),
        rng.random(n),
        rng.random((n, 3)) + 0.1,
        rng.random(n),
        rng.random(n),
        tuple("abcdefgh"[:n]),
    )


def test_detections_stand_on_the_floor_are_sure_and_numbered_unless_said_otherwise():
    seen = Detections(("chair", None), np.zeros((2, 2)), [0, 1], np.ones((2, 3)))
    assert len(seen) == 2
    assert seen.elevation.tolist() == [0, 0]
    assert seen.confidence.tolist() == [1, 1]
    assert seen.ids == ("0", "1")


def test_there_may_be_no_detections():
    seen = Detections((), [], [], [])
    assert len(seen) == 0
    assert seen.position.shape == (0, 2)
    assert seen.size.shape == (0, 3)


@pytest.mark.parametrize("known", [True, False])
def test_some_of_the_detections_keep_all_that_is_known_of_them_in_the_order_asked_for(known):
    n, rows = 4, [3, 0]
    spread = Uncertainty(
        np.eye(3) * np.arange(1.0, n + 1)[:, None, None], np.full(n, 0.5), *np.full((2, n), np.nan)
    )
    whole = Detections(
        *(getattr(detections(n), name) for name in ("category", *ARRAYS, "confidence", "ids")),
        track_id=("p", None, "q", "r"),
        broken=("upside down", None, None, None),
        tilt=np.arange(8.0).reshape(4, 2) / 10 if known else None,
        uncertainty=spread if known else None,
    )
    kept = whole.at(np.array(rows))
    for field in dataclasses.fields(Detections):
        value, before = getattr(kept, field.name), getattr(whole, field.name)
        if field.name == "uncertainty" and known:
            np.testing.assert_array_equal(value.covariance[:, 0, 0], [4.0, 1.0])
        elif before is None:
            assert value is None, field.name
        else:
            assert list(map(str, value)) == [str(before[i]) for i in rows], field.name


def test_no_array_of_detections_can_be_written_to_even_after_pickling():
    for seen in (detections(2), pickle.loads(pickle.dumps(detections(2)))):
        for name in (*ARRAYS, "confidence"):
            with pytest.raises(ValueError, match="read-only"):
                getattr(seen, name)[...] = 1


GOOD: dict[str, Any] = {
    "category": ("chair", None),
    "position": np.zeros((2, 2)),
    "yaw": np.zeros(2),
    "size": np.ones((2, 3)),
}


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        (
            "position",
            [(0, 0), (np.nan, 0)],
            r"detections\[1\].position: must be finite, from -1e6 to 1e6 metres, got \[nan, 0.0\]",
        ),
        ("position", np.zeros((2, 3)), r"detections.position: must have shape \(2, 2\), got \(2, 3\)"),
        ("yaw", [np.inf, 0], r"detections\[0\].yaw: must be finite, at most 1e6 turns, got inf"),
        ("yaw", None, r"detections.yaw: must have shape \(2,\), got \(\)"),
        (
            "size",
            [(1, 1, 1), (1, 0, 1)],
            r"detections\[1\].size: must be positive metres, from 1e-6 to 1e6, got \[1.0, 0.0, 1.0\]",
        ),
        (
            "size",
            [(1, 1, 1), (1, np.inf, 1)],
            r"detections\[1\].size: must be positive metres, from 1e-6 to 1e6, got \[1.0, inf, 1.0\]",
        ),
        (
            "elevation",
            [0, np.nan],
            r"detections\[1\].elevation: must be finite, from -1e6 to 1e6 metres, got nan",
        ),
        ("confidence", [0, 1.1], r"detections\[1\].confidence: must be from 0 to 1, got 1.1"),
        ("confidence", [-0.1, 1], r"detections\[0\].confidence: must be from 0 to 1, got -0.1"),
        ("category", ("chair", ""), r"detections\[1\].category: must be a category or None, got ''"),
        ("category", (3, "chair"), r"detections\[0\].category: must be a category or None, got 3"),
        ("category", ("chair",), r"detections.position: must have shape \(1, 2\), got \(2, 2\)"),
        ("ids", ("a", "a"), r"detections.id: must be 2 different names, got \['a', 'a'\]"),
        ("ids", ("a",), r"detections.id: must be 2 different names, got \['a'\]"),
        ("ids", ("a", "b", "b"), r"detections.id: must be 2 different names, got \['a', 'b', 'b'\]"),
        ("ids", ("a", ""), r"detections.id: must be 2 different names, got \['a', ''\]"),
        ("ids", ("a", 1), r"detections.id: must be 2 different names, got \['a', 1\]"),
    ],
)
def test_detections_that_cannot_be_are_refused_by_the_name_of_their_field(name, value, message):
    with pytest.raises(SnapshotError, match=message):
        Detections(**GOOD | {name: value})


def test_a_snapshot_has_one_camera():
    with pytest.raises(SnapshotError, match=r"camera: must be a single camera, got \(1,\)"):
        Snapshot(Camera([(0, 0)], [0]), detections(1))


def snapshot(n: int, seed: int, height: float | None = 1.5) -> Snapshot:
    return Snapshot(Camera([seed, 1], seed / 10, height=height, pitch=-0.1 * seed), detections(n, seed))


@given(st.lists(st.integers(0, 6), min_size=1, max_size=5), st.sampled_from([None, 1.5]))
def test_stacked_snapshots_come_back_one_by_one_but_for_ids_and_confidence(counts, height):
    snapshots = [snapshot(n, seed, height) for seed, n in enumerate(counts)]
    batch = SnapshotBatch.stack(snapshots)
    assert len(batch) == len(counts)
    assert batch.count.tolist() == counts
    assert batch.truth is None
    for index, one in enumerate(snapshots):
        again = batch.snapshot(index)
        assert again.detections.category == one.detections.category
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(again.detections, name), getattr(one.detections, name))
        assert again.detections.ids == tuple(str(i) for i in range(counts[index]))
        assert (again.detections.confidence == 1).all()
        for name in ("position", "yaw", "pitch"):
            np.testing.assert_array_equal(getattr(again.camera, name), getattr(one.camera, name))
        assert again.camera.height == one.camera.height
        assert again.camera.fov == one.camera.fov


def test_the_categories_of_a_batch_are_those_that_occur():
    snapshots = [
        Snapshot(Camera([0, 0], 0), detections(2, 0, ("table", None))),
        Snapshot(Camera([0, 0], 0), detections(1, 1, ("chair",))),
    ]
    batch = SnapshotBatch.stack(snapshots)
    assert batch.categories == ("chair", "table")
    assert batch.category[0].tolist() == [1, UNKNOWN]
    assert batch.category[1, 0] == 0


def test_no_snapshots_cannot_be_stacked():
    with pytest.raises(SnapshotError, match="snapshots: must be at least one, got 0"):
        SnapshotBatch.stack([])


def test_snapshots_of_different_fields_of_view_cannot_be_stacked():
    other = Snapshot(Camera([0, 0], 0, FieldOfView(1, 1, 1)), detections(1))
    with pytest.raises(SnapshotError, match=r"snapshots\[1\].camera.fov: must be the first one's"):
        SnapshotBatch.stack([snapshot(1, 0), other])


def test_snapshots_with_and_without_a_camera_height_cannot_be_stacked():
    with pytest.raises(
        SnapshotError, match="snapshots: must all have a camera height, or none, got '1 that have'"
    ):
        SnapshotBatch.stack([snapshot(1, 0), snapshot(1, 1, None)])


def batch_values() -> dict[str, Any]:
    """Two snapshots, of two detections and of one."""
    return {
        "camera": Camera(np.zeros((2, 2)), np.zeros(2)),
        "count": np.array([2, 1]),
        "categories": ["chair", "table"],
        "category": np.array([[0, 1], [UNKNOWN, 0]]),
        "position": np.zeros((2, 2, 2)),
        "yaw": np.zeros((2, 2)),
        "size": np.ones((2, 2, 3)),
        "elevation": np.zeros((2, 2)),
        "truth": np.array([[5, UNKNOWN], [3, 4]]),
    }


def test_the_true_labels_are_names_and_none_for_false_detections():
    batch = SnapshotBatch(**batch_values())
    labels = [f"label {i}" for i in range(6)]
    assert batch.true_labels(0, labels) == ("label 5", None)
    assert batch.true_labels(1, labels) == ("label 3",)


def test_true_labels_that_are_not_known_are_refused():
    with pytest.raises(SnapshotError, match="truth: must be known, got None"):
        SnapshotBatch(**batch_values() | {"truth": None}).true_labels(0, ("a",))


def test_no_array_of_a_batch_can_be_written_to_even_after_pickling():
    batch = SnapshotBatch(**batch_values())
    for one in (batch, pickle.loads(pickle.dumps(batch))):
        assert one.categories == ("chair", "table")
        for name in (*ARRAYS, "count", "category", "truth"):
            with pytest.raises(ValueError, match="read-only"):
                getattr(one, name)[...] = 1


def wrong_at(name: str, index: tuple[int, ...], value: float) -> tuple[str, Any]:
    array = batch_values()[name].astype(float if name in ARRAYS else int)
    array[index] = value
    return name, array


@pytest.mark.parametrize(
    "change",
    [
        wrong_at("position", (1, 1, 0), np.nan),
        wrong_at("yaw", (1, 1), np.nan),
        wrong_at("size", (1, 1, 2), 0),
        wrong_at("elevation", (1, 1), np.inf),
    ],
)
def test_what_stands_beyond_the_count_means_nothing(change):
    batch = SnapshotBatch(**batch_values() | dict([change]))
    assert len(batch.snapshot(1).detections) == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("camera", Camera([0, 0], 0)), r"camera: must be a batch of shape \(B,\), got \(\)"),
        (
            ("camera", Camera(np.zeros((3, 2)), np.zeros(3))),
            r"category: must have shape \(3, 2\), got \(2, 2\)",
        ),
        (("category", np.zeros(2)), r"category: must have shape \(2, 2\), got \(2,\)"),
        (("count", [1]), r"count: must have shape \(2,\), got \(1,\)"),
        (("position", np.zeros((2, 3, 2))), r"position: must have shape \(2, 2, 2\), got \(2, 3, 2\)"),
        (("truth", np.zeros((2, 3))), r"truth: must have shape \(2, 2\), got \(2, 3\)"),
        (("count", [3, 0]), r"count\[0\]: must be from 0 to 2, got 3"),
        (("count", [0, -1]), r"count\[1\]: must be from 0 to 2, got -1"),
        (wrong_at("category", (0, 1), 2), r"category\[0, 1\]: must be from -1 to 1, got 2"),
        (wrong_at("category", (1, 1), -2), r"category\[1, 1\]: must be from -1 to 1, got -2"),
        (wrong_at("truth", (1, 0), -2), r"truth\[1, 0\]: must be the index of a label or UNKNOWN, got -2"),
        (
            wrong_at("position", (1, 0, 1), np.nan),
            r"position\[1, 0, 1\]: must be finite, from -1e6 to 1e6 metres, got nan",
        ),
        (wrong_at("yaw", (0, 1), np.inf), r"yaw\[0, 1\]: must be finite, at most 1e6 turns, got inf"),
        (
            wrong_at("elevation", (0, 0), np.nan),
            r"elevation\[0, 0\]: must be finite, from -1e6 to 1e6 metres, got nan",
        ),
        (
            wrong_at("size", (0, 1, 2), 0),
            r"size\[0, 1, 2\]: must be positive metres, from 1e-6 to 1e6, got 0.0",
        ),
        (
            wrong_at("size", (0, 1, 2), np.inf),
            r"size\[0, 1, 2\]: must be positive metres, from 1e-6 to 1e6, got inf",
        ),
    ],
)
def test_a_batch_that_cannot_be_is_refused_by_the_name_of_its_field(change, message):
    with pytest.raises(SnapshotError, match=message):
        SnapshotBatch(**batch_values() | dict([change]))
