"""The statistics of a stress test: shares with intervals, medians where some are infinite, calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.stats import binomtest

from farm_ar.agents.certificates import NO_BOUND
from farm_ar.arrays import FloatArray
from farm_ar.sweeps import Row

if TYPE_CHECKING:
    from farm_ar.agents.stress.study import Study

RESAMPLES = 4000
"""Draws of a bootstrap."""


class Share(NamedTuple):
    """A share with its two-sided 95% interval."""

    value: float
    low: float
    high: float


def share_of(k: int, n: int) -> Share:
    """The share k / n of independent trials, with the exact binomial interval; 0 to 1 where n is 0."""
    if n == 0:
        return Share(float("nan"), 0.0, 1.0)
    ends = binomtest(k, n).proportion_ci(0.95, method="exact")
    return Share(k / n, float(ends.low), float(ends.high))


def clustered_share(successes: Sequence[int], trials: Sequence[int], rng: np.random.Generator) -> Share:
    """The share of trials that succeed where those of one case are alike, with a bootstrap over the cases.

    Cases are drawn with replacement, each with all of its trials (Davison and Hinkley 1997, section 3.8).
    Where all trials succeed, or none does, resampling says nothing: the interval is then the exact binomial
    one with as many trials as cases, which holds because the chance that a case has no success is at most
    1 less its share.

    Args:
        successes: (C,) of each case.
        trials: (C,) of each case, at least 1.
        rng: draws the resamples.
    """
    k, n = np.asarray(successes), np.asarray(trials)
    if not n.size or k.sum() in (0, n.sum()):
        return share_of(len(n) if k.sum() else 0, len(n))
    drawn = rng.integers(len(n), size=(RESAMPLES, len(n)))
    low, high = np.quantile(k[drawn].sum(axis=1) / n[drawn].sum(axis=1), [0.025, 0.975])
    return Share(float(k.sum() / n.sum()), float(low), float(high))


def median(values: Sequence[float | None]) -> float:
    """The middle value, those that are None counted as infinite; NaN of nothing.

    Of an even number it is the mean of the middle two, infinite if one of them is.
    """
    ordered = np.sort([np.inf if value is None else value for value in values])
    if not ordered.size:
        return float("nan")
    low, high = ordered[(len(ordered) - 1) // 2], ordered[len(ordered) // 2]
    return float(low) if low == high else float((low + high) / 2)


def broken_within(least: Sequence[float | None], distances: FloatArray) -> FloatArray:
    """(E,) share of the cases that fail within each distance; None has not failed."""
    values = np.array([np.inf if value is None else value for value in least])
    return (values[:, None] <= distances).mean(axis=0) if values.size else np.zeros(len(distances))


class Calibration(NamedTuple):
    """How far confidence is from what is right, in tenths of confidence.

    Args:
        confidence: (10,) mean confidence in each tenth, NaN where there is none.
        right: (10,) share of right answers.
        answers: (10,) how many.
        error: mean distance of the two, weighted by the answers (expected calibration error); NaN of nothing.
    """

    confidence: FloatArray
    right: FloatArray
    answers: FloatArray
    error: float


def calibrate(pairs: Sequence[tuple[float, bool]]) -> Calibration:
    """The calibration of answers, each with its confidence and whether it was right."""
    confidence = np.array([p for p, _ in pairs], dtype=np.float64)
    right = np.array([r for _, r in pairs], dtype=np.float64)
    tenth = np.minimum((confidence * 10).astype(np.int64), 9)
    count = np.bincount(tenth, minlength=10).astype(np.float64)
    with np.errstate(invalid="ignore"):
        mean = np.bincount(tenth, confidence, 10) / count
        share = np.bincount(tenth, right, 10) / count
    error = float(np.nansum(count * np.abs(mean - share)) / count.sum()) if len(pairs) else float("nan")
    return Calibration(mean, share, count, error)


@dataclass(frozen=True)
class AttackSummary:
    """One attack on one re-identifier, over its C cases.

    Args:
        attack: its name, "best" for the least of all attacks.
        least: (C) minimum perturbation of each case, None where nothing failed.
        median: of those.
        failed: share of the cases that failed within the budget.
        tightness: median of minimum perturbation by certified bound, over cases with a bound; NaN without.
        queries_per_second: identified snapshots a second of the processor, all included; NaN for "best".
    """

    attack: str
    least: tuple[float | None, ...]
    median: float
    failed: Share
    tightness: float
    queries_per_second: float


@dataclass(frozen=True)
class ReidSummary:
    """One re-identifier, over the C cases in which it is right as long as nothing has moved.

    Args:
        reid: its name.
        theorem: what certifies it; "none" where nothing does.
        cases: (C) numbers of the cases that count.
        wrong_before: how many cases are left out, because labels are wrong there before anything moves.
        stuck: cases of which an attack could ask next to nothing, because nothing can be moved there.
        bounds: (C) certified bound of each case, None for "no attack can".
        bound_median: of those; NaN without a certificate.
        bound_t1: the median of the simple bound (T1 alone).
        attacks: each attack, and last the best of them.
        noise: share of layouts under random noise in which something is wrong; the interval is over cases.
        calibration: under random noise.
        calibration_attacked: in the cheapest failures.
        transfer: share of the cheapest failures made for this one that also break each other one, of the
            cases in which that one is right before.
        miscounts: mean over the cheapest failures; None without the game.
        endpoint_error_m: mean over the cheapest failures.
        by_hand: share of the cheapest failures that are physically realizable; None without the game.
        by_hand_median: of the distances that takes, the others counted as infinite; NaN without.
        most_wrong: (C) wrong labels of each case's worst failure, and its D; None where nothing failed.
        labels: label, how often it was misread in a cheapest failure, how often seen, median bound.
        weakest: case, camera, minimum perturbation, bound, most wrong labels; the weakest first.
    """

    reid: str
    theorem: str
    cases: tuple[int, ...]
    wrong_before: int
    stuck: int
    bounds: tuple[float | None, ...]
    bound_median: float
    bound_t1: float
    attacks: tuple[AttackSummary, ...]
    noise: Share
    calibration: Calibration
    calibration_attacked: Calibration
    transfer: dict[str, Share]
    miscounts: float | None
    endpoint_error_m: float
    by_hand: Share | None
    by_hand_median: float
    most_wrong: tuple[tuple[int, float] | None, ...]
    labels: tuple[tuple[str, int, int, float], ...]
    weakest: tuple[WeakCase, ...]

    @property
    def certified(self) -> bool:
        """Whether a theorem bounds every attack."""
        return self.theorem != NO_BOUND

    @property
    def most_wrong_labels(self) -> float:
        """Median number of wrong labels of the worst failures; 0 where nothing failed, NaN without cases."""
        return median([0 if worst is None else worst[0] for worst in self.most_wrong])

    @property
    def most_wrong_distance(self) -> float:
        """Median distance of the worst failures; NaN without one."""
        return median([worst[1] for worst in self.most_wrong if worst is not None])

    @property
    def best(self) -> AttackSummary:
        """The least of all attacks."""
        return self.attacks[-1]


class WeakCase(NamedTuple):
    """A case, its camera (x, z, yaw), minimum perturbation, bound, and worst failure; None where none is."""

    case: int
    camera: tuple[float, float, float]
    least: float | None
    bound: float | None
    most_wrong: tuple[int, float] | None


def wrong_before(study: Study, reid: str) -> set[int]:
    """The cases in which a re-identifier gives wrong labels before anything has moved."""
    return {row["case"] for row in study.known if row["reid"] == reid and row["wrong_untouched"]}


def summarise_reid(study: Study, reid: str, labels: Sequence[str]) -> ReidSummary:
    """The numbers of one re-identifier; `labels` are those of the scene's objects, in order."""
    wrong = {name: wrong_before(study, name) for name in study.options.reids}
    every = [row for row in study.known if row["reid"] == reid]
    known = [row for row in every if row["case"] not in wrong[reid]]
    cases = tuple(int(row["case"]) for row in known)
    found = [row for row in study.attacked if row["reid"] == reid and row["case"] not in wrong[reid]]
    theorem = str(every[0]["theorem"])
    certified = theorem != NO_BOUND
    bounds = tuple(row["bound"] for row in known)
    cheapest = _cheapest(found, cases)
    least = tuple(None if row is None else row["least"] for row in cheapest)
    attacks = [
        _of_attack(study, reid, attack, found, cases, bounds if certified else None)
        for attack in study.options.attacks
    ]
    attacks.append(_attack_summary("best", least, bounds if certified else None, float("nan")))
    broken = [row for row in cheapest if row is not None]
    failures = [row["cheapest"] for row in broken]
    counts = [failure["miscounts"] for failure in failures if failure["miscounts"] is not None]
    by_hand = [failure["by_hand"] for failure in failures if "by_hand" in failure]
    most_wrong = _most_wrong(found, cases)
    weak = [
        WeakCase(case, tuple(row["camera"]), distance, row["bound"], worst)
        for case, row, distance, worst in zip(cases, known, least, most_wrong, strict=True)
    ]
    transfer = {}
    for other in study.options.reids:
        shown = [row["transfer"][other] > 0 for row in broken if row["case"] not in wrong[other]]
        transfer[other] = share_of(sum(shown), len(shown))
    return ReidSummary(
        reid=reid,
        theorem=theorem,
        cases=cases,
        wrong_before=len(every) - len(known),
        stuck=len({row["case"] for row in found if row["stuck"] or not row["asked"]}),
        bounds=bounds,
        bound_median=median(bounds) if certified else float("nan"),
        bound_t1=median([row["bound_t1"] for row in known]) if certified else float("nan"),
        attacks=tuple(attacks),
        noise=clustered_share(
            [row["noise_failures"] for row in known],
            [row["noise_draws"] for row in known],
            np.random.default_rng([study.options.seed, 4]),
        ),
        calibration=calibrate([tuple(pair) for row in known for pair in row["confidence"]]),
        calibration_attacked=calibrate([tuple(pair) for one in failures for pair in one["confidence"]]),
        transfer=transfer,
        miscounts=float(np.mean(counts)) if counts else None,
        endpoint_error_m=float(np.mean([one["endpoint_error_m"] for one in failures] or [np.nan])),
        by_hand=share_of(sum(distance is not None for distance in by_hand), len(by_hand))
        if by_hand
        else None,
        by_hand_median=median(by_hand),
        most_wrong=most_wrong,
        labels=_weak_labels(labels, known, failures, certified),
        weakest=tuple(sorted(weak, key=lambda one: np.inf if one.least is None else one.least)),
    )


def _cheapest(rows: Sequence[Row], cases: Sequence[int]) -> list[Row | None]:
    """The row of the attack with the least distance, case by case."""
    best: dict[int, Row] = {}
    for row in rows:
        if row["least"] is not None:
            now = best.get(row["case"])
            if now is None or row["least"] < now["least"]:
                best[row["case"]] = row
    return [best.get(case) for case in cases]


def _most_wrong(rows: Sequence[Row], cases: Sequence[int]) -> tuple[tuple[int, float] | None, ...]:
    """The wrong labels of each case's worst failure, and the least distance of as many."""
    worst: dict[int, tuple[int, float]] = {}
    for row in rows:
        if row["worst"] is not None:
            one = int(row["worst"]["wrong"]), float(row["worst"]["effort"])
            now = worst.get(row["case"])
            if now is None or (-one[0], one[1]) < (-now[0], now[1]):
                worst[row["case"]] = one
    return tuple(worst.get(case) for case in cases)


def _of_attack(
    study: Study,
    reid: str,
    attack: str,
    found: Sequence[Row],
    cases: Sequence[int],
    bounds: Sequence[float | None] | None,
) -> AttackSummary:
    least = {row["case"]: row["least"] for row in found if row["attack"] == attack}
    times = [row for row in study.measured if row["reid"] == reid and row["attack"] == attack]
    seconds = sum(row["seconds"] for row in times)
    pace = sum(row["asked"] for row in times) / seconds if seconds else float("nan")
    return _attack_summary(attack, tuple(least.get(case) for case in cases), bounds, pace)


def _attack_summary(
    attack: str, least: tuple[float | None, ...], bounds: Sequence[float | None] | None, pace: float
) -> AttackSummary:
    """Of an attack; `bounds` is None where nothing is certified."""
    ratios = [
        None if distance is None else distance / bound
        for distance, bound in zip(least, bounds or (), strict=bounds is not None)
        if bound
    ]
    failed = share_of(sum(distance is not None for distance in least), len(least))
    tightness = float("nan") if bounds is None else median(ratios)
    return AttackSummary(attack, least, median(least), failed, tightness, pace)


def _weak_labels(
    labels: Sequence[str], known: Sequence[Row], failures: Sequence[Row], certified: bool
) -> tuple[tuple[str, int, int, float], ...]:
    misread = [true for failure in failures for true, _ in failure["misread"]]
    rows = []
    for i, label in enumerate(labels):
        seen = [row for row in known if row["in_view"][i]]
        bound = median([row["bound_by_object"][i] for row in seen]) if certified else float("nan")
        rows.append((label, misread.count(label), len(seen), bound))
    shown = [row for row in rows if row[1] or row[2]]
    return tuple(sorted(shown, key=lambda row: (-row[1], np.nan_to_num(row[3], nan=np.inf))))
