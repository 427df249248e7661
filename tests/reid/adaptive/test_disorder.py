"""What `adaptive` learns of a place from confirmed answers."""

import json

import numpy as np
import pytest

from farm_ar.errors import SceneError, SnapshotError
from farm_ar.reid import AdaptiveOptions, AdaptiveReid, Disorder
from farm_ar.scenes import Camera, FieldOfView, LayoutNoise, builtin_scene, observe

EVERYWHERE = FieldOfView(np.pi, np.pi, 30.0)


def lessons(scene, noise, count, seed):
    """Snapshots of a scene that is as untidy every time, with the labels that are right."""
    rng = np.random.default_rng(seed)
    camera = Camera(np.array([2.0, 2.0]), 0.0, EVERYWHERE)
    return [observe(noise.disturb(scene.layout, scene.size, rng), camera) for _ in range(count)]


def taught(scene, examples):
    reid = AdaptiveReid(scene)
    for snapshot, labels in examples:
        reid = AdaptiveReid(scene, disorder=reid.learn(snapshot, labels))
    return reid


@pytest.mark.parametrize("noise", [LayoutNoise.of(0.05, 5.0), LayoutNoise.of(0.5, 100.0)])
def test_a_place_is_known_better_after_ten_confirmed_snapshots(noise):
    scene = builtin_scene("L1")
    known = taught(scene, lessons(scene, noise, 10, seed=1))
    true_log = {"new": 0.0, "known": 0.0}
    for snapshot, truth in lessons(scene, noise, 12, seed=2):
        columns = [scene.layout.index(label) for label in truth]
        for name, reid in (("new", AdaptiveReid(scene)), ("known", known)):
            probability = reid.identify(snapshot).probability
            true_log[name] += np.log(np.maximum(probability[np.arange(len(truth)), columns], 1e-9)).sum()
    assert true_log["known"] > true_log["new"]


def test_what_was_learnt_survives_json():
    scene = builtin_scene("L1")
    known = taught(scene, lessons(scene, LayoutNoise.of(0.3, 30.0), 2, seed=3)).disorder
    again = Disorder.from_json(json.loads(json.dumps(known.to_json())))
    assert again.snapshots == 2
    for name in ("motion", "rates", "sizes"):
        np.testing.assert_array_equal(getattr(again, name), getattr(known, name))


def test_what_was_not_learnt_by_this_method_is_refused():
    scene = builtin_scene("L1")
    with pytest.raises(SceneError, match="disorder"):
        Disorder.from_json({"snapshots": 1})
    strange = Disorder(1, np.zeros((1, 1, 1)), np.zeros(2), np.zeros(1))
    with pytest.raises(SceneError, match=r"disorder\.motion"):
        AdaptiveReid(scene, disorder=strange)
    (snapshot, _), *_ = lessons(scene, LayoutNoise(), 1, seed=4)
    with pytest.raises(SnapshotError, match="labels"):
        AdaptiveReid(scene).learn(snapshot, ["chair"])


def test_nothing_confirmed_teaches_nothing():
    scene = builtin_scene("L1")
    (snapshot, labels), *_ = lessons(scene, LayoutNoise(), 1, seed=5)
    known = AdaptiveReid(scene).learn(snapshot, [None] * len(labels))
    assert known.snapshots == 0
    assert known.motion.shape == Disorder.unknown(AdaptiveOptions()).motion.shape
