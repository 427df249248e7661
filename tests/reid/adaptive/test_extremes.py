"""What nobody would call a scene gets an answer from `adaptive`, or one clear error."""

from dataclasses import replace

import numpy as np
import pytest

from farm_ar.errors import SnapshotError
from farm_ar.reid import AdaptiveOptions, AdaptiveReid
from farm_ar.scenes import (
    Camera,
    Detections,
    FieldOfView,
    Layout,
    Scene,
    Snapshot,
)

EVERYWHERE = FieldOfView(np.pi, np.pi, 1e9)


def scene_of(position, yaw=None, size=None, category=None):
    n = len(position)
    yaw = np.zeros(n) if yaw is None else yaw
    size = np.ones((n, 3)) if size is None else size
    names = tuple(f"thing {i}" for i in range(n))
    return Scene("odd", (1e6, 1e6), Layout(names, category or ("thing",) * n, np.array(position), yaw, size))


def seen(position, yaw=None, size=None, category=None, **more):
    n = len(position)
    yaw = np.zeros(n) if yaw is None else yaw
    size = np.ones((n, 3)) if size is None else size
    category = category or ("thing",) * n
    found = Detections(category, np.reshape(position, (n, 2)), yaw, np.reshape(size, (n, 3)), **more)
    return Snapshot(Camera(np.zeros(2), 0.0, EVERYWHERE), found)


def assert_sound(answer):
    assert np.isfinite(answer.probability).all()
    np.testing.assert_allclose(answer.probability.sum(axis=1), 1, atol=1e-6)
    given = [label for label in answer.labels if label is not None]
    assert len(set(given)) == len(given)


@pytest.mark.parametrize(
    "position",
    [
        [[0.0, 0.0]],
        [[5.0, 5.0]] * 4,
        [[0.0, 0.0], [1e-6, 0.0], [1e6, 1e6]],
        [[-1e6, 1e6], [1e6, -1e6], [0.0, 0.0]],
    ],
)
def test_things_in_one_place_or_at_the_ends_of_the_world(position):
    reid = AdaptiveReid(scene_of(position))
    for found in (position, position[:1], [[3.0, -7.0]] * 2, [[1e6, 1e6]]):
        assert_sound(reid.identify(seen(found)))


def test_nothing_seen_is_nothing_to_say():
    answer = AdaptiveReid(scene_of([[0.0, 0.0], [1.0, 0.0]])).identify(seen(np.zeros((0, 2))))
    assert answer.labels == ()


def test_what_is_not_known_tells_nothing():
    """An unknown heading, size or category changes no answer of a scene in which it could tell nothing."""
    rng = np.random.default_rng(0)
    position = rng.random((6, 2)) * 4
    moved = position + rng.normal(0, 0.2, position.shape)
    reid = AdaptiveReid(scene_of(position))
    blank = seen(moved, np.full(6, np.nan), np.full((6, 3), np.nan), (None,) * 6)
    assert_sound(reid.identify(blank))
    assert reid.identify(blank).labels == reid.identify(seen(moved)).labels
    unknown = AdaptiveReid(scene_of(position, np.full(6, np.nan), np.full((6, 3), np.nan)))
    assert unknown.identify(seen(moved)).labels == reid.identify(blank).labels


def test_more_than_can_be_weighed_is_refused():
    position = np.random.default_rng(0).random((3000, 2))
    with pytest.raises(SnapshotError, match="pairs"):
        AdaptiveReid(scene_of(position)).identify(seen(position))


def test_a_known_category_is_kept_unless_a_confusion_rate_is_given():
    scene = scene_of([[0.0, 0.0], [3.0, 0.0]], category=("cup", "jug"))
    swapped = seen([[3.0, 0.0], [0.0, 0.0]], category=("cup", "jug"))
    assert AdaptiveReid(scene).identify(swapped).labels == ("thing 0", "thing 1")
    mixed = seen([[3.0, 0.01], [0.01, 0.0], [0.0, 0.3]], category=("cup", "cup", None))
    labels = AdaptiveReid(scene).identify(mixed).labels
    assert labels[0] in ("thing 0", None)
    unsure = AdaptiveReid(scene, AdaptiveOptions(confusion=0.4)).identify(swapped)
    assert unsure.probability[0, 1] > 0.01


def test_a_doubtful_detection_is_sooner_none():
    """The detector's own doubt of one detection makes it likelier to be false."""
    position = np.random.default_rng(1).random((5, 2)) * 3
    found = np.vstack([position[:4] + 0.02, [[1.4, 2.9]]])
    reid = AdaptiveReid(scene_of(position))
    none = [
        reid.identify(seen(found, confidence=np.append(np.ones(4), doubt))).probability[4, -1]
        for doubt in (1.0, 0.2)
    ]
    assert none[1] > none[0]


def test_a_hint_decides_what_the_snapshot_leaves_open():
    reid = AdaptiveReid(scene_of([[0.0, 0.0], [2.0, 0.0]]))
    between = seen([[1.0, 0.0]])
    hint = np.array([[0.0, 4.0]])
    assert reid.identify(between, hint).labels == ("thing 1",)
    assert reid.identify(between, hint[:, ::-1]).labels == ("thing 0",)
    ruled_out = reid.identify(seen([[0.0, 0.0]]), np.array([[-np.inf, 0.0]]))
    assert ruled_out.probability[0, 0] == 0
    with pytest.raises(SnapshotError, match="hint"):
        reid.identify(between, np.zeros((2, 2)))


def test_reversed_headings_are_doubted_aloud():
    """A snapshot in which every heading is reversed fits no hypothesis; the same without that is believed."""
    rng = np.random.default_rng(0)
    position, yaw = 3.0 * np.array([(x, z) for x in range(4) for z in range(3)]), rng.uniform(-3, 3, 12)
    snapshot = seen(position + rng.normal(0, 0.02, position.shape), yaw + rng.normal(0, 0.03, 12))
    reversed_ = replace(snapshot, detections=replace(snapshot.detections, yaw=yaw + np.pi))
    reid = AdaptiveReid(scene_of(position, yaw))
    assert not any("headings" in said for said in reid.identify(snapshot).warnings)
    assert any("headings" in said for said in reid.identify(reversed_).warnings)
    assert reid.identify(reversed_).confidence.mean() < reid.identify(snapshot).confidence.mean()
