"""How good an estimator is: frames with truth, what is matched with what, and one table."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment, nnls

from farm_ar.arrays import BoolArray, FloatArray, Record
from farm_ar.errors import SnapshotError
from farm_ar.geometry import wrap
from farm_ar.rendering import Mesh, View, model
from farm_ar.scenes.files import read_json
from farm_ar.vision.base import Image, PoseEstimates, PoseEstimator
from farm_ar.vision.photos import image_camera_from_dict, read_image

FOUND_M = 0.05
"""An estimate that is farther than this from every thing of its category is a false one."""

FLIPPED = np.deg2rad(20.0)
"""A heading that is wrong by more than this is counted as one that misleads."""

ROWS: dict[str, tuple[float, float]] = {
    "at least 60%": (0.6, 1.01),
    "40 to 60%": (0.4, 0.6),
    "10 to 40%": (0.1, 0.4),
}
"""Shares of a thing's pixels that are visible, from and below."""

CLAIMED = "at least 40%"
"""The row that counts, of all that are visible to so large a share."""


@dataclass(frozen=True, eq=False)
class Frame(Record):
    """An image and what stands there, T objects.

    Args:
        name: of its file.
        image: (H, W, 3).
        view: the camera.
        category: of each thing.
        position: (T, 2) metres.
        yaw: (T,) radians.
        visible: (T,) share of its pixels that the image shows.
        touching: (T,) whether it stands wall to wall with another.
        fixed: (T,) whether it never moves: those are not counted.
        hand_pixels: of the image that show a hand or its arm.
    """

    name: str
    image: Image
    view: View
    category: tuple[str, ...]
    position: FloatArray
    yaw: FloatArray
    visible: FloatArray
    touching: BoolArray
    fixed: BoolArray
    hand_pixels: int = 0


def frame_files(folder: Path, most: int | None = None) -> list[Path]:
    """The JSON files of a folder's frames, in order of their names.

    Raises:
        SnapshotError: there are none.
    """
    files = sorted(folder.glob("*.json"))[:most]
    if not files:
        expected = "must be a folder with frames, each an image and a .json file"
        raise SnapshotError("frames", expected, str(folder))
    return files


def read_frame(file: Path) -> Frame:
    """One frame, by its JSON file.

    Raises:
        SnapshotError: it cannot be read.
    """
    data = read_json(file, SnapshotError)
    try:
        camera = image_camera_from_dict({name: data[name] for name in ("camera", "intrinsics")}, file.name)
        things = data["objects"]
        return Frame(
            file.stem,
            read_image(file.with_name(data["image"])),
            camera.view,
            tuple(str(one["category"]) for one in things),
            np.array([(one["x"], one["z"]) for one in things], np.float64).reshape(-1, 2),
            np.deg2rad(np.array([one["yaw_deg"] for one in things], np.float64)),
            np.array([one["visible"] for one in things], np.float64),
            np.array([one["touching"] for one in things], bool),
            np.array([one.get("fixed", False) for one in things], bool),
            int(data.get("hand_pixels", 0)),
        )
    except (KeyError, TypeError, ValueError) as problem:
        if isinstance(problem, SnapshotError):
            raise
        expected = "must have camera, intrinsics, image and objects with their truth"
        raise SnapshotError("frame", expected, f"{type(problem).__name__}: {problem}", file.name) from None


class Matched(NamedTuple):
    """What an estimator found of a frame's objects.

    Attributes:
        found: (T,) whether each was found.
        away: (T,) how far from where it is, metres; NaN where it was not found.
        turned: (T,) by how much the heading is wrong, 0 to pi; NaN likewise.
        rescued: (T,) whether the runner-up heading is right.
        surprise: (T,) squared Mahalanobis distance of x, z and yaw from the truth; NaN likewise.
        false: estimates of what does not stand there.
        estimates: in all.
        seconds: that it took.
        order: (T,) index of the estimate, -1 where there is none.
    """

    found: BoolArray
    away: FloatArray
    turned: FloatArray
    rescued: BoolArray
    surprise: FloatArray
    false: int
    estimates: int
    seconds: float
    order: FloatArray


def match(frame: Frame, estimates: PoseEstimates, seconds: float = 0.0) -> Matched:
    """Pair estimates with the objects that are nearest, each once, within categories and `FOUND_M`."""
    seen, count = estimates.detections, len(frame.category)
    distance = np.linalg.norm(frame.position[:, None] - seen.position[None], axis=-1)
    same = np.array([[a == b for b in seen.category] for a in frame.category], bool).reshape(distance.shape)
    possible = same & (distance < FOUND_M)
    # A pair that is impossible costs more than all possible ones together.
    rows, columns = linear_sum_assignment(np.where(possible, distance, 1e3))
    right = possible[rows, columns]
    rows, columns = rows[right], columns[right]
    order = np.full(count, -1)
    order[rows] = columns
    found = order >= 0
    away, turned, surprise = (np.full(count, np.nan) for _ in range(3))
    error = np.column_stack(
        [seen.position[columns] - frame.position[rows], wrap(seen.yaw[columns] - frame.yaw[rows])]
    )
    away[rows], turned[rows] = distance[rows, columns], np.abs(error[:, 2])
    spread = estimates.covariance[columns] + 1e-12 * np.eye(3)
    surprise[rows] = np.einsum("ni,nij,nj->n", error, np.linalg.inv(spread), error) if len(rows) else 0.0
    rescued = np.zeros(count, bool)
    rival = np.abs(wrap(estimates.runner_up_yaw[columns] - frame.yaw[rows]))
    rescued[rows] = np.nan_to_num(rival, nan=np.inf) <= FLIPPED
    false = len(seen) - len(rows)
    return Matched(found, away, turned, rescued, surprise, false, len(seen), seconds, order)


class Score(NamedTuple):
    """One row of the table: of objects that are visible to some share.

    Attributes:
        things: how many.
        missed: share of them.
        away_cm: median and 90th percentile of the position error, cm.
        turned_deg: the same of the heading's, degrees.
        flipped: share of those found whose heading is wrong by over 20 degrees.
        rescued: share of those where the runner-up is right.
        covered: share whose truth lies within the 90% region of the covariance, flipped ones left out.
    """

    things: int
    missed: float
    away_cm: tuple[float, float]
    turned_deg: tuple[float, float]
    flipped: float
    rescued: float
    covered: float


class Scores(NamedTuple):
    """What an estimator does with many frames.

    Attributes:
        rows: by name.
        frames: how many.
        false: share of its estimates that are of nothing.
        image_ms: time for an image.
        thing_ms: and for each estimate in it, milliseconds of processor time.
    """

    rows: dict[str, Score]
    frames: int
    false: float
    image_ms: float
    thing_ms: float


def evaluate(
    estimator: PoseEstimator,
    frames: Iterable[Frame],
    meshes: Mapping[str, Mesh],
) -> tuple[Scores, list[Matched]]:
    """Ask an estimator about frames with truth.

    Args:
        estimator: what is judged.
        frames: with what is true; one after the other.
        meshes: of the categories that are asked for.

    Returns:
        The table, and of each frame what was found.
    """
    kept: list[tuple[Frame, Matched]] = []
    for frame in frames:
        if not kept:  # what is compiled or read at first does not count
            estimator.estimate(frame.image, frame.view, meshes)
        begin = time.process_time()
        estimates = estimator.estimate(frame.image, frame.view, meshes)
        found = match(frame, estimates, time.process_time() - begin)
        kept.append((frame, found))
    return scores(kept), [found for _, found in kept]


def scores(kept: Sequence[tuple[Frame, Matched]]) -> Scores:
    """The table of what was found in frames."""
    truth = {
        name: np.concatenate([getattr(frame, name) for frame, _ in kept])
        for name in ("visible", "touching", "fixed")
    }
    found = {
        name: np.concatenate([getattr(one, name) for _, one in kept])
        for name in ("found", "away", "turned", "rescued", "surprise")
    }
    counted = ~truth["fixed"]
    enough = counted & (truth["visible"] >= 0.4)
    chosen = {CLAIMED: enough}
    for name, (low, high) in ROWS.items():
        chosen[name] = counted & (truth["visible"] >= low) & (truth["visible"] < high)
    chosen["touching pairs"] = enough & truth["touching"]
    estimates = sum(one.estimates for _, one in kept)
    false = sum(one.false for _, one in kept) / max(estimates, 1)
    spent = np.array([(1.0, one.estimates, one.seconds) for _, one in kept])
    fitted, _ = nnls(spent[:, :2], spent[:, 2])  # no part of the time is negative
    rows = {name: _score(mask, found) for name, mask in chosen.items()}
    return Scores(rows, len(kept), false, 1000 * float(fitted[0]), 1000 * float(fitted[1]))


_NINE_TENTHS = 6.251
"""Of squared Mahalanobis distances in three dimensions (chi squared)."""


def _score(mask: BoolArray, found: Mapping[str, Any]) -> Score:
    hit = mask & found["found"]
    wrong = found["turned"] > FLIPPED

    def percentiles(values: FloatArray) -> tuple[float, float]:
        if not len(values):
            return (float("nan"), float("nan"))
        middle, high = np.percentile(values, (50, 90))
        return (float(middle), float(high))

    def share(some: BoolArray, of: BoolArray) -> float:
        return float((some & of).sum() / of.sum()) if of.any() else float("nan")

    return Score(
        int(mask.sum()),
        share(~found["found"], mask),
        percentiles(100 * found["away"][hit]),
        percentiles(np.rad2deg(found["turned"][hit])),
        share(wrong, hit),
        share(found["rescued"], hit & wrong),
        share(found["surprise"] <= _NINE_TENTHS, hit & ~wrong),
    )


COLUMNS = (
    "visible",
    "objects",
    "missed",
    "false",
    "position p50/p90 cm",
    "yaw p50/p90 deg",
    "over 20 deg",
    "of those runner-up right",
    "90% region holds",
)


def table_rows(found: Scores) -> list[list[str]]:
    """The cells of the table, by `COLUMNS`."""

    def percent(value: float) -> str:
        return "" if np.isnan(value) else f"{100 * value:.1f}%"

    def pair(values: tuple[float, float], digits: int) -> str:
        return "" if np.isnan(values[0]) else " / ".join(f"{value:.{digits}f}" for value in values)

    rows = []
    for name, row in found.rows.items():
        false = percent(found.false) if name == CLAIMED else ""
        rest = [pair(row.away_cm, 2), pair(row.turned_deg, 1), *map(percent, row[4:])]
        rows.append([name, str(row.things), percent(row.missed), false, *rest])
    return rows


def farm_meshes() -> dict[str, Mesh]:
    """The farm's buildings."""
    return {name: model(name) for name in ("coop", "hutch", "shed")}
