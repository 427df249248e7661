from __future__ import annotations

import numpy as np
import pytest

from farm_ar.experiments import headroom_report as report
from farm_ar.experiments.headroom import BINS, BOUND, METHODS, Unit, headroom, run_unit, units
from farm_ar.experiments.patterns import PATTERNS, jitter, turned
from farm_ar.experiments.setting import Setting
from farm_ar.reid import LastKnownReid, LikelihoodReid, NearestReid, SpatialReid
from farm_ar.scenes import LayoutNoise, builtin_scene

L1 = builtin_scene("L1")


@pytest.fixture(scope="module")
def rows():
    """Of a few methods in one cell of the table and under one pattern."""
    methods = {"spatial-ungated": SpatialReid, "likelihood": LikelihoodReid, "nearest": NearestReid}
    some = []
    for k, unit in enumerate((Unit("L1", "jitter", 0.3, 120), Unit("L1", "few move far"))):
        some += run_unit(unit, L1, 2, np.random.default_rng(k), methods)
    return some


def test_the_units_are_all_cells_of_the_table_and_all_patterns():
    every = units()
    assert len(every) == 6 * 16 + 6 * 5
    assert len(set(every)) == len(every)
    assert {unit.pattern for unit in every} == {"jitter", *PATTERNS}
    assert len(units(quick=True)) < len(every)


def test_a_unit_gives_a_row_for_each_method_and_the_bound(rows):
    assert [row["rule"] for row in rows] == ["spatial-ungated", "likelihood", "nearest", BOUND] * 2
    assert {(row["pattern"], row["rotation_sd_deg"]) for row in rows} == {
        ("jitter", 120),
        ("few move far", 0),
    }
    by_method = {row["rule"]: row["accuracy"] for row in rows[:4]}
    assert by_method["likelihood"] > by_method["spatial-ungated"]  # headings say little here
    counts = np.array(rows[1]["answers"].split(), dtype=int)
    assert len(counts) == BINS
    assert counts.sum() == rows[1]["detections"]
    assert rows[0]["answers"] == ""


def test_rows_have_intervals_and_paired_gains_over_the_papers_method(rows):
    for paper, *others in (rows[:4], rows[4:]):
        assert paper["over_the_paper"] == paper["over_the_paper_low"] == paper["over_the_paper_high"] == 0.0
        for row in (paper, *others):
            assert row["low"] <= row["accuracy"] <= row["high"]
            assert row["over_the_paper"] == pytest.approx(row["accuracy"] - paper["accuracy"])
            assert row["over_the_paper_low"] <= row["over_the_paper"] <= row["over_the_paper_high"]


def test_the_same_randomness_gives_the_same_rows():
    unit = Unit("L1", "two new objects")
    first, second = (
        run_unit(unit, L1, 1, np.random.default_rng(3), {"spatial-ungated": SpatialReid}) for _ in range(2)
    )
    assert first == second


def test_methods_without_a_batched_form_answer_one_by_one():
    batch = jitter(L1, LayoutNoise.of(0.05, 5), 1, np.random.default_rng(0)).snapshots
    found = LastKnownReid(L1, tolerance_m=0.06).identify_many(batch)
    for b in range(len(batch)):
        expected = LastKnownReid(L1, tolerance_m=0.06).identify(batch.snapshot(b)).labels
        assert found.names(b, int(batch.count[b])) == expected


def test_all_methods_of_the_package_take_part():
    assert {
        "spatial-ungated",
        "spatial",
        "likelihood",
        "nearest-ungated",
        "distance-ungated",
        "last-known",
    } <= set(METHODS)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_pattern_gives_snapshots_whose_truth_is_known(pattern):
    case = PATTERNS[pattern](L1, 3, np.random.default_rng(1))
    batch = case.snapshots
    assert len(batch) % 3 == 0
    exists = np.arange(batch.yaw.shape[1]) < batch.count[:, None]
    strangers = (batch.truth[exists] < 0).mean()
    assert (strangers > 0.02) == (pattern in ("missed and false", "two new objects"))
    assert (case.noise is None) == (pattern in ("cluster moved together", "camera drift"))


def test_a_drift_moves_camera_and_detections_alike():
    calm = jitter(L1, LayoutNoise.of(0.1, 15), 1, np.random.default_rng(4)).snapshots
    drifted = PATTERNS["camera drift"](L1, 1, np.random.default_rng(4)).snapshots
    exists = np.arange(calm.yaw.shape[1]) < calm.count[:, None]
    for batch in (calm, drifted):
        away = np.linalg.norm(batch.position - batch.camera.position[:, None], axis=-1)
        assert away[exists].max() < 3.0
    shift = np.abs(drifted.camera.position - calm.camera.position)
    assert 0.05 < shift.max() <= 0.1
    turn = drifted.camera.yaw - calm.camera.yaw
    assert 2 < np.rad2deg(np.abs(turn).max()) <= 5
    np.testing.assert_allclose((drifted.yaw - calm.yaw)[exists], np.repeat(turn, calm.count), atol=1e-12)
    np.testing.assert_allclose(
        np.linalg.norm(drifted.position - drifted.camera.position[:, None], axis=-1)[exists],
        np.linalg.norm(calm.position - calm.camera.position[:, None], axis=-1)[exists],
    )


def test_a_turn_is_clockwise():
    np.testing.assert_allclose(turned(np.array([0.0, 1.0]), np.pi / 2), [1.0, 0.0], atol=1e-12)


def synthetic(method, accuracy, answers, sure, right, pattern="jitter", scene="L1", translation=0.1):
    texts = (" ".join(map(str, values)) for values in (answers, sure, right))
    return {
        "scene": scene,
        "pattern": pattern,
        "translation_sd_m": translation,
        "rotation_sd_deg": 30,
        "rule": method,
        "accuracy": accuracy,
        **dict(zip(("answers", "sure", "right"), texts, strict=True)),
    }


def test_calibration_and_the_surest_answers_by_hand():
    # 10 answers at .15 of which 2 are right, 10 at .95 of which 9 are right.
    answers, sure, right = ([0] * 10 for _ in range(3))
    answers[1], sure[1], right[1] = 10, 1.5, 2
    answers[9], sure[9], right[9] = 10, 9.5, 9
    some = [synthetic("likelihood", 0.55, answers, sure, right)]
    assert report.calibration_error(some, "likelihood", None) == pytest.approx((0.5 + 0.5) / 20)
    covered, accuracy = report.risk_coverage(some, "likelihood", ("jitter",))
    assert dict(zip(covered, accuracy, strict=True))[0.5] == pytest.approx(0.9)
    assert report.accuracy_of_most_confident(some, "likelihood", None) == pytest.approx(
        0.9 + (0.55 - 0.9) * 0.6
    )
    assert np.isnan(report.calibration_error(some, "spatial-ungated", None))
    assert np.isnan(report.accuracy_of_most_confident(some, "spatial-ungated", None))


def test_the_worst_cell_is_the_one_with_the_least_gain_over_the_scenes():
    nothing = ([], [], [])
    some = [synthetic("spatial-ungated", 0.5, *nothing, translation=t) for t in (0.1, 0.3)]
    some += [synthetic("likelihood", 0.6, *nothing, translation=0.1)]
    some += [
        synthetic("likelihood", a, *nothing, translation=0.3, scene=s) for a, s in ((0.4, "L1"), (0.5, "M1"))
    ]
    worst, where = report.worst_cell(some, "likelihood")
    assert worst == pytest.approx(-0.05)
    assert where == "T 0.3, R 30"


def test_a_report_has_tables_a_figure_and_the_goals(rows):
    found = report.report_of(rows, 2)
    assert found.comparisons[0].what == "mean accuracy over the table, noise unknown"
    lines = found.tables.splitlines()
    assert "| method | table | few move far |" in lines
    assert lines.count("| method | L1 |") == 1
    assert len(found.figure.axes) == 4
    assert "likelihood" in found.markdown()


def test_a_re_identifier_of_ones_own_is_compared_in_a_line(rows):
    mine = [
        row | {"rule": "mine:Class", "accuracy": 0.25} for row in rows if row["rule"] == "spatial-ungated"
    ]
    found = report.report_of([*rows, *mine], 2, ["mine:Class"]).comparisons[-1]
    assert found.what == "mean accuracy over the table, mine:Class"
    assert found.ours == "0.2500"
    table = [
        row["accuracy"] for row in rows if (row["rule"], row["pattern"]) == ("spatial-ungated", "jitter")
    ]
    assert found.paper == f"{np.mean(table):.4f}"


def test_the_experiment_covers_all_units(monkeypatch):
    asked = []

    def run(unit, scene, layouts, rng, methods):
        asked.append((unit, layouts))
        return [
            synthetic(method, 0.5, [4], [2.0], [2], unit.pattern, unit.scene)
            for method in ("spatial-ungated", "likelihood", BOUND)
        ]

    monkeypatch.setattr("farm_ar.experiments.headroom.run_unit", run)
    found = headroom(Setting(layouts=3))
    assert [unit for unit, _ in asked] == units()
    assert {layouts for _, layouts in asked} == {3}
    assert len(found.rows) == 3 * len(units())
