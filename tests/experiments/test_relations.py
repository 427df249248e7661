import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_equal

from farm_ar.experiments import relations as module
from farm_ar.experiments.relations import RIGHT, SEEN, Unit, calibration_error, relations, run_unit, units
from farm_ar.experiments.setting import Setting
from farm_ar.experiments.shared_motions import PATTERNS, drifted, group_moved
from farm_ar.reid import LastKnownReid, LikelihoodReid, RelationalReid
from farm_ar.scenes import builtin_scene

M2 = builtin_scene("M2")
METHODS = {"likelihood": LikelihoodReid, "relational": RelationalReid}


def test_the_units_are_all_patterns_in_all_scenes_and_on_the_farm() -> None:
    assert len(units()) == len(set(units())) == 7 * len(PATTERNS)


@pytest.mark.parametrize("scene", ["M2", "farm"])
@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_pattern_gives_some_snapshots_of_two_objects_or_more(scene: str, pattern: str) -> None:
    batch, layout = PATTERNS[pattern](builtin_scene(scene), 2, 3, np.random.default_rng(0))
    assert np.bincount(layout).max() <= 3
    assert len(layout) == len(batch)
    assert 0 < len(batch) <= 6
    assert (batch.count >= 2).all()


def test_a_moved_group_keeps_its_shape_and_is_seen() -> None:
    batch, _ = group_moved(M2, 4, 3, np.random.default_rng(1))
    assert batch.truth is not None
    shapes = []
    for b in range(len(batch)):
        n = int(batch.count[b])
        before = M2.layout.position[batch.truth[b, :n]]
        far = np.linalg.norm(batch.position[b, :n] - before, axis=-1) > 0.4
        if far.sum() >= 2:
            apart, was = (
                np.linalg.norm(place[far][:, None] - place[far], axis=-1)
                for place in (batch.position[b, :n], before)
            )
            shapes.append(np.abs(apart - was).max())
    assert len(shapes) > 2
    assert np.median(shapes) < 0.5


def test_a_drift_leaves_everything_where_the_camera_sees_it() -> None:
    rng = np.random.default_rng(2)
    calm, _ = PATTERNS["calm"](M2, 2, 3, rng)
    after = drifted(calm, calm.camera.position, rng)
    for b in range(len(calm)):
        n = int(calm.count[b])
        far = [np.linalg.norm(one.position[b, :n] - one.camera.position[b], axis=-1) for one in (calm, after)]
        assert_allclose(far[0], far[1])
        assert_allclose(
            calm.yaw[b, :n] - calm.camera.yaw[b], after.yaw[b, :n] - after.camera.yaw[b], atol=1e-12
        )
    assert np.linalg.norm(after.camera.position - calm.camera.position, axis=-1).max() <= 0.1 + 1e-12


def test_calibration_error_is_the_mean_distance_from_what_was_right() -> None:
    sure, right = np.array([0.95, 0.95, 0.55, 0.55]), np.array([True, False, True, True])
    assert_allclose(calibration_error(sure, right), (abs(1.9 - 1) + abs(1.1 - 2)) / 4)
    assert np.isnan(calibration_error(np.array([np.nan]), np.array([True])))


def test_rows_are_of_each_method_and_the_same_for_the_same_randomness() -> None:
    unit = Unit("M2", "group moved")
    first, second = (run_unit(unit, M2, 1, 2, np.random.default_rng(3), METHODS) for _ in range(2))
    assert_equal(first, second)
    assert [row["rule"] for row in first] == ["likelihood", "relational"]


def test_right_labels_are_counted_by_layout() -> None:
    rows = run_unit(Unit("M2", "usual"), M2, 3, 2, np.random.default_rng(4), METHODS)
    for row in rows:
        assert len(row[RIGHT]) == len(row[SEEN]) == 3
        assert min(row[SEEN]) > 0  # each layout has its own
        assert sum(row[SEEN]) == row["detections"]
        assert_allclose(sum(row[RIGHT]) / sum(row[SEEN]), row["accuracy"])


def test_gains_are_paired_and_have_intervals_over_layouts(monkeypatch: pytest.MonkeyPatch) -> None:
    quick = {"spatial-ungated": LastKnownReid, "likelihood": LastKnownReid, "relational": LastKnownReid}
    monkeypatch.setattr(module, "METHODS", quick)
    report = relations(Setting(layouts=3, quick=True))
    for row in report.rows:
        assert row["low"] <= row["accuracy"] <= row["high"]
        assert row["over_the_paper"] == row["over_the_paper_low"] == row["over_the_paper_high"] == 0
    assert any(row["low"] < row["high"] for row in report.rows)
    assert all(" to " in one.interval for one in report.comparisons)
    assert "+0.000 (+0.000 to +0.000)" in report.tables


def test_the_report_has_every_pattern(monkeypatch: pytest.MonkeyPatch) -> None:
    quick = {"spatial-ungated": LastKnownReid, "likelihood": LastKnownReid, "relational": LastKnownReid}
    monkeypatch.setattr(module, "METHODS", quick)
    setting = Setting(layouts=1, quick=True)
    report = relations(setting)
    assert [one.what for one in report.comparisons] == [f"accuracy, {name}" for name in PATTERNS]
    assert len(report.rows) == len(units()) * 3
    assert "| frame turned | relational |" in report.tables
