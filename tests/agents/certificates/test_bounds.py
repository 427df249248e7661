"""The law of the certificates: nothing that costs less makes any label wrong."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.agents.attacks import Analytic, QueryOracle, wrong_labels
from farm_ar.agents.cases import Case, draw_case
from farm_ar.agents.certificates import NO_BOUND, lower_bound, single
from farm_ar.agents.certificates.single import Mover, single_mover, turn_gain
from farm_ar.agents.distance import distances
from farm_ar.reid import (
    REIDENTIFIERS,
    DistanceReid,
    LastKnownReid,
    NearestReid,
    Reidentifier,
    SpatialOptions,
    SpatialReid,
)
from farm_ar.scenes import Camera, FieldOfView, Layout, Scene, Site, Weights, builtin_scene

EVERYTHING = Camera(np.array([0.5, -1.0]), np.array(0.0), FieldOfView(1.0, 1.0, 9.0))
RULES = {
    "gated": SpatialReid,
    "ungated": lambda scene: SpatialReid(scene, SpatialOptions(gate_categories=False)),
    "distance": DistanceReid,
    "distance, ungated": lambda scene: DistanceReid(scene, gate_categories=False),
    "rotation only": lambda scene: SpatialReid(scene, SpatialOptions(terms=("rotation",))),
    "nearest": NearestReid,
    "nearest, ungated": lambda scene: NearestReid(scene, gate_categories=False),
    "last-known": lambda scene: LastKnownReid(scene, 0.02),
}


def room(position, yaw=None, weights=(1.0, 1.0), size=0.02, camera=EVERYTHING, category=None, fixed=None):
    n = len(position)
    layout = Layout(
        tuple(f"o{i}" for i in range(n)),
        tuple(category or ["c"] * n),
        np.array(position, dtype=float),
        np.zeros(n) if yaw is None else np.array(yaw, dtype=float),
        np.full((n, 3), size),
        fixed=fixed,
    )
    return Case(Scene("room", (1.0, 1.0), layout, weights=Weights(*weights)), camera)


def test_two_alike_cross_clear_of_each_other():
    # On the way they change places: sqrt(T^2 + s^2), with T = .4 and s = .02, by the diagonal.
    case = room([[0.3, 0.5], [0.7, 0.5]])
    found = lower_bound(case, SpatialReid(case.scene))
    assert found.total == pytest.approx(np.sqrt(0.4**2 + 0.02**2) / np.sqrt(2), rel=1e-5)
    assert found.first == pytest.approx(0.2 / np.sqrt(2))
    assert found.by_object == pytest.approx([found.total] * 2)


def test_labels_of_another_size_take_more():
    # C_d of 1.5 in every side is 1.5^3. The two stand in each other, so that they need not keep clear:
    # each cost of the own label is C times that of the other's, and both together go 2 C / (1 + C) of T.
    case = room([[0.3, 0.5], [0.32, 0.5]], size=0.06)
    size = case.layout.size * np.array([[1.0], [1.5]])
    case = Case(replace(case.scene, layout=replace(case.layout, size=size)), case.camera)
    stretch = 1.5**3
    found = lower_bound(case, SpatialReid(case.scene))
    assert found.total == pytest.approx(2 * stretch / (1 + stretch) * 0.02 / np.sqrt(2), rel=1e-5)
    without = SpatialOptions(terms=("translation", "rotation"))
    assert lower_bound(case, SpatialReid(case.scene, without)).total == pytest.approx(
        0.02 / np.sqrt(2), rel=1e-5
    )


def test_one_that_may_be_taken_for_one_out_of_view_goes_half_of_the_way():
    left_half = Camera(np.array([0.3, -1.0]), np.array(0.0), FieldOfView(0.2, 0.2, 9.0))
    case = room([[0.3, 0.5], [0.7, 0.5]], camera=left_half)
    assert case.in_view.tolist() == [True, False]
    found = lower_bound(case, SpatialReid(case.scene))
    assert found.by_object[0] == pytest.approx(0.2 / np.sqrt(2), rel=1e-5)


def test_one_alone_is_never_wrong():
    case = room([[0.3, 0.5]])
    found = lower_bound(case, SpatialReid(case.scene))
    assert found.total == np.inf


def test_fixed_ones_are_not_moved():
    case = room([[0.3, 0.5], [0.7, 0.5]], fixed=np.array([True, True]))
    found = lower_bound(case, NearestReid(case.scene))
    assert found.total == np.inf


def test_where_places_are_close_the_tolerance_is_not_all():
    # Nearer to the other's place than to its own, half of 1 cm away, although 2 cm are tolerated. The two
    # are balls of 2 mm that have to keep clear of one another.
    case = room([[0.3, 0.5], [0.31, 0.5]], size=0.002)
    found = lower_bound(case, LastKnownReid(case.scene, 0.02))
    assert found.total == pytest.approx(0.005 / np.sqrt(2), rel=1e-5)


def test_turning_is_weighed_as_the_rule_does():
    # Only headings count, half as much as a way does in distance: the whole turn of one, or half of each.
    case = room([[0.3, 0.5], [0.7, 0.5]], yaw=[0.0, 1.0], weights=(0.0, 0.5))
    found = lower_bound(case, SpatialReid(case.scene))
    assert found.total == pytest.approx(np.sin(0.5), rel=1e-5)


@pytest.mark.parametrize(
    "options", [SpatialOptions(threshold=0.5), SpatialOptions(box="world"), SpatialOptions(terms=())]
)
def test_what_no_theorem_covers_has_no_certificate(options):
    scene = builtin_scene("farm")
    case = draw_case(scene, 0, 0)
    found = lower_bound(case, SpatialReid(case.scene, options))
    assert (found.theorem, found.total, found.largest) == (NO_BOUND, 0.0, 0.0)


def test_a_users_own_rule_has_no_certificate():
    class Own:
        def identify(self, snapshot):
            raise NotImplementedError

    class Changed(SpatialReid):
        def identify(self, snapshot):
            raise NotImplementedError

    case = draw_case(builtin_scene("farm"), 0, 0)
    assert lower_bound(case, Own()).theorem == NO_BOUND
    assert lower_bound(case, Changed(case.scene)).theorem == NO_BOUND


def test_pruning_of_one_site_only_leaves_all_candidates():
    case = room([[0.3, 0.5], [0.7, 0.5]])
    scene = replace(case.scene, sites=(Site("s", 0.5, 0.5),))
    found = lower_bound(Case(scene, case.camera), SpatialReid(scene, SpatialOptions(threshold=0.0)))
    assert found.total > 0


@st.composite
def cases(draw):
    n = draw(st.integers(2, 6))
    numbers = np.random.default_rng(draw(st.integers(0, 2**31)))
    position = numbers.uniform(0.05, 0.95, (n, 2))
    yaw = numbers.uniform(-1.0, 1.0, n)
    category = [("a", "b")[k] for k in numbers.integers(0, 2, n)]
    weights = draw(st.sampled_from([(1.0, 1.0), (2.5, 1.0), (0.4, 1.0), (1.0, 0.0)]))
    eye = np.array([numbers.uniform(0, 1), numbers.uniform(-0.5, 0.2)])
    half = numbers.uniform(0.2, 0.8)
    camera = Camera(eye, numbers.uniform(-0.6, 0.6), FieldOfView(half, half, numbers.uniform(0.5, 2)))
    case = room(
        position, yaw, weights, size=draw(st.sampled_from([0.02, 0.08])), camera=camera, category=category
    )
    size = case.layout.size * numbers.choice([1.0, 1.3], (n, 1))
    return Case(replace(case.scene, layout=replace(case.layout, size=size)), camera), numbers


@pytest.mark.parametrize("name", RULES)
@given(cases())
def test_nothing_below_the_bound_makes_a_label_wrong(name, drawn):
    case, numbers = drawn
    rule, layout = RULES[name](case.scene), case.layout
    found = lower_bound(case, rule)
    oracle = QueryOracle(case, rule, queries=10_000, budget=5.0)
    n = len(layout)
    # Objects on their way to others' places, as far and as turned as chance has it.
    number = 40 if type(rule).identify_many is Reidentifier.identify_many else 400  # one by one, or at once
    goal = np.stack([numbers.permutation(n) for _ in range(number)])
    share = numbers.uniform(0, 1.2, (number, n)) * (numbers.random((number, n)) < 0.6)
    turn = share * (numbers.random((number, n)) < 0.7)
    aside = numbers.normal(0.0, 0.03, (number, n, 2)) * (share > 0)[..., None]
    position = layout.position + share[..., None] * (layout.position[goal] - layout.position) + aside
    yaw = layout.yaw + turn * (layout.yaw[goal] - layout.yaw)
    wrong = oracle.query(position, yaw)
    each = distances(layout, case.scene.diagonal, position[wrong > 0], yaw[wrong > 0])
    assert np.all(each.sum(axis=1) >= found.total)
    assert np.all(each.max(axis=1, initial=0) >= found.largest * (1 - 1e-9))
    assert found.first <= found.total + 1e-6 or not np.isfinite(found.total)


@pytest.mark.parametrize("name", [name for name in RULES if name not in ("rotation only", "last-known")])
def test_no_attack_that_knows_the_rule_goes_below_the_bound(name):
    for number in range(4):
        case = draw_case(builtin_scene("farm"), number, 1, "hard")
        rule = RULES[name](case.scene)
        oracle = QueryOracle(case, rule, queries=400, budget=1.5)
        Analytic()(oracle, np.random.default_rng(number))
        bound = lower_bound(case, rule).total
        assert bound > 0
        assert oracle.cheapest is not None
        assert bound <= oracle.cheapest.distance


def test_the_bound_of_the_paper_rule_is_tight():
    ratios = []
    for number in range(8):
        case = draw_case(builtin_scene("farm"), number, 0, "default")
        rule = REIDENTIFIERS["spatial"](case.scene)
        oracle = QueryOracle(case, rule, queries=500, budget=1.0)
        Analytic()(oracle, np.random.default_rng(number))
        ratios.append(oracle.least / lower_bound(case, rule).total)
    assert min(ratios) >= 1
    assert np.median(ratios) <= 1.25


def test_objects_in_view_have_bounds_of_their_own():
    case = draw_case(builtin_scene("farm"), 0, 0, "default")
    rule = REIDENTIFIERS["spatial"](case.scene)
    found = lower_bound(case, rule)
    assert found.by_object.min() == found.total
    # The shed is the only one of its kind.
    assert found.by_object[case.layout.index("shed")] == np.inf
    # What makes an object's label wrong costs that object's own bound at the least.
    oracle = QueryOracle(case, rule, queries=500, budget=1.0)
    Analytic()(oracle, np.random.default_rng(0))
    failure = oracle.cheapest
    assert wrong_labels(case, rule, failure.position[None], failure.yaw[None])[0] == failure.wrong


def test_half_a_turn_brings_less_than_half_of_it():
    between = np.sin(0.5)
    assert turn_gain.py_func(0.0, between) == pytest.approx(-between)
    assert turn_gain.py_func(between, between) == pytest.approx(between)
    assert turn_gain.py_func(np.sin(0.25), between) == pytest.approx(0.0)
    assert turn_gain.py_func(between / 2, between) < 0


def test_the_single_mover_says_the_same_uncompiled(monkeypatch):
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    cases = [(1.0, 1.0, 0.05, 0.1), (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.2, 0.0)]
    home, goal, between = np.array([0.3, 0.5]), np.array([0.7, 0.6]), float(np.sin(0.3))
    movers = [Mover(square, home, goal, between, 1.4, way, turn, out, s) for way, turn, out, s in cases]
    expected = [single_mover(mover) for mover in movers]
    for name in ("turn_gain", "distance_at", "_way", "_least_of_parts"):
        monkeypatch.setattr(single, name, getattr(single, name).py_func)
    assert [single_mover.py_func(mover) for mover in movers] == pytest.approx(expected)
    # Half of the way and of the turn together, whether by going or by turning; and the other's leaving.
    assert expected[0] == pytest.approx((np.hypot(0.4, 0.1) / 1.4 + between) / 2 + 0.05, rel=2e-3)


def test_what_stands_out_of_the_room_may_leave_the_view_nearer_to_its_wall_than_its_radius():
    # The view's left edge is 6 cm from the wall; the object there reaches 2 cm through the wall.
    slanted = Camera(np.array([0.5, -1.0]), np.array(0.0), FieldOfView(np.arctan(0.44 / 1.5), 1.0, 9.0))
    case = room([[0.08, 0.5], [0.45, 0.5]], size=0.2, camera=slanted)
    assert case.stays_inside.tolist() == [False, True]
    assert case.in_view.all()
    reid = SpatialReid(case.scene)
    oracle = QueryOracle(case, reid, 1, 9.0)
    # The one leaves the view; the other comes more than half of the way to where it was.
    position = np.array([[[0.05, 0.5], [0.26, 0.5]]])
    assert oracle.query(position, np.zeros((1, 2))).tolist() == [1]
    assert lower_bound(case, reid).total <= oracle.distance(position, np.zeros((1, 2)))[0]
