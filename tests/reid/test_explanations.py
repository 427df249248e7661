from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from farm_ar.errors import SnapshotError
from farm_ar.reid import (
    REIDENTIFIERS,
    AdaptiveReid,
    LikelihoodOptions,
    LikelihoodReid,
    Motion,
    Rates,
    SpatialOptions,
    SpatialReid,
    alternatives,
    explain,
)
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot, Weights, World


@pytest.fixture
def scene() -> Scene:
    layout = Layout(
        labels=("desk chair", "spare chair"),
        category=("chair", "chair"),
        position=np.array([[1.0, 1.0], [3.0, 1.0]]),
        yaw=np.array([0.0, np.pi / 2]),
        size=np.tile([0.4, 0.9, 0.5], (2, 1)),
    )
    return Scene("two chairs", (3.0, 4.0), layout, weights=Weights(2.5, 1.0))


def snapshot(*places: tuple[float, float, float]) -> Snapshot:
    values = np.array(places)
    n = len(values)
    size = np.tile([0.4, 0.9, 0.5], (n, 1))
    seen = Detections(("chair",) * n, values[:, :2], np.deg2rad(values[:, 2]), size)
    return Snapshot(Camera(np.array([2.0, -1.0]), np.array(0.0)), seen)


def test_the_terms_of_the_papers_rule_sum_to_its_costs(make_scene, make_batch):
    rng = np.random.default_rng(2)
    scene = make_scene(rng)
    reid, seen = SpatialReid(scene), make_batch(rng, scene).snapshot(1)
    np.testing.assert_allclose(sum(reid.cost_terms(seen).values()), reid.cost_matrix(seen.detections))


def test_an_explanation_says_what_speaks_for_a_label_and_what_against(scene):
    # 1.2 m from its place and turned by 60 degrees; the other would have come .8 m and turned 30.
    found = explain(SpatialReid(scene), snapshot((2.2, 1.0, 60.0), (3.0, 1.0, 90.0)), "0")
    assert found.given is not None
    assert found.runner_up is not None
    assert (found.given.label, found.runner_up.label) == ("desk chair", "spare chair")
    assert found.given.shift_m == pytest.approx(1.2)
    assert found.given.turn_deg == pytest.approx(60.0)
    assert dict(found.given.terms) == pytest.approx({"distance": 0.6, "turn": 0.5, "size": 0.0})
    assert dict(found.runner_up.terms) == pytest.approx(
        {"distance": 0.4, "turn": np.sin(np.pi / 12), "size": 0.0}
    )
    assert found.words() == (
        "0 is desk chair, moved 1.20 m and turned 60°; it could be spare chair, moved 0.80 m and turned 30°. "
        "Against it: turn (-0.24), distance (-0.20). spare chair alone would cost no more, but another "
        "detection needs it."
    )
    plain = explain(SpatialReid(scene), snapshot((1.1, 1.0, 0.0)), 0).words()
    assert plain.endswith("For desk chair: distance (+0.90), turn (+0.71).")


def test_likelihoods_explain_what_was_not_seen(scene):
    options = LikelihoodOptions(noise=(Motion(1.0, 0.5, 0.5),), rates=(Rates(1.0, 0.01, 0.01),))
    found = explain(LikelihoodReid(scene, options), snapshot((1.6, 1.0, 20.0)), "0")
    assert found.given is not None
    assert found.given.label == "desk chair"
    assert found.given.terms["its place is empty"] < 0
    assert 0.5 < found.confidence <= 1
    assert "it could be" not in found.words() or "spare chair" in found.words()


def test_without_a_label_or_a_runner_up_there_is_little_to_say(scene):
    options = LikelihoodOptions(noise=(Motion(1.0, 0.05, 0.1),), rates=(Rates(1.0, 0.01, 0.5),))
    far = explain(LikelihoodReid(scene, options), snapshot((2.0, 3.5, 180.0)), 0)
    assert far.given is None
    assert far.words().startswith("0 is none of the labels (probability 1.00)")
    one = Scene("one", (3.0, 4.0), scene.layout.subset([0]))
    assert (
        explain(SpatialReid(one), snapshot((1.0, 1.0, 0.0)), 0)
        .words()
        .endswith("without that label it would have none.")
    )


@pytest.mark.parametrize("name", sorted(REIDENTIFIERS))
def test_every_method_explains_its_label_with_the_next_best(name, scene):
    reid, seen = REIDENTIFIERS[name](scene), replace(snapshot((1.05, 1.0, 2.0)), world=World("ros", "cm"))
    answer = reid.identify(seen)
    found = explain(reid, seen, 0)
    if name == "last-known":  # takes a thing for nothing that is not where it was
        assert (
            found.words()
            == "0 is none of the labels; the likeliest would be desk chair, moved 5.0 cm and turned 2°."
        )
        return
    assert found.given is not None
    assert answer.labels == ("desk chair",)
    words = found.words()
    assert words.startswith("0 is desk chair, moved 5.0 cm and turned 2°")
    other = "spare chair, moved 195.0 cm and turned 88°"
    if answer.probability is None:
        assert other in words
    else:
        row = dict(zip(answer.candidates, answer.probability[0], strict=False))
        assert found.given.probability == row["desk chair"]
        assert [one.probability for one in found.others] == [p for p in [row["spare chair"]] if p >= 0.01]
        assert (other in words) == (row["spare chair"] >= 0.01 or bool(found.given.terms))
        assert found.none == pytest.approx(answer.probability[0, -1])
        assert f"desk chair, moved 5.0 cm and turned 2° ({row['desk chair']:.2f})" in words


def test_adaptive_says_which_motions_it_believed_in():
    rng = np.random.default_rng(5)
    position = np.array([(x, z) for x in range(4) for z in range(3)], dtype=float) * (2.0, 2.4)
    position += rng.normal(0, 0.3, position.shape)
    yaw = rng.uniform(-3, 3, 12)
    layout = Layout(tuple("abcdefghijkl"), ("chair",) * 12, position, yaw, np.full((12, 3), 0.5))
    scene = Scene("grid", None, layout)
    camera = Camera(np.array([3.0, 3.0]), np.array(0.0), FieldOfView(np.pi, np.pi, 50.0))

    def told(shift, turn):
        seen = Detections(("chair",) * 12, position + shift, yaw + turn, layout.size)
        return explain(AdaptiveReid(scene), Snapshot(camera, seen), "3").believed

    alone = told(rng.normal(0, 0.02, (12, 2)), rng.normal(0, 0.05, 12))
    assert alone[0].startswith("Inferred motion of each object: on its own, by about 0.0")
    assert alone[1].startswith("Headings: kept to about 4°")
    together = told(np.array([0.7, -0.5]) + rng.normal(0, 0.01, (12, 2)), rng.normal(0, 0.05, 12))
    assert together[0].startswith("Inferred motion of each object: all by one shift")
    blind = told(rng.normal(0, 0.05, (12, 2)), rng.uniform(-np.pi, np.pi, 12))
    assert blind[1].startswith("Headings: uninformative")
    unknown = told(rng.normal(0, 0.02, (12, 2)), np.full(12, np.nan))
    assert len(unknown) == 1
    assert "heading" not in unknown[0]


def test_adaptive_says_why_a_detection_is_none(scene):
    seen = snapshot((1.05, 1.0, 2.0), (3.02, 1.0, 91.0), (2.0, 3.5, 180.0))
    found = explain(AdaptiveReid(scene), seen, "2")
    assert found.given is None
    assert found.none == pytest.approx(found.confidence)
    assert found.words().startswith(f"2 is none of the labels (probability {found.confidence:.2f})")


@pytest.mark.parametrize("detection", [2, -1, "seven"])
def test_a_detection_that_there_is_not_is_refused(scene, detection):
    with pytest.raises(SnapshotError, match="detection: must be one of 0, or an index below 1"):
        explain(SpatialReid(scene), snapshot((1.0, 1.0, 0.0)), detection)


@pytest.mark.parametrize(
    "options",
    [SpatialOptions(), SpatialOptions(gate_categories=False), SpatialOptions(threshold=0.5)],
    ids=str,
)
def test_the_first_alternative_is_the_answer_and_the_others_cost_more(options, make_scene, make_batch):
    rng = np.random.default_rng(1)
    scene = make_scene(rng)
    reid, batch = SpatialReid(scene, options), make_batch(rng, scene)
    for b in range(len(batch)):
        snapshot = batch.snapshot(b)
        found, answer = alternatives(reid, snapshot, 5), reid.identify(snapshot)
        assert found[0].labels == answer.labels
        np.testing.assert_allclose(found[0].cost, answer.cost)
        assert found[0].candidates == answer.candidates
        assert len({one.labels for one in found}) == len(found)
        totals = [one.total for one in found]
        assert totals == sorted(totals)
        if len(answer.labels) and np.isfinite(answer.margin).any():
            assert totals[1] - totals[0] == pytest.approx(np.nanmin(answer.margin))


def test_alternatives_by_likelihood_rise_in_expected_errors(make_scene, make_batch):
    rng = np.random.default_rng(2)
    scene = make_scene(rng)
    reid, snapshot = LikelihoodReid(scene), make_batch(rng, scene).snapshot(1)
    found, answer = alternatives(reid, snapshot, 6), reid.identify(snapshot)
    assert found[0].labels == answer.labels
    assert answer.probability is not None
    index = {name: j for j, name in enumerate(answer.candidates)} | {None: len(answer.candidates)}
    right = [sum(answer.probability[i, index[x]] for i, x in enumerate(one.labels)) for one in found]
    assert all(a >= b - 1e-9 for a, b in itertools.pairwise(right))
    assert len(found) == 6
