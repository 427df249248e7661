import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from farm_ar.errors import OptionError, SceneError, SnapshotError
from farm_ar.geometry import wrap
from farm_ar.reid import LikelihoodReid, accuracy
from farm_ar.reid.fusion.tracking import track
from farm_ar.reid.registration import RigidMotion
from farm_ar.reid.relational.method import RelationalReid
from farm_ar.reid.relational.options import Relation, RelationalOptions
from farm_ar.scenes import (
    Camera,
    Detections,
    FieldOfView,
    Layout,
    LayoutNoise,
    Scene,
    Snapshot,
    builtin_scene,
    observe,
    observe_many,
)
from farm_ar.testing import check_reidentifier

SEEDS = st.integers(0, 2**32 - 1)
WIDE = FieldOfView.symmetric(np.deg2rad(170), 20.0)


def drifted(snapshot: Snapshot, motion: RigidMotion) -> Snapshot:
    """The same snapshot in a frame that has moved: camera and detections alike."""
    camera, seen = snapshot.camera, snapshot.detections
    return Snapshot(
        replace(camera, position=motion.position(camera.position[None])[0], yaw=camera.yaw + motion.turn),
        replace(seen, position=motion.position(seen.position), yaw=motion.yaw(seen.yaw)),
    )


def row_of_chairs(count: int = 6, gap: float = 0.5, fixed: bool = False) -> Scene:
    """Chairs in a row across a room, a little uneven, and a lamp that may be fixed."""
    rng = np.random.default_rng(4)
    x = 1.0 + gap * np.arange(count) + rng.uniform(-0.05, 0.05, count)
    position = np.stack([np.append(x, 1.0), np.append(rng.uniform(2.9, 3.1, count), 3.8)], axis=-1)
    layout = Layout(
        labels=(*(f"chair {i}" for i in range(count)), "lamp"),
        category=("chair",) * count + ("lamp",),
        position=position,
        yaw=np.append(rng.uniform(-0.5, 0.5, count), 0.0),
        size=np.full((count + 1, 3), 0.4),
        fixed=np.append(np.zeros(count, dtype=bool), fixed),
    )
    return Scene("row", (6.0, 5.0), layout)


def from_the_front(scene: Scene, layout: Layout) -> tuple[Snapshot, tuple[str | None, ...]]:
    return observe(layout, Camera(np.array([scene.size[0] / 2, -1.0]), np.array(0.0), WIDE))


def moved(layout: Layout, which: list[int], motion: RigidMotion) -> Layout:
    position, yaw = layout.position.copy(), layout.yaw.copy()
    position[which], yaw[which] = motion.position(position[which]), motion.yaw(yaw[which])
    return layout.with_poses(position, yaw)


def shift(x: float, z: float, degrees: float = 0.0, pivot: tuple[float, float] = (0.0, 0.0)) -> RigidMotion:
    return RigidMotion(np.array(pivot), np.array([x, z]), np.array(np.deg2rad(degrees)))


def test_the_contract_of_re_identifiers_is_kept() -> None:
    check_reidentifier(RelationalReid, ("farm", "L1"))


def test_a_group_pushed_by_its_own_spacing_is_known_by_its_shape() -> None:
    scene = row_of_chairs(9)
    pushed = moved(scene.layout, [2, 3, 4, 5], shift(0.6, 0.3))
    fov = FieldOfView.symmetric(np.deg2rad(50), 20.0)
    snapshot, truth = observe(pushed, Camera(np.array([3.5, 1.3]), np.array(0.0), fov))
    reid = RelationalReid(scene)
    assert accuracy(LikelihoodReid(scene).identify(snapshot), truth) == 0.2
    found = reid.identify(snapshot)
    assert found.labels == truth
    assert (found.confidence > 0.8).all()
    first = reid.relations(snapshot)[0]
    assert first.kind == "group"
    assert first.label in scene.layout.labels[2:6]
    assert_allclose(first.shift, [0.6, 0.3], atol=0.03)


def test_a_group_turned_about_its_middle_is_found_with_its_turn() -> None:
    scene = builtin_scene("M2")
    middle = scene.layout.position[0]
    nearest = np.argsort(np.linalg.norm(scene.layout.position - middle, axis=-1))[:5].tolist()
    motion = shift(0.4, 0.1, 40.0, (float(middle[0]), float(middle[1])))
    turned = moved(scene.layout, nearest, motion)
    camera = Camera(middle - np.array([0.0, 2.0]), np.array(0.0), FieldOfView.symmetric(np.deg2rad(70), 3.0))
    snapshot, truth = observe(turned, camera)
    reid = RelationalReid(scene)
    first = reid.relations(snapshot)[0]
    assert first.kind == "group"
    assert_allclose(first.turn, np.deg2rad(40.0), atol=np.deg2rad(5))
    assert accuracy(reid.identify(snapshot), truth) == 1.0


@settings(deadline=None, max_examples=15 * settings().max_examples // 50)
@example(220750094)  # two look-alikes at the edge of the view
@example(1)  # a single one, whose double is out of view
@example(199)  # of the shed and one other pair follows a turn that is far from the drift's
@given(SEEDS)
def test_a_drift_of_the_frame_leaves_the_labels_as_they_are(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene = builtin_scene("farm")
    camera = Camera(np.array([0.6, -0.35]), np.array(rng.uniform(-0.4, 0.4)), scene.fov)
    near = LayoutNoise.of(0.01, 5).disturb(scene.layout, scene.size, rng)
    snapshot, truth = observe(near, camera)
    angle = rng.uniform(-np.pi, np.pi)
    motion = shift(0.1 * np.sin(angle), 0.1 * np.cos(angle), rng.uniform(-5, 5), (0.6, -0.35))
    reid = RelationalReid(scene)
    assert reid.identify(drifted(snapshot, motion)).labels == reid.identify(snapshot).labels == truth


def test_a_group_is_found_in_a_frame_that_has_drifted() -> None:
    scene, rng = builtin_scene("farm"), np.random.default_rng(0)
    alone, shared = [], []
    for _ in range(4):
        pushed = moved(scene.layout, [0, 1, 5, 6], shift(0.12, 0.05, 20.0, (0.3, 0.3)))
        noisy = LayoutNoise.of(0.01, 4).disturb(pushed, scene.size, rng)
        camera = Camera(np.array([rng.uniform(0.4, 0.8), -0.35]), np.array(rng.uniform(-0.3, 0.3)), scene.fov)
        snapshot, truth = observe(noisy, camera)
        angle = rng.uniform(-np.pi, np.pi)
        motion = shift(0.08 * np.sin(angle), 0.08 * np.cos(angle), rng.uniform(-5, 5), (0.6, -0.35))
        seen = drifted(snapshot, motion)
        alone.append(accuracy(LikelihoodReid(scene).identify(seen), truth))
        shared.append(accuracy(RelationalReid(scene).identify(seen), truth))
    assert np.mean(shared) > np.mean(alone) + 0.1
    assert np.mean(shared) > 0.95


def test_what_is_fixed_shows_the_drift() -> None:
    scene, motion = row_of_chairs(fixed=True), shift(0.06, -0.05, 4.0, (3.0, -1.0))
    snapshot, truth = from_the_front(scene, scene.layout)
    reid = RelationalReid(scene)
    first = reid.relations(drifted(snapshot, motion))[0]
    assert first.kind == "drift"
    found = RigidMotion(np.array(first.pivot), np.array(first.shift), np.array(first.turn))
    place = scene.layout.position
    assert_allclose(found.position(place), motion.position(place), atol=0.01)
    assert_allclose(wrap(found.turn - motion.turn), 0, atol=np.deg2rad(0.5))
    assert reid.identify(drifted(snapshot, motion)).labels == truth


def test_nothing_shared_is_taken_for_nothing_shared() -> None:
    scene, rng = builtin_scene("M2"), np.random.default_rng(0)
    alike, both = [], []
    for _ in range(12):
        noisy = LayoutNoise.of(0.3, 30).disturb(scene.layout, scene.size, rng)
        camera = Camera(rng.uniform(1, 4, 2), np.array(rng.uniform(-np.pi, np.pi)), scene.fov)
        snapshot, truth = observe(noisy, camera)
        if not truth:
            continue
        alone, shared = LikelihoodReid(scene), RelationalReid(scene)
        both.append((accuracy(alone.identify(snapshot), truth), accuracy(shared.identify(snapshot), truth)))
        alike.append(alone.identify(snapshot).labels == shared.identify(snapshot).labels)
    means = np.mean(both, axis=0)
    assert means[1] >= means[0] - 0.02
    assert np.mean(alike) > 0.7


def test_without_relations_it_is_the_likelihood_rule() -> None:
    scene, rng = builtin_scene("L1"), np.random.default_rng(3)
    noisy = LayoutNoise.of(0.4, 40).disturb(scene.layout, scene.size, rng)
    snapshot, _ = observe(noisy, Camera(np.array([2.5, 0.0]), np.array(0.0), WIDE))
    plain = LikelihoodReid(scene)
    expected, found = plain.identify(snapshot), RelationalReid.without_relations(plain).identify(snapshot)
    assert found.labels == expected.labels
    assert found.probability is not None
    assert expected.probability is not None
    assert_allclose(found.probability, expected.probability, atol=1e-12)


def test_one_camera_that_sees_all_is_as_good_as_two_that_share_it() -> None:
    scene, rng = builtin_scene("L1"), np.random.default_rng(5)
    noisy = LayoutNoise.of(0.4, 40).disturb(scene.layout, scene.size, rng)
    middle, half = np.array([2.5, -1.0]), np.deg2rad(60)
    whole = Camera(middle, np.array(0.0), FieldOfView(2 * half, 2 * half, 4.0))
    parts = [Camera(middle, np.array(turn), FieldOfView(half, half, 4.0)) for turn in (-half, half)]
    snapshot, _ = observe(noisy, whole)
    reid = RelationalReid.without_relations(LikelihoodReid(scene))
    one = reid.identify_objects(snapshot.detections, [whole, whole])
    two = reid.identify_objects(snapshot.detections, parts)
    assert one.labels == two.labels
    assert_allclose(one.confidence, two.confidence, atol=0.02)


def test_many_snapshots_get_what_each_gets_alone() -> None:
    scene, rng = builtin_scene("M2"), np.random.default_rng(1)
    noisy = LayoutNoise.of(0.2, 20).disturb(scene.layout, scene.size, rng, (3,))
    cameras = Camera(rng.uniform(1, 4, (3, 2)), rng.uniform(-np.pi, np.pi, 3), scene.fov)
    batch = observe_many(noisy, cameras)
    reid = RelationalReid(scene)
    many = reid.identify_many(batch)
    for b in range(len(batch)):
        one = reid.identify(batch.snapshot(b))
        assert many.names(b, int(batch.count[b])) == one.labels
        assert_allclose(many.confidence[b, : batch.count[b]], one.confidence)


@pytest.mark.parametrize("rule", [LikelihoodReid, RelationalReid])
def test_a_sequence_of_one_is_what_identify_says(rule: type[LikelihoodReid]) -> None:
    scene = row_of_chairs()
    snapshot, _ = from_the_front(scene, moved(scene.layout, [0, 1], shift(0.5, 0.2)))
    reid = rule(scene)
    found, expected = track(reid, [snapshot]).identification, reid.identify(snapshot)
    assert found.labels == expected.labels
    assert found.confidence.tobytes() == expected.confidence.tobytes()


@pytest.mark.parametrize("rule", [LikelihoodReid, RelationalReid])
def test_probabilities_of_a_sequence_are_a_distribution_and_grow_surer(rule: type[LikelihoodReid]) -> None:
    scene, rng = builtin_scene("M2"), np.random.default_rng(7)
    noisy = LayoutNoise.of(0.2, 20).disturb(scene.layout, scene.size, rng)
    middle = np.array(scene.size) / 2
    seen = [observe(noisy, Camera(middle, np.array(turn), scene.fov))[0] for turn in np.arange(6) * np.pi / 3]
    reid = rule(scene)
    found = track(reid, seen)
    probability = found.identification.probability
    assert probability is not None
    assert_allclose(probability.sum(axis=1), 1.0, atol=1e-6)
    assert (probability[:, :-1].sum(axis=0) < 1.0 + 0.05).all()
    first = seen[0].detections
    alone = reid.identify(seen[0]).confidence.mean() if len(first) else 0.0
    assert found.identifications[0].confidence.mean() > alone - 0.05
    label = scene.layout.labels[0]
    where = found.whereabouts(label)
    assert_allclose(where.probability, probability[:, 0])


def one_label(count: int) -> tuple[Scene, Snapshot]:
    layout = Layout(("only",), ("chair",), np.array([[1.0, 1.0]]), np.zeros(1), np.ones((1, 3)))
    position = np.array([[1.0, 1.1], [2.0, 1.8], [0.2, 0.2]])[:count]
    seen = Detections(("chair",) * count, position, np.zeros(count), np.ones((count, 3)))
    return Scene("one", (3.0, 2.0), layout), Snapshot(
        Camera(np.array([1.0, -1.0]), np.array(0.0), WIDE), seen
    )


@pytest.mark.parametrize("count", [1, 3])
def test_one_label_is_given_to_what_stands_nearest(count: int) -> None:
    scene, snapshot = one_label(count)
    found = RelationalReid(scene).identify(snapshot)
    assert found.labels == ("only", None, None)[:count]


def test_one_detection_alone_is_identified() -> None:
    scene = row_of_chairs()
    snapshot, _ = from_the_front(scene, scene.layout)
    seen = snapshot.detections
    one = Detections(seen.category[:1], seen.position[:1], seen.yaw[:1], seen.size[:1])
    camera = replace(snapshot.camera, fov=FieldOfView.symmetric(0.01, 5.0))
    assert RelationalReid(scene).identify(Snapshot(camera, one)).labels[0] in scene.layout.labels


def test_all_in_one_spot_gives_each_label_once() -> None:
    layout = Layout(("a", "b", "c"), ("chair",) * 3, np.ones((3, 2)), np.zeros(3), np.ones((3, 3)))
    scene = Scene("spot", (2.0, 2.0), layout)
    snapshot, _ = from_the_front(scene, layout)
    found = RelationalReid(scene).identify(snapshot)
    assert set(found.labels) == {"a", "b", "c"}
    assert_allclose(found.confidence, 1 / 3, atol=0.05)


def test_what_cannot_be_is_refused() -> None:
    scene, snapshot = one_label(1)
    with pytest.raises(OptionError, match="drift: must be from 0 to below 1"):
        RelationalOptions(drift=1.0)
    with pytest.raises(OptionError, match="group_m: must be a positive number"):
        RelationalOptions(group_m=0.0)
    with pytest.raises(OptionError, match="tried: must not be negative, got -1"):
        RelationalOptions(tried=-1)
    empty = Layout((), (), np.zeros((0, 2)), np.zeros(0), np.zeros((0, 3)))
    with pytest.raises(SceneError, match="objects: must be at least one"):
        RelationalReid(Scene("empty", (1.0, 1.0), empty))
    reid, camera = RelationalReid(scene), snapshot.camera
    with pytest.raises(SnapshotError, match="cameras: must be at least one"):
        reid.identify_objects(snapshot.detections, [])
    with pytest.raises(SnapshotError, match=r"cameras\[1\].fov: must be the first one's"):
        reid.identify_objects(snapshot.detections, [camera, replace(camera, fov=scene.fov)])
    with pytest.raises(SnapshotError, match=r"cameras\[1\].height: must be known of all or of none"):
        reid.identify_objects(snapshot.detections, [camera, replace(camera, height=np.array(1.5))])


def test_a_pickled_rule_assumes_the_same_and_answers_the_same() -> None:
    scene = row_of_chairs()
    reid = RelationalReid(scene, RelationalOptions(drift=0.3, tried=2))
    again = pickle.loads(pickle.dumps(reid))
    assert again.shared == reid.shared
    snapshot, _ = from_the_front(scene, moved(scene.layout, [0, 1], shift(0.3, 0.2)))
    assert again.identify(snapshot).confidence.tobytes() == reid.identify(snapshot).confidence.tobytes()


def test_an_untouched_room_is_explained_by_nothing_having_moved_together() -> None:
    scene = row_of_chairs()
    snapshot, truth = from_the_front(scene, scene.layout)
    reid = RelationalReid(scene)
    assert reid.identify(snapshot).labels == truth
    told = reid.relations(snapshot)
    assert told[0].kind == "alone"
    assert_allclose(sum(one.probability for one in told), 1.0)
    assert isinstance(told[0], Relation)
