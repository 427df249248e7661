import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.reid.fusion import association
from farm_ar.reid.fusion.association import Noise, Seen, associate, gain, join, mean_yaw

SEEDS = st.integers(0, 2**32 - 1)
Detected = tuple[IntArray, IntArray, FloatArray, FloatArray, FloatArray]


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
    return (snapshot, truth % 2, position, yaw, np.zeros((len(truth), 3))), truth


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
        (snapshot, kind, position, yaw, sides), truth = detected(rng, objects=5, snapshots=60)
        drift = rng.normal(0, 0.04, (3, 2))[snapshot // 20]
        seen = Seen(snapshot, kind, position + drift, yaw, sides)
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
    found = associate(Seen(snapshot, np.zeros(4, np.int64), same_place, np.zeros(4), np.zeros((4, 3))), 4.0)
    assert sorted(found.object_of.tolist()) == [0, 0, 1, 1]


def test_different_categories_are_different_objects_and_an_unknown_one_may_be_either() -> None:
    place, zero, sides = np.zeros((2, 2)), np.zeros(2), np.zeros((2, 3))
    snapshot = np.array([0, 1])
    assert associate(Seen(snapshot, np.array([0, 1]), place, zero, sides), 4.0).object_of.tolist() == [0, 1]
    assert associate(Seen(snapshot, np.array([-1, 1]), place, zero, sides), 4.0).object_of.tolist() == [0, 0]


def test_a_gain_is_the_ratio_of_integrals_over_where_the_object_may_be() -> None:
    sd, yaw_sd, area = 0.1, 0.2, 6.0
    place = np.array([[0.0, 0.0], [0.12, 0.0]])
    turn, zeros = np.array([0.1, -0.1]), np.zeros((2, 3))
    noise = Noise(sd, yaw_sd, 1.0, area)
    number = np.ones(2, dtype=np.int64)
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
        assert_allclose(function(number, place, turn, zeros, 1, 0, noise), expected, rtol=1e-6)


def test_joining_adds_up_to_the_ratio_for_all_detections_of_an_object() -> None:
    rng = np.random.default_rng(0)
    n, sd, area = 5, 0.1, 6.0
    x, yaw = rng.normal(0, sd, (n, 2)), np.full(n, 3.1)
    yaw[2:] -= 2 * math.pi
    object_of = np.arange(n)
    given = (
        Seen(np.arange(n), np.zeros(n, np.int64), x, yaw, np.zeros((n, 3))),
        Noise(sd, 0.2, 0.1, area),
    )
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
    given = Seen(*rows), Noise(0.1, 0.2, 0.1, 6.0)
    total = join(*given, compiled)
    request.getfixturevalue("plain")
    assert_allclose(association.join(*given, in_python), total)
    assert compiled.tolist() == in_python.tolist()


def test_the_mean_of_headings_on_either_side_of_straight_back_is_straight_back() -> None:
    assert_allclose(abs(mean_yaw(np.array([math.pi - 0.1, -math.pi + 0.1]))), math.pi)


def test_nothing_detected_is_no_object() -> None:
    none = np.zeros(0, dtype=np.int64)
    found = associate(Seen(none, none, np.zeros((0, 2)), np.zeros(0), np.zeros((0, 3))), 4.0)
    assert len(found.object_of) == 0
