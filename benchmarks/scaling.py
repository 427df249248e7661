"""What a billion evaluations cost, in core-hours, and what one head can hand out to many machines.

    python benchmarks/scaling.py [--seconds 2] [--ray]

Rates are of processor time on one core, so that other work on the machine counts little: the best of three
rounds. The executors hand out units of some milliseconds in wall-clock time; with `--ray`, Ray too, on a
cluster of this machine.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import gymnasium as gym
import numpy as np
from service import place, seen

from farm_ar.agents.stress import StressOptions
from farm_ar.agents.stress.study import attack_case
from farm_ar.reid.registry import REIDENTIFIERS
from farm_ar.scenes import LayoutNoise, builtin_scene, observe_many
from farm_ar.sweeps import Executor, ProcessExecutor, RayExecutor, SerialExecutor, Sweep, grid, run_sweep
from farm_ar.sweeps.executors.base import Attempt, Stoppable
from farm_ar.sweeps.unit import Unit

BILLION = 1e9


def rate(work: Callable[[], int], seconds: float) -> float:
    """Evaluations a second of processor time: the best of three rounds, after one that compiles."""
    work()
    best = 0.0
    for _ in range(3):
        begin, done = time.process_time(), 0
        while time.process_time() - begin < seconds / 3:
            done += work()
        best = max(best, done / (time.process_time() - begin))
    return best


def one_by_one(name: str) -> Callable[[], int]:
    """Snapshots of 8 of 29 objects."""
    scene = place(29)
    reid, snapshot = REIDENTIFIERS[name](scene), seen(scene, 8, np.random.default_rng(0))

    def work() -> int:
        reid.identify(snapshot)
        return 1

    return work


def many(name: str) -> Callable[[], int]:
    """Snapshots along the classroom's camera path, a thousand at once."""
    room, rng = builtin_scene("classroom"), np.random.default_rng(0)
    noisy = LayoutNoise.of(0.3, 30.0).disturb(room.layout, room.size, rng)
    batch = observe_many(noisy, room.camera_path.cameras(1000, room.fov))
    reid = REIDENTIFIERS[name](room)

    def work() -> int:
        reid.identify_many(batch)
        return 1000

    return work


def queries(attack: str, reid: str) -> Callable[[], int]:
    """Queries of a stress test on the farm."""
    options = StressOptions(attacks=(attack,), reids=(reid,))

    def work() -> int:
        unit = {"scene": options.scene, "jitter": options.jitter, "case": 0, "reid": reid, "code": ""}
        found = attack_case(0, attack, options.queries, options.budget, [reid], **unit)
        return int(found.rows[0]["asked"])

    return work


def steps(env: gym.Env, number: int = 100) -> Callable[[], int]:
    """Steps of an environment under random moves, with resets."""
    env.reset(seed=0)
    env.action_space.seed(0)

    def work() -> int:
        for _ in range(number):
            _, _, terminated, truncated, _ = env.step(env.action_space.sample())
            if terminated or truncated:
                env.reset()
        return number

    return work


def batched_steps(name: str, number: int) -> Callable[[], int]:
    """Steps of a native batch, which uses all cores: processor time counts them all."""
    envs = gym.make_vec(name, num_envs=number, vectorization_mode="vector_entry_point", carry="lift")
    envs.reset(seed=0)
    envs.action_space.seed(0)

    def work() -> int:
        envs.step(envs.action_space.sample())
        return number

    return work


class Nowhere(Stoppable):
    """Does no work, and takes no time: what is left is the head's part."""

    capacity = 1000

    def __init__(self) -> None:
        self._units: list[Unit] = []

    def submit(self, unit: Unit) -> None:
        """Take a unit."""
        self._units.append(unit)

    def collect(self, seconds: float) -> Sequence[Attempt]:
        """All, as if done."""
        ended = [Attempt(unit, '[{"value":0.123456789}]', seconds=0.01) for unit in self._units]
        self._units = []
        return ended

    def stop(self) -> None:
        """Drop all."""
        self._units = []


def spin(seed: int, unit: int, ms: float) -> dict[str, int]:
    """A unit that computes for so long."""
    end = time.perf_counter() + ms / 1000
    value = unit + seed
    while time.perf_counter() < end:
        value = (value * 1_103_515_245 + 12_345) % 2_147_483_648
    return {"value": unit}


def swept(executor: Executor, units: int, ms: float) -> float:
    """Units a second of wall-clock time, from parameters to rows on disk."""
    with tempfile.TemporaryDirectory() as folder:
        sweep = Sweep("scaling", spin, grid(unit=range(units), ms=[ms]))
        begin = time.perf_counter()
        assert len(run_sweep(sweep, Path(folder) / "store", executor).rows()) == units
        return units / (time.perf_counter() - begin)


def print_rates(seconds: float) -> None:
    """Print what a billion of each costs."""
    rows = {
        "`spatial`, 8 of 29, one by one": one_by_one("spatial"),
        "`likelihood`, 8 of 29, one by one": one_by_one("likelihood"),
        "`adaptive`, 8 of 29, one by one": one_by_one("adaptive"),
        "`spatial`, classroom, a thousand at once": many("spatial"),
        "`likelihood`, classroom, a thousand at once": many("likelihood"),
        "stress query, `spatial`, random": queries("random", "spatial"),
        "stress query, `spatial`, ladder": queries("ladder", "spatial"),
        "stress query, `likelihood`, random": queries("random", "likelihood"),
        "step of `FarmToTable-v0`": steps(gym.make("FarmToTable-v0")),
        "step of `FarmToTable-v0`, 256 in a batch that lifts": batched_steps("FarmToTable-v0", 256),
        "step of `SceneLayout-v0`, 256 in a batch": batched_steps("SceneLayout-v0", 256),
    }
    print("| evaluation | a second on one core | core-hours for a billion |\n|---|---:|---:|")
    for name, work in rows.items():
        found = rate(work, seconds)
        print(f"| {name} | {found:,.0f} | {BILLION / found / 3600:,.1f} |", flush=True)


def print_handing_out(with_ray: bool) -> None:
    """Print what executors bring, and what a head can hand out."""
    print(f"\nThe head alone, of units that take no time: {swept(Nowhere(), 20_000, 0.0):,.0f} units/s")
    executors: dict[str, Executor] = {
        "serial": SerialExecutor(),
        "1 process": ProcessExecutor(1),
        "2 processes": ProcessExecutor(2),
    }
    if with_ray:
        executors["ray, 2 cores"] = own_cluster()
    print("\n| unit | " + " | ".join(executors) + " |\n|---|" + "---:|" * len(executors))
    for ms, units in ((1.0, 1000), (10.0, 300), (100.0, 40)):
        found = []
        for executor in executors.values():
            swept(executor, 20, ms)
            found.append(max(swept(executor, units, ms) for _ in range(2)) * ms / 1000)
        print(f"| {ms:g} ms | " + " | ".join(f"{one:.2f}" for one in found) + " |", flush=True)
    for executor in executors.values():
        executor.stop()


def own_cluster() -> RayExecutor:
    """A cluster on loopback, of this machine."""
    os.environ.setdefault("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    from ray.cluster_utils import Cluster

    head = {"num_cpus": 2, "object_store_memory": 80 * 2**20, "include_dashboard": False}
    return RayExecutor(Cluster(initialize_head=True, head_node_args=head).address)


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=2.0, help="of processor time for each rate")
    parser.add_argument("--ray", action="store_true", help="Ray as an executor, too")
    given = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}\n")
    print_rates(given.seconds)
    print_handing_out(given.ray)


if __name__ == "__main__":
    main()
