"""A stress test: its options, the units of work of which it is made, and running them as sweeps."""

from __future__ import annotations

import os
import time
import zlib
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from typing import Any, NotRequired, TypedDict, Unpack

import numpy as np

from farm_ar.agents.attacks import Failure, QueryOracle, attack_named, wrong_labels
from farm_ar.agents.cases import Case, draw_case
from farm_ar.agents.certificates import lower_bound
from farm_ar.agents.distance import distance_of
from farm_ar.agents.stress.impact import downstream_impact, realizable_distance
from farm_ar.agents.validity import settle
from farm_ar.arrays import FloatArray
from farm_ar.envs.generator import JITTERS, SPREADS, scene_of, unit_of
from farm_ar.errors import OptionError, known_name
from farm_ar.geometry import wrap
from farm_ar.reid import REIDENTIFIERS, Reidentifier, load_reid
from farm_ar.scenes import Gaussian, LayoutNoise, Scene, observe
from farm_ar.sweeps import Executor, Outcome, Row, Store, Sweep, Watcher, grid, run_sweep
from farm_ar.sweeps.unit import code_version

ASKED_FOR_CONFIDENCE = 12
"""Draws of random noise that are looked at for confidence too."""


@dataclass(frozen=True)
class StressOptions:
    """The options of a stress test.

    Args:
        scene: a built-in scene's name, or a `.json` file.
        reids: names of re-identifiers, as `load_reid` takes them.
        attacks: names of attacks, as `attack_named` takes them.
        queries: snapshots that one attack may query in one case.
        cases: how many layouts and cameras.
        budget: D that a perturbation may take, summed over the objects.
        jitter: how far the layouts stray from the scene's own: none, easy, default or hard.
        seed: where all randomness comes from.
        noise_draws: draws of random noise in each case.

    Raises:
        OptionError: a name is not known, a number out of its limits, or a policy cannot act in the scene.
        MissingPackageError: there are policies among the attacks, and what training needs is not installed.
    """

    scene: str = "farm"
    reids: tuple[str, ...] = ("spatial",)
    attacks: tuple[str, ...] = ("ladder",)
    queries: int = 2000
    cases: int = 40
    budget: float = 1.0
    jitter: str = "default"
    seed: int = 0
    noise_draws: int = 200

    def __post_init__(self) -> None:
        object.__setattr__(self, "reids", tuple(self.reids))
        object.__setattr__(self, "attacks", tuple(self.attacks))
        scene = scene_of(self.scene, game=False)
        for what, names in (("reid", self.reids), ("attack", self.attacks)):
            if not names or len(set(names)) < len(names):
                raise OptionError(what, "must be one name or several different ones", list(names))
        for reid in self.reids:
            load_reid(reid)(scene)
        for attack in self.attacks:
            attack_named(attack).check(scene)
        known_name("jitter", self.jitter, JITTERS)
        for name, lowest in (("queries", 1), ("cases", 1), ("seed", 0), ("noise_draws", 1)):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < lowest:
                raise OptionError(name, f"must be a whole number not below {lowest}", value)
        if not (np.isfinite(self.budget) and self.budget > 0):
            raise OptionError("budget", "must be a positive number", self.budget)

    def as_dict(self) -> dict[str, Any]:
        """The options as JSON values."""
        return {name: list(v) if isinstance(v, tuple) else v for name, v in asdict(self).items()}


@dataclass(frozen=True, eq=False)
class Study:
    """What a stress test found.

    Args:
        options: what was asked for.
        known: a row per case and re-identifier, as `describe_case` gives it.
        attacked: a row per case, re-identifier and attack, as `attack_case` gives it.
        measured: seconds of each attack, of the processor.
    """

    options: StressOptions
    known: Sequence[Row]
    attacked: Sequence[Row]
    measured: Sequence[Row]


def run_stress(
    options: StressOptions,
    store: Store | str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    watch: Watcher = lambda standing: None,
) -> Study:
    """Run a stress test.

    Args:
        options: of the test.
        store: where finished units are kept; None keeps them in memory.
        executor: where units run; by default in this process.
        watch: is called with the progress.

    Raises:
        UnfinishedSweepError: a unit failed; what the others gave is kept.
        StoreError: the store cannot be used.
    """
    shared: dict[str, Any] = {"scene": [options.scene], "jitter": [options.jitter]}
    shared |= {"case": range(options.cases), "reid": options.reids}
    looks = grid(**shared, draws=[options.noise_draws])
    for call in looks:
        call["code"] = _code_of([call["reid"]])
    known = Sweep(f"stress-cases-{options.scene}", describe_case, looks, [options.seed])
    calls = grid(**shared, attack=options.attacks, queries=[options.queries], budget=[options.budget])
    for call in calls:
        call["transfer"] = list(options.reids)
        call["code"] = _code_of(options.reids, call["attack"])
    attacks = Sweep(f"stress-attacks-{options.scene}", attack_case, calls, [options.seed])
    with nullcontext(store) if isinstance(store, Store) else Store(store) as opened:
        facts = run_sweep(known, opened, executor, watch=watch)
        found = run_sweep(attacks, opened, executor, watch=watch)
    measured = [row for outcome in found.outcomes() for row in outcome.measured]
    return Study(options, facts.rows(), found.rows(), measured)


def _code_of(reids: Sequence[str], attack: str | None = None) -> str:
    """The version of what a unit runs beside farm-ar's: re-identifiers of one's own, trained policies."""
    parts = [code_version(reid) for reid in reids if reid not in REIDENTIFIERS]
    fingerprint = "" if attack is None else attack_named(attack).fingerprint
    return " ".join([*parts, fingerprint] if fingerprint else parts)


def known_case(scene: str, case: int, jitter: str, seed: int) -> Case:
    """The case of a stress test by its number."""
    return draw_case(scene_of(scene, game=False), case, seed, jitter)


def random_noise(scene: Scene) -> LayoutNoise:
    """The noise that the environments call "default", grown with the scene: the motion model."""
    metres, radians = SPREADS["default"]
    return LayoutNoise(Gaussian(0.0, metres * unit_of(scene)), Gaussian(0.0, float(radians)))


class CaseUnit(TypedDict):
    """The parameters of a unit of work, whatever it does.

    Args:
        scene: the room's name.
        jitter: how far layouts stray.
        case: its number.
        reid: the re-identifier's name.
        code: distinguishes results that other code, or another policy, gave under the same names.
    """

    scene: str
    jitter: str
    case: int
    reid: str
    code: NotRequired[str]


def describe_case(seed: int, draws: int, **unit: Unpack[CaseUnit]) -> Outcome:
    """The certificate of a case, and how often random noise breaks the re-identifier.

    Args:
        seed: of the stress test.
        draws: how many layouts are looked at.
        unit: the case and the re-identifier.
    """
    begin = time.process_time()
    case, reid, known, tested = _begun(seed, unit)
    bound = lower_bound(known, tested)
    position, yaw = _disturbed(known, draws, np.random.default_rng([seed, case, 1]))
    wrong = wrong_labels(known, tested, position, yaw)
    confidence = [
        _confidence(known, tested, position[k], yaw[k]) for k in range(min(ASKED_FOR_CONFIDENCE, draws))
    ]
    row = {
        "case": case,
        "reid": reid,
        "bound": _finite(bound.total),
        "bound_largest": _finite(bound.largest),
        "bound_t1": _finite(bound.first),
        "bound_by_object": [_finite(value) for value in bound.by_object.tolist()],
        "theorem": bound.theorem,
        "in_view": known.in_view.tolist(),
        "wrong_untouched": int(wrong_labels(known, tested, *_untouched(known))[0]),
        "noise_draws": len(wrong),
        "noise_failures": int(np.count_nonzero(wrong)),
        "noise_wrong": int(wrong.sum()),
        "confidence": [pair for pairs in confidence for pair in pairs],
        "camera": [*known.camera.position.tolist(), float(known.camera.yaw)],
    }
    return Outcome([row], [{"case": case, "reid": reid, "seconds": time.process_time() - begin}])


def attack_case(
    seed: int, attack: str, queries: int, budget: float, transfer: list[str], **unit: Unpack[CaseUnit]
) -> Outcome:
    """One attack on one case under one re-identifier.

    Args:
        seed: of the stress test.
        attack: the attack's name.
        queries: snapshots that it may query.
        budget: distance that a perturbation may take.
        transfer: names of the re-identifiers on which its cheapest failure is also tested.
        unit: the case and the re-identifier.
    """
    case, reid, known, tested = _begun(seed, unit)
    oracle = QueryOracle(known, tested, queries, budget)
    names = zlib.crc32(f"{attack} {reid}".encode())
    begin = time.process_time()
    attack_named(attack)(oracle, np.random.default_rng([seed, case, names]))
    seconds = time.process_time() - begin
    row: dict[str, Any] = {
        "case": case,
        "reid": reid,
        "attack": attack,
        "asked": oracle.asked,
        "stuck": oracle.stuck,
        "least": None if oracle.cheapest is None else oracle.cheapest.distance,
        "cells": oracle.cells.tolist(),
        "cheapest": None,
        "worst": None,
    }
    for name in ("cheapest", "worst"):
        failure = getattr(oracle, name)
        if failure is not None:
            row[name] = _described(oracle, failure, reid, seed)
    if oracle.cheapest is not None:
        if known.layout.fixed.any():
            row["cheapest"]["by_hand"] = realizable_distance(
                known,
                oracle.reid,
                oracle.cheapest.position,
                oracle.cheapest.yaw,
                np.random.default_rng([seed, case, 3]),
            )
        shown = oracle.cheapest.position[None], oracle.cheapest.yaw[None]
        row["transfer"] = {
            other: int(wrong_labels(known, load_reid(other)(known.scene), *shown)[0]) for other in transfer
        }
    measured = {"case": case, "reid": reid, "attack": attack, "asked": oracle.asked, "seconds": seconds}
    return Outcome([row], [measured])


def _begun(seed: int, unit: CaseUnit) -> tuple[int, str, Case, Reidentifier]:
    """The number of a unit's case, the name of its re-identifier, and both themselves."""
    known = known_case(unit["scene"], unit["case"], unit["jitter"], seed)
    return unit["case"], unit["reid"], known, load_reid(unit["reid"])(known.scene)


def _described(oracle: QueryOracle, failure: Failure, reid: str, seed: int) -> dict[str, Any]:
    """A failure as JSON values, exactly, with what it takes and what it does."""
    case, layout = oracle.case, oracle.case.layout
    distance = distance_of(layout, case.scene.diagonal, failure.position, failure.yaw)
    make = load_reid(reid)
    rng = np.random.default_rng([seed, case.number, 2])
    impact = downstream_impact(case, make, failure.position, failure.yaw, rng)
    moved = np.any(failure.position != layout.position, axis=1) | (failure.yaw != layout.yaw)
    snapshot, truth = observe(layout.with_poses(failure.position, failure.yaw), case.camera)
    given = oracle.reid.identify(snapshot)
    return {
        "position": failure.position.tolist(),
        "yaw": failure.yaw.tolist(),
        "effort": failure.distance,
        "largest": distance.largest,
        "metres": distance.metres,
        "degrees": distance.degrees,
        "wrong": failure.wrong,
        "query": failure.query,
        "surprise": surprise(case, failure.position, failure.yaw),
        "moved": [layout.labels[i] for i in np.flatnonzero(moved)],
        "misread": [[true, label] for true, label in zip(truth, given.labels, strict=True) if label != true],
        "confidence": _confidence(case, oracle.reid, failure.position, failure.yaw),
        "endpoint_error_m": impact.endpoint_error_m,
        "miscounts": impact.miscounts,
    }


def surprise(case: Case, position: FloatArray, yaw: FloatArray) -> float:
    """How unlikely a displacement is under random noise: half the sum of its squared standard scores.

    The likelihood of a displacement relative to that of none is exp(-surprise).
    """
    noise, layout = random_noise(case.scene), case.layout
    shift = (position - layout.position) / noise.translation.sd
    turn = wrap(yaw - layout.yaw) / noise.rotation.sd
    return float((np.sum(shift**2) + np.sum(turn**2)) / 2)


def _disturbed(case: Case, draws: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Layouts under random noise, (B, N, 2) and (B, N); what would stand in something else stays."""
    layout = case.layout
    drawn = random_noise(case.scene).disturb(layout, case.scene.size, rng, (draws,))
    position, yaw = drawn.position.copy(), drawn.yaw.copy()
    settle(position, yaw, case.constraints)
    return position, yaw


def _confidence(
    case: Case, reid: Reidentifier, position: FloatArray, yaw: FloatArray
) -> list[tuple[float, bool]]:
    """The confidence of each answer, and whether it is right, where the re-identifier reports it."""
    snapshot, truth = observe(case.layout.with_poses(position, yaw), case.camera)
    answer = reid.identify(snapshot)
    confidence = getattr(answer, "confidence", None)
    if confidence is None:
        return []
    each = zip(confidence, answer.labels, truth, strict=True)
    return [(float(p), label == true) for p, label, true in each if np.isfinite(p)]


def _untouched(case: Case) -> tuple[FloatArray, FloatArray]:
    return case.layout.position[None], case.layout.yaw[None]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
