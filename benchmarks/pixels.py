"""Identities from pixels: how often methods are right, and whether they know, beside the oracle.

    python benchmarks/pixels.py [--visits N] [--seed N]

Random visits to the farm: buildings are moved and turned, the headset takes one picture. Each method gets the
snapshot as it truly is, with noise as measured, and as estimated from the picture, without and with what is
known of each pose's errors. AUROC and ECE are of a method's confidence.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np

from farm_ar.game_logic.perception import OraclePerception, Perceived
from farm_ar.reid import REIDENTIFIERS
from farm_ar.reid.plausibility.finding import some
from farm_ar.scenes import Snapshot, builtin_scene
from farm_ar.vision.measured_noise import MeasuredPerception, in_picture, moments_of
from farm_ar.vision.perception import PixelPerception, source_of

METHODS = ("spatial", "likelihood", "adaptive")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--visits", type=int, default=300)
    parser.add_argument("--seed", type=int, default=30)
    asked = parser.parse_args()
    scene = builtin_scene("farm")
    pixels, oracle, measured = PixelPerception(scene), OraclePerception(), MeasuredPerception()
    moments = moments_of(scene, asked.visits, asked.seed)
    kinds: dict[str, list[Perceived]] = {
        name: [] for name in ("oracle", "measured noise", "pixels, poses alone", "pixels")
    }
    print(f"Perceiving {len(moments)} visits ...", flush=True)
    for number, (truth, camera) in enumerate(moments):
        rng = np.random.default_rng(np.random.SeedSequence(asked.seed, spawn_key=(number, 1)))
        kinds["oracle"].append(
            only_in_picture(oracle.perceive(truth, camera, rng), in_picture(truth, camera))
        )
        kinds["measured noise"].append(measured.perceive(truth, camera, rng))
        found = pixels.look(truth, camera, rng)[0]
        source = source_of(found.detections.category, found.detections.position, truth)
        kinds["pixels, poses alone"].append(Perceived(Snapshot(camera, found.detections), source))
        kinds["pixels"].append(Perceived(Snapshot(camera, found.uncertain), source))
    print("| method | perception | detections | false | right | AUROC | ECE |")
    print("|---|---|---|---|---|---|---|")
    for method in METHODS:
        for kind, several in kinds.items():
            print(
                row(method, kind, several, REIDENTIFIERS[method](scene).identify, scene.layout.labels),
                flush=True,
            )


def only_in_picture(perceived: Perceived, there: np.ndarray) -> Perceived:
    """The oracle's detections of what the picture shows."""
    kept = np.flatnonzero(there[perceived.source])
    return Perceived(some(perceived.snapshot, kept), perceived.source[kept])


def row(
    method: str,
    kind: str,
    several: list[Perceived],
    identify: Callable[[Snapshot], object],
    labels: tuple[str, ...],
) -> str:
    """A row of the table."""
    right, confidence, false = [], [], 0
    for one in several:
        if not len(one.source):
            continue
        answer = identify(one.snapshot)
        for given, sure, source in zip(answer.labels, answer.confidence, one.source.tolist(), strict=True):
            false += source < 0
            right.append(given == (labels[source] if source >= 0 else None))
            confidence.append(sure)
    good, sure = np.array(right, bool), np.array(confidence, float)
    known = np.isfinite(sure).all()
    auroc, error = (f"{area(sure, good):.3f}", f"{calibration(sure, good):.3f}") if known else ("", "")
    shares = f"{false / max(len(good), 1):.1%} | {good.mean():.1%}"
    return f"| {method} | {kind} | {len(good)} | {shares} | {auroc} | {error} |"


def area(sure: np.ndarray, right: np.ndarray) -> float:
    """Probability that a right answer has more confidence than a wrong one."""
    if right.all() or not right.any():
        return float("nan")
    rank = np.argsort(np.argsort(sure, kind="stable"), kind="stable") + 1.0
    for value in np.unique(sure):
        same = sure == value
        rank[same] = rank[same].mean()
    number = right.sum()
    return float((rank[right].sum() - number * (number + 1) / 2) / (number * (~right).sum()))


def calibration(sure: np.ndarray, right: np.ndarray, bins: int = 10) -> float:
    """Expected calibration error."""
    kind = np.minimum((sure * bins).astype(int), bins - 1)
    parts = [(kind == k) for k in range(bins) if (kind == k).any()]
    return float(sum(part.mean() * abs(right[part].mean() - sure[part].mean()) for part in parts))


if __name__ == "__main__":
    main()
