"""What a session learns: how much better the eleventh snapshot is identified after ten that were confirmed.

    python benchmarks/session.py [--places 100]

Each place keeps its habits: in one all is put back nearly where it was, in another all is moved about, in a
third few things go far, in a fourth all move forward. Every snapshot is confirmed and committed. The eleventh
is identified by the session and by the method as it comes, from the same layout.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.geometry import direction, in_view
from farm_ar.reid import AdaptiveReid, Identification, Session
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot

SNAPSHOTS = 10
"""That are confirmed."""

FOV = FieldOfView(0.35, 0.35, 1e3)
Habit = Callable[[FloatArray, FloatArray, np.random.Generator], tuple[FloatArray, FloatArray]]


def _spread(shift: float, turn_deg: float) -> Habit:
    def moved(place: FloatArray, yaw: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        turn = np.deg2rad(turn_deg) * rng.normal(size=len(yaw))
        return place + shift * rng.normal(size=place.shape), yaw + turn

    return moved


def _few_go_far(
    place: FloatArray, yaw: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    far = rng.random(len(yaw)) < 0.2
    anywhere = rng.uniform(place.min(axis=0), place.max(axis=0), place.shape)
    place = np.where(far[:, None], anywhere, place + 0.03 * rng.normal(size=place.shape))
    return place, np.where(far, rng.uniform(-np.pi, np.pi, len(yaw)), yaw + 0.05 * rng.normal(size=len(yaw)))


def _forward(place: FloatArray, yaw: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    after = yaw + 0.2 * rng.normal(size=len(yaw))
    length = 0.75 * (1 + 0.2 * rng.normal(size=len(yaw)))
    return place + length[:, None] * direction(after) + 0.05 * rng.normal(size=place.shape), after


PLACES: dict[str, Habit] = {
    "shifts of 10 cm, turns of 5 degrees": _spread(0.1, 5),
    "shifts of 20 cm, turns of 25 degrees": _spread(0.2, 25),
    "shifts of 40 cm, any turn": _spread(0.4, 180),
    "a fifth goes anywhere, the others stay": _few_go_far,
    "all go forward by 75 cm": _forward,
}
"""How things move in each kind of place, where there is half a metre to the next."""


def make_place(rng: np.random.Generator) -> tuple[FloatArray, FloatArray, tuple[str, ...], FloatArray]:
    """Positions with about half a metre to the next, headings, categories and sizes of a place."""
    n = int(rng.integers(8, 20))
    place = rng.uniform(0, np.sqrt(n), (n, 2))
    code = rng.integers(0, 2, n)
    sizes = rng.uniform(0.1, 0.3, (2, 3))[code]
    return place, rng.uniform(-np.pi, np.pi, n), tuple(f"kind {c}" for c in code), sizes


def look(
    layout: Layout, place: FloatArray, yaw: FloatArray, rng: np.random.Generator
) -> tuple[Snapshot, tuple[str, ...]]:
    """A snapshot of part of the place, with a few misses; and the true labels."""
    middle, reach = place.mean(axis=0), float(np.ptp(place, axis=0).max())
    facing = rng.uniform(-np.pi, np.pi)
    eye = middle - 0.6 * reach * direction(facing)
    seen = np.flatnonzero(
        in_view(place, eye, facing, FOV.left, FOV.right, FOV.range_m) & (rng.random(len(yaw)) > 0.03)
    )
    seen = rng.permutation(seen)
    detections = Detections(
        tuple(layout.category[i] for i in seen),
        place[seen] + 0.01 * rng.normal(size=(len(seen), 2)),
        yaw[seen] + 0.02 * rng.normal(size=len(seen)),
        layout.size[seen] * np.exp(0.05 * rng.normal(size=(len(seen), 3))),
    )
    return Snapshot(Camera(eye, facing, FOV), detections), tuple(layout.labels[i] for i in seen)


def scored(answer: Identification, truth: tuple[str, ...]) -> tuple[float, float, float]:
    """Accuracy, Brier score and mean confidence of an answer."""
    right = np.array([a == b for a, b in zip(answer.labels, truth, strict=True)])
    sure = answer.confidence
    assert answer.probability is not None
    columns = [answer.candidates.index(label) for label in truth]
    told = answer.probability[np.arange(len(truth)), columns]
    brier = (answer.probability**2).sum(axis=1) - 2 * told + 1
    return float(right.mean()), float(brier.mean()), float(sure.mean())


def eleventh(habit: Habit, seed: int) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """Scores of the eleventh snapshot with what was learnt, and without."""
    rng = np.random.default_rng(seed)
    place, yaw, category, size = make_place(rng)
    names = tuple(f"o{i}" for i in range(len(yaw)))
    session = Session(Scene("place", None, Layout(names, category, place, yaw, size)))
    for _ in range(SNAPSHOTS):
        place, yaw = habit(place, yaw, rng)
        snapshot, truth = look(session.scene.layout, place, yaw, rng)
        session.identify(snapshot)
        session.confirm(truth)
        session.commit()
    known = session.scene
    place, yaw = habit(place, yaw, rng)
    snapshot, truth = look(known.layout, place, yaw, rng)
    if not truth:
        return None
    return scored(session.identify(snapshot), truth), scored(AdaptiveReid(known).identify(snapshot), truth)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--places", type=int, default=100)
    places = parser.parse_args().places
    print("| place | accuracy | learnt | difference | Brier | learnt | difference |")
    print("|---|--:|--:|--:|--:|--:|--:|")
    for name, habit in PLACES.items():
        rows = [row for seed in range(places) if (row := eleventh(habit, seed)) is not None]
        learnt, plain = (np.array([row[k] for row in rows]) for k in (0, 1))
        gain = learnt - plain
        spread = 1.96 * gain.std(axis=0, ddof=1) / np.sqrt(len(gain))
        mean = gain.mean(axis=0)
        columns = [name]
        for k in (0, 1):
            columns += [f"{plain[:, k].mean():.3f}", f"{learnt[:, k].mean():.3f}"]
            columns.append(f"{mean[k]:+.3f} ± {spread[k]:.3f}")
        print(f"| {' | '.join(columns)} |", flush=True)


if __name__ == "__main__":
    main()
