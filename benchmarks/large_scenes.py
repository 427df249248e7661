"""Identification among very many labels: time, proof and memory; and that it is the optimum.

    python benchmarks/large_scenes.py [--snapshots 1000] [--most 1000000]

200 detections of neighbouring objects, shifted with an SD of half the labels' spacing, a tenth of them moved
anywhere. The option `certify` begins with the labels nearest to each detection and adds farther ones until
the duals prove that no other label is of use. Of 10 000 labels, `--snapshots` answers are compared with the
optimum by SciPy over all 2 million costs.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from farm_ar.reid import SpatialOptions, SpatialReid
from farm_ar.reid.assignment import solve_lsap
from farm_ar.scenes import Camera, Detections, Layout, Scene, Snapshot

DETECTIONS, ANYWHERE, TURN_SD = 200, 0.1, 0.3
CURVE = (1_000, 10_000, 100_000, 1_000_000)
SPACING = 0.5
"""Mean distance of points, one a square metre at random, to the nearest other one."""


def warehouse(labels: int, rng: np.random.Generator) -> Scene:
    """Boxes at random, one a square metre, all alike."""
    side = float(np.sqrt(labels))
    layout = Layout(
        labels=tuple(map(str, range(labels))),
        category=("box",) * labels,
        position=rng.uniform(0, side, (labels, 2)),
        yaw=rng.uniform(-np.pi, np.pi, labels),
        size=np.tile([0.4, 0.4, 0.4], (labels, 1)),
    )
    return Scene("warehouse", (side, side), layout)


def snapshot_of(scene: Scene, rng: np.random.Generator) -> Snapshot:
    """What is nearest to a random place, shifted; some of it has gone anywhere."""
    layout, side = scene.layout, scene.size[0]
    camera = rng.uniform(0, side, 2)
    near = np.linalg.norm(layout.position - camera, axis=1).argpartition(DETECTIONS - 1)[:DETECTIONS]
    position = layout.position[near] + rng.normal(0, SPACING / 2, (DETECTIONS, 2))
    gone = rng.random(DETECTIONS) < ANYWHERE
    position[gone] = rng.uniform(0, side, (int(gone.sum()), 2))
    yaw = layout.yaw[near] + rng.normal(0, TURN_SD, DETECTIONS)
    seen = Detections(("box",) * DETECTIONS, position, yaw, layout.size[near])
    return Snapshot(Camera(camera, np.asarray(0.0)), seen)


def resident() -> float:
    """Memory of this process, MiB."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return int(next(line for line in lines if line.startswith("VmRSS")).split()[1]) / 1024


def measured(labels: int, snapshots: int = 50, compared: int = 0) -> list[str]:
    """A row of the table: times in processor time of one core, of a process of its own."""
    rng = np.random.default_rng(labels)
    small = SpatialReid(warehouse(1000, rng), SpatialOptions(certify=True))
    small.identify(snapshot_of(small.scene, rng))  # compiled before anything is timed
    scene = warehouse(labels, rng)
    before = resident()
    begun = time.process_time()
    reid, plain = SpatialReid(scene, SpatialOptions(certify=True)), SpatialReid(scene)
    reid.identify(snapshot_of(scene, rng))  # the index is made when it is first needed
    index = time.process_time() - begun
    grown = resident() - before
    times, equal, considered = [], 0, []
    for k in range(max(snapshots, compared)):
        one = snapshot_of(scene, rng)
        begun = time.process_time()
        found = reid.identify(one)
        times.append(time.process_time() - begun)
        considered.append(len(found.candidates))
        if k < compared:
            cost = plain.cost_matrix(one.detections)
            best = cost[np.arange(DETECTIONS), solve_lsap(cost)].sum()
            equal += abs(best - found.total) < 1e-9 * (1 + best)
    middle, high = 1e3 * np.median(times), 1e3 * np.percentile(times, 99)
    proof = f"{equal} of {compared}" if compared else "proven, not compared"
    return [
        f"{labels:,}",
        f"{middle:.2g} ms",
        f"{high:.2g} ms",
        f"{np.mean(considered):,.0f}",
        f"{1e3 * index:,.0f} ms",
        f"{grown:,.0f} MiB",
        proof,
    ]


def rows(snapshots: int, most: int) -> Sequence[list[str]]:
    """The table's rows, each from a process of its own, so that memory is its own."""
    found = []
    for labels in (one for one in CURVE if one <= most):
        compared = snapshots if labels <= 10_000 else 0
        command = [sys.executable, __file__, "--one", str(labels), "--snapshots", str(compared)]
        found.append(subprocess.run(command, check=True, capture_output=True, text=True).stdout.split("|"))
    return [[cell.strip() for cell in row] for row in found]


HEADER = ["labels", "median", "99th percentile", "labels considered", "index", "its memory", "the optimum"]
TITLE = f"Many labels, {DETECTIONS} detections"
NOTE = (
    "`SpatialReid` with `certify=True`, from the snapshot to the proven optimum, processor time; shifts of "
    "SD half the labels' spacing, 10% moved anywhere. The index is made once for a scene, at the first "
    "snapshot (which is counted with it). The optimum: how many answers cost what SciPy finds with all costs."
)


def main() -> None:
    """Measure and print."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--snapshots", type=int, default=1000, help="compared with the optimum")
    options.add_argument("--most", type=int, default=CURVE[-1], help="labels")
    options.add_argument("--one", type=int, help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.one:
        print("|".join(measured(given.one, compared=given.snapshots)))
        return
    print(f"{TITLE} (load {os.getloadavg()[0]:.1f})")
    for row in (HEADER, *rows(given.snapshots, given.most)):
        print("".join(f"{cell:>20}" for cell in row), flush=True)


if __name__ == "__main__":
    main()
