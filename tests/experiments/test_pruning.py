"""Table 3 and Fig. 9."""

from types import SimpleNamespace

import numpy as np
import pytest

from farm_ar.experiments import pruning
from farm_ar.experiments.pruning import fig9, table3
from farm_ar.experiments.setting import Setting
from farm_ar.reid.spatial_unity import SpatialUnityReid
from farm_ar.sweeps import SerialExecutor

SITES = ["S6", "S3", "S10", "S9", "S2", "S4", "S7", "S1", "S8"]
PROBABILITIES = [0.214, 0.150, 0.129, 0.110, 0.109, 0.080, 0.076, 0.067, 0.065]
CUMULATIVE = [0.214, 0.364, 0.494, 0.604, 0.713, 0.793, 0.868, 0.935, 1.000]


@pytest.fixture
def few_times(monkeypatch):
    """Take the time of two snapshots only."""
    monkeypatch.setattr(pruning, "TIMED_SNAPSHOTS", 2)


def test_table_3_comes_out_to_three_decimals_in_the_papers_order(paper_scenes):
    report = table3(Setting(paper_scenes))
    assert [row["site"] for row in report.rows] == SITES
    assert [round(row["probability"], 3) for row in report.rows] == PROBABILITIES
    cumulative = [row["cumulative"] for row in report.rows]
    # The paper adds up what it has rounded.
    assert cumulative == pytest.approx(CUMULATIVE, abs=0.0015)
    assert all(comparison.paper == comparison.ours for comparison in report.comparisons)


def test_the_authors_program_ranks_the_sites_by_their_borders(paper_scenes):
    """By an independent count: distances to the Voronoi borders on a fine grid, softmax over all sites."""
    scene = Setting(paper_scenes).scenes["H1"]
    camera, sites = np.array([2.408, 3.759]), scene.site_positions
    x, z = np.meshgrid(*(np.linspace(0, side, 1401) for side in scene.size))
    points = np.stack([x.ravel(), z.ravel()], axis=1)
    away = np.linalg.norm(points[:, None] - sites, axis=-1)
    nearest = np.sort(np.argsort(away, axis=1)[:, :2], axis=1)
    ordered = np.sort(away, axis=1)
    border = ordered[:, 1] - ordered[:, 0] < 0.01
    to_camera = np.linalg.norm(points - camera, axis=1)
    centre = np.linalg.norm(sites - camera, axis=1)
    own = int(centre.argmin())

    def least(of):
        return to_camera[border & of].min(initial=np.inf)

    between = [least((nearest == sorted((own, s))).all(axis=1)) if s != own else np.inf for s in range(10)]
    distance = [b if np.isfinite(b) else least((nearest == s).any(axis=1)) for s, b in enumerate(between)]
    beyond = int(np.argmin(between))
    distance[own] = centre[own] / centre[beyond] * between[beyond]
    weight = np.exp(1 / np.array(distance))
    expected = weight / weight.sum()
    found = SpatialUnityReid(scene).site_probability(camera)
    np.testing.assert_allclose(found, expected, atol=0.01)
    rows = table3(Setting(paper_scenes)).rows
    assert [row["program_probability"] for row in rows] == sorted(
        np.delete(found, own).tolist(), reverse=True
    )


def test_probabilities_of_any_scene_fall_and_sum_to_one():
    rows = table3(Setting()).rows
    probabilities = [row["probability"] for row in rows]
    assert len(rows) == 9
    assert probabilities == sorted(probabilities, reverse=True)
    assert rows[-1]["cumulative"] == pytest.approx(1.0)


def test_fig_8_fills_the_cells_that_a_threshold_keeps(paper_scenes):
    panels = table3(Setting(paper_scenes)).figure.axes
    kept = {}
    for axes in panels:
        colours = [patch.get_facecolor() for patch in axes.patches if patch.get_fill()]
        kept[axes.get_title()] = sum(colour != (1.0, 1.0, 1.0, 1.0) for colour in colours)
    # By Table 3: S5 alone; with S6, S3; with S10, S9 as the paper says of 0.50; by cumulative sums.
    assert kept == {
        "threshold 0.00: 1 of 10 sites": 1,
        "threshold 0.25: 3 of 10 sites": 3,
        "threshold 0.50: 5 of 10 sites": 5,
        "threshold 0.75: 7 of 10 sites": 7,
        "threshold 0.90: 9 of 10 sites": 9,
        "threshold 1.00: 10 of 10 sites": 10,
    }


@pytest.mark.usefixtures("few_times")
def test_the_threshold_curve_agrees_with_an_independent_implementation(paper_scenes):
    report = fig9(Setting(paper_scenes, layouts=40, quick=True))
    curve = {row["threshold"]: row["accuracy"] for row in report.rows}
    expected = {0.05: 0.42, 0.25: 0.68, 0.5: 0.874, 0.6: 0.966, 0.75: 0.995}
    assert {threshold: curve[threshold] for threshold in expected} == pytest.approx(expected, abs=0.03)
    assert all(round(curve[threshold], 2) == 1.0 for threshold in (0.8, 0.85, 0.9, 0.95, 1.0))
    program = {row["threshold"]: row["program"] for row in report.rows}
    assert program[0.0] == 0.0, "it keeps no site at all"
    assert program[0.5] < program[1.0] < curve[1.0], "in single precision it drops sites even at 1"
    assert all(row["low"] <= row["accuracy"] <= row["high"] for row in report.rows)


@pytest.mark.usefixtures("few_times")
def test_more_labels_are_never_worse_than_the_cameras_own_site():
    report = fig9(Setting(layouts=5, quick=True))
    curve = [row["accuracy"] for row in report.rows]
    assert [row["threshold"] for row in report.rows] == pytest.approx(np.linspace(0, 1, 21))
    assert curve[0] < 0.3
    assert curve[-1] > 0.95
    assert np.diff(curve).min() > -0.02


@pytest.mark.usefixtures("few_times")
def test_times_are_of_both_solvers_and_kept_apart_from_the_results():
    report = fig9(Setting(layouts=1, quick=True))
    assert [row["threshold"] for row in report.measured] == [0.0, 0.25, 0.5, 0.75, 1.0]
    for row in report.measured:
        assert row["mip_us"] > row["lsap_us"] > 0
    assert not any("us" in column for row in report.rows for column in row)
    at_half = [c for c in report.comparisons if c.what.startswith("time at threshold 0.50")]
    shares = [report.measured[2][f"{s}_us"] / report.measured[4][f"{s}_us"] for s in ("mip", "lsap")]
    assert [c.paper for c in at_half] == ["about 0.5"]
    assert [c.ours for c in at_half] == [f"{shares[0]:.2f} (mip), {shares[1]:.2f} (lsap)"]


def test_times_are_means_of_the_least_over_the_snapshots_that_detect_something(monkeypatch):
    """With a clock that ticks once a look, whatever is solved takes one second."""
    ticks = iter(range(100_000))
    clock = SimpleNamespace(perf_counter=lambda: float(next(ticks)))
    monkeypatch.setattr("farm_ar.reid.spatial.time", clock)
    monkeypatch.setattr(pruning, "TIMED_SNAPSHOTS", 3)
    report = fig9(Setting(layouts=1, quick=True))
    assert {(row["mip_us"], row["lsap_us"]) for row in report.measured} == {(1e6, 1e6)}
    assert next(ticks) == 2 * 3 * 5 * (1 + 5), "3 snapshots, 5 thresholds, mip once and lsap five times"


@pytest.mark.usefixtures("few_times")
def test_accuracies_and_times_are_sweeps_that_can_be_watched():
    last = {}
    fig9(Setting(layouts=1, quick=True, watch=lambda standing: last.update({standing.sweep: standing})))
    assert {name: standing.done for name, standing in last.items()} == {"fig9": 42, "fig9 times": 2}


@pytest.mark.usefixtures("few_times")
def test_times_are_taken_one_snapshot_after_the_other_wherever_the_accuracies_are_computed():
    class Elsewhere(SerialExecutor):
        def __init__(self):
            super().__init__()
            self.functions = set()

        def submit(self, unit):
            self.functions.add(unit.function.partition(":")[2])
            super().submit(unit)

    elsewhere = Elsewhere()
    fig9(Setting(layouts=1, quick=True, executor=elsewhere))
    assert elsewhere.functions == {"pruned"}
