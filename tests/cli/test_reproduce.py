import os
from pathlib import Path

import pytest
from rich.console import Console

import farm_ar.experiments
from farm_ar.cli.experiments import EXPERIMENTS
from farm_ar.sweeps import make_executor


@pytest.fixture
def given(monkeypatch):
    """What the experiments are run with, in place of running them."""
    given = {}
    monkeypatch.setattr(farm_ar.experiments, "reproduce", lambda **options: given.update(options))
    monkeypatch.setattr(farm_ar.experiments, "setting_of", lambda what, **options: {"of": what, **options})
    return given


def alike(executor, other) -> bool:
    """Whether two executors are of one kind and take as many units."""
    return type(executor) is type(other) and executor.capacity == other.capacity


def test_by_default_everything_runs_in_full(run, given, tmp_path):
    assert run("reproduce").exit_code == 0
    assert isinstance(given.pop("console"), Console)
    assert given.pop("setting") == {
        "of": "all",
        "scenes": None,
        "layouts": None,
        "seed": 0,
        "quick": False,
        "fresh": False,
        "reid": None,
    }
    assert alike(given.pop("executor"), make_executor("process", os.cpu_count() or 2))
    assert given == {"what": "all", "out": Path("out")}
    assert (tmp_path / "out").is_dir()


def test_every_option_is_passed_on(run, given, tmp_path):
    options = [
        "--scenes",
        "there",
        "--out",
        "results",
        "--layouts",
        7,
        "--workers",
        3,
        "--seed",
        5,
        "--quick",
        "--fresh",
        "--reid",
        "mine:Rule",
    ]
    assert run("reproduce", "fig9", *options).exit_code == 0
    del given["console"]
    assert given.pop("setting") == {
        "of": "fig9",
        "scenes": Path("there"),
        "layouts": 7,
        "seed": 5,
        "quick": True,
        "fresh": True,
        "reid": "mine:Rule",
    }
    assert alike(given.pop("executor"), make_executor("process", 3))
    assert given == {"what": "fig9", "out": Path("results")}


def test_help_names_the_experiments_that_there_are(run):
    assert list(EXPERIMENTS) == ["all", *farm_ar.experiments.EXPERIMENTS]
    assert f"One of {', '.join(EXPERIMENTS)}." in " ".join(run("reproduce", "--help").stdout.split())


@pytest.mark.parametrize(
    "out",
    [
        "taken",
        "taken/deeper",
        pytest.param(
            "/proc", marks=pytest.mark.skipif(not Path("/proc").is_dir(), reason="there is no /proc")
        ),
    ],
)
def test_a_folder_that_takes_no_files_is_refused_before_the_work(mistake, given, tmp_path, out):
    (tmp_path / "taken").touch()
    assert mistake("reproduce", "--out", out).startswith(
        "OptionError: --out: must be a place that can be written ("
    )
    assert not given


def invalid(option: str, most: int) -> str:
    return (
        f"Error: Invalid value for '--{option}': must be a whole number from 1 to {most}, got '0'. "
        "Try 'farm-ar reproduce --help'."
    )


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (
            ["table9"],
            f"OptionError: what: must be one of {', '.join(sorted(EXPERIMENTS[1:]))}, got 'table9'",
        ),
        (["--layouts", "0"], invalid("layouts", 10**9)),
        (["--workers", "0"], invalid("workers", 1000)),
        (
            ["--scenes", "nowhere"],
            "SceneError: scenes: must be a folder with L1.json to H2.json, got 'nowhere'",
        ),
    ],
)
def test_wrong_options_are_refused_in_one_line(mistake, arguments, line):
    assert mistake("reproduce", *arguments) == line
