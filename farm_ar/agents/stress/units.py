"""The units of a stress test: what is known of a case, and one attack on it."""

from __future__ import annotations

import time
import zlib
from functools import partial
from typing import Any

import numpy as np

from farm_ar.agents.attacks import Failure, Trial, attack_named, wrong_labels
from farm_ar.agents.attacks.validity import settle
from farm_ar.agents.cases import Case, draw_case
from farm_ar.agents.certificates import lower_bound
from farm_ar.agents.effort import effort_of
from farm_ar.agents.stress.by_hand import by_hand
from farm_ar.agents.stress.harm import harm_of
from farm_ar.agents.stress.rules import make_reid
from farm_ar.arrays import FloatArray
from farm_ar.envs.generator import SPREADS, scene_of, unit_of
from farm_ar.geometry import wrap
from farm_ar.reid import Reidentifier
from farm_ar.scenes import Gaussian, LayoutNoise, Scene, observe
from farm_ar.sweeps import Outcome

ASKED_FOR_CONFIDENCE = 12
"""Draws of everyday disorder that are looked at for confidence too."""


def known_case(scene: str, case: int, jitter: str, seed: int) -> Case:
    """The case of a stress test by its number."""
    return draw_case(scene_of(scene, game=False), case, seed, jitter)


def everyday_noise(scene: Scene) -> LayoutNoise:
    """The disorder that the environments call "default", grown with the scene: the motion model."""
    metres, radians = SPREADS["default"]
    return LayoutNoise(Gaussian(0.0, metres * unit_of(scene)), Gaussian(0.0, float(radians)))


def describe_case(
    seed: int, scene: str, jitter: str, case: int, reid: str, draws: int, code: str = ""
) -> Outcome:
    """The certificate of a case, and how often everyday disorder breaks it.

    Args:
        seed: of the stress test.
        scene: the room's name.
        jitter: how far layouts stray.
        case: its number.
        reid: the re-identifier's name.
        draws: how many disordered layouts are looked at.
        code: tells results apart that other code gave under the same names.
    """
    begin = time.process_time()
    known = known_case(scene, case, jitter, seed)
    rule = make_reid(reid, known.scene)
    bound = lower_bound(known, rule)
    position, yaw = _disordered(known, draws, np.random.default_rng([seed, case, 1]))
    wrong = wrong_labels(known, rule, position, yaw)
    sure = [_confidence(known, rule, position[k], yaw[k]) for k in range(min(ASKED_FOR_CONFIDENCE, draws))]
    row = {
        "case": case,
        "reid": reid,
        "bound": _finite(bound.total),
        "bound_largest": _finite(bound.largest),
        "bound_t1": _finite(bound.first),
        "bound_by_object": [_finite(value) for value in bound.by_object.tolist()],
        "theorem": bound.theorem,
        "in_view": known.in_view.tolist(),
        "wrong_untouched": int(wrong_labels(known, rule, *_untouched(known))[0]),
        "noise_draws": len(wrong),
        "noise_failures": int(np.count_nonzero(wrong)),
        "noise_wrong": int(wrong.sum()),
        "confidence": [pair for pairs in sure for pair in pairs],
        "camera": [*known.camera.position.tolist(), float(known.camera.yaw)],
    }
    return Outcome([row], [{"case": case, "reid": reid, "seconds": time.process_time() - begin}])


def attack_case(
    seed: int,
    scene: str,
    jitter: str,
    case: int,
    reid: str,
    attack: str,
    queries: int,
    budget: float,
    transfer: list[str],
    code: str = "",
) -> Outcome:
    """One attack on one case under one re-identifier.

    Args:
        seed: of the stress test.
        scene: the room's name.
        jitter: how far layouts stray.
        case: its number.
        reid: the re-identifier's name.
        attack: the attack's name.
        queries: snapshots that it may ask about.
        budget: effort that a perturbation may take.
        transfer: names of the re-identifiers that its cheapest failure is also shown to.
        code: tells results apart that other code, or another player, gave under the same names.
    """
    known = known_case(scene, case, jitter, seed)
    trial = Trial(known, make_reid(reid, known.scene), queries, budget)
    names = zlib.crc32(f"{attack} {reid}".encode())
    begin = time.process_time()
    attack_named(attack)(trial, np.random.default_rng([seed, case, names]))
    seconds = time.process_time() - begin
    row: dict[str, Any] = {
        "case": case,
        "reid": reid,
        "attack": attack,
        "asked": trial.asked,
        "least": None if trial.cheapest is None else trial.cheapest.effort,
        "cells": trial.cells.tolist(),
        "cheapest": None,
        "worst": None,
    }
    for name in ("cheapest", "worst"):
        failure = getattr(trial, name)
        if failure is not None:
            row[name] = _described(trial, failure, reid, seed)
    if trial.cheapest is not None:
        if known.layout.fixed.any():
            row["cheapest"]["by_hand"] = by_hand(
                known, trial.reid, trial.cheapest.position, trial.cheapest.yaw
            )
        shown = trial.cheapest.position[None], trial.cheapest.yaw[None]
        row["transfer"] = {
            other: int(wrong_labels(known, make_reid(other, known.scene), *shown)[0]) for other in transfer
        }
    measured = {"case": case, "reid": reid, "attack": attack, "asked": trial.asked, "seconds": seconds}
    return Outcome([row], [measured])


def _described(trial: Trial, failure: Failure, reid: str, seed: int) -> dict[str, Any]:
    """A failure as JSON values, exactly, with what it takes and what it does."""
    case, layout = trial.case, trial.case.layout
    effort = effort_of(layout, case.scene.diagonal, failure.position, failure.yaw)
    make = partial(make_reid, reid)
    harm = harm_of(case, make, failure.position, failure.yaw, np.random.default_rng([seed, case.number, 2]))
    moved = np.any(failure.position != layout.position, axis=1) | (failure.yaw != layout.yaw)
    snapshot, truth = observe(layout.with_poses(failure.position, failure.yaw), case.camera)
    given = trial.reid.identify(snapshot)
    return {
        "position": failure.position.tolist(),
        "yaw": failure.yaw.tolist(),
        "effort": failure.effort,
        "largest": effort.largest,
        "metres": effort.metres,
        "degrees": effort.degrees,
        "wrong": failure.wrong,
        "query": failure.query,
        "surprise": surprise(case, failure.position, failure.yaw),
        "moved": [layout.labels[i] for i in np.flatnonzero(moved)],
        "misread": [[true, label] for true, label in zip(truth, given.labels, strict=True) if label != true],
        "confidence": _confidence(case, trial.reid, failure.position, failure.yaw),
        "endpoint_error_m": harm.endpoint_error_m,
        "miscounts": harm.miscounts,
    }


def surprise(case: Case, position: FloatArray, yaw: FloatArray) -> float:
    """How unlikely a displacement is under everyday disorder: half the sum of its squared standard scores.

    The likelihood of a displacement relative to that of none is exp(-surprise).
    """
    noise, layout = everyday_noise(case.scene), case.layout
    shift = (position - layout.position) / noise.translation.sd
    turn = wrap(yaw - layout.yaw) / noise.rotation.sd
    return float((np.sum(shift**2) + np.sum(turn**2)) / 2)


def _disordered(case: Case, draws: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Layouts in everyday disorder, (B, N, 2) and (B, N); what would stand in something else stays."""
    layout = case.layout
    drawn = everyday_noise(case.scene).disturb(layout, case.scene.size, rng, (draws,))
    position, yaw = drawn.position.copy(), drawn.yaw.copy()
    settle(
        position, yaw, layout.position, layout.yaw, layout.size,
        case.keeps_clear, case.stays_inside, *case.scene.size,
    )  # fmt: skip
    return position, yaw


def _confidence(
    case: Case, rule: Reidentifier, position: FloatArray, yaw: FloatArray
) -> list[tuple[float, bool]]:
    """How sure each answer is, and whether it is right, where the rule says how sure it is."""
    snapshot, truth = observe(case.layout.with_poses(position, yaw), case.camera)
    answer = rule.identify(snapshot)
    sure = getattr(answer, "confidence", None)
    if sure is None:
        return []
    each = zip(sure, answer.labels, truth, strict=True)
    return [(float(p), label == true) for p, label, true in each if np.isfinite(p)]


def _untouched(case: Case) -> tuple[FloatArray, FloatArray]:
    return case.layout.position[None], case.layout.yaw[None]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
