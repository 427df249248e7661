"""Failures of a stress test: which ones the gallery shows, reading them from a report, replaying them."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from farm_ar.agents.attacks import QueryOracle
from farm_ar.agents.cases import Case
from farm_ar.agents.stress.statistics import wrong_before
from farm_ar.agents.stress.study import Study, known_case
from farm_ar.arrays import ANGLE, POSITION, Limits
from farm_ar.envs.generator import JITTERS
from farm_ar.errors import InputError, OptionError
from farm_ar.reid import REIDENTIFIERS, Identification, load_reid
from farm_ar.scenes import Snapshot, observe
from farm_ar.scenes.documents import Document, Listing, Object
from farm_ar.scenes.files import read_json
from farm_ar.scenes.kinds import Number, Numbers, Text, Whole
from farm_ar.sweeps import Row

GALLERY, GALLERY_OF_MANY = 6, 3
"""Failures of each kind and re-identifier; of more than two re-identifiers."""

DISTANCE = Limits(0.0, 1e9, "effort")

Order = Callable[[Row], Any]

KINDS: dict[str, tuple[str, Order]] = {
    "cheapest": ("cheapest", lambda row: row["cheapest"]["effort"]),
    "worst": ("worst", lambda row: (-row["worst"]["wrong"], row["worst"]["effort"])),
    "likeliest": ("cheapest", lambda row: row["cheapest"]["surprise"]),
}
"""By kind: which of a row's failures is meant, and by what rows are ordered."""


class ReportError(InputError):
    """A stress test's file that cannot be used."""


class Shown(NamedTuple):
    """A failure of the gallery.

    Args:
        kind: as what it is shown.
        row: the attack that found it.
        failure: what it found.
    """

    kind: str
    row: Row
    failure: dict[str, Any]


def gallery(study: Study) -> list[Shown]:
    """The cheapest, the worst and the likeliest failures of each re-identifier.

    The first of a kind is always the extreme one. Beside it stand those of the better half that differ most
    from what is shown already: of another case, with other objects misread, or misread in another way.
    """
    shown: list[Shown] = []
    number = GALLERY if len(study.options.reids) <= 2 else GALLERY_OF_MANY
    for reid in study.options.reids:
        rows = [row for row in study.attacked if row["reid"] == reid and row["cheapest"] is not None]
        rows = [row for row in rows if row["case"] not in wrong_before(study, reid)]
        before: list[Shown] = []
        for kind, (which, order) in KINDS.items():
            ranked = [Shown(kind, row, row[which]) for row in sorted(rows, key=order)]
            before += _different(ranked, number, before)
        shown += before
    return shown


def _different(ranked: Sequence[Shown], number: int, before: Sequence[Shown]) -> list[Shown]:
    """At most `number` of them, one of each case."""
    chosen: list[Shown] = []
    better = list(ranked[: max(number, len(ranked) // 2)])
    while better and len(chosen) < number:
        seen = [*before, *chosen]
        cases = [one.row["case"] for one in seen]
        ways = [_way_of(one.failure) for one in seen]

        def familiar(one: Shown, cases: list[int] = cases, ways: list[Any] = ways) -> tuple[int, int]:
            return cases.count(one.row["case"]), ways.count(_way_of(one.failure))

        best = better[0] if not chosen else min(better, key=familiar)
        chosen.append(best)
        better = [one for one in better if one.row["case"] != best.row["case"]]
    return sorted(chosen, key=lambda one: next(k for k, other in enumerate(ranked) if other is one))


def _way_of(failure: Mapping[str, Any]) -> tuple[str, frozenset[str]]:
    """In which way which objects are misread."""
    misread = dict(failure["misread"])
    if None in misread.values():
        return "no label", frozenset(misread)
    return "in a cycle" if set(misread) == set(misread.values()) else "in a path", frozenset(misread)


REPORT = Document(
    "stress test report",
    Object(
        {
            "failures": Listing(
                Object(
                    {
                        "scene": Text(about="A built-in scene, or a scene file."),
                        "jitter": Text(JITTERS),
                        "seed": Whole(0, 2**63 - 1),
                        "case": Whole(0, 10**6, about="Which layout and camera."),
                        "reid": Text(about="The re-identifier by name."),
                        "position": Listing(Numbers(2, POSITION, "[x, z] in metres, from -1e6 to 1e6")),
                        "yaw": Listing(Number(ANGLE)),
                        "effort": Number(DISTANCE),
                        "wrong": Whole(0, 10**6),
                    },
                    open=True,
                ),
                about="Failures that the report shows.",
            )
        },
        notes=True,
        open=True,
        about="What farm-ar stress-replay reads of stress.json. Metres and radians.",
    ),
    ReportError,
)
"""What a report holds that can be replayed."""


def read_failure(path: str | os.PathLike[str], number: int) -> dict[str, Any]:
    """One failure of a stress test's JSON file: plain data, checked; no code of a re-identifier is loaded.

    Raises:
        ReportError: the file cannot be used, or has no failure of that number.
    """
    name = Path(path).name
    failures = REPORT.read(read_json(path, ReportError), name)["failures"]
    if not 0 <= number < len(failures):
        expected = f"must hold number {number}, counted from 0"
        raise ReportError("failures", expected, f"{len(failures)} failures", name)
    return _checked(failures, number, name)


def read_failures(path: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """All failures of a stress test's JSON file, as `read_failure` reads one.

    Raises:
        ReportError: the file cannot be used.
    """
    name = Path(path).name
    failures = REPORT.read(read_json(path, ReportError), name)["failures"]
    return [_checked(failures, number, name) for number in range(len(failures))]


def _checked(failures: Sequence[dict[str, Any]], number: int, name: str) -> dict[str, Any]:
    """A failure, if it has as many headings as places."""
    found = failures[number]
    if len(found["yaw"]) != len(found["position"]):
        expected = f"must be {len(found['position'])} headings, as there are places"
        raise REPORT.fail(("failures", number, "yaw"), expected, f"{len(found['yaw'])}", name)
    return found


def names_code(reid: str) -> bool:
    """Whether a re-identifier's name loads somebody's module."""
    return reid not in REIDENTIFIERS and ":" in reid


@dataclass(frozen=True, eq=False)
class Replayed:
    """A failure that was replayed.

    Args:
        case: its case.
        snapshot: what the camera sees after it.
        answer: what the re-identifier says.
        truth: the labels that the detections really are.
        distance: what it takes now.
        wrong: wrong labels now; -1 if the perturbation is not allowed.
        same: whether distance and wrong labels are, bit for bit, those of the file.
    """

    case: Case
    snapshot: Snapshot
    answer: Identification
    truth: tuple[str | None, ...]
    distance: float
    wrong: int
    same: bool


def replay_failure(failure: Mapping[str, Any]) -> Replayed:
    """Replay a failure.

    Args:
        failure: scene, jitter, seed, case, reid, position, yaw, distance and wrong, as `read_failure` reads.

    Raises:
        OptionError: the scene has not as many objects, or there is no such scene or re-identifier.
    """
    case = known_case(failure["scene"], failure["case"], failure["jitter"], failure["seed"])
    position, yaw = np.array(failure["position"]), np.array(failure["yaw"])
    if len(yaw) != len(case.layout):
        raise OptionError("position", f"must be those of the scene's {len(case.layout)} objects", len(yaw))
    reid = load_reid(failure["reid"])(case.scene)
    oracle = QueryOracle(case, reid, queries=1, budget=np.inf)
    distance = float(oracle.distance(position, yaw))
    oracle.budget = max(distance, 1e-12)
    wrong = int(oracle.query(position[None], yaw[None])[0])
    snapshot, truth = observe(case.layout.with_poses(position, yaw), case.camera)
    same = distance == failure["effort"] and wrong == failure["wrong"]
    return Replayed(case, snapshot, reid.identify(snapshot), truth, distance, wrong, same)
