"""What README.md prints is true: its Python, its commands, its links, its numbers."""

import re
import runpy
import shlex
from pathlib import Path

import numpy as np
import pytest
import typer
import typer.main
from typer.testing import CliRunner

from farm_ar.cli import app

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
SHELL = [line for kind, text in BLOCKS if kind == "sh" for line in text.splitlines()]
QUOTED = [text for text in re.findall(r"`([^`\n]+)`", README) if re.match(r"(farm-ar|make) ", text)]
COMMANDS = [shlex.split(line, comments=True) for line in (*SHELL, *QUOTED)]
OURS = [words[1:] for words in COMMANDS if words[0].endswith("farm-ar")]
PAGES = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docs").glob("*.md")}


@pytest.fixture(autouse=True)
def in_the_projects_folder(monkeypatch):
    monkeypatch.chdir(ROOT)
    monkeypatch.syspath_prepend(str(ROOT / "examples"))


def python_and_output():
    """Each Python block with the block of output that follows it."""
    kinds = [kind for kind, _ in BLOCKS]
    return [(BLOCKS[i][1], BLOCKS[i + 1][1]) for i, kind in enumerate(kinds) if kind == "python"]


@pytest.mark.parametrize(("code", "output"), python_and_output())
def test_python_prints_what_stands_below_it(code, output, tmp_path, capsys):
    script = tmp_path / "block.py"
    script.write_text(code, encoding="utf-8")
    runpy.run_path(str(script))
    assert capsys.readouterr().out == output


@pytest.mark.parametrize("words", OURS, ids=" ".join)
def test_a_command_has_its_options(words):
    """The parser takes every word; nothing is run."""
    command = typer.main.get_command(app)
    name, chosen, rest = command.resolve_command(typer.Context(command), list(words))
    chosen.make_context(name, list(rest))


@pytest.mark.parametrize("words", [w for w in OURS if w[0] == "identify"], ids=" ".join)
def test_identify_runs(words, tmp_path):
    words = [str(tmp_path / "seen.png") if word.startswith("out/") else word for word in words]
    result = CliRunner().invoke(app, words)
    assert (result.exit_code, result.exception) == (0, None)
    assert "dan" in result.stdout


def test_every_target_of_make_is_one():
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    named = [words[1] for words in COMMANDS if words[0] == "make"]
    assert named
    assert set(named) <= set(targets)


def test_every_link_leads_somewhere():
    for target in re.findall(r"\]\(([^)\s]+)\)", README):
        if target.startswith("https://"):
            continue
        path, _, anchor = target.partition("#")
        assert (ROOT / path).exists(), target
        if anchor:
            headings = re.findall(r"^#+ (.*)$", (ROOT / path).read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in [re.sub(r"[^\w -]", "", text.lower()).replace(" ", "-") for text in headings]


def test_films_are_small_enough_to_load_quickly():
    films = re.findall(r"\(([^)]*\.gif)\)", README)
    assert len(films) == 7
    assert all((ROOT / film).stat().st_size < 700_000 for film in films)


def row(page, start, after=""):
    """The cells of the first row that begins so, of the tables of a page below some text."""
    (line,) = [
        line for line in PAGES[page][PAGES[page].index(after) :].splitlines() if line.startswith(f"| {start}")
    ][:1]
    return [cell.strip() for cell in line.strip("|").split("|")]


def result(start):
    """The cells of a row of the README's tables."""
    (line,) = [line for line in README.splitlines() if line.startswith(f"| {start}")]
    return [cell.strip() for cell in line.strip("|").split("|")]


def percent(share):
    return f"{100 * float(share):.1f}%"


def test_accuracies_are_those_of_the_page():
    names = ("spatial-ungated |", "spatial |", "likelihood |", "bound: noise known |")
    paper, apart, likelihood, known = (
        percent(row("reidentification.md", name, "Mean accuracy over")[1]) for name in names
    )
    cells = result("accuracy, six scenes")
    assert cells[1:] == [
        f"{paper} (categories kept apart: {apart})",
        likelihood,
        f"{known} with the noise known",
    ]
    surest = row("reidentification.md", "accuracy of the 80%")[2]
    assert result("accuracy of the 80%")[2] == percent(surest)


def test_smallest_displacements_are_those_of_the_page():
    diagonal_cm = 100 * np.hypot(1.2, 0.8)  # of the farm's table
    cells = result("smallest displacement")
    least, bound = (float(cell) for cell in row("stress-testing.md", "spatial |")[1:3])
    assert cells[1] == f"{least * diagonal_cm:.1f} cm"
    assert f"{bound * diagonal_cm:.1f} cm" in cells[3]
    assert cells[2] == f"{float(row('stress-testing.md', 'likelihood |')[1]) * diagonal_cm:.1f} cm"


def test_speeds_are_those_of_the_page():
    default = row("speed.md", "categories ignored |")[1]
    assert result("one snapshot")[1] == f"{float(default.split()[0]):.0f} µs"
    lp_solve = float(re.search(r"which took (\d+) µs", PAGES["speed.md"]).group(1))
    assert f"{lp_solve / 1000:.2f} ms" in result("one snapshot")[3]
    assert (
        result("many snapshots")[1].split()[0]
        == f"{round(int(row('speed.md', '8 x 29', '`SpatialReid.identify_many`')[2].replace(',', '')), -3):,}"
    )


def test_the_papers_numbers_are_those_of_the_page():
    offices = [row("paper-results.md", f"offices, {noise}")[2] for noise in ("rotation", "translation")]
    assert " and ".join(percent(share) for share in offices) in result("Fig. 5")[2]
    without, pruned = (
        row("paper-results.md", "accuracy, without dimension"),
        row("paper-results.md", "accuracy at threshold 0.50"),
    )
    assert f"{float(without[2].split()[0]):.2f}, paper {without[1].split()[0]}" in result("Table 2")[2]
    assert f"{float(pruned[2]):.2f}, paper {pruned[1]}" in result("Fig. 9")[2]


def test_returns_of_random_and_analytic_policies_are_what_they_get():
    import gymnasium as gym

    from farm_ar.agents.policies import AnalyticPolicy, RandomPolicy

    cells, env = result("`FarmToTable-v0` |"), gym.make("farm_ar:FarmToTable-v0", play_seconds=0.0)
    for policy, cell in ((RandomPolicy, cells[1]), (AnalyticPolicy, cells[3])):
        chosen, returns = policy(np.random.default_rng(0)), []
        for seed in range(10_000_000, 10_000_100):
            env.reset(seed=seed)
            returns.append(0.0)
            over = False
            while not over:
                _, reward, over, _, _ = env.step(chosen.act(env.unwrapped))
                returns[-1] += reward
        assert cell == f"{np.mean(returns):.2f} ± {np.std(returns, ddof=1) / 10:.2f}"
