"""A Ray cluster as executor: on two machines (of this one), one of which is killed in between."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
import warnings
from collections import deque
from importlib.util import find_spec
from pathlib import Path

import pytest
from typer.testing import CliRunner

from farm_ar.cli.program import app
from farm_ar.errors import OptionError
from farm_ar.sweeps import RayExecutor, SerialExecutor, Store, Sweep, grid, make_executor, run_sweep
from farm_ar.sweeps.executors import ray
from farm_ar.sweeps.results import as_csv

MODULES = Path(__file__).parent / "modules"

# Ray's own processes may leave sockets and files to the collector of garbage.
pytestmark = [
    pytest.mark.skipif(find_spec("ray") is None, reason="ray is not installed (the extra distributed)"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


class Machines:
    """A cluster of two machines with a core each, all on loopback."""

    def __init__(self):
        from ray.cluster_utils import Cluster

        small = {"num_cpus": 1, "object_store_memory": 80 * 2**20}
        self._small = small
        self._cluster = Cluster(initialize_head=True, head_node_args={**small, "include_dashboard": False})
        self.address = self._cluster.address
        self._second = None

    def two(self):
        """See that there are two."""
        if self._second is None:
            self._second = self._cluster.add_node(**self._small)

    def another(self):
        """A third one, without any memory to speak of."""
        self._cluster.add_node(**self._small)

    def kill_one(self):
        """As if its plug were pulled: Ray's process and its workers all at once."""
        raylet = self._second.all_processes["raylet"][0].process.pid
        workers = Path(f"/proc/{raylet}/task/{raylet}/children").read_text().split()
        for process in (raylet, *workers):
            os.kill(int(process), signal.SIGKILL)
        self._cluster.remove_node(self._second, allow_graceful=False)
        self._second = None

    def end(self):
        self._cluster.shutdown()


@pytest.fixture(scope="module")
def machines():
    with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        patch.setenv("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")  # loopback alone
        patch.setattr("ray._private.ray_constants.ENABLE_RAY_CLUSTER", False)  # had it been imported before
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        patch.setenv("RAY_memory_monitor_refresh_ms", "0")
        patch.setenv("PYTHONPATH", os.pathsep.join([str(Path(__file__).parents[2]), str(MODULES)]))
        patch.syspath_prepend(MODULES)
        made = Machines()
        assert made.address.startswith("127.0.0.1:")
        yield made
        made.end()


@pytest.fixture(scope="module")
def shared(machines):
    """One executor, since each connection starts its own workers."""
    machines.two()
    with RayExecutor(machines.address) as executor:
        yield executor


@pytest.fixture
def cluster(machines, shared):
    machines.two()
    return shared


def contents(file, name):
    with Store(file, create=False) as store:
        table = as_csv(store.results(name))
    with sqlite3.connect(file) as connection:
        rows = connection.execute("SELECT key, rows FROM results ORDER BY key").fetchall()
    connection.close()
    return table, rows


def where(name, units, seed=0):
    return Sweep(name, "sweep_functions:where", grid(x=range(units)), seeds=[seed])


def machines_of(results):
    return {row["node"] for outcome in results.outcomes() for row in outcome.measured}


def test_a_machine_that_is_killed_costs_nothing_but_time(machines, cluster, tmp_path, caplog, capfd):
    seed = 0
    while len(machines_of(run_sweep(where("warm", 20, seed), executor=cluster))) < 2:  # both are at work
        seed += 1
        assert seed < 100
    sweep, killed = where("killed", 200), []

    def pull_the_plug(standing):
        if standing.done >= 60 and not killed:
            killed.append(standing.done)
            machines.kill_one()

    results = run_sweep(sweep, tmp_path / "one", cluster, watch=pull_the_plug)
    assert killed
    assert len(results) == 200
    assert results.failures == []
    assert len(machines_of(results)) == 2
    assert "a machine of the cluster was lost" in caplog.text
    assert capfd.readouterr().out == "", "where a command's results go"
    run_sweep(sweep, tmp_path / "two", SerialExecutor())
    assert contents(tmp_path / "one", "killed") == contents(tmp_path / "two", "killed")


def test_a_unit_that_loses_four_machines_is_given_up_and_its_neighbour_is_not():
    frail, sound = where("frail", 2).units
    executor = RayExecutor.__new__(RayExecutor)  # without a cluster
    executor._lost, executor._waiting = {}, deque()
    for task in ([frail, sound], [frail], [frail]):
        assert executor._on_a_lost_machine(ray._Task(task, 0.0)) == []
        assert list(executor._waiting) == task
        executor._waiting.clear()
    (given_up,) = executor._on_a_lost_machine(ray._Task([frail, sound], 0.0))
    assert (given_up.unit, given_up.killed) == (frail, True)
    assert list(executor._waiting) == [sound]


def test_a_machine_that_comes_later_gets_work(machines, cluster):
    before = cluster.capacity
    machines.another()
    end = time.monotonic() + 30
    while cluster.capacity <= before:
        assert time.monotonic() < end
        time.sleep(0.1)


def test_only_the_unit_that_kills_its_worker_three_times_is_quarantined(cluster, tmp_path):
    """Though it goes out in a task with others."""
    log = tmp_path / "log"
    parameters = grid(x=range(60), deadly=[[47]], how=["signal"], log=[str(log)])
    results = run_sweep(Sweep("deadly", "sweep_functions:dies", parameters), executor=cluster)
    (failure,) = results.failures
    assert (failure.unit.parameters["x"], failure.kills, failure.quarantined) == (47, 3, True)
    assert failure.problem == "its worker died (WorkerCrashedError)"
    assert len(results) == 59
    assert sum(x == 47 for x in map(int, log.read_text().split())) in (3, 4)


@pytest.mark.parametrize("how", ["sleep", "compute"])
def test_a_worker_that_overruns_the_time_limit_ends(tmp_path, how):
    """Also in compiled code that lets no other thread of Python run."""
    program = (
        "import sys; from sweep_functions import *; from farm_ar.sweeps.executors.process import pack_unit; "
        "from farm_ar.sweeps.executors.ray import run_units; "
        f"sweep = Sweep('endless', 'sweep_functions:endless', [{{'how': {how!r}}}], version='1'); "
        "run_units([pack_unit(sweep.units[0])], sys.path, 0.5)"
    )
    begin = time.monotonic()
    done = subprocess.run([sys.executable, "-c", program], check=False, cwd=MODULES, timeout=60)
    assert done.returncode == -signal.SIGALRM
    assert time.monotonic() - begin < 30


@pytest.mark.long
def test_a_unit_that_overruns_the_time_limit_on_a_cluster_is_quarantined(machines, tmp_path):
    machines.two()
    log = tmp_path / "log"
    parameters = grid(x=range(6), deadly=[[3]], how=["sleep"], log=[str(log)])
    with RayExecutor(machines.address, time_limit=2.0) as executor:
        results = run_sweep(Sweep("deadly", "sweep_functions:dies", parameters), executor=executor)
    (failure,) = results.failures
    assert (failure.unit.parameters["x"], failure.kills, failure.quarantined) == (3, 3, True)
    assert (
        failure.problem == "its worker died (WorkerCrashedError), or was ended after the time limit of 2.0 s"
    )
    assert len(results) == 5


def test_exceptions_and_other_code_are_told_as_by_processes(cluster):
    results = run_sweep(Sweep("fails", "sweep_functions:fails", grid(x=range(6))), executor=cluster)
    assert [failure.unit.parameters["x"] for failure in results.failures] == [1, 4]
    assert all("ZeroDivisionError: no" in failure.problem for failure in results.failures)
    assert all(failure.kills == 0 for failure in results.failures)


def test_an_executor_that_was_stopped_can_go_on(cluster):
    sweep = Sweep("doubles", "sweep_functions:double", grid(x=range(5)))
    cluster.stop()
    assert run_sweep(sweep, executor=cluster).rows() == run_sweep(sweep).rows()


def asked(*words):
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, result.output


@pytest.mark.long
def test_a_stress_test_gives_the_same_files_on_a_cluster(machines, cluster, tmp_path):
    words = ["stress", "--attack", "random", "--queries", 40, "--cases", 4]
    for name, more in (("cluster", ["--executor", "ray", "--address", machines.address]), ("here", [])):
        asked(*words, *more, "--out", tmp_path / name)
    for name in ("stress.csv", "stress.json"):
        assert (tmp_path / "cluster" / name).read_bytes() == (tmp_path / "here" / name).read_bytes()


@pytest.mark.long
def test_experiments_and_the_benchmark_give_the_same_files_on_a_cluster(machines, cluster, tmp_path):
    there = ["--executor", "ray", "--address", machines.address]
    commands = {
        "reproduce": ["fig7", "--quick", "--layouts", 1],
        "benchmark": ["spatial", "--quick", "--rows", "players-4s"],
    }
    for command, words in commands.items():
        for name, more in (("cluster", there), ("here", ["--executor", "serial"])):
            asked(command, *words, *more, "--out", tmp_path / name)
    names = [one.name for one in (tmp_path / "here").iterdir() if one.suffix in (".csv", ".json")]
    assert len(names) > 2
    for name in names:
        if "times" not in name:
            cluster, here = (without_times(tmp_path / folder / name) for folder in ("cluster", "here"))
            assert cluster == here, name


def without_times(path: Path) -> object:
    """What a file holds; of a benchmark's scores, what was not measured by a clock."""
    if path.name != "benchmark.json":
        return path.read_bytes()
    found = json.loads(path.read_text())
    for score in found["scores"]:
        assert score.pop("milliseconds") > 0
    return found


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--address", "127.0.0.1:1"], "--address: must be left out without --executor ray"),
        (["--executor", "ray", "--workers", "2"], "--workers: must be left out with --executor ray"),
        (["--executor", "serial", "--workers", "2"], "--workers: must be left out with --executor serial"),
        (["--executor", "threads"], "--executor: must be one of process, ray, serial"),
        (["--executor", "ray", "--address", "127.0.0.1:9"], "--address: must be of a Ray cluster that runs"),
    ],
)
def test_options_that_do_not_go_together_are_one_line(shared, tmp_path, words, said):
    shared.stop()
    result = CliRunner().invoke(app, ["stress", *words, "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert said in result.stderr


@pytest.mark.parametrize("address", ["127.0.0.1:9", "nowhere", "127.0.0.1:x", "127.0.0.1:99999"])
def test_where_no_cluster_answers_it_is_said(shared, address):
    shared.stop()
    with pytest.raises(OptionError, match="address: must be of a Ray cluster that runs"):
        make_executor("ray", address=address)


def test_without_the_package_a_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ImportError, match=r"pip install 'farm-ar\[distributed\]'"):
        make_executor("ray")
