from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.errors import OptionError, SceneError
from farm_ar.reid import (
    DetectionNoise,
    LikelihoodOptions,
    LikelihoodReid,
    Motion,
    NoisePrior,
    Rates,
    association_marginals,
    motion_log_density,
)
from farm_ar.reid.likelihood.kernels import identify_batch
from farm_ar.reid.place import lengths_of
from farm_ar.scenes import (
    Camera,
    Detections,
    Detector,
    FieldOfView,
    Layout,
    LayoutNoise,
    Scene,
    Snapshot,
    observe,
)

ALL_ROUND = FieldOfView(np.pi, np.pi, 50.0)
FULL_VIEW = Camera(np.array([2.0, 2.0]), np.array(0.0), ALL_ROUND)
AWAY = Camera(np.array([100.0, 100.0]), np.array(0.0), FieldOfView(0.3, 0.3, 2.0))
KNOWN = (Motion(0.7, 0.2, 0.3), Motion(0.3, 0.8, 1.2))
RELIABLE = (Rates(1.0, 0.0, 0.0),)
SMALL = NoisePrior((0.1, 1.0), (15.0, 90.0), (2, 2))


def chairs(position, yaw=None, category=None, size=None, **more) -> Scene:
    m = len(position)
    layout = Layout(
        labels=tuple(f"chair {j}" for j in range(m)),
        category=("chair",) * m if category is None else category,
        position=np.array(position, dtype=float),
        yaw=np.zeros(m) if yaw is None else yaw,
        size=np.tile([0.4, 0.9, 0.5], (m, 1)) if size is None else size,
    )
    return Scene("chairs", (4.0, 4.0), layout, **more)


def seen(position, camera=FULL_VIEW, yaw=None, category=None, size=None) -> Snapshot:
    n = len(position)
    return Snapshot(
        camera,
        Detections(
            category=("chair",) * n if category is None else category,
            position=np.reshape(position, (n, 2)),
            yaw=np.zeros(n) if yaw is None else yaw,
            size=np.tile([0.4, 0.9, 0.5], (n, 1)) if size is None else size,
        ),
    )


@settings(max_examples=25 * settings().max_examples // 50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 5), m=st.integers(1, 6), away=st.booleans())
def test_with_known_noise_probabilities_are_those_of_the_densities(seed, n, m, away):
    """Weights worked out with NumPy and SciPy, in a view of everything or of nothing."""
    rng = np.random.default_rng(seed)
    scene = chairs(rng.uniform(0, 4, (m, 2)), rng.uniform(-3, 3, m))
    snapshot = seen(rng.uniform(0, 4, (n, 2)), AWAY if away else FULL_VIEW, rng.uniform(-3, 3, n))
    miss, none_rate, gone = 0.2, 0.3, 0.1
    options = LikelihoodOptions(
        noise=KNOWN, rates=(Rates(1.0, miss, none_rate),), gone_rate=gone, detection=DetectionNoise()
    )
    found = LikelihoodReid(scene, options).identify(snapshot)
    layout, detections = scene.layout, snapshot.detections
    poses = (detections.position, detections.yaw, layout.position, layout.yaw)
    density = np.exp(motion_log_density(*poses, KNOWN, DetectionNoise(), scene.size))
    unseen = gone + (1 - gone) * (1.0 if away else miss)
    weight = density * (1 - gone) * (1 - miss) / unseen
    area = 0.5 * lengths_of(scene).scene ** 2
    none = np.full(n, none_rate / area / (2 * np.pi))
    expected, _, _ = association_marginals(weight, none)
    np.testing.assert_allclose(found.probability, expected, atol=1e-4)
    assert found.gone is not None
    absent = 1 - expected[:, :-1].sum(axis=0)
    np.testing.assert_allclose(found.gone, absent * gone / unseen, atol=1e-4)
    for i, label in enumerate(found.labels):
        j = m if label is None else layout.index(label)
        assert found.confidence[i] == pytest.approx(expected[i, j], abs=1e-4)
        assert (
            np.isnan(found.cost[i])
            if label is None
            else found.cost[i] == pytest.approx(1 - expected[i, j], abs=1e-4)
        )


def test_unknown_noise_is_averaged_over_by_how_probable_it_makes_the_snapshot():
    rng = np.random.default_rng(3)
    scene = chairs(rng.uniform(0, 4, (6, 2)))
    snapshot = seen(scene.layout.position[:4] + rng.normal(0, 0.2, (4, 2)), yaw=rng.normal(0, 0.3, 4))
    motions = [(0.4, (Motion(1.0, 0.2, 0.3),)), (0.6, (Motion(1.0, 0.3, 0.5),))]
    every, sure = [], {"rates": RELIABLE, "gone_rate": 0.05, "detection": DetectionNoise()}
    for share, noise in motions:
        one = LikelihoodReid(scene, LikelihoodOptions(noise=noise, **sure))
        density = np.exp(
            motion_log_density(
                snapshot.detections.position,
                snapshot.detections.yaw,
                scene.layout.position,
                scene.layout.yaw,
                noise,
                DetectionNoise(),
                scene.size,
            )
        )
        _, log_evidence, _ = association_marginals(density * 0.95 / 0.05, np.zeros(4))
        every.append((np.log(share) + log_evidence, one.identify(snapshot).probability))

    class Two(NoisePrior):
        def models(self, length: float, fine: float | None = None):
            return motions

    reid = LikelihoodReid(scene, LikelihoodOptions(noise=Two(), **sure))
    weight = np.exp([log for log, _ in every])
    expected = np.tensordot(weight / weight.sum(), [p for _, p in every], 1)
    assert (weight / weight.sum()).min() > 0.02  # so both count
    np.testing.assert_allclose(reid.identify(snapshot).probability, expected, atol=1e-6)
    posterior = reid.posterior(snapshot)
    np.testing.assert_allclose(posterior.probability, weight / weight.sum(), atol=1e-6)
    assert 0.2 < posterior.translation_sd < 0.3
    assert 0.3 < posterior.rotation_sd < 0.5
    assert posterior.none_rate == 0.0


def test_the_estimated_noise_follows_the_true_one():
    rng = np.random.default_rng(1)
    grid = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
    scene = replace(chairs(grid * 2), size=(7.0, 7.0))
    reid = LikelihoodReid(scene, LikelihoodOptions())
    estimates = []
    for sd, turn in ((0.1, 15), (0.4, 60)):
        noisy = LayoutNoise.of(sd, turn).disturb(scene.layout, scene.size, rng)
        estimates.append(reid.posterior(observe(noisy, FULL_VIEW)[0]))
    assert estimates[0].translation_sd < 0.2 < estimates[1].translation_sd
    assert np.rad2deg(estimates[0].rotation_sd) < 30 < np.rad2deg(estimates[1].rotation_sd)


def test_a_label_whose_place_is_in_view_and_empty_is_likelier_than_one_out_of_view():
    # The detection stands half way between two labels, of which only one would still be seen where it was.
    scene = chairs([[1.0, 2.0], [3.0, 2.0]])
    west = Camera(np.array([2.0, 2.0]), np.array(-np.pi / 2), FieldOfView(1.2, 1.2, 3.0))
    options = LikelihoodOptions(noise=(Motion(1.0, 0.5, 0.5),), rates=RELIABLE)
    found = LikelihoodReid(scene, options).identify(seen([[1.99, 2.0]], west))
    assert found.probability is not None
    assert found.labels == ("chair 0",)
    assert found.probability[0, 0] > 0.85
    turned_away = Camera(np.array([2.0, 2.0]), np.array(0.0), FieldOfView(0.1, 0.1, 1.0))
    nothing_in_view = LikelihoodReid(scene, options).identify(seen([[2.0, 2.0]], turned_away))
    assert nothing_in_view.probability is not None
    assert nothing_in_view.probability[0, 0] == pytest.approx(0.5, abs=0.02)


def test_what_stands_behind_a_detection_counts_as_not_in_view():
    # The place of chair 1 lies behind what is detected; that of chair 2 is in plain view, as far away.
    scene = chairs([[2.0, 2.0], [2.0, 3.0], [3.0, 2.5]])
    camera = Camera(np.array([2.0, 0.5]), np.array(0.2), FieldOfView(0.8, 0.8, 4.0))
    snapshot = seen([[2.0, 2.0], [2.6, 2.75]], camera, size=np.array([[1.0, 1.0, 0.3], [0.4, 0.9, 0.5]]))
    noise = (Motion(1.0, 0.3, 0.5),)

    def probability(occlusion: bool):
        options = LikelihoodOptions(noise=noise, rates=RELIABLE, occlusion=occlusion, size_sd=5.0)
        return LikelihoodReid(scene, options).identify(snapshot).probability

    hidden, in_view = probability(True), probability(False)
    assert hidden[1, 1] < in_view[1, 1] - 0.05


def test_a_detection_far_from_all_labels_is_none_of_them_where_that_may_be():
    scene = chairs([[1.0, 1.0], [3.0, 1.0]])
    snapshot = seen([[1.02, 1.0], [3.9, 3.9]])
    noise = (Motion(1.0, 0.05, 0.2),)
    found = LikelihoodReid(scene, LikelihoodOptions(noise=noise, rates=(Rates(1.0, 0.1, 0.5),))).identify(
        snapshot
    )
    assert found.labels == ("chair 0", None)
    assert found.confidence[1] > 0.99
    assert np.isnan(found.cost[1])
    assert found.gone is not None
    assert found.gone[0] < 1e-6 < found.gone[1]


def test_the_rates_are_averaged_over_too():
    scene = chairs([[0.5, 0.5], [1.5, 0.5], [2.5, 0.5], [3.5, 0.5]])
    reid = LikelihoodReid(scene)
    camera = Camera(np.array([2.0, -1.0]), np.array(0.0), FieldOfView(1.2, 1.2, 5.0))
    clean = seen(scene.layout.position, camera)
    strange = seen(np.vstack([scene.layout.position, [[1.0, 3.5], [3.0, 3.5]]]), camera)
    assert reid.posterior(strange).none_rate > 3 * reid.posterior(clean).none_rate


def test_a_label_that_is_not_sure_enough_is_withheld_and_named_as_the_runner_up():
    scene = chairs([[1.0, 2.0], [3.0, 2.0]])
    snapshot = seen([[1.9, 2.0]])
    sure = LikelihoodReid(scene, LikelihoodOptions(rates=RELIABLE)).identify(snapshot)
    assert sure.labels == ("chair 0",)
    assert sure.runner_up == ("chair 1",)
    withheld = LikelihoodReid(scene, LikelihoodOptions(rates=RELIABLE, min_confidence=0.99)).identify(
        snapshot
    )
    assert withheld.labels == (None,)
    assert withheld.runner_up == ("chair 0",)
    assert np.isnan(withheld.margin[0])


def test_categories_and_sizes_are_likelihoods_not_gates():
    sizes = np.array([[0.4, 0.9, 0.5], [0.8, 0.9, 0.9]])
    scene = chairs([[1.0, 2.0], [1.0, 2.0]], category=("chair", "table"), size=sizes)

    def label(category, size, confusion=0.0):
        reid = LikelihoodReid(scene, LikelihoodOptions(rates=RELIABLE, confusion=confusion))
        return reid.identify(seen([[1.1, 2.0]], category=(category,), size=size[None])).labels[0]

    assert label("table", sizes[1]) == "chair 1"
    assert label(None, sizes[1]) == "chair 1"  # its size tells
    assert label("chair", sizes[1]) == "chair 0"  # a category that is known is kept
    # Where it may be wrong, it is so more often than a size is twice as large.
    assert label("chair", sizes[1], confusion=0.001) == "chair 1"
    assert label("chair", sizes[0], confusion=0.001) == "chair 0"


def test_symmetric_things_may_be_turned_by_their_period_at_no_cost():
    turn = np.array([np.pi / 2])
    options = LikelihoodOptions(noise=(Motion(1.0, 0.3, 0.1),), rates=RELIABLE, occlusion=False)
    places, yaws = [[1.0, 2.0], [1.6, 2.0]], np.array([0.0, np.pi / 2 + 0.1])
    for period, label in ((2 * np.pi, "chair 1"), (np.pi / 2, "chair 0"), (0.0, "chair 0")):
        scene = chairs(places, yaws, symmetry={"chair": period})
        assert LikelihoodReid(scene, options).identify(seen([[1.2, 2.0]], yaw=turn)).labels == (label,)


def test_fixed_things_stay_where_they_are():
    scene = chairs([[1.0, 2.0], [3.0, 2.0]])
    layout = replace(scene.layout, fixed=np.array([True, False]))
    snapshot = seen([[1.4, 2.0]])
    options = LikelihoodOptions(noise=(Motion(1.0, 0.8, 0.5),), rates=RELIABLE, occlusion=False)
    assert LikelihoodReid(scene, options).identify(snapshot).labels == ("chair 0",)
    assert LikelihoodReid(replace(scene, layout=layout), options).identify(snapshot).labels == ("chair 1",)


@pytest.mark.parametrize("height", [None, 1.6])
def test_how_probable_it_is_to_be_in_view_comes_near_a_simulation(height):
    rng = np.random.default_rng(2)
    scene = chairs(rng.uniform(0, 4, (8, 2)))
    fov = FieldOfView(0.6, 0.5, 2.5, 0.4, 0.5)
    camera = Camera(
        np.array([0.5, 0.3]), np.array(0.8), fov, None if height is None else np.array(height), np.array(-0.5)
    )
    options = LikelihoodOptions(noise=(Motion(1.0, 0.4, 0.5),), occlusion=False)
    reid = LikelihoodReid(scene, options)
    inside = 1 - np.exp(_log_unseen(reid, seen([[2.0, 2.0]], camera)))
    many = LayoutNoise.of(0.4, 0).disturb(scene.layout, scene.size, rng, (4000,))
    from farm_ar.scenes import visible

    np.testing.assert_allclose(inside, visible(many, camera).mean(axis=0), atol=0.09)


def _log_unseen(reid: LikelihoodReid, snapshot: Snapshot) -> np.ndarray:
    """Of a detector that misses nothing, and nothing gone."""
    sure = replace(reid.options, rates=RELIABLE, gone_rate=0.0)
    return LikelihoodReid(reid.scene, sure).cost_terms(snapshot)["its place is empty"][0]


NAMED = {
    "one detection": (chairs([[1, 1], [2, 2], [3, 3]]), [[2.1, 2.0]], ("chair 1",)),
    "one label": (chairs([[2, 2]]), [[2.1, 2.0]], ("chair 0",)),
    "nothing moved": (
        chairs([[1, 1], [2, 2], [3, 3]]),
        [[3, 3], [1, 1], [2, 2]],
        ("chair 2", "chair 0", "chair 1"),
    ),
    "nothing seen": (chairs([[1, 1]]), np.zeros((0, 2)), ()),
}


@pytest.mark.parametrize("case", NAMED)
@pytest.mark.parametrize(
    "noise", [NoisePrior(), (Motion(1.0, 0.0, 0.0),), KNOWN], ids=["unknown", "zero", "known"]
)
def test_simple_cases_have_simple_answers(case, noise):
    scene, position, labels = NAMED[case]
    found = LikelihoodReid(scene, LikelihoodOptions(noise=noise, rates=(Rates(1.0, 0.02, 1e-9),))).identify(
        seen(position)
    )
    if noise == (Motion(1.0, 0.0, 0.0),) and case.startswith("one"):
        labels = (None,)  # a detection 10 cm off cannot be what never moves
    assert found.labels == labels
    assert np.isfinite(found.confidence).all()


def test_labels_in_one_spot_are_equally_probable():
    scene = chairs(np.full((4, 2), 2.0))
    found = LikelihoodReid(scene, LikelihoodOptions(rates=RELIABLE)).identify(seen([[2.0, 2.0], [2.2, 2.0]]))
    assert found.probability is not None
    np.testing.assert_allclose(found.probability[:, :4], 0.25, atol=1e-3)
    assert len(set(found.labels)) == 2
    assert found.margin == pytest.approx([0.0, 0.0], abs=1e-3)


def test_identical_detections_and_more_of_them_than_labels():
    scene = chairs([[1.0, 1.0], [3.0, 3.0]])
    found = LikelihoodReid(scene, LikelihoodOptions(rates=(Rates(1.0, 0.02, 1e-6),))).identify(
        seen(np.ones((3, 2)))
    )
    given_out = [label for label in found.labels if label is not None]
    assert len(set(given_out)) == len(given_out) <= 2
    assert found.probability is not None
    np.testing.assert_allclose(found.probability, found.probability[:1].repeat(3, axis=0), atol=1e-6)
    np.testing.assert_allclose(found.probability.sum(axis=1), 1.0, atol=1e-9)


def test_many_snapshots_at_once_are_identified_as_one_by_one(make_scene, make_batch):
    rng = np.random.default_rng(5)
    scene = make_scene(rng)
    reid, batch = LikelihoodReid(scene), make_batch(rng, scene, snapshots=8)
    many = reid.identify_many(batch)
    for b in range(len(batch)):
        n, one = int(batch.count[b]), reid.identify(batch.snapshot(b))
        assert many.names(b, n) == one.labels
        for name in ("cost", "margin", "confidence"):
            np.testing.assert_array_equal(getattr(many, name)[b, :n], getattr(one, name))
        second = [None if j < 0 else scene.layout.labels[j] for j in many.runner_up[b, :n]]
        assert tuple(second) == one.runner_up


def test_beyond_what_is_summed_exactly_the_answer_warns():
    rng = np.random.default_rng(6)
    scene = chairs(rng.uniform(0, 4, (9, 2)))
    snapshot = seen(rng.uniform(0, 4, (8, 2)))
    wide = (Motion(1.0, 2.0, 3.0),)
    exact = LikelihoodReid(scene, LikelihoodOptions(noise=wide)).identify(snapshot)
    rough = LikelihoodReid(scene, LikelihoodOptions(noise=wide, most_exact=3)).identify(snapshot)
    assert exact.warnings == ()
    assert "belief propagation" in rough.warnings[0]
    assert "poor where nearly all labels are seen, as here" in rough.warnings[0]
    assert exact.probability is not None
    assert rough.probability is not None
    assert 0 < np.abs(exact.probability - rough.probability).max() < 0.3


def test_confidence_is_calibrated_where_the_noise_is_as_assumed():
    rng = np.random.default_rng(7)
    scene = replace(chairs(rng.uniform(0, 5, (14, 2)), rng.uniform(-3, 3, 14)), size=(5.0, 5.0))
    reid = LikelihoodReid(
        scene,
        LikelihoodOptions(noise=(Motion(1.0, 0.6, 0.8),), rates=(Rates(1.0, 0.1, 0.4),), occlusion=False),
    )
    camera = Camera(np.array([2.5, 0.0]), np.array(0.0), FieldOfView(0.7, 0.7, 3.5))
    sure, right = [], []
    for _ in range(250):
        noisy = LayoutNoise.of(0.6, np.rad2deg(0.8)).disturb(scene.layout, scene.size, rng)
        snapshot, truth = observe(noisy, camera, Detector(miss_rate=0.1, false_rate=0.4), rng)
        found = reid.identify(snapshot)
        sure += found.confidence.tolist()
        right += [a == b for a, b in zip(found.labels, truth, strict=True)]
    assert np.mean(sure) == pytest.approx(np.mean(right), abs=0.04)
    surest = np.argsort(sure)[len(sure) // 2 :]
    assert np.mean(np.array(right)[surest]) > np.mean(right)


def test_in_plain_python_the_kernels_say_the_same(request, make_scene, make_batch):
    rng = np.random.default_rng(8)
    scene = replace(make_scene(rng, objects=7), symmetry={"category 0": 0.0})
    options = LikelihoodOptions(noise=SMALL, most_exact=7, occlusion=True)
    fov = FieldOfView(0.6, 0.6, 3.0, 0.4, 0.6)
    batch = make_batch(rng, scene, snapshots=3, most=7)
    camera = Camera(batch.camera.position, batch.camera.yaw, fov, np.full(3, 1.5), np.full(3, -0.4))
    batch = replace(batch, camera=camera, count=np.array([0, 7, 3]))
    compiled = LikelihoodReid(scene, options).identify_many(batch)
    details = LikelihoodReid(scene, options).identify(batch.snapshot(2))
    request.getfixturevalue("plain")
    reid = LikelihoodReid(scene, options)
    plain = reid.identify_many(batch)
    np.testing.assert_array_equal(plain.label, compiled.label)
    np.testing.assert_allclose(plain.confidence, compiled.confidence, atol=1e-9)
    np.testing.assert_allclose(plain.margin, compiled.margin, atol=1e-9)
    again = reid.identify(batch.snapshot(2))
    np.testing.assert_allclose(again.probability, details.probability, atol=1e-9)
    np.testing.assert_allclose(again.gone, details.gone, atol=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"noise": (Motion(0.5, 1, 1),)}, "noise: must be motions whose shares sum to 1, got 0.5"),
        ({"rates": ()}, "rates: must be at least one"),
        ({"size_sd": 0.0}, "size_sd: must be a positive number"),
        ({"gone_rate": 1.0}, "gone_rate: must be from 0 to below 1"),
        ({"confusion": -0.1}, "confusion: must be from 0 to below 1"),
        ({"min_confidence": 2.0}, "min_confidence: must be from 0 to 1"),
        ({"most_exact": 30}, "most_exact: must be from 0 to 20"),
    ],
)
def test_wrong_options_are_refused(options, message):
    with pytest.raises(OptionError, match=message):
        LikelihoodOptions(**options)


def test_a_copy_says_the_same_by_the_same_kernels():
    scene = chairs([[1.0, 1.0], [3.0, 3.0]])
    reid, snapshot = LikelihoodReid(scene, LikelihoodOptions(noise=SMALL)), seen([[1.2, 1.1]])
    found = reid.identify(snapshot)
    compiled = len(identify_batch.signatures)
    copy = pickle.loads(pickle.dumps(reid))
    assert copy.options == reid.options
    np.testing.assert_array_equal(copy.identify(snapshot).probability, found.probability)
    assert len(identify_batch.signatures) == compiled


def test_a_scene_without_labels_is_refused():
    with pytest.raises(SceneError, match="objects: must be at least one"):
        LikelihoodReid(chairs(np.zeros((0, 2)), size=np.zeros((0, 3))))


def test_the_terms_are_those_of_the_weights():
    rng = np.random.default_rng(9)
    scene = chairs(rng.uniform(0, 4, (5, 2)), rng.uniform(-3, 3, 5))
    snapshot = seen(rng.uniform(0, 4, (3, 2)), yaw=rng.uniform(-3, 3, 3))
    options = LikelihoodOptions(
        noise=KNOWN, rates=(Rates(1.0, 0.1, 0.0),), gone_rate=0.0, detection=DetectionNoise()
    )
    terms = LikelihoodReid(scene, options).cost_terms(snapshot)
    layout, detections = scene.layout, snapshot.detections
    poses = (detections.position, detections.yaw, layout.position, layout.yaw)
    density = motion_log_density(*poses, KNOWN, DetectionNoise(), scene.size)
    np.testing.assert_allclose(sum(terms.values()), np.log(0.1) - density, atol=1e-9)
    assert set(terms) == {"distance", "turn", "size", "category", "its place is empty"}
