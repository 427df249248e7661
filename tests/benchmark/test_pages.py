"""Numbers of docs/benchmark.md and docs/choosing-a-method.md agree with each other and with what is kept."""

import json
from pathlib import Path

import numpy as np
import pytest

DOCS = Path(__file__).parents[2] / "docs"


def tables(page: str) -> list[list[list[str]]]:
    """The tables of a page, each as rows of cells; the second row, of dashes, is left out."""
    found: list[list[list[str]]] = [[]]
    for line in (DOCS / page).read_text().splitlines():
        if line.startswith("|"):
            found[-1].append([cell.strip().replace("`", "") for cell in line.strip("|").split("|")])
        elif found[-1]:
            found.append([])
    return [[rows[0], *rows[2:]] for rows in found if len(rows) > 2]


def column(table: list[list[str]], name: str) -> dict[str, str]:
    """The cells of a column by the first cell of their row."""
    place = next(i for i, head in enumerate(table[0]) if head.startswith(name))
    return {row[0]: row[place] for row in table[1:]}


@pytest.fixture(scope="module")
def reach() -> list[list[str]]:
    return next(
        table for table in tables("benchmark.md") if table[0][0] == "row" and "known motions" in table[0]
    )


@pytest.fixture(scope="module")
def choosing() -> list[list[str]]:
    return next(table for table in tables("choosing-a-method.md") if table[0][1] == "worlds")


def test_the_means_of_the_worlds_are_those_of_their_rows(reach):
    for method in reach[0][1:-1]:
        cells = column(reach, method)
        rows = [
            float(text.split()[0]) for name, text in cells.items() if name not in ("mean", "ms a snapshot")
        ]
        assert float(cells["mean"].split()[0]) == pytest.approx(np.mean(rows), abs=0.0011), method


def test_the_page_on_methods_repeats_the_means_and_times_of_the_benchmark(reach, choosing):
    worlds, times = column(choosing, "worlds"), column(choosing, "ms")
    for method in worlds:
        of_it = column(reach, method)
        assert worlds[method] == of_it["mean"].split()[0]
        assert times[method] == of_it["ms a snapshot"]


def test_the_papers_scenes_are_what_the_command_gave(choosing):
    kept = json.loads((DOCS / "results" / "authors.json").read_text())
    accuracy = {one["method"]: one["accuracy"] for one in kept["scores"] if one["row"] == "all"}
    assert sorted(kept["rows"]) == [f"authors-{name}" for name in ("H1", "H2", "L1", "L2", "M1", "M2")]
    given = column(choosing, "the paper")
    assert {method: f"{accuracy[method]:.3f}" for method in given} == given
    paired = next(table for table in tables("choosing-a-method.md") if table[0][0] == "layout")
    for one in kept["paired"]:
        cell = column(paired, f"{one['method']} less {one['other']}")[one["row"].removeprefix("authors-")]
        assert cell == f"{one['value']:+.3f} ({one['low']:+.3f} to {one['high']:+.3f})"
