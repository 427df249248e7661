"""Fig. 5."""

import numpy as np
import pytest

from farm_ar.experiments.noise_sweep import fig5, translations
from farm_ar.experiments.setting import Setting

SIDES = {"L1": 5, "L2": 8, "M1": 8, "M2": 5, "H1": 7, "H2": 15}
LOW = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
PAPER = [0.7739, 0.7739, 0.7723, 0.7723]


@pytest.fixture(scope="module")
def whole():
    """The whole sweep over our scenes, one layout per noise level."""
    return fig5(Setting(layouts=1))


def levels(report, scene, column):
    return sorted({row[column] for row in report.rows if row["scene"] == scene})


def test_the_noise_levels_are_the_papers(whole):
    for name, side in SIDES.items():
        assert levels(whole, name, "translation_sd_m") == [*LOW, *range(2, side + 1)]
        assert levels(whole, name, "rotation_sd_deg") == list(range(0, 121, 5))
    cells = {(row["scene"], row["translation_sd_m"], row["rotation_sd_deg"]) for row in whole.rows}
    assert len(cells) == len(whole.rows) == sum(25 * (9 + side) for side in SIDES.values())


@pytest.mark.parametrize("origin", ["own_scenes", "authors_scenes"])
def test_high_translation_noise_ends_at_the_side_of_the_room(origin, request):
    for name, scene in request.getfixturevalue(origin).items():
        assert translations(scene)[-1] == SIDES[name]


def test_accuracy_falls_along_both_noises_in_every_scene(whole):
    for name in SIDES:
        rows = [row for row in whole.rows if row["scene"] == name]
        low = [row for row in rows if row["translation_sd_m"] <= 1]
        high = [row for row in rows if row["translation_sd_m"] > 1]
        straight = [row for row in low if row["rotation_sd_deg"] <= 30]
        turned = [row for row in low if row["rotation_sd_deg"] >= 90]
        for better, worse in ((low, high), (straight, turned)):
            means = [np.mean([row["accuracy"] for row in group]) for group in (better, worse)]
            assert means[0] > means[1] + 0.1, name


def test_the_office_means_are_over_the_levels_that_the_paper_names(whole):
    def mean(chosen):
        found = [
            np.mean([row["accuracy"] for row in whole.rows if row["scene"] == office and chosen(row)])
            for office in ("L2", "M1", "H2")
        ]
        return f"{np.mean(found):.4f}"

    assert [comparison.paper for comparison in whole.comparisons] == [f"{number:.4f}" for number in PAPER]
    by_local_boxes = [c for c in whole.comparisons if c.what.endswith("local boxes")]
    assert by_local_boxes[0].ours == mean(
        lambda row: row["rotation_sd_deg"] == 50 and row["translation_sd_m"] <= 1
    )
    assert by_local_boxes[1].ours == mean(lambda row: row["translation_sd_m"] == 0.5)


def test_a_panel_shows_the_means_over_the_other_noise(whole):
    rotation, translation = whole.figure.axes[8:10]
    assert (rotation.get_title(), translation.get_title()) == ("(e1) H1", "(e2) H1")
    rows = [row for row in whole.rows if row["scene"] == "H1"]

    def mean(chosen):
        return np.mean([row["accuracy"] for row in rows if chosen(row)])

    low, high = rotation.get_lines()
    assert list(low.get_xdata()) == list(high.get_xdata()) == list(range(0, 121, 5))
    at_30 = [row for row in rows if row["rotation_sd_deg"] == 30]
    assert low.get_ydata()[6] == pytest.approx(
        np.mean([row["accuracy"] for row in at_30 if row["translation_sd_m"] <= 1])
    )
    assert high.get_ydata()[6] == pytest.approx(
        np.mean([row["accuracy"] for row in at_30 if row["translation_sd_m"] >= 1])
    )
    line = translation.get_lines()[0]
    assert line.get_ydata()[10] == pytest.approx(mean(lambda row: row["translation_sd_m"] == 2))


def test_the_office_means_agree_with_an_independent_implementation_on_the_authors_layouts(paper_scenes):
    report = fig5(Setting(paper_scenes, layouts=2))
    ours = [float(comparison.ours) for comparison in report.comparisons]
    assert ours == pytest.approx([0.846, 0.819, 0.809, 0.775], abs=0.03)
    program = [float(comparison.program) for comparison in report.comparisons]
    assert program == pytest.approx([0.798, 0.798, 0.754, 0.754], abs=0.03)
    for comparison in report.comparisons:
        low, high = map(float, comparison.interval.split(" to "))
        assert low <= float(comparison.ours) <= high
        difference = float(comparison.difference.split(" ")[0])
        assert difference == pytest.approx(float(comparison.ours) - float(comparison.program), abs=6e-4)
    assert all(
        comparison.spread.startswith("one layout per level: SD 0.0") for comparison in report.comparisons
    )
