import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.stats import multivariate_normal

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.reid.fusion import joining
from farm_ar.reid.fusion.association import associate, mean_place, mean_yaw
from farm_ar.reid.fusion.joining import Noise, Objects, Precision, Seen, gain, join, precision_of

SEEDS = st.integers(0, 2**32 - 1)
Detected = tuple[IntArray, IntArray, FloatArray, FloatArray, FloatArray, FloatArray]


def detected(
    rng: np.random.Generator, objects: int = 6, snapshots: int = 4, position_sd: float = 0.02
) -> tuple[Detected, IntArray]:
    """Detections of objects half a metre apart and more, shuffled; and the object of each."""
    grid = np.stack(np.meshgrid(np.arange(4), np.arange(4)), axis=-1).reshape(-1, 2)
    place = 0.6 * rng.permutation(grid)[:objects] + rng.uniform(-0.05, 0.05, (objects, 2))
    seen = rng.random((snapshots, objects)) < 0.7
    snapshot, truth = np.nonzero(seen)
    order = rng.permutation(len(truth))
    snapshot, truth = snapshot[order], truth[order]
    position = place[truth] + rng.normal(0, position_sd, (len(truth), 2))
    yaw = rng.uniform(-3, 3, objects)[truth] + rng.normal(0, 0.05, len(truth))
    n = len(truth)
    return (snapshot, truth % 2, position, yaw, np.zeros((n, 3)), np.zeros((n, 3, 3))), truth


def exact(n: int) -> Precision:
    """That of n detections that say nothing of their errors."""
    return precision_of(np.zeros((n, 3, 3)), 1.0, 1.0)


def apart_of(seen: Seen) -> BoolArray:
    """Which detections are of one snapshot, or of different categories."""
    return np.asarray((seen.snapshot[:, None] == seen.snapshot) | (seen.category[:, None] != seen.category))


def same(first: IntArray, second: IntArray) -> bool:
    """Whether two groupings put the same detections together."""
    return bool(((first[:, None] == first) == (second[:, None] == second)).all())


@settings(deadline=None, max_examples=20 * settings().max_examples // 50)
@given(SEEDS, st.sampled_from([0.0, 0.001]))
def test_objects_far_apart_are_told_apart(seed: int, sd: float) -> None:
    rows, truth = detected(np.random.default_rng(seed), position_sd=sd)
    assert same(associate(Seen(*rows), area=6.0).object_of, truth)


@pytest.mark.parametrize(("sd", "least"), [(0.02, 0.99), (0.05, 0.95)])
def test_objects_far_apart_are_nearly_always_told_apart_under_noise(sd: float, least: float) -> None:
    right = 0
    for seed in range(200):  # now and then a detection lies far enough off to look like one more object
        rows, truth = detected(np.random.default_rng(seed), position_sd=sd)
        right += same(associate(Seen(*rows), area=6.0).object_of, truth)
    assert right >= least * 200


@pytest.mark.parametrize("sd", [0.03, 0.045])
def test_a_long_walk_past_the_same_objects_finds_no_others(sd: float) -> None:
    """With 60 snapshots a noise between two steps of the grid, taken for the smaller, would split objects."""
    for seed in range(3):
        rows, truth = detected(np.random.default_rng(seed), objects=5, snapshots=60, position_sd=sd)
        assert same(associate(Seen(*rows), area=6.0).object_of, truth)


def test_a_pose_that_drifts_from_pass_to_pass_does_not_split_objects() -> None:
    """Errors of 4 cm shared by all that 20 snapshots show, twice the noise of a detection."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        rows, truth = detected(rng, objects=5, snapshots=60)
        seen = Seen(*rows)
        drift = rng.normal(0, 0.04, (3, 2))[seen.snapshot // 20]
        seen = seen._replace(position=seen.position + drift)
        assert same(associate(seen, area=6.0).object_of, truth)


@settings(deadline=None, max_examples=10 * settings().max_examples // 50)
@given(SEEDS)
def test_the_order_of_the_snapshots_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    (snapshot, *rows), _ = detected(rng, position_sd=0.2)
    renamed = rng.permutation(10)[snapshot]
    order = np.argsort(renamed, kind="stable")
    first = associate(Seen(snapshot, *rows), area=6.0)
    second = associate(Seen(renamed[order], *[row[order] for row in rows]), area=6.0)
    assert same(first.object_of[order], second.object_of)
    assert_allclose(first.log_evidence, second.log_evidence)


def test_objects_are_numbered_in_the_order_of_their_first_detections() -> None:
    rows, _ = detected(np.random.default_rng(1))
    found = associate(Seen(*rows), area=6.0).object_of
    _, first = np.unique(found, return_index=True)
    assert found[0] == 0
    assert (np.diff(first) > 0).all()


def test_two_detections_of_one_snapshot_are_two_objects_even_in_one_spot() -> None:
    snapshot, same_place = np.array([0, 0, 1, 1]), np.ones((4, 2))
    seen = Seen(
        snapshot, np.zeros(4, np.int64), same_place, np.zeros(4), np.zeros((4, 3)), np.zeros((4, 3, 3))
    )
    found = associate(seen, 4.0)
    assert sorted(found.object_of.tolist()) == [0, 0, 1, 1]


def test_different_categories_are_different_objects_and_an_unknown_one_may_be_either() -> None:
    rest = np.zeros((2, 2)), np.zeros(2), np.zeros((2, 3)), np.zeros((2, 3, 3))
    snapshot = np.array([0, 1])
    assert associate(Seen(snapshot, np.array([0, 1]), *rest), 4.0).object_of.tolist() == [0, 1]
    assert associate(Seen(snapshot, np.array([-1, 1]), *rest), 4.0).object_of.tolist() == [0, 0]


def test_a_gain_is_the_ratio_of_integrals_over_where_the_object_may_be() -> None:
    sd, yaw_sd, area = 0.1, 0.2, 6.0
    place = np.array([[0.0, 0.0], [0.12, 0.0]])
    turn, zeros = np.array([0.1, -0.1]), np.zeros((2, 3))
    noise = Noise(sd, yaw_sd, 1.0, area)
    objects = Objects(np.ones(2), exact(2), place, turn, zeros)
    # One axis at a time, by summing over a fine grid of where the object may be.
    grid = np.linspace(-3, 3, 60001)

    def integral(values: list[float], spread: float) -> float:
        density = np.ones_like(grid)
        for value in values:
            density *= np.exp(-0.5 * ((grid - value) / spread) ** 2) / (spread * math.sqrt(2 * math.pi))
        return float(density.sum() * (grid[1] - grid[0]))

    expected = math.log(area * 2 * math.pi)
    expected += math.log(integral([0.0, 0.12], sd) * integral([0.0, 0.0], sd) * integral([0.1, -0.1], yaw_sd))
    for function in (gain, gain.py_func):
        assert_allclose(function(objects, 1, 0, noise), expected, rtol=1e-6)


def test_joining_adds_up_to_the_ratio_for_all_detections_of_an_object() -> None:
    rng = np.random.default_rng(0)
    n, sd, area = 5, 0.1, 6.0
    x, yaw = rng.normal(0, sd, (n, 2)), np.full(n, 3.1)
    yaw[2:] -= 2 * math.pi
    object_of = np.arange(n)
    seen = Seen(np.arange(n), np.zeros(n, np.int64), x, yaw, np.zeros((n, 3)), np.zeros((n, 3, 3)))
    given = seen, apart_of(seen), Noise(sd, 0.2, 0.1, area)
    total = join(*given, object_of)
    squares = ((x - x.mean(axis=0)) ** 2).sum() / sd**2
    log = math.log
    place = (n - 1) * log(area) - (n - 1) * log(2 * math.pi * sd**2) - log(n) - squares / 2
    turn = (n - 1) * log(2 * math.pi) - (n - 1) / 2 * log(2 * math.pi * 0.2**2) - log(n) / 2
    assert object_of.tolist() == [0] * n
    # And n! ways in which as many objects might have been seen once each.
    assert_allclose(total, place + turn + math.log(math.factorial(n)))


def test_compiled_and_plain_joining_agree(request: pytest.FixtureRequest) -> None:
    rows, _ = detected(np.random.default_rng(3), objects=4, snapshots=3, position_sd=0.2)
    compiled, in_python = np.arange(len(rows[0])), np.arange(len(rows[0]))
    seen = Seen(*rows)
    given = seen, apart_of(seen), Noise(0.1, 0.2, 0.1, 6.0)
    total = join(*given, compiled)
    request.getfixturevalue("plain")
    assert_allclose(joining.join(*given, in_python), total)
    assert compiled.tolist() == in_python.tolist()


def test_the_mean_of_headings_on_either_side_of_straight_back_is_straight_back() -> None:
    assert_allclose(abs(mean_yaw(np.array([math.pi - 0.1, -math.pi + 0.1]), np.ones(2))), math.pi)


def test_nothing_detected_is_no_object() -> None:
    none = np.zeros(0, dtype=np.int64)
    rest = np.zeros((0, 2)), np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3, 3))
    assert len(associate(Seen(none, none, *rest), 4.0).object_of) == 0


def covariances(rng: np.random.Generator, n: int, scale: float = 0.05) -> FloatArray:
    """(n, 3, 3) of very different sizes and shapes, no heading's error going along with a place's."""
    root = rng.normal(0, scale, (n, 2, 2)) * 10.0 ** rng.uniform(-1, 1, (n, 1, 1))
    found = np.zeros((n, 3, 3))
    found[:, :2, :2] = root @ np.swapaxes(root, 1, 2)
    found[:, 2, 2] = rng.uniform(0, 0.1, n)
    return found


@settings(deadline=None)
@given(SEEDS)
def test_a_gain_counts_the_covariance_of_each_detection(seed: int) -> None:
    """The difference of two detections is normal, with the sum of both covariances and twice the noise's."""
    rng = np.random.default_rng(seed)
    covariance, place, turn = covariances(rng, 2), rng.normal(0, 0.1, (2, 2)), rng.normal(0, 0.2, 2)
    noise = Noise(0.02, 0.1, 0.1, 6.0)
    objects = Objects(np.ones(2), precision_of(covariance, 0.02, 0.1), place, turn, np.zeros((2, 3)))
    total = covariance.sum(axis=0) + 2 * np.diag([0.02**2, 0.02**2, 0.1**2])
    apart = np.append(place[0] - place[1], turn[0] - turn[1])
    expected = math.log(6.0 * 2 * math.pi) + multivariate_normal.logpdf(apart, cov=total)
    assert_allclose(gain(objects, 1, 0, noise), expected, rtol=1e-9, atol=1e-9)


@settings(deadline=None)
@given(SEEDS)
def test_joined_in_any_order_detections_count_as_exactly_as_they_say(seed: int) -> None:
    """The gains add up to the ratio of evidences of one object and of n, by generalised least squares."""
    rng = np.random.default_rng(seed)
    n, covariance = 4, covariances(rng, 4, 0.01)
    place, turn = rng.normal(0, 0.01, (n, 2)), rng.normal(0, 0.01, n)
    seen = Seen(np.arange(n), np.zeros(n, np.int64), place, turn, np.zeros((n, 3)), covariance)
    object_of = np.arange(n)
    total = join(seen, apart_of(seen), Noise(0.02, 0.1, 0.1, 6.0), object_of)
    each = covariance + np.diag([0.02**2, 0.02**2, 0.1**2])
    pose = np.column_stack([place, turn])
    mean = np.linalg.solve(np.linalg.inv(each).sum(axis=0), np.einsum("nij,nj->i", np.linalg.inv(each), pose))
    one = sum(multivariate_normal.logpdf(pose[i], mean, each[i]) for i in range(n))
    one += 0.5 * np.linalg.slogdet(2 * np.pi * np.linalg.inv(np.linalg.inv(each).sum(axis=0)))[1]
    expected = one + (n - 1) * math.log(6.0 * 2 * math.pi) + math.log(math.factorial(n))
    assert object_of.tolist() == [0] * n
    assert_allclose(total, expected, rtol=1e-9)


@settings(deadline=None)
@given(SEEDS)
def test_the_mean_of_places_is_that_of_generalised_least_squares(seed: int) -> None:
    rng = np.random.default_rng(seed)
    covariance, place = covariances(rng, 5), rng.normal(0, 1, (5, 2))
    precision = precision_of(covariance, 0.02, 0.1)
    weights = np.linalg.inv(covariance[:, :2, :2] + 0.02**2 * np.eye(2))
    expected = np.linalg.solve(weights.sum(axis=0), np.einsum("nij,nj->i", weights, place))
    assert_allclose(mean_place(place, precision.place), expected, rtol=1e-7, atol=1e-9)
    assert mean_place(place, exact(5).place).tobytes() == place.mean(axis=0).tobytes()


def near_and_far(rng: np.random.Generator, drift_m: float) -> tuple[Seen, IntArray]:
    """Walks past six objects, now near, with errors of a millimetre, now far, with errors of 5 cm.

    What the headset has wrong of its own place is the same in 20 snapshots.
    """
    rows, truth = detected(rng, snapshots=60, position_sd=0.0)
    seen = Seen(*rows)
    sd = np.where(rng.random(len(truth)) < 0.3, 0.05, 0.001)
    drift = rng.normal(0, drift_m, (3, 2))[seen.snapshot // 20]
    position = seen.position + sd[:, None] * rng.normal(0, 1, (len(truth), 2)) + drift
    covariance = sd[:, None, None] ** 2 * np.diag([1.0, 1.0, 0.0])
    return seen._replace(position=position, covariance=covariance), truth


@pytest.mark.parametrize("drift_m", [0.0, 0.03])
def test_objects_seen_exactly_and_vaguely_are_not_split_where_detections_say_how_exact_they_are(
    drift_m: float,
) -> None:
    split = 0
    for seed in range(4):
        seen, truth = near_and_far(np.random.default_rng(seed), drift_m)
        assert same(associate(seen, area=6.0).object_of, truth)
        split += not same(associate(seen._replace(covariance=0 * seen.covariance), 6.0).object_of, truth)
    assert split > 0


def test_what_is_shared_by_many_snapshots_counts_in_the_noise_of_the_objects() -> None:
    found = associate(near_and_far(np.random.default_rng(0), 0.03)[0], area=6.0)
    assert 0.01 < found.position_sd < 0.1
    assert associate(near_and_far(np.random.default_rng(0), 0.0)[0], area=6.0).position_sd < 0.01


@settings(deadline=None, max_examples=20 * settings().max_examples // 50)
@given(SEEDS)
def test_the_two_that_gain_most_are_joined_first(seed: int) -> None:
    """As by looking at all pairs anew after each merger, all means from scratch."""
    rng = np.random.default_rng(seed)
    rows, _ = detected(rng, objects=4, snapshots=4, position_sd=0.2)
    seen = Seen(*rows)._replace(covariance=covariances(rng, len(rows[0]), 0.1))
    noise, apart, n = Noise(0.1, 0.2, 0.1, 6.0), apart_of(seen), len(seen.yaw)
    object_of, expected = np.arange(n), np.arange(n)
    total = join(seen, apart, noise, object_of)
    precision, sum_of_gains = precision_of(seen.covariance, 0.1, 0.2), 0.0
    while True:
        groups = [np.flatnonzero(expected == k) for k in range(n)]
        best, pair = 0.0, (-1, -1)
        for a in range(n):
            for b in range(a):
                one, other = groups[a], groups[b]
                if not len(one) or not len(other) or apart[np.ix_(one, other)].any():
                    continue
                objects = Objects(
                    np.array([len(one), len(other)], dtype=float),
                    Precision(
                        np.array([precision.place[group].sum(axis=0) for group in (one, other)]),
                        np.array([precision.turn[group].sum() for group in (one, other)]),
                    ),
                    np.array([mean_place(seen.position[g], precision.place[g]) for g in (one, other)]),
                    np.array([mean_yaw(seen.yaw[g], precision.turn[g]) for g in (one, other)]),
                    np.zeros((2, 3)),
                )
                gained = gain(objects, 0, 1, noise)
                gained += math.log(math.comb(len(one) + len(other), len(one)))
                if gained > best:
                    best, pair = gained, (a, b)
        if pair[0] < 0:
            break
        sum_of_gains += best
        expected[groups[pair[0]]] = pair[1]
    assert object_of.tolist() == expected.tolist()
    assert_allclose(total, sum_of_gains, rtol=1e-9, atol=1e-9)
