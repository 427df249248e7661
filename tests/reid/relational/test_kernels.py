"""The compiled kernels in plain Python, and piece by piece against what they stand for."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from farm_ar.reid import LikelihoodOptions, LikelihoodReid, Motion, Rates
from farm_ar.reid.relational.method import RelationalReid
from farm_ar.reid.relational.options import RelationalOptions
from farm_ar.scenes import Camera, FieldOfView, Layout, Scene, Snapshot, observe

MOTIONS = (Motion(0.9, 0.05, 0.1), Motion(0.1, 1.0, 1.0))
OPTIONS = RelationalOptions(
    alone=LikelihoodOptions(noise=MOTIONS, rates=(Rates(0.9, 0.02, 0.01), Rates(0.1, 0.2, 0.5))), tried=2
)


def a_scene(labels: int = 4, fixed: bool = True) -> Scene:
    rng = np.random.default_rng(labels)
    layout = Layout(
        labels=tuple("abcdefgh"[:labels]),
        category=("chair",) * (labels - 1) + ("lamp",),
        position=rng.uniform(0.5, 2.5, (labels, 2)),
        yaw=rng.uniform(-1, 1, labels),
        size=np.full((labels, 3), 0.3),
        fixed=np.array([False] * (labels - 1) + [fixed]),
    )
    return Scene("small", (3.0, 3.0), layout, symmetry={"lamp": 0.0})


def a_snapshot(scene: Scene, labels: int) -> Snapshot:
    layout = scene.layout
    position = layout.position + np.where(layout.fixed, 0.0, 0.4)[:, None] * np.array([1.0, 0.2])
    camera = Camera(np.array([1.5, -1.0]), np.array(0.0), FieldOfView.symmetric(2.0, 8.0))
    return observe(layout.with_poses(position, layout.yaw), camera)[0]


@pytest.mark.parametrize("labels", [4, 7])
def test_plain_python_finds_what_the_compiled_kernels_find(
    labels: int, request: pytest.FixtureRequest
) -> None:
    scene = a_scene(labels)
    snapshot = a_snapshot(scene, labels)
    reid = RelationalReid(scene, OPTIONS)
    cameras = [snapshot.camera, Camera(np.array([1.4, -1.0]), np.array(0.1), snapshot.camera.fov)]
    expected = (
        reid.relations(snapshot),
        reid.identify(snapshot),
        reid.identify_objects(snapshot.detections, cameras),
    )
    request.getfixturevalue("plain")
    found = (
        reid.relations(snapshot),
        reid.identify(snapshot),
        reid.identify_objects(snapshot.detections, cameras),
    )
    assert [one.kind for one in found[0]] == [one.kind for one in expected[0]]
    assert_allclose(
        [one.probability for one in found[0]], [one.probability for one in expected[0]], atol=1e-9
    )
    for one, other in zip(found[1:], expected[1:], strict=True):
        assert one.labels == other.labels
        assert one.probability is not None
        assert other.probability is not None
        assert_allclose(one.probability, other.probability, atol=1e-9)


def test_a_group_that_stays_explains_as_much_as_labels_that_move_alone() -> None:
    scene = a_scene(5, fixed=False)
    snapshot = observe(
        scene.layout, Camera(np.array([1.5, -1.0]), np.array(0.0), FieldOfView.symmetric(2.0, 8.0))
    )[0]
    alone = LikelihoodReid(scene, OPTIONS.alone).identify(snapshot)
    # A prior so narrow that nothing shared can move is no relation at all.
    still = RelationalOptions(alone=OPTIONS.alone, drift_m=1e-6, drift_deg=1e-5, group_m=1e-6, group_deg=1e-5)
    shared = RelationalReid(scene, still)
    found = shared.identify(snapshot)
    assert found.labels == alone.labels
    assert_allclose(found.confidence, alone.confidence, atol=1e-3)
    told = {one.kind: one.probability for one in shared.relations(snapshot)}
    assert_allclose(told["alone"], (1 - still.drift) * (1 - still.group), atol=0.15)


def test_what_two_cameras_see_is_what_one_or_the_other_sees() -> None:
    scene = a_scene()
    reid = RelationalReid(scene, OPTIONS)
    objects = a_snapshot(scene, 4).detections
    left = Camera(np.array([0.0, -1.0]), np.array(0.0), FieldOfView.symmetric(0.6, 4.0))
    away = Camera(np.array([0.0, -1.0]), np.array(np.pi), FieldOfView.symmetric(0.6, 4.0))
    one = reid.identify_objects(objects, [left])
    both = reid.identify_objects(objects, [left, away, away])
    assert one.labels == both.labels
    assert_allclose(one.confidence, both.confidence, atol=1e-6)
