"""The evidence of a confirmed answer for each hypothesis of `AdaptiveReid`."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.adaptive.common import best_motion, density_about, mean_turn, occam
from farm_ar.reid.adaptive.hypotheses import FAMILIES, MOST_SCALES, Hypotheses
from farm_ar.reid.adaptive.inference import tabulated
from farm_ar.reid.adaptive.records import (
    Concentrations,
    DetectionModel,
    Motions,
    Pairs,
    Profile,
    Profiles,
    Table,
)
from farm_ar.reid.adaptive.screening import density_of, freedom_of

_compile = compiled(error_model="numpy")


@_compile
def common_of(pairs: Pairs, profiles: Profiles, chosen: IntArray, table: Table) -> None:
    """Fill in the densities and penalties of the motion that the chosen pairs share."""
    belief = np.zeros(len(pairs.label))
    for p in chosen:
        belief[p] = 1.0
    for r in range(len(profiles.kind)):
        kind, length = profiles.kind[r], profiles.length[r]
        if kind >= Profile.TOGETHER:
            common = best_motion(pairs, belief, length, kind)
            table.penalty[r] = occam(length, common, profiles.length.max())
            density_about(pairs, common, length, table.shift[r])
            mean_turn(pairs, belief, table.swing[r])


@_compile
def evidence_of(
    pairs: Pairs,
    profiles: Profiles,
    angles: Concentrations,
    motions: Motions,
    chosen: IntArray,
    result: FloatArray,
) -> None:
    """Fill (H,) log densities of the chosen pairs, summed, under each motion."""
    count = len(pairs.label)
    table = tabulated(pairs, profiles, angles)
    common_of(pairs, profiles, chosen, table)
    density, known = np.empty(count), np.ones(count)
    for h in range(len(result)):
        density_of(h, pairs, motions, table, known, density)
        result[h] = freedom_of(h, motions, table)
        for p in chosen:
            result[h] += np.log(max(density[p], 1e-300))


def motion_evidence(pairs: Pairs, chosen: IntArray, every: Hypotheses) -> FloatArray:
    """(F, T, A) log evidence of the confirmed pairs for each family, SD of turns and scale.

    Where a family has no such hypothesis it has the least evidence of all.

    Args:
        pairs: of the snapshot.
        chosen: (K,) the pairs that were confirmed.
        every: the motions over `MOST_SCALES` scales.
    """
    found = np.empty(len(every.family))
    evidence_of(pairs, every.profiles, every.angles, every.motions, chosen, found)
    shape = (len(FAMILIES), len(every.angles.turn), MOST_SCALES)
    result: FloatArray = np.full(shape, found.min(initial=0.0))
    result[every.family, every.motions.heading, every.motions.scale] = found
    return result


def rates_evidence(detecting: DetectionModel, inside: FloatArray, seen: IntArray, none: int) -> FloatArray:
    """(Q,) log evidence of what was seen, missed and new for each pair of rates.

    Args:
        detecting: what is known of detecting.
        inside: (M,) probability that each label's object is in view.
        seen: (K,) the labels that were.
        none: how many detections had no label.
    """
    missed = np.ones(len(inside), dtype=bool)
    missed[seen] = False
    result = np.empty(len(detecting.unseen))
    for q, (unseen, new) in enumerate(zip(detecting.unseen, detecting.new, strict=True)):
        absent = np.maximum(1 - (1 - unseen) * inside[missed], 1e-9)
        result[q] = np.log(absent).sum() + len(seen) * np.log(1 - unseen) + none * np.log(new) - new
    return result
