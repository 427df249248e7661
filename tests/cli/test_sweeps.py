"""`farm-ar sweeps`, and the exit code of work that gave no result."""

import json

import pytest

import farm_ar.experiments
from farm_ar.sweeps import Failure, Sweep, UnfinishedSweepError, Unit, grid, run_sweep

SQUARE = """
def square(seed, x):
    if x < 0:
        raise ZeroDivisionError("no square")
    return {"square": x * x}
"""


@pytest.fixture
def store(tmp_path, monkeypatch):
    """A store with a sweep of three units, of which the last fails."""
    (tmp_path / "squares.py").write_text(SQUARE)
    monkeypatch.syspath_prepend(tmp_path)
    run_sweep(Sweep("squares", "squares:square", grid(x=(2, 3, -1))), tmp_path / "store")
    return tmp_path / "store"


def test_status_says_how_far_each_sweep_is_and_names_what_failed(run, store):
    run_sweep(Sweep("other", "squares:square", grid(x=(1,))), store)
    result = run("sweeps", "status", store)
    assert result.exit_code == 0
    head, _, other, squares, problem = result.stdout.splitlines()
    assert head.split("  ")[0] == "sweep"
    assert other.split()[:6] == ["other", "1", "1", "0", "0", "0"]
    assert squares.split()[:6] == ["squares", "3", "2", "0", "1", "0"]
    assert problem == 'squares: failed: square {"x":-1} seed 0: ZeroDivisionError: no square'


def test_status_as_json(run, store):
    (status,) = json.loads(run("sweeps", "status", store, "--json").stdout)
    (problem,) = status.pop("problems")
    assert status.pop("seconds") >= 0
    counts = {"units": 3, "finished": 2, "running": 0, "failed": 1, "quarantined": 0}
    assert status == {"sweep": "squares"} | counts
    assert "Traceback" in problem


TABLE = "x,seed,square\n2,0,4\n3,0,9\n"


def test_export_writes_the_rows_as_csv(run, store, tmp_path):
    assert run("sweeps", "export", store).stdout == TABLE
    result = run("sweeps", "export", store, "--sweep", "squares", "--out", "squares.csv")
    assert result.stdout == "Wrote squares.csv: 2 of 3 units of squares\n"
    assert (tmp_path / "squares.csv").read_text() == TABLE
    assert run("sweeps", "export", store, "--times").stdout.startswith("x,seed,unit_seconds\n2,0,")


def test_export_needs_the_name_of_the_sweep_where_there_are_several(mistake, store):
    run_sweep(Sweep("other", "squares:square", grid(x=(1,))), store)
    assert mistake("sweeps", "export", store) == (
        "OptionError: --sweep: must be given, where the store has not exactly one, got 'other, squares'"
    )


@pytest.mark.parametrize("command", ["status", "export"])
def test_a_store_that_is_not_there_is_refused_and_not_made(mistake, tmp_path, command):
    line = "StoreError: nothing: store: must be a file that a sweep has made, got 'no such file'"
    assert mistake("sweeps", command, "nothing") == line
    assert not (tmp_path / "nothing").exists()


def test_work_that_gave_no_result_has_an_exit_code_of_its_own(run, monkeypatch):
    failure = Failure(Unit("m:f", '{"x":1}', 0, "1"), "its worker ended with exit code 7", kills=3)

    def fail(**options):
        raise UnfinishedSweepError("fig5", [failure])

    monkeypatch.setattr(farm_ar.experiments, "reproduce", fail)
    result = run("reproduce")
    assert (result.exit_code, result.stdout) == (3, "")
    assert result.stderr == (
        "UnfinishedSweepError: fig5: 1 of its units gave no result; all others are kept\n"
        '  quarantined, killed 3 workers: f {"x":1} seed 0: its worker ended with exit code 7\n'
    )
