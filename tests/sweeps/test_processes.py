"""Worker processes: what kills one, what becomes of its unit, and of all others."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from farm_ar.errors import OptionError
from farm_ar.sweeps import (
    Failure,
    ProcessExecutor,
    SerialExecutor,
    Store,
    Sweep,
    UnfinishedSweepError,
    grid,
    make_executor,
    run_sweep,
)
from farm_ar.sweeps.executors import process


def deadly(tmp_path, how, xs=(3,)):
    parameters = grid(x=range(6), deadly=[xs], how=[how], log=[str(tmp_path / "log")])
    return Sweep("deadly", "sweep_functions:dies", parameters)


def tried(tmp_path):
    return sorted(map(int, (tmp_path / "log").read_text().split()))


@pytest.mark.parametrize(
    ("how", "problem"),
    [
        ("signal", "its worker was ended by signal 9 (SIGKILL)"),
        ("exit", "its worker ended with exit code 7"),
        ("sleep", "killed after the time limit of 0.8 s"),
    ],
)
def test_a_unit_that_kills_its_worker_three_times_is_quarantined_and_the_others_finish(
    tmp_path, how, problem
):
    sweep = deadly(tmp_path, how)
    with ProcessExecutor(1, time_limit=0.8 if how == "sleep" else None) as executor:
        results = run_sweep(sweep, tmp_path / "store", executor)
        assert tried(tmp_path) == [0, 1, 2, 3, 3, 3, 4, 5], "three times, and no other unit twice"
        assert [unit.parameters["x"] for unit, _ in results.finished()] == [0, 1, 2, 4, 5]
        (failure,) = results.failures
        assert (failure.unit, failure.problem, failure.kills) == (sweep.units[3], problem, 3)
        assert failure.quarantined
        with pytest.raises(UnfinishedSweepError) as error:
            results.rows()
    lines = str(error.value).splitlines()
    assert lines[0] == "deadly: 1 of its units gave no result; all others are kept"
    assert lines[1].startswith('  quarantined, killed 3 workers: dies {"deadly":[3]')
    assert lines[1].endswith(f'"x":3}} seed 0: {problem}')


def test_what_is_quarantined_stays_so_until_another_try_is_asked_for(tmp_path):
    sweep = deadly(tmp_path, "exit")
    with ProcessExecutor(1) as executor:
        for number, options in ((8, {}), (8, {}), (11, {"retry": True}), (19, {"fresh": True})):
            results = run_sweep(sweep, tmp_path / "store", executor, **options)
            assert len(tried(tmp_path)) == number
            assert [failure.kills for failure in results.failures] == [3]


def test_kills_are_counted_across_runs(tmp_path):
    sweep = deadly(tmp_path, "exit")

    for number in (1, 2, 3):

        def give_up_at_once(standing, number=number):
            with Store(tmp_path / "store") as store:
                if store.kills([sweep.units[3].key]) == {sweep.units[3].key: number}:
                    raise KeyboardInterrupt

        with ProcessExecutor(1) as executor, pytest.raises(KeyboardInterrupt):
            run_sweep(sweep, tmp_path / "store", executor, watch=give_up_at_once)
        with Store(tmp_path / "store") as store:
            (failure,) = store.results("deadly").failures
        assert (failure.kills, failure.quarantined) == (number, number == 3)
        assert str(failure).startswith("to be tried again, " if number < 3 else "quarantined, ")


def test_a_unit_whose_worker_was_killed_from_outside_is_computed_by_another_one(tmp_path):
    sweep = Sweep("sleeps", "sweep_functions:sleeps_once", grid(file=[str(tmp_path / "pid")]))

    def kill_it(standing):
        if (tmp_path / "pid").exists():
            with contextlib.suppress(ProcessLookupError):
                os.kill(int((tmp_path / "pid").read_text()), signal.SIGKILL)

    with ProcessExecutor(1) as executor:
        (row,) = run_sweep(sweep, executor=executor, watch=kill_it).rows()
    assert row["pid"] != int((tmp_path / "pid").read_text())


def test_many_deaths_among_short_units_blame_nobody_else(tmp_path):
    deaths = (5, 40, 41)
    parameters = grid(x=range(100), deadly=[deaths], how=["exit"], log=[str(tmp_path / "log")])
    with ProcessExecutor(2) as executor:
        results = run_sweep(Sweep("deadly", "sweep_functions:dies", parameters), executor=executor)
    assert [failure.unit.parameters["x"] for failure in results.failures] == list(deaths)
    assert sorted(tried(tmp_path)) == sorted([*range(100), *deaths, *deaths])


def test_an_exception_ends_its_unit_only_and_is_tried_again_by_the_next_run(tmp_path):
    sweep = Sweep("fails", "sweep_functions:fails", grid(x=range(6)))
    for executor in (SerialExecutor(), ProcessExecutor(1)):
        standings = []
        with executor:
            results = run_sweep(sweep, tmp_path / "store", executor, watch=standings.append)
        assert [failure.unit.parameters["x"] for failure in results.failures] == [1, 4]
        assert all("ZeroDivisionError: no" in failure.problem for failure in results.failures)
        assert not any(failure.quarantined for failure in results.failures)
        assert results.failures[0].line() == 'failed: fails {"x":1} seed 0: ZeroDivisionError: no 1'
        assert (standings[-1].failures, standings[-1].left) == (2, 0)


def test_an_error_names_every_quarantined_unit_and_the_first_of_many_failed_ones():
    sweep = Sweep("fails", "sweep_functions:fails", grid(x=range(1, 121, 3)))
    failures = run_sweep(sweep).failures
    assert len(failures) == 40
    unit = Sweep("doubles", "sweep_functions:double", grid(x=(1,))).units[0]
    error = UnfinishedSweepError("fails", [*failures, Failure(unit, "its worker ended", kills=3)])
    lines = str(error).splitlines()
    assert lines[0] == "fails: 41 of its units gave no result; all others are kept"
    assert lines[1] == '  quarantined, killed 3 workers: double {"x":1} seed 0: its worker ended'
    assert lines[21] == '  failed: fails {"x":58} seed 0: ZeroDivisionError: no 58'
    assert lines[22:24] == ["  and 20 more", "The first of them in full:"]
    assert lines[24] == 'failed: fails {"x":1} seed 0: Traceback (most recent call last):'
    assert lines[-1] == "ZeroDivisionError: no 1"


def test_a_row_that_cannot_be_kept_is_a_failure_with_its_place():
    sweep = Sweep("returns", "sweep_functions:returns", grid(what=("text", "number", "complex")))
    problems = [failure.line() for failure in run_sweep(sweep).failures]
    assert [problem.partition("OptionError: ")[2][:30] for problem in problems] == [
        "result: must be a row, a list ",
        "result: must be a row, a list ",
        "rows[0].z: must be a JSON valu",
    ]


def test_the_time_limit_is_of_each_unit_and_not_of_those_that_wait():
    sweep = Sweep("sleeps", "sweep_functions:sleeps", grid(seconds=(0.0, 0.3, 0.31, 0.32, 0.33)))
    with ProcessExecutor(1, time_limit=1.2) as executor:
        assert len(run_sweep(sweep, executor=executor).rows()) == 5


def test_a_busy_worker_has_short_units_ahead_and_never_waits_behind_a_long_one():
    executor = ProcessExecutor(2)
    assert executor.capacity == 2
    executor._mean_seconds = 0.001
    assert 20 < executor.capacity < 200
    executor._mean_seconds = 1.0
    assert executor.capacity == 2


def test_units_larger_than_any_pipe_do_not_block():
    big = "x" * 300_000
    sweep = Sweep("big", "sweep_functions:echo", grid(text=[f"{i}{big}" for i in range(12)]))
    with ProcessExecutor(2) as executor:
        assert [row["text"] for row in run_sweep(sweep, executor=executor).rows()] == [
            f"{i}{big}" for i in range(12)
        ]


def test_workers_that_never_get_ready_end_the_run_with_an_error(monkeypatch):
    from sweep_functions import ends_at_once

    monkeypatch.setattr(process, "work", ends_at_once)
    with ProcessExecutor(1) as executor, pytest.raises(RuntimeError, match="3 workers in a row ended before"):
        run_sweep(Sweep("doubles", "sweep_functions:double", grid(x=(1,))), executor=executor)


def test_an_executor_serves_one_sweep_after_the_other_with_the_same_workers():
    with ProcessExecutor(1) as executor:
        pids = {
            run_sweep(Sweep("s", "sweep_functions:sleeps", grid(seconds=(t,))), executor=executor).rows()[0][
                "pid"
            ]
            for t in (0.0, 0.001)
        }
        worker = executor._workers[0].process
        assert pids == {worker.pid} != {os.getpid()}
    assert not worker.is_alive()


def test_workers_end_with_a_parent_that_was_killed(tmp_path):
    from multiprocessing import get_context

    from sweep_functions import run_and_tell

    parent = get_context("spawn").Process(target=run_and_tell, args=(tmp_path / "pid",))
    parent.start()
    until = time.monotonic() + 20
    while not (tmp_path / "pid").exists() and time.monotonic() < until:
        time.sleep(0.02)
    worker = int((tmp_path / "pid").read_text())
    parent.kill()
    parent.join()
    while time.monotonic() < until:
        try:
            os.kill(worker, 0)
        except ProcessLookupError:
            return
        if "Z" in state_of(worker):
            return
        time.sleep(0.02)
    pytest.fail("the worker outlived its parent")


def state_of(pid):
    """The state of a process as Linux tells it; a dead one may wait for init to take note of it."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return ""


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"workers": 0}, "workers: must be a whole number not below 1, got 0"),
        ({"workers": 1.5}, "workers: must be a whole number not below 1, got 1.5"),
        ({"time_limit": 0}, "time_limit: must be a positive number of seconds, got 0"),
        ({"time_limit": "1"}, "time_limit: must be a positive number of seconds, got '1'"),
        ({"name": "serial", "time_limit": 1.0}, "time_limit: must be None with the executor serial"),
        ({"name": "cloud"}, "executor: must be one of process, ray, serial, got 'cloud'"),
    ],
)
def test_executors_that_cannot_be_are_refused(options, message):
    with pytest.raises(OptionError) as problem:
        make_executor(**options)
    assert str(problem.value).startswith(message)


def test_executors_are_made_by_name():
    assert isinstance(make_executor("serial"), SerialExecutor)
    assert make_executor("process", 3).capacity == 3


WHERE = """
import sys
sys.path.insert(0, sys.argv[1])
from farm_ar.sweeps import ProcessExecutor, Sweep, run_sweep

def where(seed):
    import farm_ar
    return {"file": farm_ar.__file__}

if __name__ == "__main__":
    with ProcessExecutor(1) as executor:
        print(run_sweep(Sweep("where", where, [{}]), executor=executor).rows()[0]["file"])
"""


def test_workers_run_the_farm_ar_of_their_parent_wherever_it_was_found(tmp_path):
    here = Path(__file__).parents[2] / "farm_ar"
    shutil.copytree(here, tmp_path / "copy" / "farm_ar", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "where.py").write_text(WHERE)
    command = [sys.executable, str(tmp_path / "where.py"), str(tmp_path / "copy")]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.stdout.strip() == str(tmp_path / "copy" / "farm_ar" / "__init__.py"), run.stderr
