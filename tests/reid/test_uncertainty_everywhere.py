"""What a detector knows of its errors reaches every method by every way: files, sessions, fusion, batches."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal, vonmises

from farm_ar.reid import (
    AdaptiveReid,
    DetectionNoise,
    LikelihoodOptions,
    LikelihoodReid,
    Motion,
    Rates,
    Session,
    association_marginals,
    identify,
)
from farm_ar.reid.adaptive.densities import shift_with_errors, turn_with_errors
from farm_ar.reid.adaptive.pairs import Surroundings, problem_of
from farm_ar.reid.adaptive.records import Profile
from farm_ar.reid.fusion import objects_of
from farm_ar.scenes import (
    Camera,
    Detections,
    FieldOfView,
    Layout,
    Scene,
    Snapshot,
    SnapshotBatch,
    Uncertainty,
    load_snapshot,
    save_snapshot,
)

EYE = Camera(np.array([0.0, -4.0]), np.array(0.0), FieldOfView(1.0, 1.0, 12.0))


def world(rng, known=True, n=6):
    """A few chairs that were moved, and a detector that knows how wrong it is of each."""
    position, yaw = rng.uniform(-1.5, 1.5, (n, 2)), rng.uniform(-3, 3, n)
    layout = Layout(tuple("abcdefgh"[:n]), ("chair",) * n, position, yaw, np.tile([0.4, 0.9, 0.5], (n, 1)))
    root = rng.normal(0, 0.25, (n, 3, 3))
    covariance = root @ root.transpose(0, 2, 1)
    error = np.einsum("nij,nj->ni", np.linalg.cholesky(covariance), rng.standard_normal((n, 3)))
    flipped = rng.random(n) < 0.3
    seen_yaw = yaw + 0.1 * rng.standard_normal(n) + error[:, 2] + np.pi * flipped
    uncertainty = Uncertainty(covariance, np.ones(n), seen_yaw + np.pi, np.full(n, 0.4))
    seen = Detections(
        ("chair",) * n,
        position + 0.1 * rng.standard_normal((n, 2)) + error[:, :2],
        seen_yaw,
        layout.size,
        uncertainty=uncertainty if known else None,
    )
    return Scene("chairs", None, layout), Snapshot(EYE, seen)


def blind(snapshot):
    return replace(snapshot, detections=replace(snapshot.detections, uncertainty=None))


def same(one, other):
    assert one.labels == other.labels
    np.testing.assert_allclose(one.confidence, other.confidence, rtol=1e-6)


@pytest.mark.parametrize("method", ["likelihood", "adaptive", "relational"])
def test_it_counts_and_a_file_carries_it(tmp_path, method):
    scene, snapshot = world(np.random.default_rng(1))
    told, untold = identify(scene, snapshot, method), identify(scene, blind(snapshot), method)
    assert np.abs(told.confidence - untold.confidence).max() > 0.01
    save_snapshot(snapshot, tmp_path / "seen.json")
    same(identify(scene, load_snapshot(tmp_path / "seen.json"), method), told)


def test_many_at_once_are_answered_as_one_by_one():
    scene = world(np.random.default_rng(2))[0]
    some = [world(np.random.default_rng(k))[1] for k in range(5)]
    for method in (LikelihoodReid, AdaptiveReid):
        reid = method(scene)
        answers = reid.identify_many(SnapshotBatch.stack(some))
        for b, one in enumerate(some):
            alone = reid.identify(one)
            assert answers.names(b, len(one.detections)) == alone.labels, method
            np.testing.assert_allclose(answers.confidence[b], alone.confidence, rtol=1e-6)


def test_a_session_asks_learns_and_remembers_with_it(tmp_path):
    scene, snapshot = world(np.random.default_rng(3))
    session = Session(scene)
    same(session.identify(snapshot), identify(scene, snapshot))
    session.save(tmp_path / "session.json")
    back = Session.load(tmp_path / "session.json").state.look.snapshot.detections.uncertainty
    np.testing.assert_allclose(back.covariance, snapshot.detections.uncertainty.covariance, rtol=1e-12)
    blindly = Session(scene)
    blindly.identify(blind(snapshot))
    for one in (session, blindly):
        one.correct(dict(zip(snapshot.detections.ids, scene.layout.labels, strict=True)))
        one.confirm()
    assert session.state.learnt.to_json() != blindly.state.learnt.to_json()


def test_objects_of_several_snapshots_are_known_no_better_than_each():
    """In no direction; and in those that look equally exact not better than in one, however many they are."""
    rng = np.random.default_rng(4)
    _, snapshot = world(rng)
    given = snapshot.detections.uncertainty.covariance
    objects = objects_of([snapshot] * 3)[0]
    assert len(objects) == len(snapshot.detections)
    added = objects.uncertainty.covariance - given
    assert (np.linalg.eigvalsh(added) > 0).all(), "what is common to all comes on top"
    np.testing.assert_allclose(added, np.broadcast_to(added[0], added.shape), atol=1e-9)
    assert (np.sqrt(added[0].diagonal()) < [0.01, 0.01, 0.03]).all(), "little, beside 0.25"
    assert np.isnan(objects.uncertainty.runner_up_yaw).all()
    covariance = rng.uniform(0.2, 5, len(given))[:, None, None] * given[rng.permutation(len(given))]
    known = replace(snapshot.detections.uncertainty, covariance=covariance)
    other = replace(snapshot, detections=replace(snapshot.detections, uncertainty=known))
    mixed = objects_of([snapshot, other])[0].uncertainty.covariance
    for _ in range(50):
        way = rng.normal(0, 1, 3)
        exactness = [np.einsum("i,nij,j->n", way, np.linalg.inv(c), way) for c in (mixed, given, covariance)]
        assert (exactness[0] <= np.maximum(*exactness[1:]) * (1 + 1e-9)).all()


def test_a_detector_that_says_nothing_beside_one_that_does_is_taken_for_as_exact_as_usual():
    _, snapshot = world(np.random.default_rng(4))
    given = snapshot.detections.uncertainty.covariance
    place = np.median((given[:, 0, 0] + given[:, 1, 1]) / 2)
    usual = np.tile(np.diag([place, place, np.median(given[:, 2, 2])]), (len(given), 1, 1))
    told = replace(snapshot.detections.uncertainty, covariance=usual)
    said = replace(snapshot, detections=replace(snapshot.detections, uncertainty=told))
    first, second = (objects_of([snapshot, snapshot, other])[0] for other in (blind(snapshot), said))
    assert len(first) == len(second) == len(snapshot.detections)
    np.testing.assert_allclose(first.uncertainty.covariance, second.uncertainty.covariance, rtol=0.05)
    assert objects_of([blind(snapshot)] * 2)[0].uncertainty is None


def test_detections_that_may_be_flipped_are_of_one_thing_and_say_together_how_it_is_turned():
    rng, n = np.random.default_rng(8), 6
    scene, snapshot = world(rng, n=n)
    truth, several, of, wrong = scene.layout, [], [], []
    for _ in range(15):
        seen = rng.permutation(n)[:4]
        flipped = rng.random(4) < 0.2
        yaw = truth.yaw[seen] + 0.02 * rng.standard_normal(4) + np.pi * flipped
        known = Uncertainty(np.zeros((4, 3, 3)), np.ones(4), yaw + np.pi, np.full(4, 0.2))
        place = truth.position[seen] + 0.005 * rng.standard_normal((4, 2))
        detections = Detections(("chair",) * 4, place, yaw, truth.size[seen], uncertainty=known)
        several.append(replace(snapshot, detections=detections))
        of.append(seen)
        wrong.append(flipped)
    objects, object_of = objects_of(several)
    assert len(objects) == n
    for k in range(n):
        mine = np.concatenate(object_of) == k
        (i,) = set(np.concatenate(of)[mine].tolist())
        half = np.sign(0.5 - np.concatenate(wrong)[mine].mean())
        assert half * np.cos(objects.yaw[k] - truth.yaw[i]) > 0.999, "as most of them say"


def test_errors_that_go_together_are_believed_as_such():
    """Against SciPy's multivariate normal densities, with no headings."""
    rng = np.random.default_rng(5)
    place, motion, usual = rng.uniform(-1, 1, (4, 2)), 0.3, 0.05
    layout = Layout(
        tuple("abcd"), ("chair",) * 4, place, np.full(4, np.nan), np.tile([0.4, 0.9, 0.5], (4, 1))
    )
    root = rng.normal(0, 0.4, (3, 2, 2))
    covariance = np.zeros((3, 3, 3))
    covariance[:, :2, :2] = root @ root.transpose(0, 2, 1)
    at = place[:3] + rng.normal(0, 0.3, (3, 2))
    nothing = np.full(3, np.nan)
    known = Uncertainty(covariance, np.ones(3), nothing, nothing)
    seen = Detections(("chair",) * 3, at, nothing, layout.size[:3], uncertainty=known)
    options = LikelihoodOptions(
        noise=(Motion(1.0, motion, 0.3),),
        rates=(Rates(1.0, 0.0, 0.0),),
        gone_rate=0.1,
        detection=DetectionNoise(usual, 0.02),
        walls=False,
    )
    away = Camera(np.array([90.0, 90.0]), np.array(0.0), FieldOfView(0.3, 0.3, 2.0))
    found = LikelihoodReid(Scene("chairs", None, layout), options).identify(Snapshot(away, seen))
    density = np.empty((3, 4))
    for i in range(3):
        square, along = np.linalg.eigh(covariance[i, :2, :2])
        noise = along @ np.diag(np.maximum(square, usual**2)) @ along.T
        for j in range(4):
            density[i, j] = multivariate_normal.pdf(at[i], place[j], motion**2 * np.eye(2) + noise)
    expected, _, _ = association_marginals(density * 0.9, np.full(3, 1e-300))
    np.testing.assert_allclose(found.probability, expected, atol=1e-6)


def test_the_adaptive_methods_densities_widen_as_a_gaussian_error_widens_them():
    rng = np.random.default_rng(6)
    scene, snapshot = world(rng)
    reid = AdaptiveReid(scene)
    known = Surroundings.of(scene.layout, {})
    codes = np.zeros(len(snapshot.detections), dtype=np.int64)
    problem = problem_of(known, snapshot.detections, codes, None, reid.options)
    pairs, spacing, length = problem.pairs, known.spacing, 0.7
    density = np.empty(len(pairs.label))
    shift_with_errors(Profile.GAUSSIAN, length, 0.0, pairs, density)
    of = np.repeat(np.arange(len(codes)), np.diff(pairs.start))
    for p in range(0, len(density), 5):
        i, shift = of[p], np.array([pairs.shift_x[p], pairs.shift_z[p]])
        noise = snapshot.detections.uncertainty.covariance[i] / spacing**2
        expected = multivariate_normal.pdf(shift, np.zeros(2), length**2 * np.eye(2) + noise[:2, :2])
        assert density[p] == pytest.approx(expected, rel=1e-9)
        kappa = 30.0
        sharp = kappa / (1 + kappa * snapshot.detections.uncertainty.covariance[i, 2, 2])
        turn = snapshot.detections.yaw[i] - scene.layout.yaw[problem.labels[pairs.label[p]]]
        expected = 0.6 * vonmises.pdf(turn, sharp) + 0.4 * vonmises.pdf(turn + np.pi, sharp)
        assert turn_with_errors(kappa, 1, pairs, p) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("method", ["likelihood", "adaptive"])
def test_it_means_the_same_however_a_stranger_writes_the_world(method):
    scene, snapshot = world(np.random.default_rng(7))
    layout, seen = scene.layout, snapshot.detections
    turn, scale, far = 0.8, 40.0, np.array([300.0, -80.0])
    cosine, sine = np.cos(turn), np.sin(turn)
    way = scale * np.array([[cosine, -sine], [sine, cosine]])  # of rows
    errors = seen.uncertainty.turned(turn)
    unit = np.array([scale, scale, 1.0])
    moved = replace(errors, covariance=errors.covariance * np.outer(unit, unit))
    elsewhere = replace(
        layout, position=layout.position @ way + far, yaw=layout.yaw + turn, size=scale * layout.size
    )
    eye = replace(
        EYE, position=EYE.position @ way + far, yaw=np.array(turn), fov=FieldOfView(1, 1, 12 * scale)
    )
    detections = replace(
        seen,
        position=seen.position @ way + far,
        yaw=seen.yaw + turn,
        size=scale * seen.size,
        uncertainty=moved,
    )
    first = identify(scene, snapshot, method, checks=False)
    other = identify(Scene("there", None, elsewhere), Snapshot(eye, detections), method, checks=False)
    same(first, other)


def test_knowing_ones_errors_helps():
    """Over worlds with flips and errors of all shapes: more are right, and confidence is nearer the truth."""
    counts = {name: [] for name in ("told", "untold")}
    for seed in range(40):
        scene, snapshot = world(np.random.default_rng(100 + seed))
        for name, one in (("told", snapshot), ("untold", blind(snapshot))):
            for reid in (LikelihoodReid(scene), AdaptiveReid(scene)):
                answer = reid.identify(one)
                right = np.array(answer.labels) == np.array(scene.layout.labels)
                counts[name] += np.column_stack([right, answer.confidence]).tolist()
    told, untold = (np.array(counts[name]) for name in ("told", "untold"))
    assert told[:, 0].mean() > untold[:, 0].mean() + 0.02
    brier = [((one[:, 0] - one[:, 1]) ** 2).mean() for one in (told, untold)]
    assert brier[0] < brier[1] - 0.02
