"""The conformance test of re-identifiers passes the package's own, finds what is broken, and says what."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from farm_ar.reid import REIDENTIFIERS, Identification, SpatialOptions, SpatialReid
from farm_ar.scenes import Bounds, builtin_scene
from farm_ar.testing import check_reidentifier
from farm_ar.testing.reidentifiers import snapshots_of

REPEATS = {"nearest", "last-known"}


@pytest.mark.parametrize("name", sorted(REIDENTIFIERS))
def test_every_method_of_the_package_passes(name):
    check_reidentifier(REIDENTIFIERS[name], allow_repeats=name in REPEATS)


@pytest.mark.parametrize("name", sorted(REIDENTIFIERS))
@pytest.mark.parametrize("bounds", [None, Bounds.rectangle(9, 9, (-1000, 500), 0.4)])
def test_every_method_of_the_package_passes_where_the_world_is_another(name, bounds):
    scene = builtin_scene("L2").moved((-1000.0, 500.0), 0.4)
    layout = scene.layout
    yaw, size = np.array(layout.yaw), np.array(layout.size)
    yaw[::2], size[::3] = np.nan, np.nan
    elsewhere = replace(scene, layout=replace(layout, yaw=yaw, size=size), bounds=bounds)
    check_reidentifier(REIDENTIFIERS[name], [elsewhere], allow_repeats=name in REPEATS)


@pytest.mark.parametrize("threshold", [0.5, 1.0])
def test_the_papers_rule_passes_on_every_scene(threshold):
    options = SpatialOptions(threshold=threshold)
    scenes = ["H1", "L2", builtin_scene("classroom")]
    check_reidentifier(lambda scene: SpatialReid(scene, options), scenes)


def test_a_method_that_takes_an_unknown_heading_for_a_number_is_noticed():
    class Hopeful(SpatialReid):
        def identify(self, snapshot):
            found = super().identify(snapshot)
            return replace(found, cost=found.cost + snapshot.detections.yaw)

    with pytest.raises(AssertionError, match="no heading or size known"):
        check_reidentifier(Hopeful, ["L2"])


def changed(change):
    """The paper's method with an answer that has been changed."""

    class Changed:
        calls = itertools.count()

        def __init__(self, scene):
            self._rule = SpatialReid(scene)

        def identify(self, snapshot):
            return change(self._rule.identify(snapshot), snapshot, next(self.calls))

    return Changed


def relabelled(answer, labels):
    return Identification(tuple(labels), np.where([label is None for label in labels], np.nan, 1.0))


def strange(answer, snapshot, call):
    return relabelled(answer, [f"thing {i}" for i in range(len(answer.labels))])


def repeated(answer, snapshot, call):
    return relabelled(answer, answer.labels[:1] * len(answer.labels))


def short(answer, snapshot, call):
    return relabelled(answer, answer.labels[:-1])


def costly_nothing(answer, snapshot, call):
    return Identification((None,) * len(answer.labels), np.ones(len(answer.labels)))


def wordless(answer, snapshot, call):
    nothing = (None,) * len(answer.labels)
    return Identification(nothing, reason=(7,) * len(answer.labels))


def infinite(answer, snapshot, call):
    return Identification(answer.labels, np.full(len(answer.labels), np.inf))


def moody(answer, snapshot, call):
    return replace(answer, cost=answer.cost + 1e-12 * call)


def no_answer(answer, snapshot, call):
    return list(answer.labels)


def afraid_of_nothing(answer, snapshot, call):
    return relabelled(answer, answer.labels) if answer.labels[0] else answer


def afraid_of_crowds(answer, snapshot, call):
    if len(snapshot.detections) > 2 * 11 - 1:
        raise ValueError("too many")
    return answer


def afraid_of_the_unknown(answer, snapshot, call):
    if None in snapshot.detections.category:
        raise KeyError("category")
    return answer


BROKEN = [
    (strange, "farm, nothing moved: labels that the scene does not have: thing 0"),
    (repeated, "farm, nothing moved: labels given to several detections:"),
    (short, r"farm, nothing moved: there must be one entry for each of \d+ detections"),
    (costly_nothing, "farm, nothing moved: detection 0 has no label but a cost of 1.0"),
    (wordless, "farm, nothing moved: the reason of detection 0 must be text or None, is 7"),
    (infinite, "farm, nothing moved: detection 0 has an infinite cost"),
    (moody, "farm, nothing moved: the second answer differs from the first"),
    (no_answer, "farm, nothing moved: the answer must be an Identification, is list"),
    (afraid_of_nothing, "farm, nothing in view: identify raised IndexError"),
    (afraid_of_crowds, "farm, more detections than labels: identify raised ValueError: too many"),
    (afraid_of_the_unknown, "identify raised KeyError"),
]


@pytest.mark.parametrize(("change", "message"), BROKEN, ids=lambda value: getattr(value, "__name__", ""))
def test_what_is_broken_is_found_and_named(change, message):
    with pytest.raises(AssertionError, match=message) as caught:
        check_reidentifier(changed(change), ["farm"])
    assert "\n" not in str(caught.value)


def test_an_instance_that_draws_its_own_luck_is_found():
    class Lucky:
        instances = itertools.count()

        def __init__(self, scene):
            self._rule, self._bias = SpatialReid(scene), next(self.instances)

        def identify(self, snapshot):
            found = self._rule.identify(snapshot)
            return replace(found, cost=found.cost + self._bias)

    with pytest.raises(AssertionError, match="another instance's answer differs"):
        check_reidentifier(Lucky, ["farm"])


def test_what_cannot_be_made_for_a_scene_is_no_reidentifier():
    with pytest.raises(AssertionError, match="farm: making it for the scene raised TypeError"):
        check_reidentifier(object, ["farm"])


def test_what_cannot_identify_is_no_reidentifier():
    with pytest.raises(AssertionError, match=r"farm: there is no method identify\(snapshot\)"):
        check_reidentifier(lambda scene: object(), ["farm"])


def test_repeats_may_be_allowed():
    check_reidentifier(changed(repeated_but_for_nothing), ["farm"], allow_repeats=True)


def repeated_but_for_nothing(answer, snapshot, call):
    return relabelled(answer, ["shed"] * len(answer.labels))


@pytest.mark.parametrize("name", ["farm", "L1", "M2"])
def test_the_snapshots_are_as_many_kinds_as_promised(name, rng):
    scene = builtin_scene(name)
    n = len(scene.layout)
    kinds = {}
    for kind, snapshot in snapshots_of(scene, rng):
        kinds.setdefault(kind, []).append(snapshot.detections)
    assert len(kinds["everything in view"][0]) == n
    assert len(kinds["nothing in view"][0]) == 0
    assert len(kinds["more detections than labels"][0]) == 2 * n
    assert set(kinds["no category known"][0].category) == {None}
    assert 0 < len(kinds["nothing moved"][0]) <= n
    noisy = [name for detections in kinds["things moved, with noise"] for name in detections.category]
    assert None in noisy


def test_a_label_without_a_cost_is_noticed():
    class Priceless(SpatialReid):
        def identify(self, snapshot):
            return Identification(super().identify(snapshot).labels)

    with pytest.raises(AssertionError, match="has a label but no cost"):
        check_reidentifier(Priceless)
