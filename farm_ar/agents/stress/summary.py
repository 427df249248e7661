"""What a stress test says, in numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from farm_ar.agents.certificates import NO_BOUND
from farm_ar.agents.stress.gallery import Shown, gallery
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
        queries_per_second: identified snapshots a second of the processor, all included; NaN for "best".
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
        by_hand: share of the cheapest failures that the game's hand can bring about; None without the game.
        by_hand_median: of the efforts with which it does, those it cannot counted as infinite; NaN without.
        most_wrong: (C) wrong labels of each case's worst failure, and its effort; None where nothing failed.
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
    by_hand: Share | None
    by_hand_median: float
    most_wrong: tuple[tuple[int, float] | None, ...]
    labels: tuple[tuple[str, int, int, float], ...]
    cases: tuple[tuple[int, tuple[float, float, float], float | None, float | None], ...]

    @property
    def most_wrong_labels(self) -> float:
        """Median number of wrong labels of the worst failures; 0 where nothing failed."""
        return median([0 if worst is None else worst[0] for worst in self.most_wrong])

    @property
    def most_wrong_effort(self) -> float:
        """Median effort of the worst failures; NaN without one."""
        return median([worst[1] for worst in self.most_wrong if worst is not None])

    @property
    def best(self) -> AttackSummary:
        """The least of all attacks."""
        return self.attacks[-1]


@dataclass(frozen=True)
class Summary:
    """What a stress test says.

    Args:
        rules: each re-identifier.
        failures: those that the gallery shows.
    """

    rules: tuple[RuleSummary, ...]
    failures: tuple[Shown, ...]


def summarise(study: Study, labels: Sequence[str]) -> Summary:
    """The numbers of a study; `labels` are those of the scene's objects, in order."""
    rules = tuple(_of_rule(study, reid, labels) for reid in study.options.reids)
    return Summary(rules, tuple(gallery(study)))


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
    by_hand = [failure["by_hand"] for failure in failures if "by_hand" in failure]
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
        by_hand=clopper_pearson(sum(effort is not None for effort in by_hand), len(by_hand))
        if by_hand
        else None,
        by_hand_median=median(by_hand),
        most_wrong=_most_wrong([row for row in study.attacked if row["reid"] == reid], study.options.cases),
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


def _most_wrong(rows: Sequence[Row], cases: int) -> tuple[tuple[int, float] | None, ...]:
    """The wrong labels of each case's worst failure, and the least effort of as many."""
    worst: list[tuple[int, float] | None] = [None] * cases
    for row in rows:
        failure, now = row["worst"], worst[row["case"]]
        if failure is None:
            continue
        if now is None or (-failure["wrong"], failure["effort"]) < (-now[0], now[1]):
            worst[row["case"]] = int(failure["wrong"]), float(failure["effort"])
    return tuple(worst)


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
