"""What a stress test says, in numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from farm_ar.agents.certificates import NO_BOUND
from farm_ar.agents.stress.statistics import Calibration, Share, calibrate, clopper_pearson, median
from farm_ar.agents.stress.study import Study
from farm_ar.sweeps import Row


@dataclass(frozen=True)
class AttackSummary:
    """One attack on one re-identifier, over all cases.

    Args:
        attack: its name, "best" for the least of all attacks.
        least: (C) least effort of each case, None where nothing failed.
        median: of those.
        failed: share of the cases that failed within the budget.
        tightness: median of least effort by certified bound, over the cases with a bound; NaN without.
        queries_per_second: identified snapshots a second, everything included; NaN for "best".
    """

    attack: str
    least: tuple[float | None, ...]
    median: float
    failed: Share
    tightness: float
    queries_per_second: float


@dataclass(frozen=True)
class RuleSummary:
    """One re-identifier, over all cases.

    Args:
        reid: its name.
        theorem: what certifies it; "none" where nothing does.
        bounds: (C) certified bound of each case, None for "no attack can".
        bound_median: of those; NaN without a certificate.
        bound_t1: the median that T1 alone would certify.
        attacks: each attack, and last the best of them.
        noise: share of everyday disorder after which something is wrong.
        calibration: under everyday disorder.
        calibration_attacked: in the cheapest failures.
        transfer: share of the cheapest failures made for this rule that also break each other one.
        miscounts: mean over the cheapest failures; None without the game.
        endpoint_error_m: mean over the cheapest failures.
        labels: label, how often it was misread in a cheapest failure, how often seen, median bound.
        cases: case, camera, least effort, bound; the weakest first.
    """

    reid: str
    theorem: str
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
    labels: tuple[tuple[str, int, int, float], ...]
    cases: tuple[tuple[int, tuple[float, float, float], float | None, float | None], ...]

    @property
    def best(self) -> AttackSummary:
        """The least of all attacks."""
        return self.attacks[-1]


@dataclass(frozen=True)
class Summary:
    """What a stress test says.

    Args:
        rules: each re-identifier.
        failures: the rows of the attacks' failures that the gallery shows: kind, row, failure.
    """

    rules: tuple[RuleSummary, ...]
    failures: tuple[tuple[str, Row, dict[str, Any]], ...]


GALLERY, GALLERY_OF_MANY = 6, 3
"""Failures of each kind and rule in the gallery; of more than two rules."""


def summarise(study: Study, labels: Sequence[str]) -> Summary:
    """The numbers of a study; `labels` are those of the scene's objects, in order."""
    rules = tuple(_of_rule(study, reid, labels) for reid in study.options.reids)
    return Summary(rules, tuple(_gallery(study)))


def _of_rule(study: Study, reid: str, labels: Sequence[str]) -> RuleSummary:
    known = [row for row in study.known if row["reid"] == reid]
    rows = [row for row in study.attacked if row["reid"] == reid]
    theorem = str(known[0]["theorem"])
    certified = theorem != NO_BOUND
    bounds = tuple(row["bound"] for row in known)
    cheapest = _cheapest(rows, study.options.cases)
    attacks = [_of_attack(study, reid, attack, bounds, certified) for attack in study.options.attacks]
    least = tuple(None if row is None else row["least"] for row in cheapest)
    attacks.append(_attack_summary("best", least, bounds, certified, float("nan")))
    failures = [row["cheapest"] for row in cheapest if row is not None]
    counts = [failure["miscounts"] for failure in failures if failure["miscounts"] is not None]
    return RuleSummary(
        reid=reid,
        theorem=theorem,
        bounds=bounds,
        bound_median=median(bounds) if certified else float("nan"),
        bound_t1=median([row["bound_t1"] for row in known]) if certified else float("nan"),
        attacks=tuple(attacks),
        noise=clopper_pearson(
            sum(row["noise_failures"] for row in known), sum(row["noise_draws"] for row in known)
        ),
        calibration=calibrate([tuple(pair) for row in known for pair in row["confidence"]]),
        calibration_attacked=calibrate([tuple(pair) for one in failures for pair in one["confidence"]]),
        transfer={
            other: clopper_pearson(
                sum(row["transfer"][other] > 0 for row in cheapest if row is not None), len(failures)
            )
            for other in study.options.reids
        },
        miscounts=float(np.mean(counts)) if counts else None,
        endpoint_error_m=float(np.mean([one["endpoint_error_m"] for one in failures] or [np.nan])),
        labels=_weak_labels(labels, known, failures, certified),
        cases=_weak_cases(known, least),
    )


def _cheapest(rows: Sequence[Row], cases: int) -> list[Row | None]:
    """The row of the attack with the least effort, case by case."""
    best: list[Row | None] = [None] * cases
    for row in rows:
        now = best[row["case"]]
        if row["least"] is not None and (now is None or row["least"] < now["least"]):
            best[row["case"]] = row
    return best


def _of_attack(
    study: Study, reid: str, attack: str, bounds: Sequence[float | None], certified: bool
) -> AttackSummary:
    least: list[float | None] = [None] * study.options.cases
    for row in study.attacked:
        if row["reid"] == reid and row["attack"] == attack:
            least[row["case"]] = row["least"]
    times = [row for row in study.measured if row["reid"] == reid and row["attack"] == attack]
    seconds = sum(row["seconds"] for row in times)
    pace = sum(row["asked"] for row in times) / seconds if seconds else float("nan")
    return _attack_summary(attack, tuple(least), bounds, certified, pace)


def _attack_summary(
    attack: str,
    least: tuple[float | None, ...],
    bounds: Sequence[float | None],
    certified: bool,
    pace: float,
) -> AttackSummary:
    ratios = [
        None if effort is None else effort / bound
        for effort, bound in zip(least, bounds, strict=True)
        if bound
    ]
    return AttackSummary(
        attack,
        least,
        median(least),
        clopper_pearson(sum(effort is not None for effort in least), len(least)),
        median(ratios) if certified else float("nan"),
        pace,
    )


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


def _weak_cases(
    known: Sequence[Row], least: Sequence[float | None]
) -> tuple[tuple[int, tuple[float, float, float], float | None, float | None], ...]:
    rows = [
        (int(row["case"]), tuple(row["camera"]), effort, row["bound"])
        for row, effort in zip(known, least, strict=True)
    ]
    return tuple(sorted(rows, key=lambda row: np.inf if row[2] is None else row[2]))


def _gallery(study: Study) -> list[tuple[str, Row, dict[str, Any]]]:
    """The cheapest, the worst and the likeliest failures of each re-identifier, one of each case."""
    shown = []
    number = GALLERY if len(study.options.reids) <= 2 else GALLERY_OF_MANY
    for reid in study.options.reids:
        rows = [row for row in study.attacked if row["reid"] == reid and row["cheapest"] is not None]
        orders = {
            "cheapest": lambda row: row["cheapest"]["effort"],
            "worst": lambda row: (-row["worst"]["wrong"], row["worst"]["effort"]),
            "likeliest": lambda row: row["cheapest"]["surprise"],
        }
        for kind, order in orders.items():
            cases: set[int] = set()
            for row in sorted(rows, key=order):
                if row["case"] not in cases and len(cases) < number:
                    cases.add(row["case"])
                    shown.append((kind, row, row["worst" if kind == "worst" else "cheapest"]))
    return shown
