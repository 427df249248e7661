"""What an experiment leaves on disk and in the summary."""

import csv
import json

import pytest
from matplotlib.figure import Figure

from farm_ar.experiments.report import Comparison, Report, new_figure


def a_report(**changes) -> Report:
    figure = new_figure(2.0, 1.0)
    figure.subplots().plot([0, 1], [0, 1])
    values = {
        "name": "table9",
        "title": "Table 9: a made-up one",
        "rows": [
            {"scene": "H1", "accuracy": 0.5, "layouts": 3},
            {"scene": 'with, "quotes"', "accuracy": float("nan"), "layouts": None},
        ],
        "comparisons": [Comparison("accuracy", "0.91", "0.500", "SD 0.1"), Comparison("time", "1 s", "2 s")],
        "figure": figure,
    }
    return Report(**{**values, **changes})


def test_csv_json_and_picture_are_written(tmp_path):
    written = a_report().write(tmp_path / "new")
    assert [path.name for path in written] == ["table9.csv", "table9.json", "table9.svg"]
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == sorted(p.name for p in written)
    with written[0].open(newline="") as file:
        assert list(csv.reader(file)) == [
            ["scene", "accuracy", "layouts"],
            ["H1", "0.5", "3"],
            ['with, "quotes"', "", ""],
        ]
    assert json.loads(written[1].read_text(), parse_constant=pytest.fail) == [
        {"scene": "H1", "accuracy": 0.5, "layouts": 3},
        {"scene": 'with, "quotes"', "accuracy": None, "layouts": None},
    ]
    assert written[2].read_text().startswith("<?xml")


def test_measured_times_have_files_of_their_own(tmp_path):
    a_report(measured=[{"threshold": 0.5, "mip_us": 12.5}]).write(tmp_path)
    assert (tmp_path / "table9_times.csv").read_text() == "threshold,mip_us\n0.5,12.5\n"
    assert json.loads((tmp_path / "table9_times.json").read_text()) == [{"threshold": 0.5, "mip_us": 12.5}]
    assert "12.5" not in (tmp_path / "table9.csv").read_text()


def test_a_report_without_rows_has_a_picture_only(tmp_path):
    assert [path.name for path in a_report(rows=[]).write(tmp_path)] == ["table9.svg"]


def test_the_summary_sets_the_papers_numbers_beside_ours():
    assert a_report(note="One layout.").markdown() == (
        "## Table 9: a made-up one\n\n"
        "One layout.\n\n"
        "| | paper | ours | spread |\n"
        "|---|---|---|---|\n"
        "| accuracy | 0.91 | 0.500 | SD 0.1 |\n"
        "| time | 1 s | 2 s |  |\n\n"
        "Picture: [table9.svg](table9.svg)\n"
    )


def test_columns_that_some_comparison_fills_stand_between_ours_and_the_spread():
    whole = Comparison("accuracy", "0.91", "0.500", "SD 0.1", "0.4 to 0.6", "0.3", "+0.2")
    lines = a_report(comparisons=[whole, Comparison("time", "1 s", "2 s")]).markdown().splitlines()
    head = "| | paper | ours | 95% interval | authors' program | ours less program (95%) | spread |"
    assert lines[2:][:1] == [head]
    assert "| accuracy | 0.91 | 0.500 | 0.4 to 0.6 | 0.3 | +0.2 | SD 0.1 |" in lines
    assert "| time | 1 s | 2 s |  |  |  |  |" in lines


def test_a_summary_without_a_note_goes_straight_to_the_table():
    assert a_report().markdown().splitlines()[2] == "| | paper | ours | spread |"


def test_a_picture_that_fails_half_way_leaves_the_old_one_and_nothing_else(tmp_path, monkeypatch):
    (tmp_path / "table9.svg").write_text("the old one")

    def fail(self, target, **options):
        target.write(b"<svg> half of it")
        raise OSError("no space left")

    monkeypatch.setattr(Figure, "savefig", fail)
    with pytest.raises(OSError, match="no space left"):
        a_report().write(tmp_path)
    assert (tmp_path / "table9.svg").read_text() == "the old one"
    assert {path.name for path in tmp_path.iterdir()} == {"table9.csv", "table9.json", "table9.svg"}


def test_a_row_that_cannot_be_written_leaves_no_half_file(tmp_path):
    with pytest.raises(TypeError):
        a_report(rows=[{"accuracy": 0.5}, {"accuracy": object()}]).write(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["table9.csv"]
