"""Table 2 and Fig. 7."""

import numpy as np
import pytest

from farm_ar.experiments.ablation import NOISE, ablate, fig7, table2, worked_example
from farm_ar.experiments.setting import Setting, noisy_snapshots, path_cameras
from farm_ar.reid import SpatialOptions, SpatialReid
from farm_ar.reid.spatial_unity import SpatialUnityReid
from farm_ar.scenes import observe, visible

CONDITIONS = ["all costs", "without translation", "without rotation", "without dimension"]


def test_table_2_agrees_with_an_independent_implementation_on_the_authors_layout(paper_scenes):
    report = table2(Setting(paper_scenes, layouts=100))
    assert [row["condition"] for row in report.rows] == CONDITIONS
    means = [row["mean"] for row in report.rows]
    assert means == pytest.approx([0.902, 0.161, 0.767, 0.784], abs=0.02)
    sds = [row["sd_over_snapshots"] for row in report.rows]
    assert sds == pytest.approx([0.189, 0.213, 0.267, 0.252], abs=0.02)
    for row in report.rows:
        assert 58 <= row["snapshots_per_layout"] <= 66
        assert row["layouts"] == 100
    assert 0.03 < report.rows[0]["sd_of_layout_means"] < 0.07


def test_world_boxes_agree_with_an_independent_implementation_on_the_authors_layout(paper_scenes):
    found = ablate(Setting(paper_scenes, layouts=100), "world")
    assert list(found) == CONDITIONS
    means = [np.nanmean(found[condition]) for condition in CONDITIONS]
    assert means == pytest.approx([0.857, 0.122, 0.742, 0.784], abs=0.02)


def test_the_authors_program_is_below_the_text_where_sizes_count(paper_scenes):
    """An independent count gave it 0.783 with all costs."""
    report = table2(Setting(paper_scenes, layouts=12))
    rows = {row["condition"]: row for row in report.rows}
    assert rows["all costs"]["program_mean"] == pytest.approx(0.783, abs=0.03)
    assert rows["all costs"]["difference_low"] > 0.05
    for row, comparison in zip(report.rows, report.comparisons, strict=True):
        assert row["low"] < row["mean"] < row["high"]
        assert comparison.program == f"{row['program_mean']:.3f} / {row['program_sd']:.3f}"
        assert row["difference"] == pytest.approx(row["mean"] - row["program_mean"])


def test_without_sizes_the_program_differs_by_the_sites_that_it_drops_alone(paper_scenes):
    scene, terms = Setting(paper_scenes).scenes["H1"], ("translation", "rotation")
    program = SpatialUnityReid(scene, terms=terms)
    text = SpatialReid(scene, SpatialOptions(terms=terms, gate_categories=False))
    batch = noisy_snapshots(scene, NOISE, 2, np.random.default_rng(0))
    whole = 0
    for snapshot in (batch.snapshot(i) for i in range(len(batch))):
        answer = program.identify(snapshot)
        if len(answer.candidates) == len(scene.layout) and len(snapshot.detections):
            whole += 1
            assert answer.labels == text.identify(snapshot).labels
    assert 20 < whole < len(batch) - 20


def test_every_ablation_is_below_all_costs_in_our_scene():
    found = ablate(Setting(layouts=20))
    means = {condition: np.nanmean(accuracy) for condition, accuracy in found.items()}
    whole = means.pop("all costs")
    assert whole < 1.0
    assert all(mean < whole - 0.03 for mean in means.values())
    assert means["without translation"] < 0.3, "translation matters most"


def test_table_2_sets_the_papers_numbers_beside_ours():
    report = table2(Setting(layouts=2))
    paper = [(0.91, 0.19), (0.17, 0.27), (0.76, 0.27), (0.85, 0.24)]
    assert [(row["paper_mean"], row["paper_sd"]) for row in report.rows] == paper
    assert [c.paper for c in report.comparisons] == [f"{mean:.2f} / {sd:.2f}" for mean, sd in paper]
    for row, comparison in zip(report.rows, report.comparisons, strict=True):
        assert comparison.what == f"accuracy, {row['condition']}: mean / SD over snapshots"
        assert comparison.ours == f"{row['mean']:.3f} / {row['sd_over_snapshots']:.3f}"
        assert comparison.spread == f"one layout's mean: SD {row['sd_of_layout_means']:.3f}"
    bars = [patch.get_height() for patch in report.figure.axes[0].patches]
    assert bars == pytest.approx([mean for mean, _ in paper] + [row["mean"] for row in report.rows])


def test_all_conditions_judge_the_same_snapshots():
    found = list(ablate(Setting(layouts=2)).values())
    for accuracy in found[1:]:
        np.testing.assert_array_equal(np.isnan(accuracy), np.isnan(found[0]))


def test_the_worked_example_sees_seven_objects_from_the_path(own_scenes, rng):
    scene = own_scenes["H1"]
    noisy, camera = worked_example(scene, rng)
    cameras = path_cameras(scene)
    counts = visible(noisy, cameras).sum(axis=-1)
    assert visible(noisy, camera).sum() == 7
    chosen = np.flatnonzero(np.all(cameras.position == camera.position, axis=-1))
    assert counts[chosen] == [7]
    away = np.linalg.norm(cameras.position - (2.408, 3.759), axis=-1)
    assert away[chosen] == away[counts == 7].min(), "it is the one nearest to the paper's camera"


def test_fig_7_shows_what_each_condition_answers_to_one_snapshot(own_scenes):
    setting = Setting(seed=3)
    report = fig7(setting)
    scene = own_scenes["H1"]
    noisy, camera = worked_example(scene, setting.rng(7, 0))
    snapshot, truth = observe(noisy, camera)
    assert [row["truth"] for row in report.rows] == list(truth)
    without_rotation = SpatialOptions(terms=("translation", "dimension"))
    answer = SpatialReid(scene, without_rotation).identify(snapshot)
    assert [row["without rotation"] for row in report.rows] == list(answer.labels)
    for comparison, condition in zip(report.comparisons, CONDITIONS, strict=True):
        right = np.mean([row[condition] == row["truth"] for row in report.rows])
        assert (comparison.what, comparison.ours) == (f"accuracy, {condition}", f"{right:.2f}")
    assert [comparison.paper for comparison in report.comparisons] == ["1.00", "0.14", "0.43", "0.71"]
    titles = [axes.get_title() for axes in report.figure.axes]
    assert titles[:2] == ["(a) noisy layout", "(b) true labels"]
    assert titles[4] == f"(e) without rotation ({report.comparisons[2].ours})"
