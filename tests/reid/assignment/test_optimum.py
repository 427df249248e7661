from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.reid import UNASSIGNED, SpatialOptions, SpatialReid, alternatives, explain, solve_assignment
from farm_ar.reid.assignment import find_margins, margins, margins_and_runners_up
from farm_ar.scenes import Camera, Detections, Snapshot


def every_assignment(cost: FloatArray) -> list[tuple[tuple[int, ...], float]]:
    """All assignments that give as many rows as possible a column of their own, and what each costs."""
    n, m = cost.shape
    found: list[tuple[tuple[int, ...], float]] = [((), 0.0)]
    for i in range(n):
        found = [
            ((*columns, j), total + (0.0 if j == UNASSIGNED else float(cost[i, j])))
            for columns, total in found
            for j in (UNASSIGNED, *(j for j in range(m) if np.isfinite(cost[i, j]) and j not in columns))
        ]
    fewest = min(columns.count(UNASSIGNED) for columns, _ in found)
    return [(columns, total) for columns, total in found if columns.count(UNASSIGNED) == fewest]


def check_against_all_assignments(
    cost: FloatArray, column: IntArray, margin: FloatArray, runner_up: IntArray
) -> None:
    """Margins and runners-up are those of the best assignment in which the row has another column or none."""
    every = every_assignment(cost)
    least = min(total for _, total in every)
    for i, own in enumerate(column.tolist()):
        if own == UNASSIGNED:
            assert np.isnan(margin[i])
            assert runner_up[i] == UNASSIGNED
            continue
        others = [(columns, total) for columns, total in every if columns[i] != own]
        expected = min((total - least for _, total in others), default=np.inf)
        assert margin[i] == pytest.approx(expected, abs=1e-9)
        nearest = {columns[i] for columns, total in others if total - least <= expected + 1e-9}
        assert runner_up[i] in (nearest or {UNASSIGNED})


KINDS = ("spare", "square", "surplus", "banned", "categories", "ties")


def problem(rng: np.random.Generator, kind: str) -> FloatArray:
    """Random costs: with spare columns or rows, with forbidden pairs, with categories apart, or with ties."""
    n, m = rng.integers(1, 6, 2)
    shape = {"spare": (min(n, m), max(n, m)), "surplus": (max(n, m), min(n, m)), "square": (n, n)}
    cost = rng.uniform(0, 3, shape.get(kind, (n, m)))
    if kind == "ties":
        cost = rng.integers(0, 3, (n, m)).astype(float)
    if kind in ("banned", "ties"):
        cost[rng.random((n, m)) < rng.choice([0.0, 0.3, 0.7])] = np.inf
    if kind == "categories":
        cost[rng.integers(0, 2, n)[:, None] != rng.integers(0, 2, m)] = np.inf
    return cost


@pytest.mark.parametrize("kind", KINDS)
def test_a_margin_is_what_the_best_assignment_without_the_rows_column_costs_more(kind: str) -> None:
    rng = np.random.default_rng(KINDS.index(kind))
    for _ in range(600):
        cost = problem(rng, kind)
        column = solve_assignment(cost)
        check_against_all_assignments(cost, column, *margins_and_runners_up(cost, column))


@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(KINDS))
def test_plain_python_and_compiled_code_find_the_same_margins(seed: int, kind: str) -> None:
    cost = problem(np.random.default_rng(seed), kind)
    column = solve_assignment(cost)
    compiled, plain = find_margins(cost, column), find_margins.py_func(cost, column)
    np.testing.assert_allclose(compiled[0], plain[0], atol=1e-12)
    np.testing.assert_array_equal(compiled[1], plain[1])


def test_a_row_without_a_column_may_take_the_label_of_another() -> None:
    # One label: the second detection would be it for 1 more, and the first would then be nothing.
    margin, runner_up = margins_and_runners_up(np.array([[2.0], [3.0]]), np.array([0, UNASSIGNED]))
    assert margin[0] == pytest.approx(1.0)
    assert np.isnan(margin[1])
    assert runner_up.tolist() == [UNASSIGNED, UNASSIGNED]


def test_a_margin_by_hand() -> None:
    # Row 0 would take column 2 for 2 more; row 1 would take it for 3 more, or swap with row 0 for 7 more.
    cost = np.array([[1.0, 4.0, 3.0], [6.0, 2.0, 5.0]])
    assert margins(cost, np.array([0, 1])).tolist() == pytest.approx([2.0, 3.0])


def test_a_row_without_another_column_has_an_infinite_margin() -> None:
    assert margins(np.array([[1.0]]), np.array([0])).tolist() == [np.inf]
    assert margins(np.array([[1.0, np.inf]]), np.array([0])).tolist() == [np.inf]


def test_rows_without_a_column_have_no_margin() -> None:
    assert np.isnan(margins(np.array([[np.inf, np.inf]]), np.array([UNASSIGNED]))).all()
    assert margins(np.zeros((0, 3)), np.zeros(0, dtype=np.int64)).shape == (0,)


SCENES = {"few labels": (2, 1), "categories and a false detection": (5, 2), "labels to spare": (7, 2)}


@pytest.mark.parametrize("gate", [True, False])
@pytest.mark.parametrize(("objects", "categories"), SCENES.values(), ids=SCENES)
def test_margins_explanations_and_alternatives_are_those_of_solving_again(
    make_scene: Any, make_batch: Any, objects: int, categories: int, gate: bool
) -> None:
    rng = np.random.default_rng(objects)
    for _ in range(20):
        scene = make_scene(rng, objects, categories)
        reid = SpatialReid(scene, SpatialOptions(gate_categories=gate))
        batch = make_batch(rng, scene, most=5)
        many = reid.identify_many(batch, margins=True)
        for b in range(len(batch)):
            snapshot, n = batch.snapshot(b), int(batch.count[b])
            answer, (cost, names) = reid.identify(snapshot), reid.problem(snapshot)
            column = [UNASSIGNED if name is None else names.index(name) for name in answer.labels]
            runner_up = [UNASSIGNED if name is None else names.index(name) for name in answer.runner_up]
            own = np.array(column, dtype=np.int64)
            check_against_all_assignments(cost, own, answer.margin, np.array(runner_up, dtype=np.int64))
            check_against_all_assignments(cost, own, many.margin[b, :n], many.runner_up[b, :n])
            for i in range(n):
                why = explain(reid, snapshot, i)
                assert why.margin == pytest.approx(answer.margin[i], nan_ok=True)
                assert (why.runner_up and why.runner_up.label) == answer.runner_up[i]
            best = sorted(total for _, total in every_assignment(cost))[:4]
            assert [one.total for one in alternatives(reid, snapshot, 4)] == pytest.approx(best)


def test_an_explanation_says_that_another_detection_could_have_the_label(make_scene: Any) -> None:
    rng = np.random.default_rng(0)
    scene = make_scene(rng, objects=1)
    place = scene.layout.position[0]
    seen = Detections(
        scene.layout.category * 2,
        place + np.array([[0.1, 0.0], [0.2, 0.0]]),
        np.repeat(scene.layout.yaw, 2),
        np.repeat(scene.layout.size, 2, axis=0),
    )
    reid, snapshot = SpatialReid(scene), Snapshot(Camera(np.zeros(2), np.array(0.0)), seen)
    rise = scene.cost_weights.translation * 0.1 / scene.diagonal
    assert reid.identify(snapshot).margin[0] == pytest.approx(rise)
    assert (
        explain(reid, snapshot, 0)
        .words()
        .endswith(f"; another detection could have that label instead, for {rise:.2f} more in all.")
    )
