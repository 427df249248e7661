"""How fast detections are identified, all of it in one run and as ratios within it.

    python benchmarks/identification.py [--write]

Prints the tables; with --write also makes docs/speed.md of them.
"""

from __future__ import annotations

import argparse
import gc
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from statistics import median

import large_scenes
import lp_solve
import numba
import numpy as np
from cp_sat import solve_cp_sat

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.reid import LikelihoodReid, RelationalReid, SpatialOptions, SpatialReid, assignment
from farm_ar.reid.assignment import assessment, solve_lsap, solve_mip
from farm_ar.scenes import (
    Camera,
    Detections,
    Layout,
    LayoutNoise,
    Scene,
    Site,
    Snapshot,
    SnapshotBatch,
    builtin_scene,
)

Size = tuple[int, int]
SIZES: tuple[Size, ...] = ((3, 10), (8, 29), (14, 52), (50, 200), (200, 1000))
BUILTIN = {10: "pantry", 29: "classroom", 52: "H1"}
NOISE = LayoutNoise.of(0.3, 30.0)
SECONDS = 1.5
"""How long each thing is measured, if it does not take longer once."""
MOST_REPEATS = 500
BLOCK = 10
COMPILING = 20.0
"""How many times as long as that a first call may take, and is made once more: it may have compiled."""
PAIRS = 5


def solve_compiled(cost: FloatArray) -> IntArray:
    n, m = cost.shape
    column = np.empty(n, dtype=np.int64)
    assignment.assign(cost, column, np.empty(n), np.empty(m))
    return column


LP_SOLVE, CP_SAT, LSAP = "lp_solve 5.5", "CP-SAT (OR-Tools)", "`lsap`: SciPy"
SOLVERS: dict[str, Callable[[FloatArray], IntArray]] = {
    LP_SOLVE: lp_solve.solve_lp_solve,
    CP_SAT: solve_cp_sat,
    "`mip`: SCIP (OR-Tools)": solve_mip,
    LSAP: solve_lsap,
    "compiled `assign`": solve_compiled,
}
TOO_LONG = {(CP_SAT, (200, 1000)): "not run: 5 min"}
"""What takes minutes is not run; the time is from a run by hand."""


@dataclass
class Table:
    """A table of text, with what is to be said of it."""

    title: str
    header: Sequence[str]
    rows: list[list[str]]
    note: str

    def markdown(self) -> str:
        """The table as a section of a page."""
        lines = [self.header, ["---", *["---:"] * (len(self.header) - 1)], *self.rows]
        table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
        return f"## {self.title}\n\n{table}\n\n{self.note}\n"


def scene_with(labels: int) -> Scene:
    """A scene with that many objects: a built-in one, or a larger room as crowded as the classroom."""
    if labels in BUILTIN:
        return builtin_scene(BUILTIN[labels])
    rng = np.random.default_rng(labels)
    side = float(np.sqrt(labels * builtin_scene("classroom").area / 29))
    layout = Layout(
        labels=tuple(str(i) for i in range(labels)),
        category=("chair",) * labels,
        position=rng.uniform(0, side, (labels, 2)),
        yaw=rng.integers(0, 4, labels) * np.pi / 2 + rng.normal(0, 0.1, labels),
        size=np.tile([0.5, 0.9, 0.5], (labels, 1)),
    )
    sites = tuple(Site(f"S{s}", *rng.uniform(0, side, 2)) for s in range(labels // 5))
    return Scene(f"{labels} chairs", (side, side), layout, sites)


def of_several_categories(scene: Scene) -> Scene:
    """The scene with its objects made to be of four categories and sizes."""
    code = np.arange(len(scene.layout)) % 4
    size = scene.layout.size * (1.0 + 0.25 * code)[:, None]
    return replace(
        scene, layout=replace(scene.layout, category=tuple(f"category {c}" for c in code), size=size)
    )


def snapshots_of(scene: Scene, detections: int, count: int) -> list[Snapshot]:
    """Snapshots of a disturbed layout: each has the objects nearest to a random camera."""
    rng = np.random.default_rng(1)
    known = scene.layout
    result = []
    for _ in range(count):
        noisy = NOISE.disturb(known, scene.size, rng)
        camera = rng.uniform(0, scene.size)
        near = np.linalg.norm(noisy.position - camera, axis=1).argsort()[:detections]
        category = tuple(known.category[i] for i in near)
        seen = Detections(category, noisy.position[near], noisy.yaw[near], known.size[near])
        result.append(Snapshot(Camera(camera, np.array(0.0)), seen))
    return result


@dataclass
class Measured:
    """How long the calls of one thing took, seconds."""

    calls: Sequence[Callable[[], object]]
    times: list[float] = field(default_factory=list)

    def call(self, number: int) -> None:
        """Measure the next `number` calls, from the first one on, and again when all had their turn."""
        for _ in range(number):
            call = self.calls[len(self.times) % len(self.calls)]
            begin = time.perf_counter()
            call()
            self.times.append(time.perf_counter() - begin)

    @property
    def typical(self) -> float:
        """Median time, seconds."""
        return median(self.times)


def interleaved(
    calls: Mapping[str, Sequence[Callable[[], object]]], seconds: float = SECONDS
) -> dict[str, Measured]:
    """Measure each name's calls, ten of one name and then ten of the next, over and over.

    So a slow moment of the machine slows all alike. A call or two warm up, also where the first one had to
    compile, and say how often each can be repeated in the seconds given; of what takes longer than that, the
    last of these is the only one.
    """
    measured = {name: Measured(some) for name, some in calls.items()}
    repeats = dict.fromkeys(calls, 1)
    gc.disable()
    try:
        for name, one in measured.items():
            one.call(1)
            if one.times[0] > COMPILING * seconds:  # what takes so long is not compiling
                continue
            one.times.clear()
            one.call(1)
            if one.times[0] < seconds:
                repeats[name] = max(1, min(MOST_REPEATS, int(seconds / one.times.pop())))
                one.times.clear()
        while any(len(measured[name].times) < number for name, number in repeats.items()):
            for name, one in measured.items():
                one.call(min(BLOCK, repeats[name] - len(one.times)))
    finally:
        gc.enable()
    return measured


@dataclass
class Solving:
    """One problem for one solver, whose answer must be the optimum."""

    solve: Callable[[FloatArray], IntArray]
    cost: FloatArray
    answer: IntArray | None = None

    def __call__(self) -> None:
        """Solve it."""
        self.answer = self.solve(self.cost)

    def check(self, name: str) -> None:
        """End the run if the problem was solved, but not to its optimum."""
        if self.answer is None:
            return
        rows = np.arange(len(self.cost))
        best, found = (self.cost[rows, column].sum() for column in (solve_lsap(self.cost), self.answer))
        if len(set(self.answer.tolist())) < len(rows) or abs(found - best) > 1e-6:
            sys.exit(f"{name} found {found}, not the optimum {best}, of a problem of size {self.cost.shape}")


def in_units(seconds: float) -> str:
    for unit, name in ((1.0, "s"), (1e-3, "ms")):
        if seconds >= unit:
            return f"{seconds / unit:.3g} {name}"
    return f"{seconds * 1e6:.3g} µs"


def share(value: float, of: float) -> str:
    return f"{value / of:.2g}" if value < 10 * of else f"{value / of:.0f}"


def with_share(value: float, of: float | None) -> str:
    return in_units(value) if of is None else f"{in_units(value)} ({share(value, of)})"


def solvers_table() -> Table:
    """Each solver on the same cost matrices."""
    known = {name: solve for name, solve in SOLVERS.items() if name != LP_SOLVE or lp_solve.AVAILABLE}
    rows = {name: [name] for name in SOLVERS}
    for size in SIZES:
        scene = scene_with(size[1])
        reid = SpatialReid(scene)
        costs = [reid.cost_matrix(snapshot.detections) for snapshot in snapshots_of(scene, size[0], 50)]
        run = {name: solve for name, solve in known.items() if (name, size) not in TOO_LONG}
        problems = {name: [Solving(solve, cost) for cost in costs] for name, solve in run.items()}
        measured = interleaved(problems)
        yardstick = measured[LP_SOLVE].typical if LP_SOLVE in measured else None
        for name in SOLVERS:
            if name in measured:
                for problem in problems[name]:
                    problem.check(name)
                rows[name].append(with_share(measured[name].typical, yardstick))
            else:
                rows[name].append(TOO_LONG.get((name, size), "not installed"))
    return Table(
        "Solvers",
        ["solver", *(f"{n} x {m}" for n, m in SIZES)],
        list(rows.values()),
        "Median time to solve one assignment of N detections to M labels, the building of a model included; "
        "in parentheses its ratio to lp_solve's. All found the same optimum of every problem. The costs are "
        "those of pantry, classroom, H1 and two larger rooms as crowded as the classroom, with noise "
        "T(0, 0.3) and R(0, 30). lp_solve, CP-SAT and SCIP solve the paper's binary programme, each on one "
        f"thread. What takes more than {SECONDS:g} s was run once.",
    )


def relational_table() -> Table:
    """`LikelihoodReid` and `RelationalReid` of few and of a hundred, beside lp_solve alone."""
    rows = []
    for n, m in ((8, 29), (50, 100), (100, 100)):
        scene = scene_with(m)
        snapshots = snapshots_of(scene, n, 5)
        spatial = SpatialReid(scene)
        reids = {"likelihood": LikelihoodReid(scene), "relational": RelationalReid(scene)}
        calls: dict[str, list[Callable[[], object]]] = {
            name: [partial(reid.identify, one) for one in snapshots] for name, reid in reids.items()
        }
        if lp_solve.AVAILABLE:
            costs = [spatial.cost_matrix(one.detections) for one in snapshots]
            calls[LP_SOLVE] = [partial(lp_solve.solve_lp_solve, cost) for cost in costs]
        measured = interleaved(calls)
        yardstick = measured[LP_SOLVE].typical if lp_solve.AVAILABLE else None
        times = [with_share(measured[name].typical, yardstick) for name in reids]
        rows.append([f"{n} x {m}", "not installed" if yardstick is None else in_units(yardstick), *times])
    return Table(
        "`LikelihoodReid` and `RelationalReid`, noise unknown",
        ["size", LP_SOLVE, "`LikelihoodReid`", "`RelationalReid`"],
        rows,
        "Median time of `identify`; in parentheses its ratio to lp_solve's for the binary programme alone.",
    )


KERNEL = "the default's kernel alone"


def kernel_call(reid: SpatialReid, snapshot: Snapshot) -> Callable[[], object]:
    """The compiled costs and assignment of a snapshot, without what is made for them in Python."""
    asked: list[Callable[[], object]] = []
    kernel = assessment.assess_batch

    def heard(*problem: object) -> None:
        asked.append(partial(kernel, *problem))
        kernel(*problem)

    assessment.assess_batch = heard
    try:
        reid.identify(snapshot)
    finally:
        assessment.assess_batch = kernel
    return asked[0]


def identify_table() -> Table:
    """`identify` from the snapshot to the labels, beside lp_solve alone."""
    one_category = builtin_scene("classroom")
    variants = {
        "categories ignored": SpatialOptions(gate_categories=False),
        "categories kept apart (default)": SpatialOptions(),
        "categories ignored, pruned at 0.5": SpatialOptions(threshold=0.5, gate_categories=False),
        "categories kept apart, pruned at 0.75": SpatialOptions(threshold=0.75),
        "categories ignored, boxes along the world's axes": SpatialOptions(
            box="world", gate_categories=False
        ),
    }
    rows = {name: [name] for name in (*variants, KERNEL)}
    notes = []
    for title, scene in (("one", one_category), ("four", of_several_categories(one_category))):
        snapshots = snapshots_of(scene, 8, 50)
        costs = [SpatialReid(scene).cost_matrix(snapshot.detections) for snapshot in snapshots]
        reids = {name: SpatialReid(scene, options) for name, options in variants.items()}
        calls: dict[str, list[Callable[[], object]]] = {
            name: [partial(reid.identify, snapshot) for snapshot in snapshots] for name, reid in reids.items()
        }
        calls[KERNEL] = [kernel_call(SpatialReid(scene), snapshot) for snapshot in snapshots]
        alone: list[float] = []
        if lp_solve.AVAILABLE:
            calls[LP_SOLVE] = [partial(lp_solve.solve_lp_solve, cost, alone) for cost in costs]
        measured = interleaved(calls)
        yardstick = None
        if lp_solve.AVAILABLE:
            yardstick = measured[LP_SOLVE].typical
            notes.append(
                f"{in_units(yardstick)} ({in_units(median(alone))} of them in its `solve`) with {title}"
            )
        for name in rows:
            rows[name].append(with_share(measured[name].typical, yardstick))
    took = f"took {' and '.join(notes)}" if notes else "is not installed"
    return Table(
        "`SpatialReid.identify`, 8 detections and 29 labels",
        ["options", "one category", "four categories"],
        list(rows.values()),
        "Median time from the snapshot to the labels, costs included; in parentheses its ratio to lp_solve's "
        f"for the binary programme alone, which {took}. Margins and certificates are worked out when "
        "they are asked for. The goal is 1/35 (0.029) for the default, 1/60 (0.017) for the kernel.",
    )


def likelihood_table() -> Table:
    """`LikelihoodReid` with unknown noise, confidence and margin, beside lp_solve alone."""
    rows = []
    for n, m in SIZES[:3]:
        scene = scene_with(m)
        snapshots = snapshots_of(scene, n, 50)
        batch = SnapshotBatch.stack(snapshots)
        likelihood, spatial = LikelihoodReid(scene), SpatialReid(scene)
        costs = [spatial.cost_matrix(snapshot.detections) for snapshot in snapshots]
        likelihood.identify(snapshots[0])  # which compiles it, if need be
        calls: dict[str, list[Callable[[], object]]] = {
            "spatial": [partial(spatial.identify, snapshot) for snapshot in snapshots],
            "one": [partial(likelihood.identify, snapshot) for snapshot in snapshots],
            "many": [partial(likelihood.identify_many, batch)],
        }
        if lp_solve.AVAILABLE:
            calls[LP_SOLVE] = [partial(lp_solve.solve_lp_solve, cost) for cost in costs]
        measured = interleaved(calls)
        yardstick = measured[LP_SOLVE].typical if lp_solve.AVAILABLE else None
        rows.append(
            [
                f"{n} x {m}",
                "not installed" if yardstick is None else in_units(yardstick),
                with_share(measured["spatial"].typical, yardstick),
                with_share(measured["one"].typical, yardstick),
                with_share(measured["many"].typical / len(batch), yardstick),
            ]
        )
    return Table(
        "`LikelihoodReid`, noise unknown",
        ["size", LP_SOLVE, "`SpatialReid.identify`", "`identify`", "`identify_many`, per snapshot"],
        rows,
        "Median time from the snapshot to labels, probabilities, margins and runners-up, on one thread; in "
        "brackets its ratio to lp_solve's for the binary programme alone. The goal is at most 2.5 at 8 x 29.",
    )


def many_table() -> Table:
    """`identify_many` on one and two threads, beside a loop over `identify`."""
    rows, loads = [], []
    for n, m in ((3, 10), (8, 10), (8, 29), (14, 52), (50, 200)):
        scene = scene_with(m)
        reid = SpatialReid(scene)
        snapshots = snapshots_of(scene, n, 50)
        batch = SnapshotBatch.stack(snapshots * max(1, 20_000_000 // (n * m * len(snapshots))))
        loop = interleaved(
            {"loop": [partial(lambda r, some: [r.identify(one) for one in some], reid, snapshots)]}
        )
        pairs = []
        for _ in range(PAIRS + 1):  # the first pair warms up
            loads.append(os.getloadavg()[0])
            pairs.append([timed_on(threads, reid, batch) for threads in (1, 2)])
        one, two = (len(batch) / min(times) for times in zip(*pairs[1:], strict=True))
        once = len(snapshots) / loop["loop"].typical
        faster = max(alone / both for alone, both in pairs[1:])
        rates = (f"{once:,.0f}", f"{one:,.0f}", f"{two:,.0f}", f"{one / once:.1f}", f"{faster:.2f}")
        rows.append([f"{n} x {m}", *rates])
    return Table(
        "`SpatialReid.identify_many`",
        ["size", "`identify` in a loop", "one thread", "two threads", "one thread / loop", "two / one"],
        rows,
        f"Problems per second, from snapshots to labels: the best of {PAIRS} runs, in which one thread and "
        f"two take turns, and the best pair; load {min(loads):.1f} to {max(loads):.1f} meanwhile on "
        f"{os.cpu_count()} cores, so that two threads had less than two cores where it is above 0.3. "
        "Compiling is not counted.",
    )


def timed_on(threads: int, reid: SpatialReid, batch: SnapshotBatch) -> float:
    """Seconds that `identify_many` takes on so many threads."""
    usual = numba.config.NUMBA_NUM_THREADS
    numba.config.NUMBA_NUM_THREADS = threads
    try:
        begin = time.perf_counter()
        reid.identify_many(batch)
        return time.perf_counter() - begin
    finally:
        numba.config.NUMBA_NUM_THREADS = usual


def large_table(snapshots: int) -> Table:
    """Very many labels, of `large_scenes`."""
    found = [list(row) for row in large_scenes.rows(snapshots, large_scenes.CURVE[-1])]
    return Table(large_scenes.TITLE, large_scenes.HEADER, found, large_scenes.NOTE)


def start_table() -> Table:
    """The whole process of `farm-ar --help`, beside one that imports NumPy."""
    commands = {
        '`python -c "import numpy"`': [sys.executable, "-c", "import numpy"],
        "`farm-ar --help`": [sys.executable, "-m", "farm_ar", "--help"],
    }
    run = partial(subprocess.run, check=True, stdout=subprocess.DEVNULL)
    measured = interleaved({name: [partial(run, command)] for name, command in commands.items()}, seconds=5.0)
    base = next(iter(measured.values())).typical
    return Table(
        "Starting",
        ["command", "time", "ratio"],
        [[name, in_units(one.typical), share(one.typical, base)] for name, one in measured.items()],
        "Median of the whole process. The goal is at most 4.",
    )


def surroundings() -> str:
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba", "ortools"))
    busy = f" (load {os.getloadavg()[0]:.1f} when it began)" if hasattr(os, "getloadavg") else ""
    return (
        f"{platform.system()}, {os.cpu_count()} cores{busy}, Python {platform.python_version()}, {packages}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="make docs/speed.md of the tables")
    parser.add_argument("--optima", type=int, default=1000, help="answers among 10 000 labels to compare")
    given = parser.parse_args()
    write = given.write
    page = "# Speed\n\nMade by `python benchmarks/identification.py --write`: all measured in one run, with "
    page += f"{surroundings()}.\nThe ratios carry over to other machines better than the times.\n"
    print(page)
    large = partial(large_table, given.optima)
    for make in (
        solvers_table,
        identify_table,
        likelihood_table,
        relational_table,
        many_table,
        large,
        start_table,
    ):
        section = make().markdown()
        print(section, flush=True)
        page += f"\n{section}"
    if write:
        target = Path(__file__).parents[1] / "docs" / "speed.md"
        target.parent.mkdir(exist_ok=True)
        unfinished = target.with_suffix(".md.part")
        unfinished.write_text(page, encoding="utf-8")
        unfinished.replace(target)


if __name__ == "__main__":
    main()
