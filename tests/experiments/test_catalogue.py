"""Every table and figure of the paper is known by its number."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from farm_ar.cli import app
from farm_ar.errors import OptionError
from farm_ar.experiments import EXPERIMENTS, setting_of
from farm_ar.experiments.catalogue import ELSEWHERE, NOT_GIVEN, SHOWN_BY, elsewhere, experiment_of

TABLES, FIGURES = 5, 26
EVERY = [f"table{n}" for n in range(1, TABLES + 1)] + [f"fig{n}" for n in range(1, FIGURES + 1)]


@pytest.mark.parametrize("name", EVERY)
def test_each_has_exactly_one_place(name):
    places = [name in EXPERIMENTS, name in SHOWN_BY, name in ELSEWHERE, name in NOT_GIVEN]
    assert sum(places) == 1
    assert SHOWN_BY.get(name, "table1") in EXPERIMENTS


def test_the_page_of_results_names_every_table_and_figure():
    """And a command, or that there is none, in the same row."""
    page = (Path(__file__).parents[2] / "docs" / "paper-results.md").read_text()
    rows = page.split("## Every table and figure")[1].split("\n\n")[1].splitlines()[2:]
    named = set()
    for row in rows:
        first, _, command, state = (cell.strip() for cell in row.strip("|").split("|"))
        assert command == "–" or command.startswith("`farm-ar ")
        assert state
        for kind, numbers in re.findall(r"(Table|Fig)s?\.? ([\d, and to]+)", first):
            for low, high in re.findall(r"(\d+)(?: to (\d+))?", numbers):
                named |= {f"{kind.lower()}{n}" for n in range(int(low), int(high or low) + 1)}
    assert named == set(EVERY)


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("Fig. 8", "table3"),
        ("figure 5", "fig5"),
        ("Table 2", "table2"),
        ("fig7c", "fig7"),
        ("headroom", "headroom"),
        ("all", "all"),
    ],
)
def test_numbers_may_be_written_as_in_the_paper(written, name):
    assert experiment_of(written) == name


@pytest.mark.parametrize("name", sorted(NOT_GIVEN))
def test_what_cannot_be_given_is_refused_with_the_reason(name, tmp_path):
    with pytest.raises(OptionError, match="cannot be reproduced"):
        setting_of(name)
    answer = CliRunner().invoke(app, ["reproduce", name, "--out", str(tmp_path / "out")])
    assert (answer.exit_code, answer.stderr.count("\n")) == (2, 1)
    assert NOT_GIVEN[name] in answer.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", sorted(ELSEWHERE))
def test_what_another_command_gives_is_named_with_it(name, tmp_path):
    answer = CliRunner().invoke(app, ["reproduce", name, "--out", str(tmp_path / "out")])
    assert answer.exit_code == 0
    assert answer.stdout.strip() == elsewhere(name)
    assert not (tmp_path / "out").exists()
    command = elsewhere(name).rpartition(": farm-ar ")[2].split()
    assert CliRunner().invoke(app, [command[0], "--help"]).exit_code == 0
    with pytest.raises(OptionError, match="must be an experiment"):
        setting_of(name)


def test_several_may_be_named_at_once_and_each_runs_once(tmp_path):
    out = tmp_path / "out"
    names = ["table4", "Fig. 17", "table1", "fig11"]
    answer = CliRunner().invoke(app, ["reproduce", *names, "--quick", "--out", str(out)])
    assert answer.exit_code == 0
    assert elsewhere("fig17") in answer.stdout
    summary = (out / "summary.md").read_text()
    assert [line.split(":")[0] for line in summary.splitlines() if line.startswith("## ")] == [
        "## Table 4",
        "## Table 1",
    ]


def test_experiments_of_different_sizes_are_not_run_together_without_a_number_of_layouts():
    with pytest.raises(OptionError, match="layouts: must be given where experiments have different defaults"):
        setting_of(["table5", "headroom"])
    assert setting_of(["table5", "headroom"], layouts=3).layouts == 3
    assert setting_of(["table5", "fig14"]).layouts == 20
