"""`identify`: what cannot be identified is set aside with a reason, and the rest keeps its places."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from farm_ar.errors import OptionError, SnapshotError
from farm_ar.reid import (
    REIDENTIFIERS,
    LikelihoodReid,
    NearestReid,
    Reidentifier,
    SpatialReid,
    align,
    identify,
)
from farm_ar.reid.adaptive import AdaptiveOptions, AdaptiveReid
from farm_ar.reid.answers import Assurance, Identification
from farm_ar.reid.plausibility import set_aside
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot, load_scene, load_snapshot


@pytest.fixture
def scene():
    """Four chairs in a row and a table, 2 m apart."""
    position = np.array([(1.0 + 2 * k, 3.0) for k in range(5)])
    size = np.array([(0.5, 0.9, 0.5)] * 4 + [(1.4, 0.7, 0.8)])
    layout = Layout(
        ("ada", "ben", "cleo", "dan", "desk"), ("chair",) * 4 + ("table",), position, np.zeros(5), size
    )
    return Scene("row", (10.0, 6.0), layout)


def snapshot(scene, **changes):
    """All five as they stood, with some values changed; `extra` ones are appended."""
    layout = scene.layout
    camera = Camera(np.array([5.0, -2.0]), np.asarray(0.0), FieldOfView(1.2, 1.2, 12.0))
    values = {
        "category": layout.category,
        "position": layout.position,
        "yaw": layout.yaw,
        "size": layout.size,
    }
    return Snapshot(camera, Detections(**values | changes))


def again(scene, k, shift=(0.0, 0.0), **changes):
    """All five, and one of them a second time, a little off."""
    layout = scene.layout
    return snapshot(
        scene,
        **{
            "category": (*layout.category, layout.category[k]),
            "position": np.vstack([layout.position, layout.position[k] + shift]),
            "yaw": np.append(layout.yaw, layout.yaw[k]),
            "size": np.vstack([layout.size, layout.size[k]]),
        }
        | changes,
    )


@pytest.mark.parametrize("reid", ["spatial", "likelihood", "relational", "nearest"])
def test_without_anything_to_set_aside_the_answer_is_the_methods_own(scene, reid):
    mine, its = identify(scene, snapshot(scene), reid), REIDENTIFIERS[reid](scene).identify(snapshot(scene))
    assert mine.labels == its.labels == scene.layout.labels
    for name in ("cost", "margin", "confidence"):
        np.testing.assert_array_equal(getattr(mine, name), getattr(its, name))
    assert (mine.runner_up, mine.reason, mine.warnings) == (its.runner_up, its.reason, its.warnings)


def test_a_category_that_the_scene_lacks_has_a_reason_and_leaves_the_rest_in_place(scene):
    seen = snapshot(scene, category=("chair", "plate", "chair", "Chair", "table"))
    found = identify(scene, seen, "likelihood")
    assert found.labels == ("ada", None, "cleo", None, "desk")
    assert found.reason[1] == "the scene has no 'plate', only chair, table"
    assert found.reason[3] == "the scene has no 'Chair', only chair, table (is it 'chair'?)"
    kept = [0, 2, 4]
    rest = Snapshot(
        seen.camera,
        Detections(
            ("chair", "chair", "table"),
            *(getattr(seen.detections, one)[kept] for one in ("position", "yaw", "size")),
        ),
    )
    alone = LikelihoodReid(scene).identify(rest)
    for name in ("cost", "margin", "confidence", "probability"):
        values = getattr(found, name)
        np.testing.assert_array_equal(values[kept], getattr(alone, name))
        assert np.isnan(values[[1, 3]]).all()
    assert [found.runner_up[i] for i in kept] == list(alone.runner_up)
    copy = pickle.loads(pickle.dumps(found))
    assert (copy.labels, copy.reason, copy.warnings) == (found.labels, found.reason, found.warnings)


@pytest.mark.parametrize(
    ("reid"),
    [SpatialReid, lambda scene: SpatialReid(scene), NearestReid],
)
def test_a_class_a_function_and_an_instance_serve_as_the_method(scene, reid):
    for one in (reid, reid(scene)):
        assert identify(scene, snapshot(scene), one).labels == scene.layout.labels


def broken(seen, k):
    """The snapshot, with NaN for one detection's pose, as a stream gives it."""
    values = {
        name: np.array(getattr(seen.detections, name)) for name in ("position", "yaw", "size", "elevation")
    }
    for array in values.values():
        array[k] = np.nan
    return Snapshot(seen.camera, Detections.trusted(**vars(seen.detections) | values))


@pytest.mark.parametrize("reid", sorted(REIDENTIFIERS))
def test_one_broken_pose_costs_no_more_than_itself(scene, reid):
    found = identify(scene, broken(snapshot(scene), 3), reid)
    assert found.labels == ("ada", "ben", "cleo", None, "desk")
    assert found.reason[3] == "its pose is broken: its position is not a number"
    with pytest.raises(SnapshotError, match=r"^detections\[3\].position: must be finite"):
        REIDENTIFIERS[reid](scene).identify(broken(snapshot(scene), 3))


def test_a_broken_pose_does_not_hinder_the_search_for_the_frame(scene):
    rng = np.random.default_rng(0)
    known = scene.knowing(scene.layout.with_poses(rng.uniform(0.5, 5.5, (5, 2)), rng.uniform(-3, 3, 5)))
    whole = identify(known, snapshot(known), "spatial", frame="unknown")
    assert whole.labels == known.layout.labels
    found = identify(known, broken(snapshot(known), 3), "spatial", frame="unknown")
    assert found.labels == ("ada", "ben", "cleo", None, "desk")
    matches = align(known, broken(snapshot(known), 3)).matches
    assert matches[3] is None
    assert set(matches[:3]) <= {"ada", "ben", "cleo", None}


def test_sizes_that_cannot_be_right_are_not_used(scene):
    right = identify(scene, snapshot(scene))
    wrong = identify(scene, snapshot(scene, size=100 * scene.layout.size))
    assert any(
        "100 times too large, as if the snapshot gave them in centimetres" in one for one in wrong.warnings
    )
    assert wrong.labels == right.labels
    given_to = []

    class Spy(Twice):
        def identify(self, snapshot):
            given_to.append(snapshot.detections.size)
            return super().identify(snapshot)

    identify(scene, snapshot(scene, size=100 * scene.layout.size), Spy(scene))
    assert np.isnan(given_to[0]).all()
    np.testing.assert_allclose(wrong.confidence, right.confidence, atol=1e-3)


def test_a_method_or_a_frame_that_is_not_known_is_refused(scene):
    with pytest.raises(OptionError, match=r"^reid: must be one of "):
        identify(scene, snapshot(scene), "magic")
    with pytest.raises(OptionError, match=r"^reid: must be a name"):
        identify(scene, snapshot(scene), 7)
    with pytest.raises(OptionError, match=r"^frame: must be one of map, unknown, got 'mine'"):
        identify(scene, snapshot(scene), "spatial", frame="mine")


class Twice(Reidentifier):
    """What counts how many detections it is asked about."""

    def __init__(self, scene):
        self.scene, self.asked = scene, []

    def identify(self, snapshot):
        self.asked.append(len(snapshot.detections))
        return SpatialReid(self.scene).identify(snapshot)


@pytest.mark.parametrize(
    "change",
    [
        {"position": np.zeros((5, 2)) + np.arange(5)[:, None]},
        {"yaw": np.array([0.0, 0, 0, 0, 0.1])},
        {"labels": ("ada", "ben", "cleo", "dan", "table")},
        {"fixed": np.array([True, False, False, False, False])},
    ],
)
def test_a_method_made_for_another_layout_is_refused(scene, change):
    other = replace(scene, layout=replace(scene.layout, **change))
    with pytest.raises(OptionError, match="reid: must be made for this scene"):
        identify(scene, snapshot(scene), SpatialReid(other))
    same = replace(scene, name="again", layout=replace(scene.layout))
    assert identify(scene, snapshot(scene), SpatialReid(same)).labels == scene.layout.labels


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.01, 0.005)])
def test_of_a_thing_detected_twice_the_less_sure_detection_is_set_aside(scene, shift):
    sure = np.ones(6)
    sure[1] = 0.4
    method = Twice(scene)
    found = identify(scene, again(scene, 1, shift, confidence=sure), method)
    assert found.labels == ("ada", None, "cleo", "dan", "desk", "ben")
    assert found.reason[1] == "the same thing as detection 5"
    assert method.asked == [5]
    sure[1] = 1.0
    assert (
        identify(scene, again(scene, 1, shift, confidence=sure)).reason[5] == "the same thing as detection 1"
    )


def test_a_second_detection_without_a_category_is_the_same_thing(scene):
    found = identify(scene, again(scene, 4, category=(*scene.layout.category, None)), "spatial")
    assert found.labels[5] is None


def test_what_stands_near_above_or_is_of_another_category_is_another_thing(scene):
    layout = scene.layout
    beside = again(scene, 1, (0.3, 0.0))
    assert set_aside(scene, beside) == (None,) * 6
    above = again(scene, 1, elevation=np.array([0, 0, 0, 0, 0, 1.0]))
    assert set_aside(scene, above) == (None,) * 6
    other = again(scene, 1, (0.0, 0.01), category=(*layout.category, "table"))
    assert set_aside(scene, other) == (None,) * 6


def test_heights_count_where_sizes_are_not_known(scene):
    unknown = np.full((6, 3), np.nan)
    above = again(scene, 1, size=unknown, elevation=np.array([0, 0, 0, 0, 0, 1.0]))
    assert set_aside(scene, above) == (None,) * 6
    assert set_aside(scene, again(scene, 1, size=unknown))[5] == "the same thing as detection 1"


def test_things_that_coincide_in_the_map_may_coincide_in_a_snapshot(scene):
    layout = scene.layout
    piled = scene.knowing(
        layout.with_poses(
            np.vstack([layout.position[:3], layout.position[2:3], layout.position[4:]]), layout.yaw
        )
    )
    found = identify(piled, snapshot(piled), "spatial")
    assert sorted(found.labels) == sorted(layout.labels)


def test_where_more_are_detected_than_there_are_less_must_coincide(scene):
    five_chairs = again(scene, 1, (0.15, 0.0))
    assert identify(scene, five_chairs, "spatial").reason[5] == "the same thing as detection 1"
    layout = scene.layout
    fewer = layout.subset([0, 1, 2, 3])
    four = Snapshot(
        five_chairs.camera,
        Detections(
            ("chair",) * 3,
            [*fewer.position[:2], fewer.position[1] + (0.15, 0.0)],
            np.zeros(3),
            fewer.size[:3],
        ),
    )
    assert set_aside(scene, four) == (None,) * 3


def test_poses_of_lost_trackers_are_set_aside_and_the_rest_is_identified(scene):
    position, yaw = scene.layout.position.copy(), scene.layout.yaw.copy()
    position[[0, 3]], yaw[[0, 3]] = 0.0, 0.0
    found = identify(scene, snapshot(scene, position=position, yaw=yaw), "spatial")
    assert found.labels == (None, "ben", "cleo", None, "desk")
    assert all("no measurement" in found.reason[i] for i in (0, 3))
    assert any("have one pose, to the last digit" in said for said in found.warnings)


def test_a_snapshot_that_fits_far_better_mirrored_is_not_answered_with_confidence(scene):
    rng = np.random.default_rng(0)
    position = rng.uniform(0.5, 5.5, (5, 2)) * (1.6, 1.0)
    known = scene.knowing(scene.layout.with_poses(position, rng.uniform(-3, 3, 5)))
    right = identify(known, snapshot(known))
    assert right.confidence.min() > 0.9
    wrong = identify(known, snapshot(known, position=known.layout.position * (1, -1), yaw=-known.layout.yaw))
    assert any("mirrored" in said for said in wrong.warnings)
    assert np.nanmax(wrong.confidence) < 0.3
    np.testing.assert_allclose(wrong.probability.sum(axis=1), 1.0)
    unchecked = identify(known, snapshot(known, position=known.layout.position * (1, -1)), checks=False)
    assert unchecked.warnings == ()


def test_a_method_that_names_no_candidates_is_doubted_as_others_are(scene):
    class Sure(Reidentifier):
        def __init__(self, scene):
            self.scene = scene

        def identify(self, snapshot):
            n = len(snapshot.detections)
            return Identification(self.scene.layout.labels[:n], assurance=Assurance(confidence=np.ones(n)))

    wrong = snapshot(scene, position=scene.layout.position * 100)
    assert identify(scene, wrong, Sure).confidence == pytest.approx(np.full(5, 1 / 6), abs=1e-3)


def test_what_is_certified_is_named_by_its_place_among_all_detections(scene):
    whole = identify(scene, snapshot(scene), "spatial").certified
    assert whole is not None
    assert whole.detections == (0, 1, 2, 3, 4)
    rest = identify(scene, snapshot(scene, category=("plate", *scene.layout.category[1:])), "spatial")
    assert rest.certified is not None
    assert rest.certified.detections == (1, 2, 3, 4)


def test_nothing_detected_is_an_empty_answer(scene):
    nothing = Snapshot(snapshot(scene).camera, Detections((), [], [], []))
    for reid in ("spatial", "likelihood"):
        found = identify(scene, nothing, reid)
        assert (found.labels, found.reason, found.warnings) == ((), (), ())


def test_all_set_aside_is_an_answer_of_none(scene):
    found = identify(scene, snapshot(scene, category=("plate",) * 5), "likelihood")
    assert found.labels == (None,) * 5
    assert None not in found.reason
    assert any("the scene has no plate, only chair, table" in said for said in found.warnings)


def test_what_the_method_gives_no_label_has_a_reason_too(scene):
    layout = scene.layout
    more = snapshot(
        scene,
        category=("chair",) * 5,
        position=np.vstack([layout.position[:4], [(2.0, 5.0)]]),
        size=np.vstack([layout.size[:4], layout.size[:1]]),
    )
    found = identify(scene, more, "spatial")
    assert found.labels[4] is None
    assert found.reason == (None,) * 4 + ("all labels that it may have are given to others",)
    moved = identify(scene, snapshot(scene, position=layout.position + 0.3), "last-known")
    assert moved.reason == ("no label fits it",) * 5


LIMITS = st.floats(-1e6, 1e6)
UNKNOWN_OR = st.one_of(st.just(np.nan), st.floats(-10, 10))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=st.lists(
        st.tuples(
            st.sampled_from(["chair", "table", "Chair", None]),
            st.one_of(LIMITS, st.just(np.nan), st.floats(0, 10)),
            st.one_of(LIMITS, st.floats(0, 6)),
            UNKNOWN_OR,
            st.one_of(st.just(np.nan), st.floats(1e-6, 1e6)),
            st.floats(0, 1),
        ),
        max_size=7,
    ),
    reid=st.sampled_from(["spatial", "likelihood", "nearest"]),
)
def test_whatever_is_detected_is_answered(scene, rows, reid):
    n = len(rows)
    columns = list(zip(*rows, strict=True)) if rows else [()] * 6
    seen = Detections.trusted(
        **vars(Detections((), [], [], []))
        | {
            "category": tuple(columns[0]),
            "position": np.array([columns[1], columns[2]], dtype=float).T.reshape(n, 2),
            "yaw": np.array(columns[3], dtype=float),
            "size": np.repeat(np.array(columns[4], dtype=float), 3).reshape(n, 3),
            "elevation": np.zeros(n),
            "confidence": np.array(columns[5], dtype=float),
            "ids": tuple(map(str, range(n))),
            "track_id": (None,) * n,
            "broken": (None,) * n,
        }
    )
    found = identify(scene, Snapshot(snapshot(scene).camera, seen), reid)
    assert len(found.labels) == len(found.reason) == len(found.confidence) == len(found.margin) == n
    given_labels = [label for label in found.labels if label is not None]
    assert set(given_labels) <= set(scene.layout.labels)
    assert reid == "nearest" or len(set(given_labels)) == len(given_labels)
    for label, reason, row in zip(found.labels, found.reason, rows, strict=True):
        assert (label is None) == (reason is not None)
        assert label is None or (row[0] != "Chair" and not np.isnan(row[1]))


DATA = Path(__file__).parents[2] / "examples" / "data"


def test_a_label_below_the_threshold_is_named_with_its_probability():
    before, seen = load_scene(DATA / "before.json"), load_snapshot(DATA / "seen.json")
    plain = identify(before, seen)
    sure = identify(before, seen, lambda scene: AdaptiveReid(scene, AdaptiveOptions(min_confidence=0.8)))
    below = [k for k, label in enumerate(sure.labels) if label is None]
    assert below
    for k in below:
        assert sure.reason[k] == (
            f"its likeliest label, {plain.labels[k]}, has a probability of {plain.confidence[k]:.2f} only"
        )
