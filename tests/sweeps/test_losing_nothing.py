"""Whatever happens to a run, its store holds what an undisturbed run gives."""

import contextlib
import json
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from farm_ar.sweeps import (
    SerialExecutor,
    Store,
    StoreError,
    Sweep,
    UnfinishedSweepError,
    grid,
    leases,
    run_sweep,
)
from farm_ar.sweeps.executors.base import Attempt
from farm_ar.sweeps.leases import Presence, is_alive
from farm_ar.sweeps.results import KILLS, Failure, as_csv

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the runs are forked and killed by signals")

MODULES = Path(__file__).parent / "modules"
PATHS = [str(Path(__file__).parents[2]), str(MODULES)]


def kill_runs(what, folder):
    program = f"import runpy, sys; sys.path[:0] = {PATHS!r}; sys.argv[:] = ['', {what!r}, {str(folder)!r}]; "
    program += f"runpy.run_path({str(MODULES / 'kill_runs.py')!r}, run_name='__main__')"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout.splitlines()[-1]), run.stderr


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The results of a run that nothing happens to: as CSV, and as they stand in the file."""
    folder = tmp_path_factory.mktemp("undisturbed")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(MODULES)
        run_sweep(Sweep("killed", "sweep_functions:slow", grid(x=range(250))), folder / "store")
    return contents(folder / "store")


def contents(file):
    with Store(file, create=False) as store:
        table = as_csv(store.results("killed"))
    with sqlite3.connect(file) as connection:
        rows = connection.execute("SELECT key, rows FROM results ORDER BY key").fetchall()
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert connection.execute("SELECT count(*) FROM times").fetchone() == (250,)
        assert connection.execute("SELECT count(*) FROM claims").fetchone() == (0,)
    connection.close()
    return table, rows


@pytest.mark.parametrize(("how", "kills"), [("serial", 42), ("process", 8)])
def test_runs_killed_at_random_moments_leave_the_bytes_of_an_undisturbed_run(
    tmp_path, undisturbed, how, kills
):
    said, _ = kill_runs(how, tmp_path)
    assert said == {"killed": kills, "well": [True]}
    for file in tmp_path.iterdir():
        assert contents(file) == undisturbed, "and no file of a killed run is left beside a store"


def test_two_runs_on_one_store_share_the_units_and_compute_none_twice(tmp_path, undisturbed):
    said, errors = kill_runs("together", tmp_path)
    assert said == {"well": [True, True]}, errors
    assert sorted(map(int, (tmp_path / "log").read_text().split())) == list(range(250))
    table, rows = contents(tmp_path / "store")
    assert [json.loads(text) for _, text in rows] != []
    assert without_parameters(table) == without_parameters(undisturbed[0])


def test_a_run_takes_over_what_a_killed_one_had_claimed(tmp_path, undisturbed):
    said, errors = kill_runs("survivor", tmp_path)
    assert said == {"well": [False, True]}, errors
    assert set(map(int, (tmp_path / "log").read_text().split())) == set(range(250))
    assert without_parameters(contents(tmp_path / "store")[0]) == without_parameters(undisturbed[0])


def without_parameters(table):
    return [line.split(",")[-2:] for line in table.splitlines()]


def test_a_full_disk_ends_with_one_error_and_a_store_that_goes_on_later(tmp_path):
    said, _ = kill_runs("full disk", tmp_path)
    expected = "must be on a disk with room left that can be read and written, got 'disk I/O error'"
    assert said == {"error": "StoreError", "message": f"{tmp_path / 'store'}: store: {expected}"}
    sweep = Sweep("killed", "sweep_functions:bulky", grid(x=range(250)))
    standings = []
    rows = run_sweep(sweep, tmp_path / "store", watch=standings.append).rows()
    assert standings[0].before > 0, "what was kept before the disk was full is kept"
    assert rows == run_sweep(sweep).rows()


def test_a_store_without_room_is_told_by_name(tmp_path):
    """SQLite's own limit stands for a disk that says that it is full."""
    sweep = Sweep("bulky", "sweep_functions:bulky", grid(x=range(100)))
    with Store(tmp_path / "store") as store:
        store._connection.execute("PRAGMA max_page_count = 60")
        with pytest.raises(StoreError) as problem:
            run_sweep(sweep, store, keep_every=0.001)
        assert str(problem.value) == (
            f"{tmp_path / 'store'}: store: must be on a disk with room left, got 'database or disk is full'"
        )
        assert 0 < len(store.results("bulky")) < 100
    assert run_sweep(sweep, tmp_path / "store").rows() == run_sweep(sweep).rows()


def test_a_locked_store_ends_with_one_error_and_nothing_lost(tmp_path):
    sweep = Sweep("doubles", "sweep_functions:double", grid(x=range(50)))
    other = sqlite3.connect(tmp_path / "store", isolation_level=None)

    def lock(standing):
        if standing.done == 10:
            other.execute("BEGIN IMMEDIATE")

    with Store(tmp_path / "store", timeout=0.05) as store:
        with pytest.raises(StoreError) as problem:
            run_sweep(sweep, store, watch=lock, keep_every=0.0)
        expected = "must not be locked by another program for so long, got 'database is locked'"
        assert str(problem.value) == f"{tmp_path / 'store'}: store: {expected}"
        other.execute("ROLLBACK")
        assert 5 < len(store.results("doubles")) <= 10
        assert run_sweep(sweep, store).rows() == run_sweep(sweep).rows()
    other.close()


def test_a_store_that_is_locked_when_it_is_opened_is_an_error_after_the_wait(tmp_path):
    Store(tmp_path / "store").close()
    other = sqlite3.connect(tmp_path / "store", isolation_level=None)
    other.execute("PRAGMA locking_mode = EXCLUSIVE")
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(StoreError, match="must not be locked by another program"):
        Store(tmp_path / "store", timeout=0.05)
    other.close()
    Store(tmp_path / "store").close()


def test_an_interruption_keeps_what_is_finished(tmp_path):
    sweep = Sweep("interrupted", "sweep_functions:interrupted", grid(x=range(4)))
    with pytest.raises(KeyboardInterrupt):
        run_sweep(sweep, tmp_path / "store", keep_every=60.0)
    with Store(tmp_path / "store") as store:
        assert [outcome.rows for _, outcome in store.results("interrupted").finished()] == [
            [{"x": 0}],
            [{"x": 1}],
        ]
    assert [file.name for file in tmp_path.iterdir()] == ["store"]


def test_a_run_waits_for_what_another_one_has_claimed(tmp_path):
    sweep = Sweep("doubles", "sweep_functions:double", grid(x=range(3)))
    keys = [unit.key for unit in sweep.units]
    with Store(tmp_path / "store") as store:
        store.plan("doubles", sweep.units)
        other = Presence(store.path)
        assert store.claim(other.token, keys, most=1, since=0.0).mine == {keys[0]}
        waited = []

        def end_the_other(standing):
            if standing.done == 2:
                waited.append(is_alive(store.path, other.token))
                if len(waited) == 3:
                    assert store.claimed(store.results("doubles")) == 1
                    other.end()

        assert run_sweep(sweep, store, watch=end_the_other).rows() == run_sweep(sweep).rows()
        assert waited[:3] == [True, True, True]
        assert store.claimed(store.results("doubles")) == 0


def test_a_unit_that_killed_its_worker_stays_claimed_until_it_is_quarantined(tmp_path):
    (unit,) = Sweep("doubles", "sweep_functions:double", grid(x=[0])).units
    with Store(tmp_path / "store") as store:
        store.plan("doubles", [unit])
        run, other = Presence(store.path), Presence(store.path)
        assert store.claim(run.token, [unit.key], most=1, since=0.0).mine == {unit.key}
        store.save([], [Failure(unit, "killed its worker", 1)])
        assert store.claim(other.token, [unit.key], most=1, since=0.0).others == {unit.key}
        assert store.claimed(store.results("doubles")) == 1
        store.save([], [Failure(unit, "killed its worker", KILLS)])
        assert store.claim(other.token, [unit.key], most=1, since=0.0).given_up == {unit.key}
        assert store.claimed(store.results("doubles")) == 0
        run.end()
        other.end()


def test_what_failed_or_was_quarantined_in_a_run_beside_is_not_tried_here(tmp_path):
    sweep = Sweep("fails", "sweep_functions:fails", grid(x=range(6)))
    calls = []

    class Other(SerialExecutor):
        """Before its first unit, lets another run do everything."""

        def submit(self, unit):
            if not calls:
                calls.append("other")
                run_beside()
            calls.append(unit.parameters["x"])
            super().submit(unit)

    def run_beside():
        keys = [unit.key for unit in sweep.units]
        with Store(tmp_path / "store") as beside:
            beside.claim("dead", keys, most=6, since=0.0)
        results = run_sweep(Sweep("beside", "sweep_functions:fails", grid(x=range(1, 6))), tmp_path / "store")
        assert len(results.failures) == 2

    results = run_sweep(sweep, tmp_path / "store", Other())
    assert calls == ["other", 0]
    assert [failure.unit.parameters["x"] for failure in results.failures] == [1, 4]
    assert len(results) == 4


def in_sqlite(file, statement):
    with contextlib.closing(sqlite3.connect(file)) as connection:
        connection.execute(statement)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda file: file.write_text("no database" * 100),
            "a sweep has made",
        ),
        (lambda file: file.mkdir(), "must be a plain file, got 'a folder'"),
        (lambda file: file.parent.joinpath("nothing"), "must be a file that a sweep has made"),
        (lambda file: in_sqlite(file, "CREATE TABLE a (b)"), "must be a store of form 1"),
        (lambda file: in_sqlite(file, "PRAGMA user_version = 9"), "must be a store of form 1"),
    ],
)
def test_what_is_no_store_is_refused_and_left_as_it_is(tmp_path, make, message):
    file = tmp_path / "store"
    make(file)
    before = file.read_bytes() if file.is_file() else None
    with pytest.raises(StoreError, match=message):
        Store(file, create=file.is_dir())
    assert (file.read_bytes() if file.is_file() else None) == before


def test_the_folder_of_a_store_is_made_unless_something_is_in_its_way(tmp_path):
    Store(tmp_path / "some" / "where" / "store").close()
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="must be in a folder that can be written"):
        Store(tmp_path / "file" / "store")


def test_a_sweep_that_the_store_does_not_have_is_refused(tmp_path):
    with Store(tmp_path / "store") as store:
        store.plan("doubles", Sweep("doubles", "sweep_functions:double", grid(x=(1,))).units)
        with pytest.raises(StoreError, match="sweep: must be one of the store's: doubles, got 'triples'"):
            store.results("triples")


def test_an_empty_file_that_is_being_read_is_waited_for(tmp_path):
    reader = sqlite3.connect(tmp_path / "store", isolation_level=None)
    reader.execute("BEGIN")
    reader.execute("SELECT * FROM sqlite_master")
    with pytest.raises(StoreError, match="must not be locked by another program"):
        Store(tmp_path / "store", timeout=0.05)
    reader.execute("COMMIT")
    reader.close()
    Store(tmp_path / "store").close()


def test_a_mistake_of_ours_in_a_statement_is_no_error_of_the_store(tmp_path):
    with (
        Store(tmp_path / "store") as store,
        pytest.raises(sqlite3.OperationalError, match="no such table"),
    ):
        store._run("SELECT * FROM nowhere", [])


@pytest.mark.parametrize("taken", ["locked", "removed"])
def test_a_run_whose_file_was_taken_for_a_dead_ones_makes_another(tmp_path, monkeypatch, taken):
    lock, files = leases._lock, []

    def disturbed(file, mode):
        files.append(file)
        if len(files) > 1:
            return lock(file, mode)
        if taken == "locked":
            other.append(lock(file, mode))
        elif mode == "rwc":
            connection = lock(file, mode)
            file.unlink()
            return connection
        return lock(file, mode)

    other = []
    monkeypatch.setattr(leases, "_lock", disturbed)
    presence = Presence(tmp_path / "store")
    assert len(set(files)) == 2
    assert is_alive(tmp_path / "store", presence.token)
    presence.end()
    assert not is_alive(tmp_path / "store", presence.token)
    for connection in other:
        connection.close()


def test_the_file_that_a_killed_run_left_goes_with_the_next_run(tmp_path):
    (tmp_path / "store-run-0123456789ab").touch()
    (tmp_path / "store-running-order").touch()
    run_sweep(Sweep("doubles", "sweep_functions:double", grid(x=(1,))), tmp_path / "store")
    assert {file.name for file in tmp_path.iterdir()} == {"store", "store-running-order"}


def test_a_run_cannot_be_alive_where_no_file_can_be_made(tmp_path):
    with pytest.raises(sqlite3.OperationalError, match="unable to open database file"):
        Presence(tmp_path / ("x" * 240))


def test_results_are_never_taken_for_whole_while_units_are_missing(tmp_path):
    sweep = Sweep("doubles", "sweep_functions:double", grid(x=range(3)))
    with Store(tmp_path / "store") as store:
        store.plan("doubles", sweep.units)
        with pytest.raises(UnfinishedSweepError, match="3 of its units gave no result") as problem:
            store.results("doubles").rows()
        assert "not run yet, or its result was removed" in str(problem.value)

        def start_over(standing):
            if standing.done == 3:
                store.plan("doubles", sweep.units, fresh=True)

        with pytest.raises(UnfinishedSweepError):
            run_sweep(sweep, store, watch=start_over, keep_every=0.0).rows()


def test_what_is_in_the_store_wins_over_what_comes_later(tmp_path):
    (unit,) = Sweep("doubles", "sweep_functions:double", grid(x=(1,))).units
    with Store(tmp_path / "store") as store:
        store.plan("doubles", [unit])
        for number in (1, 2):
            store.save([Attempt(unit, rows=f'[{{"n":{number}}}]', seconds=float(number))])
        results = store.results("doubles")
    assert (results.rows(), dict(results.seconds)) == ([{"n": 1}], {unit.key: 1.0})
