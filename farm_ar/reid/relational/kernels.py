"""Compiled kernels of `RelationalReid`: how likely a snapshot is if labels, or their frame, moved as one."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.kernels import compiled
from farm_ar.reid.likelihood.densities import (
    heading_density,
    likeness,
    translation_density,
    view_probability,
)
from farm_ar.reid.likelihood.kernels import CHEAP, LEAST_NONE
from farm_ar.reid.likelihood.records import Labels, Models
from farm_ar.reid.marginals import exact_marginals, propagate, scale_rows
from farm_ar.reid.registration import add_pair, solve_motion, volume
from farm_ar.reid.relational.records import Alone, Group, Groups, Known, Outcome, Reach, Search, Sight

ROUNDS = 30
"""Most rounds of belief propagation; that of one model starts from where the last one's ended."""

LEAST_PAIR = 1e-4
"""Probability of a pair below which it does not count for a motion."""

LEAST_UNSEEN = 1e-9

LEAST_MODEL = 1e-2
"""Probability, of the most probable one's, of a model that is looked at in every step."""

HOPELESS = 2.0
"""By how much, in logarithms, a motion that is worth improving may fall short of one that counts."""

MOST_SEEDS = 500
"""Motions of one group that are looked at."""

STILL = 1e-3
"""Metres and radians by which a motion that is found may still change."""

_compile = compiled(error_model="numpy")


@_compile
def look(known: Known, sight: Sight) -> None:
    """Fill in how likely the detections' looks are."""
    for i in range(len(sight.nothing)):
        category, sides = sight.found.category[0, i], sight.found.sides[0, i]
        likeness(known.labels, known.detecting, category, sides, sight.like[i])
        sight.nothing[i] = sight.like[i].mean() / (known.camera.area * 2 * math.pi)


@_compile
def reach_labels(known: Known, labels: Labels, sight: Sight, reach: Reach) -> None:
    """Fill in where labels may be found by one camera or another."""
    translation_density(labels, known.models, known.detecting, sight.found.position[0], reach.place)
    heading_density(labels, known.models, sight.found.yaw[0], reach.heading)
    if len(sight.eyes.yaw) == 1:
        view_probability(labels, known.models, known.camera, sight.eyes, sight.found, 0, reach.inside)
    else:
        view_between(known, labels, sight, reach.inside)


@_compile
def view_between(known: Known, labels: Labels, sight: Sight, result: FloatArray) -> None:
    """Fill (A, M): how probable it is that each label's object is in view of one camera or another.

    Each of the places that stand for where an object may be is looked for by all cameras.
    """
    every, places = known.models, len(known.models.offset)
    one, seen = np.empty_like(result), np.empty_like(result)
    result[:] = 0.0
    for q in range(places):
        models = Models(
            every.translation_sd,
            every.part,
            every.share,
            every.log_prior,
            every.detect_rate,
            every.none_rate,
            every.heading,
            every.offset[q : q + 1],
        )
        seen[:] = 0.0
        for b in range(len(sight.eyes.yaw)):
            view_probability(labels, models, known.camera, sight.eyes, sight.found, b, one)
            seen = np.maximum(seen, one)
        result += seen
    result /= places


@_compile
def move_labels(known: Known, group: Group, motion: FloatArray) -> None:
    """Fill in where the labels of a group stand after a motion: shift x, shift z, turn about its pivot."""
    sine, cosine = math.sin(motion[2]), math.cos(motion[2])
    for g in range(len(group.label)):
        j = group.label[g]
        x, z = known.labels.position[j, 0] - group.pivot[0], known.labels.position[j, 1] - group.pivot[1]
        group.labels.position[g, 0] = group.pivot[0] + cosine * x + sine * z + motion[0]
        group.labels.position[g, 1] = group.pivot[1] + cosine * z - sine * x + motion[1]
        group.labels.yaw[g] = known.labels.yaw[j] + motion[2]


@_compile
def correct_frame(raw: Sight, pivot: FloatArray, motion: FloatArray, sight: Sight) -> None:
    """Fill in cameras and detections as they were before a motion of their frame about a pivot."""
    sine, cosine = math.sin(motion[2]), math.cos(motion[2])
    for b in range(len(raw.eyes.yaw)):
        x, z = raw.eyes.position[b, 0] - pivot[0] - motion[0], raw.eyes.position[b, 1] - pivot[1] - motion[1]
        sight.eyes.position[b, 0] = pivot[0] + cosine * x - sine * z
        sight.eyes.position[b, 1] = pivot[1] + cosine * z + sine * x
        sight.eyes.yaw[b] = raw.eyes.yaw[b] - motion[2]
    for i in range(len(raw.nothing)):
        x = raw.found.position[0, i, 0] - pivot[0] - motion[0]
        z = raw.found.position[0, i, 1] - pivot[1] - motion[1]
        # Each camera has a row of its own, and all rows are alike.
        sight.found.position[:, i, 0] = pivot[0] + cosine * x - sine * z
        sight.found.position[:, i, 1] = pivot[1] + cosine * z + sine * x
        sight.found.yaw[:, i] = raw.found.yaw[0, i] - motion[2]


@_compile
def weigh_alone(known: Known, sight: Sight, reach: Reach, alone: Alone) -> None:
    """Fill in how likely each label is for each detection under each model, if it moved alone."""
    labels, models = known.labels, known.models
    count, parts = models.share.shape
    n, m = sight.like.shape
    alone.density[:] = 0.0
    alone.inside[:] = 0.0
    for k in range(count):
        rate = (1 - known.detecting.gone_rate) * models.detect_rate[k]
        for p in range(parts):
            share = models.share[k, p]
            if share == 0.0:
                continue
            a, b = models.part[k, p]
            for j in range(m):
                alone.inside[k, j] += share * reach.inside[0 if labels.fixed[j] else a, j]
            for i in range(n):
                for j in range(m):
                    alone.density[k, i, j] += share * reach.place[a, i, j] * reach.heading[b, i, j]
        for j in range(m):
            unseen = max(1 - rate * alone.inside[k, j], LEAST_UNSEEN)
            alone.log_unseen[k, j] = math.log(unseen)
            for i in range(n):
                alone.weight[k, i, j] = alone.density[k, i, j] * sight.like[i, j] * rate / unseen


@_compile
def weigh_group(
    known: Known,
    k: int,
    sight: Sight,
    alone: Alone,
    group: Group,
    go: Reach,
    weight: FloatArray,
    together: FloatArray,
    unseen: FloatArray,
) -> float:
    """Weights under model k, where the labels of a group have moved as one or alone.

    Args:
        known: the labels and models.
        k: the model.
        sight: the detections.
        alone: how likely they are of labels that move alone.
        group: which labels may have moved as one.
        go: where these then may be found.
        weight: (N, M) filled with the weight of each label.
        together: (N, G) filled with the share of it that is due to moving as one.
        unseen: (M,) filled with the probability that each label is not seen.

    Returns:
        The log probability that no label is seen.
    """
    models, n = known.models, len(sight.nothing)
    rate = (1 - known.detecting.gone_rate) * models.detect_rate[k]
    log_unseen = 0.0
    for i in range(weight.shape[0]):  # not all at once, which takes seconds more to compile
        for j in range(weight.shape[1]):
            weight[i, j] = alone.weight[k, i, j]
    for j in range(len(unseen)):
        unseen[j] = math.exp(alone.log_unseen[k, j])
        log_unseen += alone.log_unseen[k, j]
    for g in range(len(group.label)):
        j, member = group.label[g], group.member[g]
        inside = 0.0
        for p in range(models.share.shape[1]):
            a = 0 if known.labels.fixed[j] else models.part[k, p, 0]
            inside += models.share[k, p] * go.inside[a, g]
        inside = member * inside + (1 - member) * alone.inside[k, j]
        unseen[j] = max(1 - rate * inside, LEAST_UNSEEN)
        log_unseen += math.log(unseen[j]) - alone.log_unseen[k, j]
        for i in range(n):
            moved = 0.0
            for p in range(models.share.shape[1]):
                a, b = models.part[k, p]
                moved += models.share[k, p] * go.place[a, i, g] * go.heading[b, i, g]
            moved *= member
            density = moved + (1 - member) * alone.density[k, i, j]
            together[i, g] = moved / density if density > 0.0 else 0.0
            weight[i, j] = density * sight.like[i, j] * rate / unseen[j]
    return log_unseen


@_compile
def judge(
    known: Known,
    k: int,
    sight: Sight,
    log_unseen: float,
    floor: float,
    weight: FloatArray,
    none: FloatArray,
    to_row: FloatArray,
    chance: FloatArray,
) -> float:
    """Log evidence of model k, and the marginals; minus infinite where it cannot reach a floor.

    Args:
        known: the models.
        k: the model.
        sight: the detections.
        log_unseen: log probability that no label is seen.
        floor: log evidence below which the model does not matter.
        weight: (N, M) of each label; changed.
        none: (N,) room.
        to_row: (N, M) messages of belief propagation: where to start from, and where it ended.
        chance: (N, M + 1) filled with the marginals.
    """
    evidence = known.models.log_prior[k] + log_unseen
    bound = evidence
    for i in range(len(none)):
        none[i] = max(sight.nothing[i] * max(known.models.none_rate[k], LEAST_NONE), 1e-290)
        bound += math.log(none[i] + weight[i].sum())
    if not bound > floor:
        return -np.inf
    evidence += scale_rows(weight, none)
    if len(none) <= CHEAP:
        return float(evidence + math.log(exact_marginals(weight, none, chance)))
    return float(evidence + propagate(weight, none, chance, to_row, ROUNDS, 1e-3))


@_compile
def add_pairs(
    known: Known,
    k: int,
    sight: Sight,
    group: Group,
    go: Reach,
    turn: float,
    chance: FloatArray,
    together: FloatArray,
    sums: FloatArray,
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
        together: (N, G) share of these that is due to moving as one.
        sums: (7,) as `add_pair` has them.
    """
    labels, models = known.labels, known.models
    for i in range(len(sight.nothing)):
        position, yaw = sight.found.position[0, i], sight.found.yaw[0, i]
        for g in range(len(group.label)):
            j = group.label[g]
            probable = chance[i, j] * together[i, g]
            if probable < LEAST_PAIR:
                continue
            total, precision, sharpness = 0.0, 0.0, 0.0
            for p in range(models.share.shape[1]):
                a, b = models.part[k, p]
                part = models.share[k, p] * go.place[a, i, g] * go.heading[b, i, g]
                spread = 0.0 if labels.fixed[j] else models.translation_sd[a]
                total += part
                precision += part / (spread * spread + known.detecting.position_sd**2)
                sharpness += part * known.sharpness[0 if labels.fixed[j] else b]
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
                sums,
            )


@_compile
def next_motion(
    group: Group, outcome: Outcome, sums: FloatArray, counts: BoolArray, motion: FloatArray
) -> bool:
    """Move on to the likeliest motion over all models, each as probable as its evidence makes it.

    Args:
        group: whose prior counts.
        outcome: the evidence, not all of it minus infinite.
        sums: (K, 7) of each model.
        counts: (K,) filled with which models are probable enough to be looked at in the next step.
        motion: (3,) changed.

    Returns:
        Whether it stays about the same.
    """
    pooled, total, highest, one = np.zeros(7), 0.0, outcome.evidence.max(), np.empty(3)
    for k in range(len(counts)):
        share = math.exp(outcome.evidence[k] - highest)
        counts[k] = share > LEAST_MODEL
        if counts[k]:
            total += share
            pooled += share * sums[k]
    solve_motion(pooled / total, group.shift_precision, group.turn_concentration, one)
    change = np.abs(motion - one).max()
    for i in range(3):
        motion[i] = one[i]
    return bool(change < STILL)


@_compile
def fit_group(
    known: Known,
    sight: Sight,
    alone: Alone,
    group: Group,
    go: Reach,
    use: BoolArray,
    steps: int,
    floor: float,
    motion: FloatArray,
    outcome: Outcome,
) -> None:
    """Fit the motion of a group by expectation and maximisation, over assignments and models alike.

    Args:
        known: the labels and models.
        sight: the detections.
        alone: how likely they are of labels that move alone.
        group: which labels may have moved as one; none, for the evidence of moving alone.
        go: room for where they then may be found.
        use: (K,) the models to think of.
        steps: most steps of maximisation.
        floor: log evidence below which a model does not matter.
        motion: (3,) shift x and z, metres, and turn, radians: where to begin, filled with the end.
        outcome: filled.
    """
    models, (n, m) = len(known.models.log_prior), sight.like.shape
    weight, none, to_row = np.empty((n, m)), np.empty(n), np.empty((n, m))
    together, sums = np.empty((n, len(group.label))), np.empty((models, 7))
    counts = use.copy()
    outcome.evidence[:] = -np.inf
    last = steps == 0
    for step in range(steps + 1):
        move_labels(known, group, motion)
        reach_labels(known, group.labels, sight, go)
        sums[:] = 0.0
        to_row[:] = 1.0
        for k in range(models):
            if not (use[k] if last else counts[k]):
                continue
            log_unseen = weigh_group(known, k, sight, alone, group, go, weight, together, outcome.unseen[k])
            chance = outcome.chance[k]
            outcome.evidence[k] = judge(known, k, sight, log_unseen, floor, weight, none, to_row, chance)
            if outcome.evidence[k] > -np.inf:
                add_pairs(known, k, sight, group, go, motion[2], chance, together, sums[k])
                outcome.evidence[k] += volume(
                    sums[k], group.shift_precision, group.turn_concentration, motion
                )
        if last or not outcome.evidence.max() > floor - HOPELESS:
            break
        last = next_motion(group, outcome, sums, counts, motion) or step + 1 == steps


@_compile
def fit_frame(
    known: Known,
    raw: Sight,
    group: Group,
    use: BoolArray,
    steps: int,
    floor: float,
    motion: FloatArray,
    sight: Sight,
    reach: Reach,
    alone: Alone,
    outcome: Outcome,
) -> None:
    """`fit_group` of the frame that cameras and detections are in: all labels seem to have moved as one.

    Args:
        known: the labels and models.
        raw: the detections as they came.
        group: all labels.
        use: (K,) the models to think of.
        steps: most steps of maximisation.
        floor: log evidence below which a model does not matter.
        motion: (3,) of the frame: where to begin, filled with the end.
        sight: filled with the detections as they were before the motion.
        reach: filled with where the labels may be found by these.
        alone: filled likewise.
        outcome: filled.
    """
    models, (n, m) = len(known.models.log_prior), raw.like.shape
    none, to_row = np.empty(n), np.empty((n, m))
    together, sums = np.ones((n, m)), np.empty((models, 7))
    counts = use.copy()
    outcome.evidence[:] = -np.inf
    last = steps == 0
    for step in range(steps + 1):
        correct_frame(raw, group.pivot, motion, sight)
        reach_labels(known, known.labels, sight, reach)
        weigh_alone(known, sight, reach, alone)
        sums[:] = 0.0
        to_row[:] = 1.0
        for k in range(models):
            if not (use[k] if last else counts[k]):
                continue
            for j in range(alone.log_unseen.shape[1]):
                outcome.unseen[k, j] = np.exp(alone.log_unseen[k, j])
            chance, log_unseen = outcome.chance[k], alone.log_unseen[k].sum()
            weight = alone.weight[k].copy()
            outcome.evidence[k] = judge(known, k, sight, log_unseen, floor, weight, none, to_row, chance)
            if outcome.evidence[k] > -np.inf:
                add_pairs(known, k, raw, group, reach, motion[2], chance, together, sums[k])
                outcome.evidence[k] += volume(
                    sums[k], group.shift_precision, group.turn_concentration, motion
                )
        if last or not outcome.evidence.max() > floor - HOPELESS:
            break
        last = next_motion(group, outcome, sums, counts, motion) or step + 1 == steps


@_compile
def score_motion(
    known: Known, search: Search, sight: Sight, group: Group, motion: FloatArray, density: FloatArray
) -> float:
    """How likely the detections are if a group moved so, each without regard to the others: a logarithm.

    Args:
        known: the labels and models.
        search: the scales at which to judge.
        sight: the detections.
        group: which labels may have moved as one.
        motion: (3,) shift x and z, metres, and turn, radians.
        density: (N, M) of each detection if each label moved alone.
    """
    models = known.models
    spread = models.translation_sd[search.translation_scale]
    variance = spread * spread + known.detecting.position_sd**2
    height = (1 - search.wide) / (2 * math.pi * variance)
    last = models.heading.shape[2] - 1
    move_labels(known, group, motion)
    score = 0.0
    for i in range(len(sight.nothing)):
        total = sight.nothing[i] + density[i].sum()
        for g in range(len(group.label)):
            j, member = group.label[g], group.member[g]
            total -= member * density[i, j]
            dx = sight.found.position[0, i, 0] - group.labels.position[g, 0]
            dz = sight.found.position[0, i, 1] - group.labels.position[g, 1]
            squares = (dx * dx + dz * dz) / variance
            if squares > 50.0 or sight.like[i, j] == 0.0:
                continue
            heading = 1 / (2 * math.pi)
            turn = sight.found.yaw[0, i] - group.labels.yaw[g]
            if group.labels.period[g] > 0.0 and not math.isnan(turn):
                turn /= group.labels.period[g]
                half_turns = 2 * abs(turn - np.round(turn))
                place = int(half_turns * last + 0.5) if half_turns <= 1.0 else last
                heading = models.heading[search.rotation_scale, group.labels.table[g], place]
            total += member * height * math.exp(-0.5 * squares) * heading * sight.like[i, j]
        score += math.log(max(total, 1e-300))
    squared = motion[0] ** 2 + motion[1] ** 2
    turned = group.turn_concentration * (1 - math.cos(motion[2]))
    return float(score - 0.5 * group.shift_precision * squared - turned)


@_compile
def find_motions(
    known: Known, search: Search, sight: Sight, group: Group, density: FloatArray, seeds: FloatArray
) -> int:
    """Motions that take a group's pivot, where its first label stood, to a detection.

    It turns as that label does, or so that another label of the group fits another detection: every pair of
    that label and a detection, and every two pairs whose distances agree, is tried.

    Args:
        known: the labels and the models.
        search: limits, and the scales at which motions are judged.
        sight: the detections.
        group: the labels, the first of which stood on the pivot.
        density: (N, M) of each detection if each label moved alone.
        seeds: (Q, 4) filled with score, shift x and z, and turn.

    Returns:
        How many there are, at most Q.
    """
    labels, position, yaw = known.labels, sight.found.position[0], sight.found.yaw[0]
    n = len(sight.nothing)
    first = group.label[0]
    motion, count = np.empty(3), 0
    for i in range(n):
        motion[0], motion[1] = position[i, 0] - group.pivot[0], position[i, 1] - group.pivot[1]
        if sight.like[i, first] == 0.0 or math.hypot(motion[0], motion[1]) > search.longest:
            continue
        for other in range(n):
            x, z = position[other, 0] - position[i, 0], position[other, 1] - position[i, 1]
            apart = math.hypot(x, z)
            for g in range(len(group.label)):
                second = group.label[g]
                if other == i or g == 0:
                    # The first pair alone, once: its own turn.
                    period = labels.period[first]
                    turn = yaw[i] - labels.yaw[first]
                    if other != i or g != 0 or period == 0.0 or math.isnan(turn):
                        continue
                else:
                    sx = labels.position[second, 0] - group.pivot[0]
                    sz = labels.position[second, 1] - group.pivot[1]
                    before = math.hypot(sx, sz)
                    if sight.like[other, second] == 0.0 or before == 0.0 or apart == 0.0:
                        continue
                    if abs(before - apart) > search.tolerance:
                        continue
                    period = 2 * math.pi
                    turn = math.atan2(x, z) - math.atan2(sx, sz)
                turn -= period * np.round(turn / period)
                if abs(turn) > search.most_turned or count == len(seeds):
                    continue
                motion[2] = turn
                seeds[count, 0] = score_motion(known, search, sight, group, motion, density)
                seeds[count, 1], seeds[count, 2], seeds[count, 3] = motion[0], motion[1], motion[2]
                count += 1
    return count


@_compile
def best_motions(
    known: Known,
    search: Search,
    sight: Sight,
    reach: Reach,
    groups: Groups,
    best: FloatArray,
) -> None:
    """The motions of each group that are the most promising.

    Args:
        known: the labels and the models.
        search: limits, and the scales at which motions are judged.
        sight: the detections.
        reach: where labels that move alone may be found.
        groups: the groups.
        best: (Q, S, 4) filled with the best S of each group: score, shift x and z, and turn; a score of minus
            infinity where there are fewer.
    """
    n, m = sight.like.shape
    a, b = search.translation_scale, search.rotation_scale
    wide_a, wide_b = reach.place.shape[0] - 1, reach.heading.shape[0] - 1
    density = np.empty((n, m))
    for i in range(n):
        for j in range(m):
            narrow = reach.place[a, i, j] * reach.heading[b, i, j]
            wide = reach.place[wide_a, i, j] * reach.heading[wide_b, i, j]
            density[i, j] = sight.like[i, j] * ((1 - search.wide) * narrow + search.wide * wide)
    seeds = np.empty((MOST_SEEDS, 4))
    best[:] = -np.inf
    for q in range(len(groups.size)):
        group = group_at(known, groups, q)
        count = find_motions(known, search, sight, group, density, seeds)
        order = np.argsort(-seeds[:count, 0])
        for place in range(min(count, best.shape[1])):
            for i in range(best.shape[2]):
                best[q, place, i] = seeds[order[place], i]


@_compile
def group_at(known: Known, groups: Groups, q: int) -> Group:
    """One of many groups."""
    label = groups.label[q, : groups.size[q]].copy()
    every = known.labels
    labels = Labels(
        every.position[label],
        every.yaw[label],
        every.elevation[label],
        every.category[label],
        every.sides[label],
        every.period[label],
        every.table[label],
        every.fixed[label],
        every.room,
    )
    member, pivot = groups.member[q, : groups.size[q]].copy(), every.position[label[0]].copy()
    return Group(label, member, labels, pivot, groups.shift_precision[q], groups.turn_concentration[q])
