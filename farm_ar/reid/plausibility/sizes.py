"""Whether detected sizes are in the unit of the map's."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.reid.plausibility.finding import Finding, named, number
from farm_ar.scenes import Detections, Scene

UNITS = {"millimetres": 1e-3, "centimetres": 1e-2, "decimetres": 0.1, "inches": 0.0254, "feet": 0.3048}
"""Metres in a unit."""

NEAR = 0.15
"""By how much, in logarithms, a factor may differ from that of a unit and still be called by its name."""

COMMON, FAR = 2.0, 5.0
"""How many times too large or small sizes are: all by about one factor, or a single one by its own."""

TODO = "give width, height and depth in one unit, metres in Python, or leave out sizes that are not known"

SPREAD = 0.3
"""By how much, in logarithms, the factors of single detections may differ from a common one."""


def unit_of(factor: float) -> tuple[str, bool] | None:
    """The unit in which lengths `factor` times too large are given, and whether it is the map's."""
    for name, metres in UNITS.items():
        if abs(np.log(factor * metres)) < NEAR:
            return name, False
        if abs(np.log(factor / metres)) < NEAR:
            return name, True
    return None


def times(factor: float) -> str:
    """How many times too large or too small, in words."""
    size = factor if factor > 1 else 1 / factor
    return f"{float(f'{size:.3g}'):g} times too {'large' if factor > 1 else 'small'}"


def check_sizes(scene: Scene, seen: Detections) -> Iterator[Finding]:
    """Detections many times larger or smaller than every label that they may be."""
    factor = _factors(scene, seen)
    known = np.flatnonzero(~np.isnan(factor))
    if not len(known):
        return
    common = float(np.median(factor[known]))
    together = np.abs(factor[known] - common) < SPREAD
    enough = len(known) > 1 or abs(common) > np.log(FAR)
    if abs(common) > np.log(COMMON) and together.mean() >= 0.8 and enough:
        which, by = tuple(known[together].tolist()), float(np.exp(common))
        said = f"sizes of {number(len(which))} of {len(seen)} are {times(by)}{_guess(by)}, and not used"
        yield Finding("sizes", f"{said}: {TODO}", which)
        return
    odd = tuple(known[np.abs(factor[known]) > np.log(FAR)].tolist())
    if odd:
        names = named([seen.ids[i] for i in odd])
        said = f"sizes of {number(len(odd))} of {len(seen)} ({names}) {FAR:g} times off or more, not used"
        yield Finding("sizes", f"{said}: {TODO}", odd)


def _guess(factor: float) -> str:
    unit = unit_of(factor)
    if unit is None:
        return ""
    return f", as if {'the map' if unit[1] else 'the snapshot'} gave them in {unit[0]}"


def _factors(scene: Scene, seen: Detections) -> FloatArray:
    """(N,) logarithms of how many times larger each is than the nearest in size that it may be, or NaN."""
    layout = scene.layout
    category = np.array(layout.category)
    mine, theirs = (np.log(size).mean(axis=1) for size in (seen.size, layout.size))
    result = np.full(len(seen), np.nan)
    for i, name in enumerate(seen.category):
        may_be = theirs if name is None else theirs[category == name]
        gaps = mine[i] - may_be[~np.isnan(may_be)]
        if len(gaps) and not np.isnan(mine[i]):
            result[i] = gaps[np.abs(gaps).argmin()]
    return result
