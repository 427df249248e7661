"""What a motion that labels shared makes of a snapshot: weights, evidence, sums for a likelier motion."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled
from farm_ar.reid.likelihood.densities import heading_density, translation_density, view_probability
from farm_ar.reid.likelihood.kernels import CHEAP, LEAST_NONE, LEAST_UNSEEN
from farm_ar.reid.likelihood.records import Known, Labels, Reach
from farm_ar.reid.marginals import exact_marginals, propagate, scale_rows
from farm_ar.reid.registration import add_pair
from farm_ar.reid.relational.records import Frame, Group, Outcome, Sight, Work

ROUNDS = 30
"""Most rounds of belief propagation; that of one model starts from where the last one's ended."""

LEAST_PAIR = 1e-4
"""Probability of a pair below which it does not count for a motion."""

_compile = compiled(error_model="numpy")


@_compile
def move_labels(labels: Labels, group: Group, motion: FloatArray) -> None:
    """Fill in where the labels of a group stand after a motion: shift x, shift z, turn about its pivot."""
    sine, cosine = math.sin(motion[2]), math.cos(motion[2])
    for g in range(len(group.label)):
        j = group.label[g]
        x, z = labels.position[j, 0] - group.pivot[0], labels.position[j, 1] - group.pivot[1]
        group.labels.position[g, 0] = group.pivot[0] + cosine * x + sine * z + motion[0]
        group.labels.position[g, 1] = group.pivot[1] + cosine * z - sine * x + motion[1]
        group.labels.yaw[g] = labels.yaw[j] + motion[2]


@_compile
def reach_labels(known: Known, labels: Labels, sight: Sight, reach: Reach) -> None:
    """Fill in where labels may be found by one camera or another."""
    translation_density(known, labels, sight.found, 0, reach.place)
    heading_density(known.models, labels, sight.found, 0, reach.heading)
    view_probability(known, labels, sight.eyes, sight.found, 0, len(sight.eyes.yaw), reach.inside)


@_compile
def weigh_group(known: Known, frame: Frame, group: Group, go: Reach, work: Work, outcome: Outcome) -> None:
    """Fill in weights where the labels of a group have moved as one or alone, under the models in use.

    Args:
        known: the labels and models.
        frame: the detections, and how likely they are of labels that move alone.
        group: which labels may have moved as one.
        go: where these then may be found.
        work: weight, together and log_unseen are filled.
        outcome: its unseen is filled.
    """
    models, fixed, n = known.models, known.labels.fixed, len(frame.sight.nothing)
    share, part, parts = models.share, models.part, models.share.shape[1]
    place, heading, inside_alone = go.place, go.heading, frame.reach.inside
    together, label, members, inside_go = work.together, group.label, group.member, go.inside
    here, turned, like = frame.reach.place, frame.reach.heading, frame.sight.like
    for k in range(len(work.use)):
        if not work.use[k]:
            continue
        rate = (1 - known.detecting.gone_rate) * models.detect_rate[k]
        weight, unseen = work.weight[k], outcome.unseen[k]
        for i in range(n):  # not all at once, which takes seconds more to compile
            for j in range(weight.shape[1]):
                weight[i, j] = frame.alone.weight[k, i, j]
        log_unseen = frame.alone.log_unseen[k]
        for j in range(len(unseen)):
            unseen[j] = frame.alone.unseen[k, j]
        for g in range(len(label)):
            j, member = label[g], members[g]
            inside = 0.0
            for p in range(parts):
                a = 0 if fixed[j] else part[k, p, 0]
                seen = member * inside_go[a, g] + (1 - member) * inside_alone[a, j]
                inside += share[k, p] * seen
            log_unseen -= math.log(unseen[j])
            unseen[j] = max(1 - rate * inside, LEAST_UNSEEN)
            log_unseen += math.log(unseen[j])
            for i in range(n):
                moved, stayed = 0.0, 0.0
                for p in range(parts):
                    a, b = part[k, p, 0], part[k, p, 1]
                    moved += share[k, p] * place[a, i, g] * heading[b, i, g]
                    stayed += share[k, p] * here[a, i, j] * turned[b, i, j]
                moved *= member
                density = moved + (1 - member) * stayed
                together[k, i, g] = moved / density if density > 0.0 else 0.0
                weight[i, j] = density * like[i, j] * rate / unseen[j]
        work.log_unseen[k] = log_unseen


@_compile
def assess_models(
    known: Known,
    sight: Sight,
    group: Group,
    go: Reach,
    work: Work,
    turn: float,
    floor: float,
    outcome: Outcome,
) -> None:
    """Log evidence of the models in use, their marginals, and the sums for the likeliest motion.

    Args:
        known: the labels and models.
        sight: the detections.
        group: the labels that moved as one.
        go: where they may be found after the motion.
        work: room; its sums are added to.
        turn: of the motion, radians.
        floor: log evidence below which a model does not matter.
        outcome: evidence and chance are filled; minus infinite where a model cannot reach the floor.
    """
    none, nothing, false = work.none, sight.nothing, sight.found.false[0]
    for k in range(len(work.use)):
        if not work.use[k]:
            continue
        weight, chance = work.weight[k], outcome.chance[k]
        evidence = known.models.log_prior[k] + work.log_unseen[k]
        bound, rate = evidence, max(known.models.none_rate[k], LEAST_NONE)
        for i in range(len(none)):
            none[i] = max(nothing[i] * (rate + false[i]), 1e-290)
            row = none[i]
            for j in range(weight.shape[1]):
                row += weight[i, j]
            bound += math.log(row)
        if not bound > floor:
            continue
        evidence += scale_rows(weight, none)
        if len(none) <= CHEAP:
            evidence += math.log(exact_marginals(weight, none, chance))
        else:
            evidence += propagate(weight, none, chance, work.to_row, ROUNDS, 1e-3)
        outcome.evidence[k] = evidence
        if evidence > -np.inf:
            add_pairs(known, k, sight, group, go, turn, chance, work)


@_compile
def add_pairs(
    known: Known,
    k: int,
    sight: Sight,
    group: Group,
    go: Reach,
    turn: float,
    chance: FloatArray,
    work: Work,
) -> None:
    """Add up what the likeliest motion of a group follows from: pairs, as probably as they moved as one.

    Args:
        known: the labels and models.
        k: the model.
        sight: the detections.
        group: the labels.
        go: where they may be found after the motion.
        turn: of the motion, radians: the symmetry of an object leaves its own turn open.
        chance: (N, M + 1) marginal probabilities.
        work: its sums are added to.
    """
    labels, models = known.labels, known.models
    for i in range(len(sight.nothing)):
        position, yaw = sight.found.position[0, i], sight.found.yaw[0, i]
        for g in range(len(group.label)):
            j = group.label[g]
            probable = chance[i, j] * work.together[k, i, g]
            if probable < LEAST_PAIR:
                continue
            total, precision, sharpness = 0.0, 0.0, 0.0
            for p in range(models.share.shape[1]):
                a, b = models.part[k, p]
                part = models.share[k, p] * go.place[a, i, g] * go.heading[b, i, g]
                spread = 0.0 if labels.fixed[j] else models.translation_sd[a]
                total += part
                precision += part / (spread * spread + known.detecting.position_sd**2)
                sharpness += part * models.sharpness[0 if labels.fixed[j] else b]
            own = yaw - labels.yaw[j]
            if math.isnan(own):
                own, sharpness = 0.0, 0.0
            elif labels.period[j] > 0.0:
                own -= labels.period[j] * np.round((own - turn) / labels.period[j])
            else:
                sharpness = 0.0
            add_pair(
                labels.position[j],
                position,
                group.pivot,
                own,
                precision * probable / total,
                sharpness * probable / total,
                work.sums[k],
            )
