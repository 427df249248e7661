"""Where to look for a motion that a group shared: every pair, and every two pairs, of label and detection."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled
from farm_ar.reid.likelihood.records import Known, Reach
from farm_ar.reid.relational.records import Group, Search, Sight
from farm_ar.reid.relational.weighing import move_labels

MOST_SEEDS = 500
"""Motions of one group that are looked at."""


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
    move_labels(known.labels, group, motion)
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
