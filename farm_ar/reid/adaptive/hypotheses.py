"""The hypotheses of `AdaptiveReid` about how far objects of a place move, as arrays for its kernels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import i0e, i1e

from farm_ar.arrays import FloatArray, IntArray, read_only
from farm_ar.reid.adaptive.options import AdaptiveOptions
from farm_ar.reid.adaptive.records import (
    Concentrations,
    Motions,
    Profile,
    Profiles,
)

LEAST = 0.01
"""The finest scale of motion, in spacings."""

RATIO = 1.6
"""Of one scale of motion to the next finer one."""

FOLDS = (2, 4)
"""Parts of a whole turn by which objects may look the same."""

MOST_SCALES = 32
"""Up to 20 000 spacings."""


EVEN_LEVEL = 7
"""Index of the scale that stands for motions to anywhere, for how far objects rise; all have it."""

WALKING = 0.4
"""What is left of the prior's rise about the usual scale where objects go ahead: looks are any time apart."""


@dataclass(frozen=True)
class Family:
    """A way in which objects move.

    Args:
        name: of the family.
        prior: its share.
        kind: the profile of its shifts.
        far: share of the objects that go anywhere.
        width: SD of the logarithm of the distance, for a ring; ahead, SD as a share of the distance.
        course: for a ring or a ray, how much farther courses stray from the heading than turns explain.
        least: index of the finest scale.
        usual: how much of the prior's rise about the usual scale it has.
        folds: whether objects that look the same turned by half or a quarter are tried.
    """

    name: str
    prior: float
    kind: int
    far: float
    width: float = 0.0
    course: float = 0.0
    least: int = 0
    usual: float = 1.0
    folds: bool = False


FAMILIES = (
    Family("gaussian", 0.24, Profile.GAUSSIAN, 0.003, folds=True),
    Family("exponential", 0.10, Profile.EXPONENTIAL, 0.003),
    Family("student", 0.05, Profile.STUDENT, 0.003, folds=True),
    Family("stay or move, few", 0.05, Profile.STUDENT, 0.04),
    Family("stay or move", 0.06, Profile.GAUSSIAN, 0.12, folds=True),
    Family("nudged or moved", 0.06, Profile.STUDENT, 0.15, folds=True),
    Family("stay or move, many", 0.03, Profile.GAUSSIAN, 0.35, folds=True),
    Family("forward", 0.04, Profile.RING, 0.02, 0.25, 1.0, 4, WALKING),
    Family("forward, swerving", 0.024, Profile.RING, 0.02, 0.25, 3.0, 4, WALKING),
    Family("forward, speeds differ", 0.02, Profile.RING, 0.08, 0.7, 1.0, 4, WALKING),
    Family("ahead", 0.032, Profile.AHEAD, 0.01, 0.5, 0.0, 4, WALKING),
    Family("ahead, some far, some not", 0.032, Profile.AHEAD, 0.03, 1.0, 0.0, 4, WALKING),
    Family("together", 0.30, Profile.TOGETHER, 0.003, folds=True),
    Family("together, some not", 0.08, Profile.TOGETHER, 0.12),
    Family("together, turning", 0.02, Profile.TURNING, 0.003),
    Family("together, turning, some not", 0.005, Profile.TURNING, 0.12),
    Family("forward, from standing on", 0.02, Profile.RAY, 0.05, 0.0, 1.0, 4, WALKING),
    Family("forward, many turn off", 0.01, Profile.RING, 0.35, 0.25, 1.0, 4, WALKING),
    Family("together, and ahead", 0.04, Profile.STREAMING, 0.003),
    Family("together, bending", 0.03, Profile.BENDING, 0.003),
    Family("anywhere", 0.003, Profile.EVEN, 1.0),
)
"""The families that are averaged; what was learnt of a place counts on their order, so new ones come last."""


def concentration(sd: float) -> float:
    """Of the von Mises distribution with the mean resultant of a wrapped Gaussian of that SD, radians."""
    if not sd < 6:
        return 0.0
    wanted = np.exp(-0.5 * sd * sd)
    low, high = 1e-9, 1e6
    for _ in range(80):
        middle = np.sqrt(low * high)
        if i1e(middle) / i0e(middle) < wanted:
            low = middle
        else:
            high = middle
    return float(np.sqrt(low * high))


def peak(kappa: FloatArray) -> FloatArray:
    """Density of the von Mises distribution at its mean, 1 / radian."""
    result: FloatArray = 1.0 / (2 * np.pi * i0e(kappa))
    return result


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """All motions over so many scales.

    Args:
        profiles: of the shifts.
        angles: of turns and courses.
        motions: with the prior of the families, headings and scales, before the scene's extent counts.
        scale: (A,) in spacings.
        family: (H,) index of the family of each motion.
    """

    profiles: Profiles
    angles: Concentrations
    motions: Motions
    scale: FloatArray
    family: IntArray


@lru_cache(maxsize=64)
def hypotheses(options: AdaptiveOptions, scales: int) -> Hypotheses:
    """The motions over so many scales, from the finest on."""
    scale = scale_lengths(scales)
    first_shared = len(options.turn_sds) + 1 + len(FOLDS)
    last_shared = first_shared + len(options.shared_sds)
    folded = [fold * options.fold_sd for fold in FOLDS]
    turns = np.array([*options.turn_sds, np.inf, *folded, *options.shared_sds, *options.anyone_sds])
    shares = (*options.turn_shares, *options.fold_shares, *options.shared_shares, *options.anyone_shares)
    nothing = len(options.turn_sds)
    kappa = np.array([concentration(sd) for sd in turns])
    profiles: list[tuple[int, float, float]] = []
    courses: list[float] = []
    rows: list[tuple[int, int, int, float, int, int, float, int]] = []
    group = [0]
    for f, family in enumerate(FAMILIES):
        levels = range(family.least, scales)
        if family.kind == Profile.EVEN:
            levels = range(EVEN_LEVEL, EVEN_LEVEL + 1)
        headings = [t for t in range(len(turns)) if _tried(family, t, nothing, last_shared)]
        course = dict.fromkeys(headings, -1)
        if family.kind in (Profile.RING, Profile.RAY):
            for t in headings:
                kappa_of = concentration(float(np.hypot(family.course * 0.35 * turns[t], options.course_sd)))
                if kappa_of not in courses:
                    courses.append(kappa_of)
                course[t] = courses.index(kappa_of)
        prior = np.array([_scale_prior(float(scale[a]), family, options) for a in levels])
        for a, share in zip(levels, prior / prior.sum(), strict=True):
            place = (family.kind, float(scale[a]), family.width)
            if place not in profiles:
                profiles.append(place)
            where = profiles.index(place)
            beyond = where if family.kind == Profile.EVEN else -1
            for t in headings:
                chance = family.prior * float(share) * (1.0 if family.kind == Profile.EVEN else shares[t])
                rows.append((where, t, course[t], family.far, beyond, int(a), chance, f))
            group.append(len(rows))
    columns = list(zip(*rows, strict=True))
    course_kappa = np.array(courses)
    return Hypotheses(
        Profiles(
            read_only([p[0] for p in profiles], np.int64),
            read_only([p[1] for p in profiles], np.float64),
            read_only([p[2] for p in profiles], np.float64),
        ),
        Concentrations(
            read_only(kappa, np.float64),
            read_only(peak(kappa), np.float64),
            read_only([*[1] * (nothing + 1), *FOLDS, *[1] * (len(turns) - first_shared)], np.int64),
            read_only([first_shared <= t < last_shared for t in range(len(turns))], np.bool_),
            read_only([t >= last_shared for t in range(len(turns))], np.bool_),
            read_only(course_kappa, np.float64),
            read_only(peak(course_kappa), np.float64),
            options.outliers,
            options.astray,
        ),
        Motions(
            read_only(group, np.int64),
            read_only(columns[0], np.int64),
            read_only(columns[1], np.int64),
            read_only(columns[2], np.int64),
            read_only(columns[3], np.float64),
            read_only(columns[4], np.int64),
            read_only(columns[5], np.int64),
            read_only(np.log(columns[6]), np.float64),
        ),
        read_only(scale, np.float64),
        read_only(columns[7], np.int64),
    )


def _tried(family: Family, turn: int, nothing: int, anyone: int) -> bool:
    """Whether a family is tried with some concentration of turns."""
    if family.kind == Profile.EVEN:
        return turn == 0  # as good as any, for things that go anywhere are turned anyhow
    if turn >= anyone:
        return family.kind not in (Profile.RING, Profile.RAY, Profile.AHEAD)
    if turn > nothing + len(FOLDS):
        return family.kind >= Profile.TOGETHER
    if turn > nothing:
        return family.folds
    return turn < nothing or family.kind not in (Profile.RING, Profile.RAY, Profile.AHEAD)


def _scale_prior(scale: float, family: Family, options: AdaptiveOptions) -> float:
    """Even by ratio, and more about where labels are neither obvious nor hopeless."""
    usual = -0.5 * (np.log(scale / options.usual_scale) / options.usual_width) ** 2
    return float(family.usual * options.usual_weight * np.exp(usual) + 1.0)


def scale_lengths(scales: int) -> FloatArray:
    """(A,) the finest scales, in spacings."""
    result: FloatArray = LEAST * RATIO ** np.arange(scales, dtype=np.float64)
    return result


def scales_for(extent: float) -> int:
    """How many scales reach from the finest to beyond an extent, in spacings."""
    return int(np.clip(np.ceil(np.log(3 * extent / LEAST) / np.log(RATIO)) + 1, 8, MOST_SCALES))
