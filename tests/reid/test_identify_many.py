import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import SnapshotError
from farm_ar.reid import (
    Assurance,
    Identification,
    IdentificationBatch,
    Reidentifier,
    SpatialOptions,
    SpatialReid,
    batch_accuracy,
)
from farm_ar.reid.assignment import assessment
from farm_ar.scenes import (
    Camera,
    LayoutNoise,
    Scene,
    Snapshot,
    SnapshotBatch,
    Weights,
    builtin_scene,
    observe_many,
)

OPTIONS = st.builds(
    SpatialOptions,
    threshold=st.sampled_from([0.0, 0.3, 0.5, 0.75, 1.0]),
    weights=st.sampled_from(["scene", "paper", Weights(0.0, 2.0)]),
    terms=st.sampled_from(
        [("translation", "rotation", "dimension"), ("rotation", "dimension"), ("translation",)]
    ),
    gate_categories=st.booleans(),
    box=st.sampled_from(["local", "world"]),
)


def check_agreement(reid: SpatialReid, batch: SnapshotBatch) -> None:
    """What `identify_many` says of each snapshot is what `identify` says of it."""
    many = reid.identify_many(batch, margins=True)
    assert len(many) == len(batch)
    for b in range(len(batch)):
        n = int(batch.count[b])
        one = reid.identify(batch.snapshot(b))
        assert many.names(b, n) == one.labels
        np.testing.assert_allclose(many.cost[b, :n], one.cost, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(many.margin[b, :n], one.margin, rtol=1e-9, atol=1e-9)
        assert many.candidates[b] == len(one.candidates)
        assert bool(many.widened[b]) == one.widened
        assert np.all(many.label[b, n:] == -1)
        assert np.isnan(many.cost[b, n:]).all()


@given(
    seed=st.integers(0, 2**32 - 1),
    options=OPTIONS,
    objects=st.integers(1, 12),
    categories=st.integers(1, 3),
    sites=st.sampled_from([0, 1, 2, 5]),
    templates=st.booleans(),
)
def test_many_snapshots_at_once_are_identified_as_one_by_one(
    make_scene: Any,
    make_batch: Any,
    seed: int,
    options: SpatialOptions,
    objects: int,
    categories: int,
    sites: int,
    templates: bool,
) -> None:
    rng = np.random.default_rng(seed)
    scene = make_scene(rng, objects, categories, sites, templates)
    if options.weights == Weights(0.0, 2.0) and "rotation" not in options.terms:
        return  # every cost is 0: see the test of ties
    check_agreement(SpatialReid(scene, options), make_batch(rng, scene))


@pytest.mark.parametrize(
    "options",
    [
        SpatialOptions(gate_categories=False),
        SpatialOptions(threshold=0.4),
        SpatialOptions(terms=("rotation",)),
    ],
)
def test_the_kernels_say_the_same_as_plain_python(
    make_scene: Any,
    make_batch: Any,
    options: SpatialOptions,
    rng: np.random.Generator,
    plain: None,
) -> None:
    for sites, objects in ((5, 12), (0, 5), (3, 4)):
        scene = make_scene(rng, objects, categories=3, sites=sites)
        check_agreement(SpatialReid(scene, options), make_batch(rng, scene))


def test_runners_up_are_found_on_request_only(
    make_scene: Any, make_batch: Any, rng: np.random.Generator
) -> None:
    scene = make_scene(rng)
    reid, batch = SpatialReid(scene), make_batch(rng, scene)
    many = reid.identify_many(batch, margins=True)
    for b in range(len(batch)):
        one = reid.identify(batch.snapshot(b))
        second = [None if j < 0 else scene.layout.labels[j] for j in many.runner_up[b, : batch.count[b]]]
        assert tuple(second) == one.runner_up
    plain = reid.identify_many(batch)
    np.testing.assert_array_equal(plain.label, many.label)
    assert np.isnan(plain.margin).all()
    assert (plain.runner_up == -1).all()


@pytest.mark.parametrize("solver", ["lsap", "mip"])
def test_the_answers_do_not_depend_on_the_solver_named(
    make_scene: Any, make_batch: Any, solver: str, rng: np.random.Generator
) -> None:
    scene = make_scene(rng)
    check_agreement(SpatialReid(scene, SpatialOptions(solver=solver)), make_batch(rng, scene, snapshots=3))


def test_snapshots_of_a_built_in_scene_agree(rng: np.random.Generator) -> None:
    scene = builtin_scene("H2")
    noisy = LayoutNoise.of(0.3, 30).disturb(scene.layout, scene.size, rng, (2, 1))
    batch = observe_many(noisy, scene.camera_path.cameras(30, scene.fov))
    for threshold in (0.2, 1.0):
        check_agreement(SpatialReid(scene, SpatialOptions(threshold=threshold)), batch)


def test_without_noise_all_is_identified() -> None:
    scene = builtin_scene("M1")
    batch = observe_many(scene.layout, scene.camera_path.cameras(40, scene.fov))
    found = SpatialReid(scene).identify_many(batch)
    accuracy = batch_accuracy(found.label, batch.truth, batch.count)
    assert np.all(accuracy[batch.count > 0] == 1)


@pytest.fixture
def case(make_scene: Any, make_batch: Any, rng: np.random.Generator) -> tuple[Scene, SnapshotBatch]:
    scene = make_scene(rng)
    return scene, make_batch(rng, scene, snapshots=4, most=3, unknown=0.0)


def test_what_stands_beyond_the_detections_means_nothing(case: tuple[Scene, SnapshotBatch]) -> None:
    scene, batch = case
    beyond = np.arange(3) >= batch.count[:, None]
    assert beyond.any()
    filled = {
        "category": np.where(beyond, 1, batch.category),
        "position": np.where(beyond[..., None], np.nan, batch.position),
        "yaw": np.where(beyond, np.inf, batch.yaw),
        "size": np.where(beyond[..., None], 0.0, batch.size),
    }
    expected = SpatialReid(scene).identify_many(batch)
    for options in (SpatialOptions(), SpatialOptions(box="world")):
        found = SpatialReid(scene, options).identify_many(replace(batch, **filled))
        if options.box == "local":
            np.testing.assert_array_equal(found.label, expected.label)
            np.testing.assert_array_equal(found.cost, expected.cost)
    check_agreement(SpatialReid(scene, SpatialOptions(gate_categories=True)), replace(batch, **filled))


def test_arrays_of_other_types_and_orders_are_taken(case: tuple[Scene, SnapshotBatch]) -> None:
    scene, batch = case
    changed = replace(
        batch,
        count=batch.count.astype(np.int32),
        category=batch.category.astype(np.int8),
        position=np.asfortranarray(batch.position),
        yaw=batch.yaw[::-1][::-1],
    )
    expected = SpatialReid(scene).identify_many(batch)
    np.testing.assert_array_equal(SpatialReid(scene).identify_many(changed).label, expected.label)


def test_the_batchs_own_list_of_categories_may_differ_from_the_scenes(
    case: tuple[Scene, SnapshotBatch],
) -> None:
    scene, batch = case
    renamed = replace(
        batch, categories=("not seen here", *reversed(batch.categories)), category=2 - batch.category
    )
    reid = SpatialReid(scene, SpatialOptions(gate_categories=True))
    np.testing.assert_array_equal(reid.identify_many(renamed).label, reid.identify_many(batch).label)


def test_no_snapshots_and_no_detections_give_empty_answers(case: tuple[Scene, SnapshotBatch]) -> None:
    scene, batch = case
    for rng in (None, np.random.default_rng(0)):
        nothing = replace(batch, count=np.zeros(4, dtype=np.int64))
        assert np.all(SpatialReid(scene, rng=rng).identify_many(nothing).label == -1)
        narrow = SnapshotBatch(
            batch.camera,
            np.zeros(4, dtype=np.int64),
            (),
            np.zeros((4, 0), dtype=np.int64),
            np.zeros((4, 0, 2)),
            np.zeros((4, 0)),
            np.zeros((4, 0, 3)),
            np.zeros((4, 0)),
        )
        assert SpatialReid(scene, rng=rng).identify_many(narrow).label.shape == (4, 0)
        none = replace(
            narrow,
            camera=Camera(np.zeros((0, 2)), np.zeros(0)),
            count=np.zeros(0, dtype=np.int64),
            **{
                name: getattr(narrow, name)[:0]
                for name in ("category", "position", "yaw", "size", "elevation")
            },
        )
        assert len(SpatialReid(scene, rng=rng).identify_many(none)) == 0


def tied(detections: list[list[float]], labels: int) -> tuple[Scene, SnapshotBatch]:
    """4000 snapshots alike, of detections at equal distances from all of the labels."""
    scene = builtin_scene("pantry")
    layout = scene.layout.subset(range(labels)).with_poses(np.zeros((labels, 2)), np.zeros(labels))
    n, copies = len(detections), 4000
    shape = (copies, n)
    batch = SnapshotBatch(
        camera=Camera(np.zeros((copies, 2)), np.zeros(copies)),
        count=np.full(copies, n),
        categories=("chair",),
        category=np.zeros(shape, dtype=np.int64),
        position=np.broadcast_to(np.array(detections), (*shape, 2)),
        yaw=np.zeros(shape),
        size=np.broadcast_to(layout.size[0], (*shape, 3)),
        elevation=np.zeros(shape),
    )
    return replace(scene, layout=layout), batch


def test_ties_among_labels_are_broken_evenly() -> None:
    scene, batch = tied([[1.0, 0.0], [1.0, 0.0]], labels=3)
    label = SpatialReid(scene, rng=np.random.default_rng(0)).identify_many(batch).label
    pairs, counts = np.unique(label, axis=0, return_counts=True)
    assert pairs.tolist() == [[0, 1], [0, 2], [1, 0], [1, 2], [2, 0], [2, 1]]
    assert counts / 4000 == pytest.approx([1 / 6] * 6, abs=0.04)


def test_ties_among_detections_for_too_few_labels_are_broken_evenly() -> None:
    scene, batch = tied([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]], labels=1)
    label = SpatialReid(scene, rng=np.random.default_rng(0)).identify_many(batch).label
    assert np.all(np.sort(label, axis=1) == [-1, -1, 0])
    assert (label == 0).mean(axis=0) == pytest.approx([1 / 3] * 3, abs=0.04)


def test_ties_are_broken_by_the_seed_and_without_a_generator_always_alike() -> None:
    scene, batch = tied([[1.0, 0.0]], labels=3)

    def labels(seed: int) -> list[list[int]]:
        return SpatialReid(scene, rng=np.random.default_rng(seed)).identify_many(batch).label.tolist()

    assert labels(3) == labels(3)
    assert labels(3) != labels(4)
    assert len(np.unique(SpatialReid(scene).identify_many(batch).label)) == 1


def test_a_generator_changes_nothing_where_there_are_no_ties(make_scene: Any, make_batch: Any) -> None:
    rng = np.random.default_rng(1)
    scene = make_scene(rng, objects=7)
    batch = make_batch(rng, scene, snapshots=50, most=9)
    for options in (SpatialOptions(gate_categories=False), SpatialOptions(threshold=0.2)):
        expected = SpatialReid(scene, options).identify_many(batch)
        found = SpatialReid(scene, options, np.random.default_rng(0)).identify_many(batch)
        np.testing.assert_array_equal(found.label, expected.label)
        np.testing.assert_allclose(found.cost, expected.cost)
        np.testing.assert_array_equal(found.widened, expected.widened)


def test_the_answer_cannot_be_written_to(case: tuple[Scene, SnapshotBatch]) -> None:
    found = SpatialReid(case[0]).identify_many(case[1])
    for array in (found.label, found.cost, found.candidates, found.widened):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_names_are_those_of_the_labels() -> None:
    batch = IdentificationBatch(
        ("a", "b"), np.array([[1, -1, 0]]), np.zeros((1, 3)), np.array([2]), np.array([False])
    )
    assert batch.names(0, 3) == ("b", None, "a")
    assert batch.names(0, 1) == ("b",)


def test_an_undeclared_category_is_named(case: tuple[Scene, SnapshotBatch]) -> None:
    scene, batch = case
    category = batch.category.copy()
    category[1, 2] = 2
    undeclared = replace(batch, categories=(*batch.categories, "sofa"), category=category)
    where = r"^snapshots\[1\]\.detections\[2\]\.category"
    with pytest.raises(
        SnapshotError, match=f"{where}: must be null or one of category 0, category 1, got 'sofa'$"
    ):
        SpatialReid(scene).identify_many(undeclared)
    SpatialReid(scene).identify_many(replace(undeclared, count=np.array([0, 2, 0, 0])))


def test_snapshots_of_different_sizes_can_be_stacked(case: tuple[Scene, SnapshotBatch]) -> None:
    scene, batch = case
    snapshots: list[Snapshot] = [batch.snapshot(b) for b in range(4)]
    found = SpatialReid(scene).identify_many(SnapshotBatch.stack(snapshots))
    for b, snapshot in enumerate(snapshots):
        n = len(snapshot.detections)
        assert found.names(b, n) == SpatialReid(scene).identify(snapshot).labels


def test_the_confidence_is_worked_out_when_it_is_asked_for(
    case: tuple[Scene, SnapshotBatch],
) -> None:
    scene, batch = case
    worked_out: list[int] = []

    class Late(Reidentifier):
        def __init__(self) -> None:
            self.scene = scene

        def identify(self, snapshot: Snapshot) -> Identification:
            n = len(snapshot.detections)

            def assure() -> Assurance:
                worked_out.append(n)
                return Assurance(confidence=np.full(n, 0.25))

            return Identification((None,) * n, assurance=assure)

    found = Late().identify_many(batch)
    assert worked_out == []
    exists = np.arange(batch.yaw.shape[1]) < batch.count[:, None]
    np.testing.assert_array_equal(found.confidence, np.where(exists, 0.25, np.nan))
    assert worked_out == batch.count.tolist()
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(found)).confidence, found.confidence)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_answers_do_not_depend_on_how_many_threads_give_them(threads, monkeypatch):
    scene = builtin_scene("lab")
    rng = np.random.default_rng(2)
    moved = LayoutNoise.of(0.5, 60.0).disturb(scene.layout, scene.size, rng, (23,))
    batch = observe_many(moved, Camera(rng.uniform(0, 5, (23, 2)), rng.uniform(-3, 3, 23), scene.fov))
    for made in (
        lambda: SpatialReid(scene),
        lambda: SpatialReid(scene, SpatialOptions(threshold=0.5), np.random.default_rng(1)),
    ):
        expected = made().identify_many(batch, margins=True)
        with monkeypatch.context() as patched:
            patched.setattr(assessment, "_PART", 4 * batch.yaw.shape[1] * len(scene.layout))
            patched.setattr(assessment.numba.config, "NUMBA_NUM_THREADS", threads)
            found = made().identify_many(batch, margins=True)
        for name in ("label", "cost", "candidates", "widened", "margin", "runner_up"):
            assert getattr(found, name).tobytes() == getattr(expected, name).tobytes(), name
