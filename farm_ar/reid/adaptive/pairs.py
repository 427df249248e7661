"""What `AdaptiveReid` knows of a scene, and of each pair of a detection and a label, without a length."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypedDict

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray, read_only
from farm_ar.errors import SnapshotError
from farm_ar.reid.adaptive.densities import NEAR
from farm_ar.reid.adaptive.errors import errors_of
from farm_ar.reid.adaptive.hypotheses import MOST_SCALES, scale_lengths
from farm_ar.reid.adaptive.options import AdaptiveOptions
from farm_ar.reid.adaptive.records import Pairs
from farm_ar.reid.adaptive.sizes import SizeModel
from farm_ar.reid.costs import sorted_log_sides
from farm_ar.scenes import UNKNOWN, Detections, Layout

MOST_PAIRS = 250_000
"""Pairs of a detection and a label that it could be, which take some seconds and half a gigabyte."""

_LEAST_RISE = 0.02
"""Least SD, in spacings, of how far objects rise or sink."""

_LIFTED = 0.1
"""Share of the objects whose heights change by anything."""


def spacing_of(layout: Layout) -> float:
    """Median distance from a label to the nearest of its look-alikes, metres: the unit of all lengths.

    Where there are no look-alikes it is that to the nearest label, or else the size of the only one.
    """
    position = layout.position - layout.position.mean(axis=0)
    apart = np.hypot(*(position[:, None] - position).transpose(2, 0, 1))
    alike = layout.category_code[:, None] == layout.category_code
    tiny = 1e-9 * apart.max(initial=0.0)
    for among in (alike, np.ones_like(alike)):
        nearest = np.where(among & (apart > tiny), apart, np.inf).min(axis=1, initial=np.inf)
        known = nearest[np.isfinite(nearest)]
        if len(known):
            return float(np.median(known))
    sides = layout.size[np.isfinite(layout.size)]
    return float(sides.mean()) if len(sides) else 1.0


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What a scene is in units of its spacing.

    Args:
        spacing: of the look-alikes, metres.
        centre: (2,) of the labels, metres.
        place: (M, 2) of the labels about the centre.
        heading: (M, 2) sine and cosine of the yaw; NaN where not known.
        period: (M,) of symmetry, radians.
        height: (M,) elevations.
        category: (M,) codes.
        fixed: (M,) what never moves.
        sizes: of the labels.
    """

    spacing: float
    centre: FloatArray
    place: FloatArray
    yaw: FloatArray
    period: FloatArray
    height: FloatArray
    category: IntArray
    fixed: BoolArray
    sizes: SizeModel

    @classmethod
    def of(cls, layout: Layout, symmetry: Mapping[str, float]) -> Surroundings:
        """Those of a layout."""
        spacing, centre = spacing_of(layout), layout.position.mean(axis=0)
        return cls(
            spacing=spacing,
            centre=centre,
            place=read_only((layout.position - centre) / spacing, np.float64),
            yaw=layout.yaw,
            period=read_only([symmetry.get(name, 2 * np.pi) for name in layout.category], np.float64),
            height=read_only(layout.elevation / spacing, np.float64),
            category=read_only(layout.category_code, np.int64),
            fixed=layout.fixed,
            sizes=SizeModel.of(sorted_log_sides(layout.size), layout.category_code),
        )


@dataclass(frozen=True, eq=False)
class Problem:
    """The pairs of one snapshot, of the labels that could be any of its detections.

    Args:
        pairs: the pairs.
        labels: (M,) indices of these labels in the layout.
        place: (N, 2) of the detections about the centre, in spacings.
        area: (N,) over which a detection may be of something new, in square spacings.
        extent: of what looks alike, in spacings: no scale is much larger.
        complete: whether of each category seen there are as many detections as labels.
    """

    pairs: Pairs
    labels: IntArray
    place: FloatArray
    area: FloatArray
    extent: float
    complete: bool


def problem_of(
    known: Surroundings,
    seen: Detections,
    codes: IntArray,
    hint: FloatArray | None,
    options: AdaptiveOptions,
) -> Problem:
    """The pairs of a snapshot.

    Args:
        known: the scene.
        seen: N detections.
        codes: (N,) of their categories, `UNKNOWN` where not known.
        hint: (N, M) log-odds of each label, from elsewhere; None for none.
        options: what is assumed.
    """
    place = (seen.position - known.centre) / known.spacing
    could = (codes[:, None] == UNKNOWN) | (codes[:, None] == known.category)
    if options.confusion > 0:
        could = np.ones_like(could)
    if hint is not None:
        could = could & (hint > -np.inf)
    labels = np.flatnonzero(could.any(axis=0))
    could = could[:, labels]
    i, j = np.nonzero(could)
    if len(i) > MOST_PAIRS:
        expected = f"must make at most {MOST_PAIRS} pairs with the labels that they could be"
        raise SnapshotError("detections", expected, len(i))
    start = np.concatenate([[0], np.cumsum(could.sum(axis=1))])
    area_of, overall = _areas(known, place, codes, labels)
    of_label = area_of[known.category[labels]]
    shift = place[i] - known.place[labels[j]]
    distance = np.hypot(shift[:, 0], shift[:, 1])
    angles = _angles(known, seen.yaw, labels, i, j, shift, distance)
    like = np.ones(len(i))
    if options.confusion > 0:
        kinds = max(len(area_of) - 1, 1)
        same = codes[i] == known.category[labels[j]]
        like = np.where(
            codes[i] == UNKNOWN, 1.0, np.where(same, 1 - options.confusion, options.confusion / kinds)
        )
    if hint is not None:
        like = like * np.exp(np.clip(hint[i, labels[j]], -60.0, 60.0))
    pairs = Pairs(
        start=start.astype(np.int64),
        label=j.astype(np.int64),
        from_x=known.place[labels[j], 0],
        from_z=known.place[labels[j], 1],
        shift_x=shift[:, 0].copy(),
        shift_z=shift[:, 1].copy(),
        distance=distance,
        **angles,
        vertical=_vertical(known.height[labels], seen.elevation / known.spacing, i, j),
        size=known.sizes.likeness(sorted_log_sides(seen.size), codes, i, labels[j], options.reliabilities),
        like=like,
        stays=known.fixed[labels[j]],
        far=1 / of_label[j],
        farther=1 / (np.pi * (distance**2 + NEAR**2) * np.log1p(of_label[j] / np.pi / NEAR**2)),
        errors=errors_of(
            seen.uncertainty, known.spacing, i, shift, known.yaw[labels[j]], known.period[labels[j]]
        ),
    )
    # What is new is as often of a category as labels are.
    share = np.bincount(known.category[labels], minlength=len(area_of)) / max(len(labels), 1)
    area = np.where(codes == UNKNOWN, overall, area_of[codes] / np.maximum(share[codes], 1e-9))
    extent = float(np.sqrt(of_label.max(initial=1.0) / np.pi))
    seen_of = np.bincount(codes[codes != UNKNOWN], minlength=len(area_of))
    known_of = np.bincount(known.category[labels], minlength=len(area_of))
    complete = bool((seen_of == known_of).all())
    return Problem(pairs, labels, place, area, extent, complete)


def _areas(
    known: Surroundings, place: FloatArray, codes: IntArray, labels: IntArray
) -> tuple[FloatArray, float]:
    """(C,) area that each category takes, of labels and detections together; that of all; square spacings."""
    count = int(known.category.max()) + 1
    points = np.concatenate([known.place[labels], place])
    kind = np.concatenate([known.category[labels], codes])
    area = np.full(count, np.nan)
    for c in range(count):
        own = points[kind == c]
        if len(own):
            area[c] = _area(own)
    overall = _area(points) if len(points) else 1.0
    return np.where(np.isfinite(area), area, overall), overall


def _area(points: FloatArray) -> float:
    """Of a disc over which points would be strewn as widely, and of a spacing about each."""
    return float(2 * np.pi * (((points - points.mean(axis=0)) ** 2).sum(axis=1).mean() + 1.0))


class _Angles(TypedDict):
    turn: FloatArray
    turn_sine: FloatArray
    turned: BoolArray
    course: FloatArray
    course_known: FloatArray
    ahead_x: FloatArray
    ahead_z: FloatArray


def _angles(
    known: Surroundings,
    yaw: FloatArray,
    labels: IntArray,
    i: IntArray,
    j: IntArray,
    shift: FloatArray,
    distance: FloatArray,
) -> _Angles:
    """What headings say of pairs."""
    before, after = known.yaw[labels[j]], yaw[i]
    period = known.period[labels[j]]
    knew, knows = np.isfinite(before), np.isfinite(after)
    turned = knew & knows & (period > 0)
    angle = np.where(turned, (after - before) * (2 * np.pi / np.where(period > 0, period, 1.0)), 0.0)
    before, after = np.where(knew, before, 0.0), np.where(knows, after, 0.0)
    x = np.where(knew, np.sin(before), 0.0) + np.where(knows, np.sin(after), 0.0)
    z = np.where(knew, np.cos(before), 0.0) + np.where(knows, np.cos(after), 0.0)
    ahead = shift[:, 0] * x + shift[:, 1] * z
    length = np.maximum(np.hypot(x, z), 1e-6)
    course = ahead / np.maximum(distance * length, 1e-12)
    how_well = np.where(period < 2 * np.pi - 1e-9, 0.0, 0.5 * knew + 0.5 * knows)
    return {
        "turn": np.where(turned, np.cos(angle), 0.0),
        "turn_sine": np.sin(angle),
        "turned": turned,
        "course": np.clip(course, -1.0, 1.0),
        "course_known": how_well,
        "ahead_x": np.where(how_well > 0, x / length, 0.0),
        "ahead_z": np.where(how_well > 0, z / length, 0.0),
    }


def _vertical(height: FloatArray, seen: FloatArray, i: IntArray, j: IntArray) -> FloatArray:
    """(A, P) how much likelier a rise is on each scale than any; (0, P) where all is level."""
    every = np.concatenate([height, seen])
    spread = float(np.ptp(every)) if len(every) else 0.0
    if not spread > 1e-9:
        return np.zeros((0, len(i)))
    rise = seen[i] - height[j]
    sd = np.hypot(np.minimum(scale_lengths(MOST_SCALES)[:, None], spread), _LEAST_RISE)
    broad = np.hypot(sd, spread)
    likely = np.exp(-0.5 * (rise / sd) ** 2 + 0.5 * (rise / broad) ** 2) * (broad / sd)
    result: FloatArray = _LIFTED + (1 - _LIFTED) * likely
    return result
