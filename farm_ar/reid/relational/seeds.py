"""Where to look for a motion that a group shared: every pair, and every two pairs, of label and detection."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.likelihood.records import Known, Reach
from farm_ar.reid.relational.records import Group, Search, Sight
from farm_ar.reid.relational.weights import move_labels

MOST_SEEDS = 500
"""Motions of one group that are looked at."""

FARTHEST = 50.0
"""Square of how far a moved label may be from a detection and count, by the SD."""


class Laid(NamedTuple):
    """The detections of a snapshot, for the scores of all motions of a group.

    Args:
        alone: (N,) how likely each is without what the group adds where it has moved.
        log_alone: the sum of the logarithms.
        order: (N,) the detections by x, rising.
        x: (N,) theirs, metres.
        more: (N,) room: what the group adds, 0 between two motions.
    """

    alone: FloatArray
    log_alone: float
    order: IntArray
    x: FloatArray
    more: FloatArray


def best_motions(
    known: Known, search: Search, sight: Sight, reach: Reach, groups: list[Group], kept: int
) -> list[list[list[float]]]:
    """The motions of each group that are the most promising, the best first: score, shift x and z, and turn.

    Args:
        known: the labels and the models.
        search: limits, and the scales at which motions are judged.
        sight: the detections.
        reach: where labels that move alone may be found.
        groups: the groups.
        kept: how many of each at most.
    """
    narrow = reach.place[search.translation_scale] * reach.heading[search.rotation_scale]
    wide = reach.place[-1] * reach.heading[-1]
    density = sight.like * ((1 - search.wide) * narrow + search.wide * wide)
    seeds = np.empty((MOST_SEEDS, 4))
    best = []
    for group in groups:
        count = find_motions(known, search, sight, group, density, seeds)
        order = np.argsort(-seeds[:count, 0], kind="stable")[:kept]
        best.append(seeds[order].tolist())
    return best


_compile = compiled(error_model="numpy")


@_compile
def lay_out(sight: Sight, group: Group, density: FloatArray) -> Laid:
    """The detections as `score_motion` needs them, whatever the motion of a group.

    Args:
        sight: the detections.
        group: which labels may have moved as one.
        density: (N, M) of each detection if each label moved alone.
    """
    n = len(sight.nothing)
    alone, other = np.empty(n), np.ones(density.shape[1])
    for g in range(len(group.label)):
        other[group.label[g]] -= group.member[g]
    for i in range(n):
        alone[i] = sight.nothing[i]
        for j in range(len(other)):
            alone[i] += other[j] * density[i, j]
        alone[i] = max(alone[i], 1e-300)
    x = sight.found.position[0, :, 0].copy()
    order = np.argsort(x)
    return Laid(alone, np.log(alone).sum(), order, x[order], np.zeros(n))


@_compile
def score_motion(
    known: Known, search: Search, sight: Sight, group: Group, motion: FloatArray, laid: Laid
) -> float:
    """How likely the detections are if a group moved so, each without regard to the others: a logarithm.

    Args:
        known: the labels and models.
        search: the scales at which to judge.
        sight: the detections.
        group: which labels may have moved as one.
        motion: (3,) shift x and z, metres, and turn, radians.
        laid: the detections, of `lay_out`.
    """
    models, here = known.models, group.labels
    spread = models.translation_sd[search.translation_scale]
    variance = spread * spread + known.detecting.position_sd**2
    height, reach = (1 - search.wide) / (2 * math.pi * variance), math.sqrt(FARTHEST * variance)
    last = models.heading.shape[2] - 1
    move_labels(known.labels, group, motion)
    score = laid.log_alone
    for g in range(len(group.label)):
        j, x, z = group.label[g], here.position[g, 0], here.position[g, 1]
        for k in range(np.searchsorted(laid.x, x - reach), len(laid.x)):
            i, dx = laid.order[k], laid.x[k] - x
            if dx > reach:
                break
            dz = sight.found.position[0, i, 1] - z
            squares = (dx * dx + dz * dz) / variance
            if squares > FARTHEST or sight.like[i, j] == 0.0:
                continue
            heading = 1 / (2 * math.pi)
            turn = sight.found.yaw[0, i] - here.yaw[g]
            if here.period[g] > 0.0 and not math.isnan(turn):
                turn /= here.period[g]
                half_turns = 2 * abs(turn - np.round(turn))
                place = int(half_turns * last + 0.5) if half_turns <= 1.0 else last
                heading = models.heading[search.rotation_scale, here.table[g], place]
            laid.more[i] += group.member[g] * height * math.exp(-0.5 * squares) * heading * sight.like[i, j]
    for i in range(len(laid.more)):
        if laid.more[i] > 0.0:
            score += math.log1p(laid.more[i] / laid.alone[i])
            laid.more[i] = 0.0
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
    n, members = len(sight.nothing), len(group.label)
    first = group.label[0]
    before, towards = np.empty(members), np.empty(members)
    for g in range(members):
        sx = labels.position[group.label[g], 0] - group.pivot[0]
        sz = labels.position[group.label[g], 1] - group.pivot[1]
        before[g], towards[g] = math.hypot(sx, sz), math.atan2(sx, sz)
    motion, count, laid = np.empty(3), 0, lay_out(sight, group, density)
    for i in range(n):
        motion[0], motion[1] = position[i, 0] - group.pivot[0], position[i, 1] - group.pivot[1]
        if sight.like[i, first] == 0.0 or math.hypot(motion[0], motion[1]) > search.longest:
            continue
        for other in range(n):
            x, z = position[other, 0] - position[i, 0], position[other, 1] - position[i, 1]
            apart = math.hypot(x, z)
            for g in range(members):
                if other == i or g == 0:
                    # The first pair alone, once: its own turn.
                    period = labels.period[first]
                    turn = yaw[i] - labels.yaw[first]
                    if other != i or g != 0 or period == 0.0 or math.isnan(turn):
                        continue
                else:
                    if abs(before[g] - apart) > search.tolerance or before[g] == 0.0 or apart == 0.0:
                        continue
                    if sight.like[other, group.label[g]] == 0.0:
                        continue
                    period = 2 * math.pi
                    turn = math.atan2(x, z) - towards[g]
                turn -= period * np.round(turn / period)
                if abs(turn) > search.most_turned or count == len(seeds):
                    continue
                motion[2] = turn
                seeds[count, 0] = score_motion(known, search, sight, group, motion, laid)
                seeds[count, 1], seeds[count, 2], seeds[count, 3] = motion[0], motion[1], motion[2]
                count += 1
    return count
