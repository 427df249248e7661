"""None of the labels needs evidence: a thing that left by far has moved; a detector's doubt is evidence."""

import numpy as np
import pytest

from farm_ar.reid import DetectionNoise, LikelihoodOptions, LikelihoodReid, Motion, Rates, RelationalReid
from farm_ar.scenes import Bounds, Camera, Detections, FieldOfView, Layout, Scene, Snapshot


def room(scale, number, seed):
    """Look-alikes strewn over a room of `scale` times 6 x 5 metres."""
    rng = np.random.default_rng(seed)
    position = np.zeros((0, 2))
    while len(position) < number:
        one = rng.uniform((0.4, 0.4), (5.6, 4.6))
        if not len(position) or np.linalg.norm(position - one, axis=1).min() > 2.5 / np.sqrt(number):
            position = np.vstack([position, one])
    labels = tuple(f"crate {k}" for k in range(number))
    yaw = rng.uniform(-np.pi, np.pi, number)
    layout = Layout(labels, ("crate",) * number, scale * position, yaw, np.full((number, 3), 0.4 * scale))
    return Scene("room", None, layout, bounds=Bounds.rectangle(6 * scale, 5 * scale))


def from_the_middle(scale, category, position, yaw, size, **more):
    camera = Camera(scale * np.array([3.0, 2.5]), np.asarray(0.0), FieldOfView(np.pi, np.pi, 5 * scale))
    return Snapshot(camera, Detections(category, position, yaw, size, **more))


@pytest.mark.parametrize("scale", [0.02, 1.0, 30.0])
@pytest.mark.parametrize("number", [5, 10])
def test_one_that_left_by_far_while_all_is_in_view_has_moved(scale, number):
    rng, right = np.random.default_rng(0), []
    for seed in range(20):
        scene = room(scale, number, seed)
        layout = scene.layout
        corners = scale * np.array([[0.3, 0.3], [5.7, 0.3], [0.3, 4.7], [5.7, 4.7]])
        position, yaw = layout.position + rng.normal(0, 0.02 * scale, (number, 2)), layout.yaw.copy()
        position[0] = corners[np.linalg.norm(corners - position[0], axis=1).argmax()]
        yaw[0] += rng.uniform(-np.pi, np.pi)
        seen = from_the_middle(scale, layout.category, position, yaw, layout.size)
        right.append(LikelihoodReid(scene).identify(seen).labels == layout.labels)
    assert np.mean(right) >= 0.8


@pytest.mark.parametrize("confidence", [1.0, 0.9, 0.3])
def test_the_odds_of_none_follow_from_the_detectors_confidence(confidence):
    """Of one detection and one label: it is false as probably as the detector says, and then anywhere."""
    layout = Layout(("a",), ("crate",), [[3.0, 2.5]], [0.0], [[0.4, 0.4, 0.4]])
    scene = Scene("one", None, layout)
    options = LikelihoodOptions(
        noise=(Motion(1.0, 0.3, 0.5),), rates=(Rates(1.0, 0.02, 0.01),), detection=DetectionNoise(0.005, 0.01)
    )
    odds = []
    for sure in (1.0, confidence):
        one = ("crate",), [[3.4, 2.5]], [0.2], layout.size
        seen = from_the_middle(1.0, *one, confidence=np.array([sure]))
        probability = LikelihoodReid(scene, options).identify(seen).probability
        odds.append(probability[0, 1] / probability[0, 0])
    expected = (0.01 + (1 - confidence) / confidence) / 0.01
    assert odds[1] / odds[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("method", [LikelihoodReid, RelationalReid])
def test_what_the_detector_doubts_and_stands_nowhere_known_gets_no_label(method):
    scene = room(1.0, 6, 3)
    layout = scene.layout
    position = layout.position.copy()
    stray = np.array([[0.2, 0.2], [5.8, 0.2], [0.2, 4.8], [5.8, 4.8]])
    position[2] = stray[np.linalg.norm(stray - position[2], axis=1).argmax()]
    for sure, none in ((1.0, False), (0.02, True)):
        confidence = np.ones(6)
        confidence[2] = sure
        seen = from_the_middle(1.0, layout.category, position, layout.yaw, layout.size, confidence=confidence)
        found = method(scene).identify(seen)
        assert (found.labels[2] is None) == none
        assert [label for k, label in enumerate(found.labels) if k != 2] == [
            label for k, label in enumerate(layout.labels) if k != 2
        ]


@pytest.mark.parametrize("error", [0.0, 0.05, 0.1, 0.2, 0.3])
def test_measured_sizes_of_look_alikes_mislead_nobody(error):
    """Each side of eight alike chairs is measured with an error, in the map and again in the snapshot."""
    rng, right, sure = np.random.default_rng(5), 0, []
    for seed in range(12):
        scene = room(1.0, 8, seed)
        layout = scene.layout
        known, again = (layout.size * np.exp(rng.normal(0, error, (8, 3))) for _ in range(2))
        measured = Scene(
            "measured", None, Layout(layout.labels, layout.category, layout.position, layout.yaw, known)
        )
        position = layout.position + rng.normal(0, 0.07, (8, 2))
        found = LikelihoodReid(measured).identify(
            from_the_middle(1.0, layout.category, position, layout.yaw, again)
        )
        right += sum(a == b for a, b in zip(found.labels, layout.labels, strict=True))
        sure.append(found.confidence)
        if error == 0.3:
            terms = LikelihoodReid(measured).cost_terms(
                from_the_middle(1.0, layout.category, position, layout.yaw, again)
            )
            assert np.median(terms["size"]) < 6  # half a sum of 3 squares, by their own error
    assert right >= 0.99 * 12 * 8
    assert np.mean(sure) > 0.95


def test_exact_sizes_still_tell_things_apart():
    scene = room(1.0, 4, 1)
    layout = scene.layout
    size = layout.size * np.array([1.0, 1.3, 1.7, 2.2])[:, None]
    sized = Scene("sized", None, Layout(layout.labels, layout.category, layout.position, layout.yaw, size))
    order = [1, 2, 3, 0]  # everything has changed places
    seen = from_the_middle(1.0, layout.category, layout.position, layout.yaw, size[order])
    assert LikelihoodReid(sized).identify(seen).labels == tuple(layout.labels[j] for j in order)
