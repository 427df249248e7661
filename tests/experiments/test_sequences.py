import numpy as np
import pytest
from numpy.testing import assert_equal

from farm_ar.experiments import sequences as module
from farm_ar.experiments.sequences import LENGTHS, Unit, run_unit, sequences, units
from farm_ar.experiments.setting import Setting
from farm_ar.reid import LastKnownReid, NearestReid, SpatialReid
from farm_ar.scenes import builtin_scene

L1 = builtin_scene("L1")


def test_the_units_are_all_levels_in_all_scenes_and_a_noisy_detector() -> None:
    assert len(units()) == len(set(units())) == 6 * 5
    assert len(units(quick=True)) < len(units())


def test_a_row_for_each_length_and_more_snapshots_show_more_objects() -> None:
    unit, methods = Unit("L1", 0.3, 30, "exact"), {"spatial-ungated": SpatialReid}
    rows = run_unit(unit, L1, 2, 2, np.random.default_rng(0), methods, (1, 4, 16))
    assert [row["snapshots"] for row in rows] == [1, 4, 16]
    assert rows[0]["objects"] <= rows[1]["objects"] < rows[2]["objects"]
    # An exact detector tells all objects apart.
    assert [row["objects"] for row in rows] == [row["real_objects"] for row in rows]
    assert rows[0]["accuracy"] == rows[0]["accuracy_of_first"]


def test_the_same_randomness_gives_the_same_rows() -> None:
    unit, methods = Unit("L1", 0.3, 30, "noisy"), {"spatial-ungated": SpatialReid}
    first, second = (run_unit(unit, L1, 1, 1, np.random.default_rng(3), methods, (1, 3)) for _ in range(2))
    assert_equal(first, second)


def test_the_report_has_every_length(monkeypatch: pytest.MonkeyPatch) -> None:
    quick = {"spatial-ungated": LastKnownReid, "likelihood": LastKnownReid}
    monkeypatch.setattr(module, "METHODS", quick)
    setting = Setting(layouts=1, quick=True)
    report = sequences(setting)
    assert len(report.comparisons) == len(LENGTHS)
    assert "| noisy | objects |" in report.tables
    assert len(report.rows) == len(units(quick=True)) * 2 * len(LENGTHS)


def test_intervals_are_over_layouts_and_gains_over_the_first_snapshot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    quick = {"spatial-ungated": NearestReid, "likelihood": LastKnownReid}
    monkeypatch.setattr(module, "METHODS", quick)
    report = sequences(Setting(layouts=3, quick=True))
    for row in report.rows:
        assert row["accuracy_low"] <= row["accuracy"] <= row["accuracy_high"]
        assert not any(key.startswith(module.BY_LAYOUT) for key in row)
    assert any(row["accuracy_low"] < row["accuracy_high"] for row in report.rows)
    assert "| likelihood | the first's | 16 | " in report.tables
    assert "| +0.000 (+0.000 to +0.000) |" in report.tables
