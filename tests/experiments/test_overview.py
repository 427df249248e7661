"""Table 1."""

import pytest

from farm_ar.experiments.overview import table1
from farm_ar.experiments.setting import Setting
from farm_ar.scenes import save_scene

# Sites, types, objects, square metres.
TABLE_1 = {
    "L1": (2, 1, 16, 25),
    "L2": (4, 1, 8, 64),
    "M1": (5, 3, 35, 64),
    "M2": (6, 2, 30, 25),
    "H1": (10, 5, 52, 49),
    "H2": (14, 11, 48, 225),
}


@pytest.mark.parametrize("folder", [None, "paper_scenes"])
def test_the_counts_are_the_papers(folder, request):
    report = table1(Setting(folder and request.getfixturevalue(folder)))
    found = {row["scene"]: row for row in report.rows}
    assert list(found) == [*TABLE_1]
    for name, counts in TABLE_1.items():
        columns = ("sites", "types", "objects", "area_m2")
        assert tuple(found[name][column] for column in columns) == counts, name
        assert tuple(found[name][f"paper_{column}"] for column in columns) == counts, name
    assert all(comparison.paper == comparison.ours for comparison in report.comparisons)


def test_a_scene_that_departs_from_the_paper_is_shown_as_it_is(own_scenes, tmp_path):
    for name in own_scenes:
        save_scene(own_scenes["L2" if name == "L1" else name], tmp_path / f"{name}.json")
    comparison = table1(Setting(tmp_path)).comparisons[0]
    assert (comparison.paper, comparison.ours) == ("2, 1, 16, 25", "4, 1, 8, 64")


def test_each_scene_has_a_panel():
    titles = [axes.get_title() for axes in table1(Setting()).figure.axes]
    assert titles[0] == "L1: 16 objects, 25 m²"
    assert [title.split(":")[0] for title in titles] == list(TABLE_1)
