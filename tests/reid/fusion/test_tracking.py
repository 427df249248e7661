from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from farm_ar.errors import SnapshotError
from farm_ar.reid import AdaptiveReid, Identification, SpatialOptions, SpatialReid
from farm_ar.reid.answers import Assurance
from farm_ar.reid.fusion.tracking import Whereabouts, objects_of, track, track_all
from farm_ar.scenes import (
    Camera,
    Detections,
    Detector,
    FieldOfView,
    Layout,
    LayoutNoise,
    Scene,
    Snapshot,
    Uncertainty,
    builtin_scene,
    observe,
)

SEEDS = st.integers(0, 2**32 - 1)
SEQUENCES = settings(deadline=None, max_examples=10 * settings().max_examples // 50)
Truth = tuple[str | None, ...]


def turning_head(
    scene: Scene,
    layout: Layout,
    rng: np.random.Generator,
    snapshots: int = 4,
    detector: Detector | None = None,
) -> list[tuple[Snapshot, Truth]]:
    """Snapshots of one layout from the room's middle, each turned by an eighth of a circle, and the truth."""
    fov = FieldOfView.symmetric(np.deg2rad(70), scene.diagonal)
    middle = np.array(scene.size) / 2
    return [
        observe(layout, Camera(middle, np.array(t * np.pi / 4), fov), detector or Detector(), rng)
        for t in range(snapshots)
    ]


def test_adaptive_takes_what_other_cameras_saw_for_seen() -> None:
    """By the last camera alone, most of the objects would be out of view, and called none of the labels."""
    scene, rng = builtin_scene("cafeteria"), np.random.default_rng(0)
    moved = disturbed(scene, rng, 0.3, 20)
    snapshots, truths = zip(*turning_head(scene, moved, rng, 8), strict=True)
    answers = track(AdaptiveReid(scene), snapshots).identifications
    given = [label for answer in answers for label in answer.labels]
    true = [label for truth in truths for label in truth]
    assert len({label for label in true if label}) == len(scene.layout)
    assert np.mean([a == b for a, b in zip(given, true, strict=True)]) > 0.9


def disturbed(scene: Scene, rng: np.random.Generator, metres: float = 0.3, degrees: float = 30) -> Layout:
    return LayoutNoise.of(metres, degrees).disturb(scene.layout, scene.size, rng)


@pytest.mark.parametrize("name", ["L1", "M2", "farm"])
def test_one_snapshot_gives_exactly_what_identify_gives(name: str) -> None:
    scene, rng = builtin_scene(name), np.random.default_rng(0)
    reid = SpatialReid(scene)
    snapshot, _ = turning_head(scene, disturbed(scene, rng, 0.1), rng, 1)[0]
    found, expected = track(reid, [snapshot]), reid.identify(snapshot)
    assert found.identifications[0].labels == found.identification.labels == expected.labels
    assert found.identifications[0].cost.tobytes() == expected.cost.tobytes()
    assert found.objects is snapshot.detections
    assert np.isnan(found.position_sd).all()


@SEQUENCES
@given(SEEDS)
def test_the_order_of_the_snapshots_does_not_matter(seed: int) -> None:
    scene, rng = builtin_scene("M2"), np.random.default_rng(seed)
    noise = Detector(position_sd=0.02, yaw_sd=0.05)
    seen = [snapshot for snapshot, _ in turning_head(scene, disturbed(scene, rng), rng, 5, noise)]
    reid, order = SpatialReid(scene), rng.permutation(5)
    forwards, shuffled = track(reid, seen), track(reid, [seen[t] for t in order])
    for place, t in enumerate(order):
        assert shuffled.identifications[place].labels == forwards.identifications[t].labels


@SEQUENCES
@given(SEEDS)
def test_no_label_is_given_to_two_objects_and_each_object_has_one_label_throughout(seed: int) -> None:
    scene, rng = builtin_scene("L1"), np.random.default_rng(seed)
    noise = Detector(position_sd=0.05, yaw_sd=0.2, false_rate=1.0, miss_rate=0.2)
    seen = [snapshot for snapshot, _ in turning_head(scene, disturbed(scene, rng, 1.0), rng, 6, noise)]
    found = track(SpatialReid(scene), seen)
    given_labels = [label for label in found.identification.labels if label is not None]
    assert len(set(given_labels)) == len(given_labels)
    for answer, index in zip(found.identifications, found.object_of, strict=True):
        assert answer.labels == tuple(found.identification.labels[k] for k in index)


def two_chairs(first: float, second: float) -> Scene:
    layout = Layout(
        labels=("near", "far"),
        category=("chair", "chair"),
        position=np.array([[first, 1.0], [second, 1.0]]),
        yaw=np.zeros(2),
        size=np.ones((2, 3)),
    )
    return Scene("two chairs", (4.0, 2.0), layout)


def test_an_early_error_is_corrected_when_more_is_seen() -> None:
    scene = two_chairs(1.0, 2.0)
    # Both chairs are pushed to the right; the one that is seen first ends nearer to the other's place.
    pushed = scene.layout.with_poses(np.array([[1.6, 1.0], [2.6, 1.0]]), np.zeros(2))
    fov = FieldOfView.symmetric(np.deg2rad(60), 3.0)
    early = observe(pushed, Camera(np.array([1.1, 0.0]), np.array(0.0), fov))
    late = observe(pushed, Camera(np.array([2.1, 0.0]), np.array(0.0), fov))
    assert [early[1], late[1]] == [("near",), ("near", "far")]
    reid = SpatialReid(scene)
    assert reid.identify(early[0]).labels == ("far",)
    assert track(reid, [early[0], late[0]]).identifications[0].labels == ("near",)


def test_poses_sharpen_as_the_root_of_the_number_of_detections() -> None:
    scene, rng = builtin_scene("farm"), np.random.default_rng(0)
    fov = FieldOfView.symmetric(np.deg2rad(170), 3.0)
    camera = Camera(np.array([0.6, -0.3]), np.array(0.0), fov)
    noise = Detector(position_sd=0.01, yaw_sd=0.05)
    errors, stated = [], []
    for _ in range(20):
        seen = [observe(scene.layout, camera, noise, rng) for _ in range(9)]
        found = track(SpatialReid(scene), [snapshot for snapshot, _ in seen])
        truth = {
            int(k): name
            for (_, names), index in zip(seen, found.object_of, strict=True)
            for k, name in zip(index, names, strict=True)
        }
        true_place = scene.layout.position[[scene.layout.index(truth[k] or "") for k in range(len(truth))]]
        errors.append(found.objects.position - true_place)
        stated.append(found.position_sd.mean())
    assert_allclose(np.std(np.concatenate(errors)), 0.01 / 3, rtol=0.1)
    # The noise is known to one of a few levels only.
    assert 0.01 / 3 / 2 < np.mean(stated) < 0.01 / 3 * 2


def test_empty_snapshots_in_a_sequence_change_nothing() -> None:
    scene, rng = builtin_scene("L1"), np.random.default_rng(2)
    seen = [snapshot for snapshot, _ in turning_head(scene, disturbed(scene, rng), rng)]
    nothing = Detections((), np.zeros((0, 2)), np.zeros(0), np.zeros((0, 3)))
    empty = replace(seen[0], detections=nothing)
    reid = SpatialReid(scene)
    found = track(reid, [empty, *seen, empty])
    assert [one.labels for one in found.identifications[1:-1]] == [
        one.labels for one in track(reid, seen).identifications
    ]
    assert found.identifications[0].labels == ()
    assert track(reid, [empty, empty]).identification.labels == ()


def test_more_objects_than_labels_leave_the_surplus_unidentified() -> None:
    scene = two_chairs(1.0, 2.0)
    far_apart = Detections(
        category=("chair",) * 3,
        position=np.array([[0.2, 0.2], [1.1, 1.0], [2.1, 1.0]]),
        yaw=np.zeros(3),
        size=np.ones((3, 3)),
    )
    snapshot = Snapshot(Camera(np.zeros(2), np.array(0.0)), far_apart)
    found = track(SpatialReid(scene), [snapshot, snapshot])
    assert found.identifications[1].labels == (None, "near", "far")


def test_all_in_one_spot_gives_each_label_once() -> None:
    scene = two_chairs(1.0, 1.0)
    spot = Detections(("chair",) * 2, np.ones((2, 2)), np.zeros(2), np.ones((2, 3)))
    snapshot = Snapshot(Camera(np.zeros(2), np.array(0.0)), spot)
    found = track(SpatialReid(scene), [snapshot, snapshot, snapshot])
    assert len(found.objects) == 2
    assert set(found.identification.labels) == {"near", "far"}


def test_a_rule_that_prunes_considers_all_sites_of_a_sequence() -> None:
    scene, rng = builtin_scene("M2"), np.random.default_rng(0)
    seen = turning_head(scene, scene.layout, rng, 8)
    found = track(SpatialReid(scene, SpatialOptions(threshold=0.0)), [snapshot for snapshot, _ in seen])
    for answer, (_, truth) in zip(found.identifications, seen, strict=True):
        assert answer.labels == truth


class Surest:
    """A rule that tells what it was asked, and answers with a distribution."""

    def __init__(self) -> None:
        self.cameras: Sequence[Camera] = ()

    def identify(self, snapshot: Snapshot) -> Identification:
        raise AssertionError("a sequence must be asked for as one")

    def identify_objects(self, objects: Detections, cameras: Sequence[Camera]) -> Identification:
        self.cameras = cameras
        probability = np.tile([0.2, 0.3, 0.5], (len(objects), 1))
        assurance = Assurance(confidence=np.full(len(objects), 0.5), probability=probability)
        return Identification((None,) * len(objects), candidates=("near", "far"), assurance=assurance)


def test_a_rule_for_sequences_is_told_all_cameras_and_its_distribution_is_kept() -> None:
    scene, rng, rule = two_chairs(1.0, 2.0), np.random.default_rng(0), Surest()
    seen = [snapshot for snapshot, _ in turning_head(scene, scene.layout, rng, 8)]
    found = track(rule, seen)
    assert [float(one.yaw) for one in rule.cameras] == [float(one.camera.yaw) for one in seen]
    for answer, one in zip(found.identifications, seen, strict=True):
        assert answer.confidence.tolist() == [0.5] * len(one.detections)
        assert answer.probability is not None
        assert answer.probability.shape == (len(one.detections), 3)
    assert_allclose(found.whereabouts("far").probability, 0.3)


def test_whereabouts_say_how_probably_a_label_was_not_seen() -> None:
    where = Whereabouts("a", np.array([0.1, 0.6]), np.zeros((2, 2)), np.zeros(2))
    assert_allclose(where.unseen, 0.3)
    assert where.likeliest == 1
    assert Whereabouts("a", np.array([0.2]), np.zeros((1, 2)), np.zeros(1)).likeliest is None
    assert Whereabouts("a", np.zeros(0), np.zeros((0, 2)), np.zeros(0)).likeliest is None


def test_a_rule_without_probabilities_is_believed() -> None:
    scene, rng = builtin_scene("L1"), np.random.default_rng(0)
    found = track(SpatialReid(scene), [one for one, _ in turning_head(scene, scene.layout, rng)])
    label = found.identification.labels[1]
    assert label is not None
    assert found.whereabouts(label).likeliest == 1


def test_what_cannot_be_tracked_is_refused() -> None:
    reid = SpatialReid(two_chairs(1.0, 2.0))
    with pytest.raises(SnapshotError, match="snapshots: must be at least one"):
        track(reid, [])
    nothing = Detections((), np.zeros((0, 2)), np.zeros(0), np.zeros((0, 3)))
    found = track(reid, [Snapshot(Camera(np.zeros(2), np.array(0.0)), nothing)])
    with pytest.raises(SnapshotError, match="label: must be one of near, far, got 'middle'"):
        found.whereabouts("middle")


def test_a_subclass_made_of_a_scene_alone_considers_all_sites_of_a_sequence() -> None:
    class Near(SpatialReid):
        def __init__(self, scene: Scene) -> None:
            super().__init__(scene, SpatialOptions(threshold=0.0))

    scene = builtin_scene("L1")
    cameras = scene.camera_path.cameras(40, scene.fov)
    seen = [observe(scene.layout, cameras.at(k))[0] for k in (0, 20)]
    near, every = Near(scene), SpatialReid(scene)
    assert track(near, seen).identification.labels == track(every, seen).identification.labels
    assert near.options.threshold == 0.0


def saying(snapshot: Snapshot, covariance: np.ndarray) -> Snapshot:
    """The snapshot with a detector that says how exact it is."""
    known = replace(Uncertainty.unknown(len(snapshot.detections)), covariance=covariance)
    return replace(snapshot, detections=replace(snapshot.detections, uncertainty=known))


def exact_and_vague(rng: np.random.Generator) -> list[Snapshot]:
    """Snapshots of chairs with errors of which each detection says how large they are, and where to."""
    scene, found = builtin_scene("M2"), []
    for one, _ in turning_head(scene, disturbed(scene, rng), rng, 8):
        seen = one.detections
        root = rng.normal(0, 0.02, (len(seen), 3, 3)) * 10.0 ** rng.uniform(-1.5, 0.5, (len(seen), 1, 1))
        error = np.einsum("nij,nj->ni", root, rng.normal(0, 1, (len(seen), 3)))
        moved = replace(seen, position=seen.position + error[:, :2], yaw=seen.yaw + error[:, 2])
        found.append(saying(replace(one, detections=moved), root @ np.swapaxes(root, 1, 2)))
    return found


@SEQUENCES
@given(
    SEEDS,
    st.floats(-3, 3),
    st.floats(0.05, 20),
    st.tuples(st.floats(-30, 30), st.floats(-30, 30)),
)
def test_objects_do_not_depend_on_where_the_world_begins_how_it_is_turned_and_in_which_unit(
    seed: int, turn: float, scale: float, shift: tuple[float, float]
) -> None:
    """Detections' covariances go along: their places are shifted, turned and measured in other units."""
    seen = exact_and_vague(np.random.default_rng(seed))
    cosine, sine = np.cos(turn), np.sin(turn)
    rotation = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    unit = np.diag([scale, scale, 1.0]) @ rotation

    def moved(one: Snapshot) -> Snapshot:
        assert one.detections.uncertainty is not None
        covariance = unit @ one.detections.uncertainty.covariance @ unit.T
        fov = replace(one.camera.fov, range_m=scale * one.camera.fov.range_m)
        camera = replace(
            one.camera,
            position=unit[:2, :2] @ one.camera.position + shift,
            yaw=one.camera.yaw + turn,
            fov=fov,
        )
        poses = replace(
            one.detections,
            position=one.detections.position @ unit[:2, :2].T + shift,
            yaw=one.detections.yaw + turn,
            size=scale * one.detections.size,
        )
        return saying(Snapshot(camera, poses), (covariance + np.swapaxes(covariance, 1, 2)) / 2)

    (here, of), (there, of_moved) = objects_of(seen), objects_of([moved(one) for one in seen])
    assert [one.tolist() for one in of] == [one.tolist() for one in of_moved]
    assert_allclose(there.position, here.position @ unit[:2, :2].T + shift, atol=1e-6 * scale)
    assert_allclose(np.cos(there.yaw - here.yaw - turn), 1.0)
    assert here.uncertainty is not None
    assert there.uncertainty is not None
    expected = unit @ here.uncertainty.covariance @ unit.T
    assert_allclose(there.uncertainty.covariance, expected, rtol=1e-6, atol=1e-9 * scale**2)


def test_an_object_stands_where_its_exact_detections_are() -> None:
    """One within a millimetre beside three that are 6 cm off and say so; from each side."""
    camera = Camera(np.zeros(2), np.array(0.0), FieldOfView.symmetric(np.deg2rad(60), 5.0))

    def seen_at(x: float, sd: float) -> Snapshot:
        one = Detections(("chair",) * 2, np.array([[x, 2.0], [x + 1, 2.0]]), np.zeros(2), np.ones((2, 3)))
        return saying(Snapshot(camera, one), np.tile(np.diag([sd**2, sd**2, 0.01]), (2, 1, 1)))

    vague = [seen_at(1.06, 0.06)] * 3
    objects, _ = objects_of([*vague, seen_at(1.0, 0.001)])
    assert len(objects) == 2
    assert_allclose(objects.position[0], [1.0, 2.0], atol=0.01)
    assert objects.uncertainty is not None
    sd = np.sqrt(objects.uncertainty.covariance[0, 0, 0])
    assert 0.001 < sd < 0.03, "as exact as the exact one counts, not as their mean"


def test_saying_nothing_of_errors_is_as_saying_that_they_are_zero() -> None:
    """To the bit: what is not known is what is common to all detections."""
    rng = np.random.default_rng(3)
    scene = builtin_scene("M2")
    noise = Detector(position_sd=0.02, yaw_sd=0.05)
    plain = [one for one, _ in turning_head(scene, disturbed(scene, rng), rng, 6, noise)]
    zeros = [saying(one, np.zeros((len(one.detections), 3, 3))) for one in plain]
    first, second = track(SpatialReid(scene), plain), track(SpatialReid(scene), zeros)
    assert first.objects.position.tobytes() == second.objects.position.tobytes()
    assert first.objects.yaw.tobytes() == second.objects.yaw.tobytes()
    assert first.position_sd.tobytes() == second.position_sd.tobytes()
    assert first.identification.labels == second.identification.labels
    assert second.objects.uncertainty is not None
    assert not second.objects.uncertainty.covariance.any()


def test_several_methods_at_once_say_what_each_says_alone() -> None:
    scene, rng = builtin_scene("L1"), np.random.default_rng(1)
    noise = Detector(position_sd=0.02, yaw_sd=0.05)
    seen = [one for one, _ in turning_head(scene, disturbed(scene, rng), rng, 5, noise)]
    reids = [SpatialReid(scene), AdaptiveReid(scene)]
    for snapshots in (seen, seen[:1]):
        for reid, found in zip(reids, track_all(reids, snapshots), strict=True):
            alone = track(reid, snapshots)
            assert found.identification.labels == alone.identification.labels
            assert found.objects.position.tobytes() == alone.objects.position.tobytes()
            assert found.position_sd.tobytes() == alone.position_sd.tobytes()
