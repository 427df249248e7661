"""Looking for motions that objects shared in a snapshot, and what each makes of it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.reid.likelihood.densities import look
from farm_ar.reid.likelihood.records import Eyes, Found, Known, Ways
from farm_ar.reid.place import USUAL_LENGTH_M, Lengths
from farm_ar.reid.registration import RigidMotion, concentration_of
from farm_ar.reid.relational.fit import STILL, Limits, fill_frame, fit_frame, fit_group, new_reach
from farm_ar.reid.relational.groups import a_group, fresh
from farm_ar.reid.relational.options import Relation, RelationalOptions
from farm_ar.reid.relational.records import Frame, Group, Outcome, Search, Sight
from farm_ar.reid.relational.seeds import best_motions

STEPS = 4
"""Most steps in which a motion is improved."""

NEGLIGIBLE = 8.0
"""By how much, in logarithms, evidence may fall short of the best and still count."""

SPREADS, TURN = (0.15, 0.4), float(np.deg2rad(15))
"""Scales at which motions are compared: SDs of places, by the labels' usual distance, and of headings."""

TOLERANCE, APART = 0.25, 0.3
"""By the labels' usual distance: how well two pairs must agree; from where on two motions differ."""

WIDE = 0.05
"""Share of the labels that may have moved far, when motions are compared."""

LIMIT = 3.0
"""SDs within which motions are looked for."""

ROUNDING = 1e-9
"""Share of a length that is rounding: a look-alike may have stood just as far away as is looked."""

NEAR = 2.0 / USUAL_LENGTH_M
"""Distance of a camera from a pivot, by the scene's length, up to which turning moves little that is far."""

DRIFT = 0.2
"""SD of a drift's shift in x and z, by the spacing of look-alikes, where none is given."""

KEPT_SEEDS = 5
"""Motions of each group that are compared with others'."""

LEAST_RATES = 0.05
"""Probability of rates of misses and false detections below which they are left out."""


class Hypothesis(NamedTuple):
    """A motion that objects may have shared, the log of its prior, and what follows from it."""

    relation: Relation
    log_prior: float
    outcome: Outcome

    @property
    def best(self) -> float:
        """Log of the prior and evidence of the most probable model."""
        return self.log_prior + float(self.outcome.evidence.max())


class Setting(NamedTuple):
    """What motions are looked for with.

    Args:
        known: the labels and models.
        names: of the labels.
        options: what is assumed.
        lengths: of the scene.
        middle: (2,) of the scene, metres.
        spacing: usual distance of a label to the nearest other one, metres.
        groups: those that may have moved.
        anchors: all labels, around each that is fixed.
    """

    known: Known
    names: tuple[str, ...]
    options: RelationalOptions
    lengths: Lengths
    middle: FloatArray
    spacing: float
    groups: list[Group]
    anchors: list[Group]


def hypotheses(setting: Setting, eyes: Eyes, found: Found) -> list[Hypothesis]:
    """All that may explain what was seen; the first is that each label moved alone.

    Args:
        setting: what motions are looked for with.
        eyes: the cameras between which the detections were seen.
        found: the detections, one row for each camera, all alike.
    """
    options, labels = setting.options, len(setting.names)
    raw = _sight(eyes, found, labels)
    look(setting.known, found, 0, raw.like, raw.nothing)
    frame = _frame(setting, raw)
    fill_frame(setting.known, frame)
    no_group = float(np.log1p(-options.group))
    result = [_alone(setting, frame, float(np.log1p(-options.drift)) + no_group)]
    best, still, there = result[0], frame, setting
    use = _worth_using(setting, best.outcome)
    if options.drift > 0:
        for pivot in (raw.eyes.position.mean(axis=0), setting.middle):
            log_prior = float(np.log(options.drift / 2)) + no_group
            hypothesis, drifted = _drifted(setting, raw, still, pivot, use, log_prior, best.best)
            result.append(hypothesis)
            if hypothesis.best > best.best:
                best, frame, there = hypothesis, drifted, _drifted_too(setting, hypothesis.outcome)
    if options.group > 0 and len(raw.nothing) > 1:
        log_prior = best.log_prior - no_group + float(np.log(options.group / max(len(setting.groups), 1)))
        highest = best.best
        for q, motion in _promising(setting, frame):
            result.append(_moved(there, frame, q, motion, use, log_prior, highest))
            highest = max(highest, result[-1].best)
    return result


def _worth_using(setting: Setting, alone: Outcome) -> BoolArray:
    """(K,) models to consider if objects moved together: those with probable rates.

    Rates say nothing of how objects moved, so that those which one hypothesis makes improbable are left out.
    """
    models = setting.known.models
    rates = np.stack([models.detect_rate, models.none_rate], axis=-1)
    _, which = np.unique(rates, axis=0, return_inverse=True)
    which = which.reshape(-1)
    total = np.bincount(which, np.exp(alone.evidence - alone.evidence.max()))
    prior = np.bincount(which, np.exp(models.log_prior))
    worth: BoolArray = (total > LEAST_RATES * total.sum()) | (prior == prior.max())
    return worth[which]


def _alone(setting: Setting, frame: Frame, log_prior: float) -> Hypothesis:
    """That each label moved alone: a group without members."""
    nobody = a_group(setting.known.labels, np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(2), (1.0, 1.0))
    outcome = _outcome(frame)
    limits = Limits(np.ones(len(outcome.evidence), dtype=bool), 0, -np.inf, _still(setting))
    fit_group(setting.known, frame, nobody, limits, np.zeros(3), outcome)
    return Hypothesis(Relation("alone", 0.0), log_prior, outcome)


def _drifted(
    setting: Setting,
    raw: Sight,
    still: Frame,
    pivot: FloatArray,
    use: BoolArray,
    log_prior: float,
    best: float,
) -> tuple[Hypothesis, Frame]:
    """That the frame drifted about a pivot, from the start that leads to the most."""
    options, labels = setting.options, np.arange(len(setting.names))
    turn_sd = float(np.deg2rad(options.drift_deg))
    prior = _drift_sd(setting), turn_sd
    everyone = a_group(setting.known.labels, labels, np.ones(len(labels)), pivot, prior)
    reached: list[tuple[Hypothesis, Frame]] = []
    for motion in _drift_starts(setting, still, pivot, turn_sd):
        frame = _frame(setting, _sight(raw.eyes, raw.found, 0, raw))
        outcome, limits = _outcome(frame), Limits(use, STEPS, best - log_prior - NEGLIGIBLE, _still(setting))
        fit_frame(setting.known, raw, everyone, limits, motion, frame, outcome)
        hypothesis = Hypothesis(_relation("drift", everyone, motion), log_prior, outcome)
        best = max(best, hypothesis.best)
        reached.append((hypothesis, frame))
    return max(reached, key=lambda one: one[0].best)


def _drifted_too(setting: Setting, drift: Outcome) -> Setting:
    """What groups in a drifted frame are looked for with: models as likely as they and their drift."""
    known, likely = setting.known, drift.likely.copy()
    likely[np.isneginf(drift.evidence)] = likely[drift.evidence.argmax()]  # its drift was not fitted
    models = known.models._replace(log_prior=known.models.log_prior + likely)
    return setting._replace(known=known._replace(models=models))


def _drift_starts(setting: Setting, still: Frame, pivot: FloatArray, turn_sd: float) -> list[FloatArray]:
    """Where to begin: no drift; turned either way about what is far; what takes a fixed label to a detection.

    What is fixed shows the drift as exactly as it is detected, but only from close by.
    """
    near = np.linalg.norm(still.sight.eyes.position - pivot, axis=-1).max() < NEAR * setting.lengths.scene
    starts = [np.array([0.0, 0.0, sign * turn_sd]) for sign in ((0.0,) if near else (0.0, -1.0, 1.0))]
    if not setting.anchors:
        return starts
    away = float(np.linalg.norm(still.sight.found.position[0] - pivot, axis=-1).max())
    longest = LIMIT * float(np.hypot(_drift_sd(setting), away * turn_sd))
    search = _search(setting, SPREADS[0], longest, LIMIT * turn_sd)
    best = best_motions(setting.known, search, still.sight, still.reach, setting.anchors, 1)
    for anchor, motions in zip(setting.anchors, best, strict=True):
        for _, *motion in motions:
            about = RigidMotion(anchor.pivot, np.array(motion[:2]), np.array(motion[2])).about(pivot)
            starts.append(np.array([*about.shift, about.turn]))
    return starts


def _still(setting: Setting) -> float:
    """By how much a motion that is found may still change, metres."""
    return STILL * setting.lengths.scene / USUAL_LENGTH_M


def _drift_sd(setting: Setting) -> float:
    """SD of a drift's shift in x and z, metres."""
    given = setting.options.drift_m
    return DRIFT * setting.lengths.spacing if given is None else given


def _moved(
    setting: Setting, frame: Frame, q: int, motion: FloatArray, use: BoolArray, log_prior: float, best: float
) -> Hypothesis:
    """That a group moved, by about a motion."""
    group, outcome = fresh(setting.groups[q]), _outcome(frame)
    limits = Limits(use, STEPS, best - log_prior - NEGLIGIBLE, _still(setting))
    fit_group(setting.known, frame, group, limits, motion, outcome)
    label = setting.names[group.label[0]]
    return Hypothesis(_relation("group", group, motion, label), log_prior, outcome)


def _promising(setting: Setting, frame: Frame) -> list[tuple[int, FloatArray]]:
    """The most promising motions of groups that differ: which group, and the motion."""
    every: list[tuple[float, int, FloatArray]] = []
    if not setting.groups:
        return []
    turn_sd = float(np.deg2rad(setting.options.group_deg))
    shift_sd = setting.groups[0].shift_precision ** -0.5
    groups = [fresh(group) for group in setting.groups]
    for spread in SPREADS:
        search = _search(setting, spread, LIMIT * shift_sd, LIMIT * turn_sd)
        best = best_motions(setting.known, search, frame.sight, frame.reach, groups, KEPT_SEEDS)
        every += [(row[0], q, np.array(row[1:])) for q, rows in enumerate(best) for row in rows]
    every.sort(key=lambda one: -one[0])
    chosen: list[tuple[int, FloatArray]] = []
    for _, q, motion in every:
        if len(chosen) >= setting.options.tried:
            break
        if not any(_alike(setting, q, motion, *other) for other in chosen):
            chosen.append((q, motion.copy()))
    return chosen


def _search(setting: Setting, spread: float, longest: float, most_turned: float) -> Search:
    known = setting.known
    spreads, sharpness = known.models.translation_sd[1:], known.models.sharpness[1:]
    return Search(
        translation_scale=1 + int(np.abs(spreads - spread * setting.spacing).argmin()),
        rotation_scale=1 + int(np.abs(sharpness - concentration_of(np.array(TURN))).argmin()),
        wide=WIDE,
        longest=longest * (1 + ROUNDING),
        most_turned=min(most_turned, np.pi),
        tolerance=TOLERANCE * setting.spacing,
    )


def _alike(setting: Setting, q: int, motion: FloatArray, other: int, second: FloatArray) -> bool:
    """Whether a group's motion and another's take its middle to about the same pose."""
    middle, end = (setting.groups[one].pivot for one in (q, other))
    x, z = middle - end
    sine, cosine = math.sin(second[2]), math.cos(second[2])
    dx = cosine * x + sine * z + second[0] - x - motion[0]
    dz = cosine * z - sine * x + second[1] - z - motion[1]
    turn = abs((motion[2] - second[2] + math.pi) % (2 * math.pi) - math.pi)
    return math.hypot(dx, dz) < APART * setting.spacing and turn < TURN


def _relation(kind: str, group: Group, motion: FloatArray, label: str | None = None) -> Relation:
    x, z, turn = motion.tolist()
    return Relation(kind, 0.0, (float(group.pivot[0]), float(group.pivot[1])), (x, z), turn, label)


def _sight(eyes: Eyes, found: Found, labels: int, like: Sight | None = None) -> Sight:
    """Cameras and detections whose poses may be changed; the looks are to be filled in, or another's."""
    eyes = eyes._replace(position=eyes.position.copy(), yaw=eyes.yaw.copy())
    found = found._replace(position=found.position.copy(), yaw=found.yaw.copy(), rival=found.rival.copy())
    if like is not None:
        return Sight(eyes, found, like.like, like.nothing)
    n = found.yaw.shape[1]
    return Sight(eyes, found, np.empty((n, labels)), np.empty(n))


def _frame(setting: Setting, sight: Sight) -> Frame:
    k, (n, m) = len(setting.known.models.log_prior), sight.like.shape
    alone = Ways(
        weight=np.empty((k, n, m)),
        none=np.empty((0, n)),
        unseen=np.empty((k, m)),
        log_unseen=np.empty(k),
        each=np.empty((0, n, m + 1)),
        posterior=np.empty(0),
    )
    return Frame(sight, new_reach(setting.known, n, m), alone)


def _outcome(frame: Frame) -> Outcome:
    k, n, m = frame.alone.weight.shape
    return Outcome(np.empty(k), np.zeros(k), np.zeros((k, n, m + 1)), np.ones((k, m)))
