"""T1 to T6: what is proven of the paper's method, as properties of random scenes.

D(q, p) = w_t |q - p| / l + w_r |sin(yaw difference / 2)| throughout, and sizes agree.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from farm_ar.arrays import FloatArray
from farm_ar.reid import NearestReid, SpatialOptions, SpatialReid, association_marginals, solve_assignment
from farm_ar.reid.assignment import margins
from farm_ar.reid.certificates import Choices, PoseMetric, certified_radius
from farm_ar.scenes import Camera, Detections, Layout, Scene, Snapshot, Weights

SEEDS = st.integers(0, 2**32 - 1)
few = settings(max_examples=40 * settings().max_examples // 50, deadline=None)


@dataclass
class World:
    """Labels at p, of which the first n are detected at q; D between all of them."""

    position: FloatArray
    yaw: FloatArray
    n: int
    weights: tuple[float, float]
    diagonal: float = 7.0

    def distance(self, position: FloatArray, yaw: FloatArray) -> FloatArray:
        """D from each label to poses: (N, M)."""
        return PoseMetric(self.diagonal, *self.weights).between((position, yaw), (self.position, self.yaw))


def world(rng: np.random.Generator, n: int, m: int) -> World:
    weights = (float(rng.uniform(0.3, 4)), float(rng.uniform(0, 2)))
    return World(rng.uniform(0, 5, (m, 2)), rng.uniform(-np.pi, np.pi, m), n, weights)


def step(rng: np.random.Generator, w: World, i: int, reach: float) -> tuple[FloatArray, float]:
    """A pose whose D from that of label i is at most `reach`."""
    share = rng.uniform()
    away = reach * share * w.diagonal / w.weights[0]
    angle = rng.uniform(-np.pi, np.pi)
    sine = min(1.0, reach * (1 - share) / w.weights[1]) if w.weights[1] > 0 else 1.0
    turn = 2 * np.arcsin(sine) * rng.choice([-1, 1])
    shift = rng.uniform(0.5, 1) * away * np.array([np.sin(angle), np.cos(angle)])
    return w.position[i] + shift, float(w.yaw[i] + rng.uniform(0.5, 1) * turn)


def moved(rng: np.random.Generator, w: World, reach: FloatArray) -> tuple[FloatArray, FloatArray]:
    poses = [step(rng, w, i, reach[i]) for i in range(w.n)]
    return np.array([p for p, _ in poses]).reshape(-1, 2), np.array([y for _, y in poses])


def total(cost: FloatArray, column: FloatArray) -> float:
    return float(cost[np.arange(len(cost)), column].sum())


@few
@given(seed=SEEDS, n=st.integers(1, 6), extra=st.integers(0, 5))
def test_t1_what_moved_less_than_half_way_to_any_other_label_is_identified(seed, n, extra):
    rng = np.random.default_rng(seed)
    w = world(rng, n, n + extra)
    apart = w.distance(w.position, w.yaw) + np.diag(np.full(n + extra, np.inf))
    position, yaw = moved(rng, w, 0.499 * apart.min(axis=1) if n + extra > 1 else np.full(1, 1.0))
    cost = w.distance(position, yaw)
    # In any candidate set that holds the true labels.
    offered = np.sort(
        np.append(np.arange(n), rng.permutation(np.arange(n, n + extra))[: rng.integers(extra + 1)])
    )
    part = cost[:, offered]
    column = solve_assignment(part)
    assert column.tolist() == list(range(n))
    assert (margins(part, column) > 0).all()  # and it is the only optimum


@few
@given(seed=SEEDS, n=st.integers(1, 5), extra=st.integers(0, 5))
def test_t2_one_mover_is_identified_just_if_no_undetected_label_is_nearer(seed, n, extra):
    rng = np.random.default_rng(seed)
    w = world(rng, n, n + extra)
    position, yaw = w.position[:n].copy(), w.yaw[:n].copy()
    position[0], yaw[0] = rng.uniform(0, 5, 2), rng.uniform(-np.pi, np.pi)
    cost = w.distance(position, yaw)
    optimal = total(cost, np.arange(n)) <= total(cost, solve_assignment(cost)) + 1e-12
    nearer = cost[0, n:].min(initial=np.inf)
    assume(abs(cost[0, 0] - nearer) > 1e-9)
    assert optimal == (cost[0, 0] <= nearer)


def alternatives(n: int, m: int) -> list[tuple[int, ...]]:
    return [a for a in itertools.permutations(range(m), n) if a != tuple(range(n))]


def cycles_and_paths(assignment: tuple[int, ...]) -> list[list[int]]:
    """The rows of each alternating cycle or path along which an assignment differs from the identity."""
    n, left = len(assignment), {i for i, j in enumerate(assignment) if i != j}
    starts = [i for i in left if i not in assignment] + sorted(left)  # a path from its beginning
    found = []
    for start in starts:
        piece, i = [], start
        while i < n and i in left:
            left.remove(i)
            piece.append(i)
            i = assignment[i]
        if piece:
            found.append(piece)
    return found


@few
@given(seed=SEEDS, n=st.integers(2, 4), extra=st.integers(0, 2))
def test_t3_the_identity_is_optimal_if_every_cycle_is_longer_than_what_moved_along_it(seed, n, extra):
    rng = np.random.default_rng(seed)
    w = world(rng, n, n + extra)
    apart = w.distance(w.position, w.yaw)
    near = (apart + np.diag(np.full(n + extra, np.inf))).min(axis=1)
    position, yaw = moved(rng, w, rng.uniform(0, 1, n) * near[:n])
    cost = w.distance(position, yaw)
    own = np.diag(cost)
    holds = all(
        2 * own[piece].sum() < sum(apart[i, a[i]] for i in piece)
        for a in alternatives(n, n + extra)
        for piece in cycles_and_paths(a)
    )
    assume(holds)
    best_other = min(total(cost, np.array(a)) for a in alternatives(n, n + extra))
    assert total(cost, np.arange(n)) < best_other


def test_t3_is_put_to_the_test_where_t1_does_not_hold():
    # Label 0 moved .6 of the way to label 1, which did not move: T1 is silent, T3 is not.
    w = World(np.array([[0.0, 0.0], [1.0, 0.0]]), np.zeros(2), 2, (7.0, 0.0))
    cost = w.distance(np.array([[0.6, 0.0], [1.0, 0.0]]), np.zeros(2))
    assert cost[0, 0] > 0.5 * w.distance(w.position, w.yaw)[0, 1]
    assert 2 * (cost[0, 0] + cost[1, 1]) < 2 * w.distance(w.position, w.yaw)[0, 1]
    assert solve_assignment(cost).tolist() == [0, 1]


@few
@given(seed=SEEDS, n=st.integers(1, 5), extra=st.integers(0, 4))
def test_t5_a_label_is_that_of_an_additively_weighted_voronoi_cell(seed, n, extra):
    rng = np.random.default_rng(seed)
    w = world(rng, n, n + extra)
    cost = w.distance(rng.uniform(0, 5, (n, 2)), rng.uniform(-np.pi, np.pi, n))
    rest = [np.delete(np.delete(cost, 0, axis=0), j, axis=1) for j in range(n + extra)]
    weight = np.array([total(part, solve_assignment(part)) if n > 1 else 0.0 for part in rest])
    order = np.sort(cost[0] + weight)
    assume(len(order) == 1 or order[1] - order[0] > 1e-9)
    assert solve_assignment(cost)[0] == np.argmin(cost[0] + weight)


@few
@given(seed=SEEDS, n=st.integers(1, 5), extra=st.integers(0, 4))
def test_t5_no_displacement_of_less_than_half_the_margin_changes_a_label(seed, n, extra):
    rng = np.random.default_rng(seed)
    w = world(rng, n, n + extra)
    assume(n + extra > 1)
    position, yaw = rng.uniform(0, 5, (n, 2)), rng.uniform(-np.pi, np.pi, n)
    cost = w.distance(position, yaw)
    column = solve_assignment(cost)
    margin = margins(cost, column)[0]
    here = World(position, yaw, n, w.weights)
    position, yaw = position.copy(), yaw.copy()
    position[0], yaw[0] = step(rng, here, 0, 0.499 * margin)
    assert solve_assignment(w.distance(position, yaw))[0] == column[0]


def permanent(a: FloatArray) -> float:
    n, m = a.shape
    return sum(float(np.prod(a[np.arange(n), list(c)])) for c in itertools.permutations(range(m), n))


@few
@example(seed=163, n=3, extra=0, beta=20.0)
@given(seed=SEEDS, n=st.integers(1, 4), extra=st.integers(0, 3), beta=st.sampled_from([0.5, 3.0, 20.0]))
def test_t6_marginals_are_ratios_of_permanents(seed, n, extra, beta):
    rng = np.random.default_rng(seed)
    a = np.exp(-beta * rng.uniform(0, 2, (n, n + extra)))
    whole = permanent(a)
    probability, log_evidence, exact = association_marginals(a, np.zeros(n))
    for i, j in itertools.product(range(n), range(n + extra)):
        without = np.delete(np.delete(a, i, axis=0), j, axis=1)
        assert probability[i, j] == pytest.approx(a[i, j] * permanent(without) / whole, abs=1e-9)
    assert exact
    assert log_evidence == pytest.approx(np.log(whole))


def scene_of(w: World, rng: np.random.Generator, sizes: int = 1) -> Scene:
    m = len(w.yaw)
    kind = rng.integers(sizes, size=m)
    layout = Layout(
        labels=tuple(f"label {j}" for j in range(m)),
        category=tuple(f"kind {k}" for k in kind),
        position=w.position,
        yaw=w.yaw,
        size=np.array([[0.4, 0.9, 0.5]]) * (1 + 0.3 * kind[:, None]),
    )
    return Scene("random", (5.0, 5.0), layout, weights=Weights(*w.weights))


@few
@given(
    seed=SEEDS,
    n=st.integers(1, 5),
    extra=st.integers(0, 4),
    reach=st.floats(0, 0.6),
    gate=st.booleans(),
    nearest=st.booleans(),
)
def test_a_certificate_holds_whenever_everything_moved_less_than_it_says(
    seed, n, extra, reach, gate, nearest
):
    rng = np.random.default_rng(seed)
    w = world(rng, n, n + extra)
    if nearest:
        w.weights = (1.0, 0.0)
    scene = scene_of(w, rng, sizes=2)
    w.diagonal = scene.diagonal
    apart = (w.distance(w.position, w.yaw) + np.diag(np.full(n + extra, np.inf))).min(axis=1)
    position, yaw = moved(rng, w, reach * np.minimum(apart, 1.0))
    size = scene.layout.size[:n] * rng.choice([1.0, 1.1])  # measured wrongly, or not
    seen = Detections(scene.layout.category[:n], position, yaw, size)
    reid = NearestReid(scene) if nearest else SpatialReid(scene, SpatialOptions(gate_categories=gate))
    found = reid.identify(Snapshot(Camera(np.zeros(2), np.array(0.0)), seen))
    truly = np.diag(w.distance(position, yaw))
    if found.certified is not None and truly.max() < found.certified.radius:
        assert found.labels == scene.layout.labels[:n]
        assert found.certified.detections == tuple(range(n))


def test_a_certificate_says_how_far_in_metres_and_degrees():
    # Two labels 2 m apart, w_t / l = .5 and w_r = 1: half of D = 1 is 1 m, or a turn of 60 degrees.
    layout = Layout(
        ("a", "b"), ("chair",) * 2, np.array([[0.0, 0.0], [2.0, 0.0]]), np.zeros(2), np.ones((2, 3))
    )
    scene = Scene("two", (3.0, 4.0), layout, weights=Weights(2.5, 1.0))
    seen = Detections(("chair",), layout.position[:1], layout.yaw[:1], layout.size[:1])
    certified = SpatialReid(scene).identify(Snapshot(Camera(np.zeros(2), np.array(0.0)), seen)).certified
    assert certified is not None
    assert certified.radius == pytest.approx(0.5)
    assert certified.metres == pytest.approx(1.0)
    assert certified.degrees == pytest.approx(60.0)
    only_places = NearestReid(scene).identify(Snapshot(Camera(np.zeros(2), np.array(0.0)), seen)).certified
    assert only_places is not None
    assert (only_places.metres, only_places.degrees) == (pytest.approx(1.0), 180.0)


def test_nothing_is_certified_where_labels_stand_in_one_spot_or_none_is_given():
    layout = Layout(("a", "b"), ("chair",) * 2, np.zeros((2, 2)), np.zeros(2), np.ones((2, 3)))
    scene = Scene("one spot", (3.0, 4.0), layout)
    camera = Camera(np.zeros(2), np.array(0.0))
    for number in (1, 3):  # three detections leave one without a label
        seen = Detections(("chair",) * number, np.zeros((number, 2)), np.zeros(number), np.ones((number, 3)))
        assert SpatialReid(scene).identify(Snapshot(camera, seen)).certified is None


def test_a_label_that_was_not_offered_limits_what_is_certified():
    every = np.ones((1, 2), dtype=bool)
    moved_by, apart = np.array([[0.0, 0.3]]), np.array([[0.0, 5.0], [5.0, 0.0]])
    only_first = np.array([True, False])
    ones = np.ones((1, 2))
    assert certified_radius(moved_by, apart, Choices(ones, every, only_first)) == pytest.approx(0.3)
    assert certified_radius(moved_by, apart, Choices(ones, every, np.ones(2, bool))) == pytest.approx(2.5)
    assert certified_radius(ones[:0], apart, Choices(ones[:0], every[:0], only_first)) == 0.0
