import pickle
from dataclasses import FrozenInstanceError
from typing import Any

import numpy as np
import pytest

from farm_ar.errors import OptionError, SnapshotError
from farm_ar.reid import (
    Assurance,
    Certificate,
    Identification,
    NearestReid,
    Reidentifier,
    SpatialReid,
    alternatives,
    as_reidentifier,
    certificates,
    explain,
    track,
)
from farm_ar.scenes import Camera, FieldOfView, builtin_scene, observe, observe_many


def test_costs_are_not_known_unless_given() -> None:
    found = Identification(("a", None))
    assert np.isnan(found.cost).tolist() == [True, True]
    assert found.total == 0


def test_the_total_is_over_the_labels_given() -> None:
    assert Identification(("a", None, "b"), np.array([0.25, np.nan, 0.5])).total == 0.75


def test_there_must_be_a_cost_for_each_label() -> None:
    with pytest.raises(SnapshotError, match=r"^cost: must have shape \(2,\), got \(3,\)$"):
        Identification(("a", "b"), np.zeros(3))


def test_what_has_no_label_may_have_a_reason_which_pickling_keeps() -> None:
    assert Identification(("a", None)).reason == (None, None)
    found = Identification(("a", None, None), reason=("never kept", "its pose is broken", None))
    assert found.reason == (None, "its pose is broken", None)
    again = pickle.loads(pickle.dumps(found))
    assert (again.labels, again.reason) == (found.labels, found.reason)
    with pytest.raises(SnapshotError, match=r"^reason: must have an entry for each of 2 detections"):
        Identification(("a", None), reason=("one",))


def test_answers_pickled_before_there_were_reasons_still_load() -> None:
    kind, values = Identification(("a", None)).__reduce__()
    assert kind(*values[:-1]).reason == (None, None)


def test_an_identification_cannot_be_changed() -> None:
    cost = np.array([1.0])
    found = Identification(("a",), cost)
    cost[0] = 2.0
    assert found.cost[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        found.cost[0] = 3.0
    with pytest.raises(FrozenInstanceError):
        found.labels = ("b",)  # type: ignore[misc]


def test_answers_survive_pickling_and_stay_read_only() -> None:
    scene = builtin_scene("L1")
    assert scene.camera_path is not None
    batch = observe_many(scene.layout, scene.camera_path.cameras(8, scene.fov))
    one, many = SpatialReid(scene).identify(batch.snapshot(0)), SpatialReid(scene).identify_many(batch)
    one_again, many_again = pickle.loads(pickle.dumps((one, many)))
    assert one_again.labels == one.labels
    np.testing.assert_array_equal(many_again.label, many.label)
    assert not one_again.cost.flags.writeable
    assert not many_again.label.flags.writeable


def test_a_rule_survives_pickling() -> None:
    scene = builtin_scene("L1")
    assert scene.camera_path is not None
    batch = observe_many(scene.layout, scene.camera_path.cameras(8, scene.fov))
    reid = SpatialReid(scene)
    again = pickle.loads(pickle.dumps(reid))
    np.testing.assert_array_equal(again.identify_many(batch).label, reid.identify_many(batch).label)


def test_without_an_assurance_nothing_is_known_of_how_sure_an_answer_is():
    answer = Identification(("a", None))
    assert np.isnan(answer.margin).all()
    assert np.isnan(answer.confidence).all()
    assert answer.runner_up == (None, None)
    assert (answer.probability, answer.gone, answer.certified, answer.warnings) == (None, None, None, ())


def test_an_assurance_is_worked_out_once_when_it_is_first_asked_for():
    asked = []

    def work_out():
        asked.append(1)
        return Assurance(margin=[0.5], runner_up=("b",), certified=Certificate(0.1, 0.2, 30.0, (0,)))

    answer = Identification(("a",), assurance=work_out)
    assert not asked
    assert answer.margin.tolist() == [0.5]
    assert answer.runner_up == ("b",)
    assert answer.certified == Certificate(0.1, 0.2, 30.0, (0,))
    assert len(asked) == 1
    copy = pickle.loads(pickle.dumps(answer))
    assert copy.margin.tolist() == [0.5]
    assert not copy.margin.flags.writeable
    assert len(asked) == 1


@pytest.mark.parametrize("name", ["margin", "confidence", "runner_up"])
def test_an_assurance_has_an_entry_for_each_detection(name):
    value = ("b",) if name == "runner_up" else [0.5]
    answer = Identification(("a", "b"), assurance=Assurance(**{name: value}))
    with pytest.raises(SnapshotError, match=f"{name}: must have an entry for each of 2 detections, got 1"):
        _ = answer.warnings


class Duck:
    """Somebody's own re-identifier, which inherits from nothing."""

    def __init__(self, scene):
        self._nearest = NearestReid(scene)

    def identify(self, snapshot):
        return self._nearest.identify(snapshot)


class Mine(Reidentifier):
    def __init__(self, scene):
        self.scene = scene

    def identify(self, snapshot):
        return NearestReid(self.scene).identify(snapshot)


def test_what_has_identify_is_a_reidentifier_and_the_contract_gives_the_rest(make_scene, make_batch):
    rng = np.random.default_rng(8)
    scene = make_scene(rng)
    batch, expected = make_batch(rng, scene), NearestReid(scene)
    for reid in (Duck(scene), Mine(scene)):
        assert isinstance(reid, Reidentifier)
        whole = as_reidentifier(reid, scene)
        many = whole.identify_many(batch, margins=True)
        for b in range(len(batch)):
            snapshot, n = batch.snapshot(b), int(batch.count[b])
            one = expected.identify(snapshot)
            assert many.names(b, n) == one.labels
            np.testing.assert_array_equal(many.margin[b, :n], one.margin)
            names = [None if j < 0 else scene.layout.labels[j] for j in many.runner_up[b, :n]]
            assert tuple(names) == one.runner_up
            assert (many.label[b, n:] == -1).all()
        cameras = [batch.snapshot(b).camera for b in (0, 1)]
        found = whole.identify_objects(batch.snapshot(1).detections, cameras)
        assert found.labels == expected.identify(batch.snapshot(1)).labels
        assert len(track(reid, [batch.snapshot(b) for b in range(3)]).identifications) == 3
        with pytest.raises(OptionError, match="must assign labels by costs"):
            alternatives(reid, batch.snapshot(1), 2)
        with pytest.raises(OptionError, match="must have costs that are sums of terms"):
            whole.cost_terms(batch.snapshot(1))
        assert explain(whole, batch.snapshot(1), 0).words().startswith("0 is ")
    assert as_reidentifier(expected) is expected
    assert not isinstance(scene, Reidentifier)
    with pytest.raises(TypeError, match="abstract"):
        Reidentifier()


def test_methods_of_its_own_are_asked_in_place_of_the_defaults(make_scene, make_batch):
    rng = np.random.default_rng(9)
    scene = make_scene(rng)
    batch, own = make_batch(rng, scene), SpatialReid(scene)

    class Fast(Duck):
        def __init__(self):
            self.identify_many, self.problem, self.cost_terms = own.identify_many, own.problem, own.cost_terms
            self.identify_objects = own.identify_objects

    whole, snapshot = as_reidentifier(Fast(), scene), batch.snapshot(1)
    np.testing.assert_array_equal(whole.identify_many(batch).label, own.identify_many(batch).label)
    np.testing.assert_array_equal(whole.problem(snapshot)[0], own.problem(snapshot)[0])
    assert whole.cost_terms(snapshot).keys() == own.cost_terms(snapshot).keys()
    objects = snapshot.detections
    assert whole.identify_objects(objects, [snapshot.camera]).labels == own.identify(snapshot).labels


@pytest.mark.parametrize(
    ("labels", "told"),
    [
        (lambda n: ("nobody",) * n, "labels: must be labels of the scene, or None, got 'nobody'"),
        (lambda n: (None,) * (n - 1), r"labels: must have an entry for each of \d+ detections, got \d+"),
    ],
)
def test_many_answers_have_a_label_of_the_scene_for_each_detection(labels, told):
    class Careless(Reidentifier):
        def __init__(self, scene):
            self.scene = scene

        def identify(self, snapshot):
            return Identification(labels(len(snapshot.detections)))

    scene = builtin_scene("L1")
    batch = observe_many(scene.layout, scene.camera_path.cameras(20, scene.fov))
    assert batch.count.any()
    with pytest.raises(SnapshotError, match=told):
        Careless(scene).identify_many(batch)


def test_a_certificate_is_worked_out_when_it_is_asked_for_and_is_in_a_pickle(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    proofs = list[Any]()
    usual = certificates.certificate

    def counted(*given: Any) -> Certificate | None:
        proofs.append(given)
        return usual(*given)

    monkeypatch.setattr(certificates, "certificate", counted)
    scene = builtin_scene("lab")
    snapshot, _ = observe(
        scene.layout, Camera(np.array([3.0, 2.5]), np.asarray(0.0), FieldOfView(np.pi, np.pi, 100.0))
    )
    answer = SpatialReid(scene).identify(snapshot)
    assert np.isfinite(answer.margin).all()
    assert not proofs
    copied = pickle.loads(pickle.dumps(answer))
    assert copied.certified == answer.certified
    assert answer.certified is not None
    assert len(proofs) <= 2
