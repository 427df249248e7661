"""Compiled densities of `AdaptiveReid`: of shifts, turns and courses, and of what is in view."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled
from farm_ar.reid.adaptive.records import (
    Concentrations,
    Errors,
    Pairs,
    Profile,
    Profiles,
)

FREEDOM = 2.0
"""Degrees of freedom of Student's distribution."""

LOOSELY = 2
"""Which of the concentrations of turns is that of objects that are pushed about."""

SWINGS = 4.0
"""Concentration of shared turns about none."""

NEAR = 0.02
"""Shifts, in spacings, below which the direction of a shift carries less and less information."""

STANDING = 0.04
"""Length, in spacings, of the shifts of what never moves."""

_compile = compiled(error_model="numpy")
_inlined = compiled(error_model="numpy", inline="always")


@_compile
def shift_density(kind: int, length: float, width: float, distance: float, log_distance: float) -> float:
    """Density in the plane of a shift by a distance, whose logarithm is given, in any direction."""
    if kind == Profile.GAUSSIAN:
        return math.exp(-0.5 * (distance / length) ** 2) / (2 * math.pi * length**2)
    if kind == Profile.EXPONENTIAL:
        return math.exp(-distance / length) / (2 * math.pi * length**2)
    if kind == Profile.STUDENT:
        bulk = 1.0 + (distance / length) ** 2 / FREEDOM
        return 1.0 / (bulk * bulk * 2 * math.pi * length**2)  # to the power of (FREEDOM + 2) / 2
    if kind == Profile.RAY:
        # Half of them go at speeds that are half-normal, half at any from standing on, even by ratio.
        bulk = 1.0 / (math.sqrt(2 * math.pi) * math.pi * length * max(distance, 0.05 * length))
        even = 1.0 / (math.pi * (distance**2 + NEAR**2) * math.log1p((length / NEAR) ** 2))
        return 0.5 * (bulk + even) * math.exp(-0.5 * (distance / length) ** 2)
    # A ring whose radius is log-normal; within a tenth of it the density no longer changes.
    far = max(distance, 0.1 * length)
    log_radius = max(log_distance - math.log(length), math.log(0.1)) / width
    return math.exp(-0.5 * log_radius**2) / (width * math.sqrt(2 * math.pi) * far * 2 * math.pi * far)


@_compile
def scaled_bessel(x: float) -> float:
    """exp(-x) I0(x), x not negative, to 2e-7: Abramowitz and Stegun 9.8.1 and 9.8.2."""
    if x < 3.75:
        t = (x / 3.75) ** 2
        bulk = 1.2067492 + t * (0.2659732 + t * (0.0360768 + t * 0.0045813))
        return math.exp(-x) * (1.0 + t * (3.5156229 + t * (3.0899424 + t * bulk)))
    t = 3.75 / x
    tail = -0.02057706 + t * (0.02635537 + t * (-0.01647633 + t * 0.00392377))
    bulk = 0.00225319 + t * (-0.00157565 + t * (0.00916281 + t * tail))
    return (0.39894228 + t * (0.01328592 + t * bulk)) / math.sqrt(x)


@_compile
def density_ahead(length: float, sd: float, distance: float, course: float, known: float) -> float:
    """Density in the plane of a shift about a place ahead; without a heading, of one in any direction."""
    if known > 0.0:
        rest = distance**2 - 2.0 * distance * length * course + length**2
        return math.exp(-0.5 * rest / sd**2) / (2 * math.pi * sd**2)
    round_about = scaled_bessel(distance * length / sd**2)
    return math.exp(-0.5 * ((distance - length) / sd) ** 2) * round_about / (2 * math.pi * sd**2)


@_compile
def folded(cosine: float, fold: int) -> float:
    """Cosine of twice or four times the angle."""
    if fold >= 2:
        cosine = 2.0 * cosine * cosine - 1.0
    if fold == 4:
        cosine = 2.0 * cosine * cosine - 1.0
    return cosine


@_compile
def level_rows(pairs: Pairs, turn: FloatArray) -> None:
    """Give all pairs of a detection the mean of their densities of turns; not those of what never moves."""
    for i in range(len(pairs.start) - 1):
        total, count = 0.0, 0
        for p in range(pairs.start[i], pairs.start[i + 1]):
            if pairs.turned[p] and not pairs.stays[p]:
                total += turn[p]
                count += 1
        for p in range(pairs.start[i], pairs.start[i + 1]):
            if pairs.turned[p] and not pairs.stays[p]:
                turn[p] = total / count


@_compile
def widened(length: float, errors: Errors, p: int) -> tuple[float, float]:
    """The length that a shift seems to have been drawn with, and by what its density is multiplied.

    Those of a Gaussian shift of that SD and a Gaussian error are exact; others are stretched likewise.
    """
    one, other = length**2 + errors.wide[p], length**2 + errors.narrow[p]
    square = 1.0 / (errors.along[p] / one + (1.0 - errors.along[p]) / other)
    return math.sqrt(square), square / math.sqrt(one * other)


@_compile
def shift_with_errors(kind: int, length: float, width: float, pairs: Pairs, density: FloatArray) -> None:
    """Widen (P,) densities of shifts by what detectors say of the errors of their places."""
    for p in range(len(density)):
        if not pairs.errors.wide[p] > 0.0:
            continue
        distance = pairs.distance[p]
        logarithm = math.log(max(distance, 1e-300))
        if pairs.stays[p]:
            scale, times = widened(STANDING, pairs.errors, p)
            density[p] = times * shift_density(Profile.GAUSSIAN, scale, 0.0, distance, logarithm)
        elif kind == Profile.AHEAD:
            sd = math.sqrt((width * length) ** 2 + 0.5 * (pairs.errors.wide[p] + pairs.errors.narrow[p]))
            density[p] = density_ahead(length, sd, distance, pairs.course[p], pairs.course_known[p])
        elif kind == Profile.RING:
            far = max(distance, 0.1 * length)
            wide = 0.5 * (pairs.errors.wide[p] + pairs.errors.narrow[p]) / far**2
            density[p] = shift_density(
                Profile.RING, length, math.sqrt(width * width + wide), distance, logarithm
            )
        elif kind != Profile.EVEN:
            scale, times = widened(length, pairs.errors, p)
            density[p] = times * shift_density(kind, scale, width, distance, logarithm)


@_compile
def turn_with_errors(kappa: float, fold: int, pairs: Pairs, p: int) -> float:
    """Density of a turn without outliers: less sharp by the heading's error, and with the second heading."""
    kappa = kappa / (1.0 + kappa * pairs.errors.turn[p] * fold**2)
    top = 1.0 / (2 * math.pi * scaled_bessel(kappa))
    weight = pairs.errors.rival_weight[p]
    one = math.exp(kappa * (folded(pairs.turn[p], fold) - 1.0))
    other = math.exp(kappa * (folded(pairs.errors.rival_turn[p], fold) - 1.0))
    return float(top * ((1.0 - weight) * one + weight * other))


@_compile
def tabulate(
    pairs: Pairs,
    profiles: Profiles,
    angles: Concentrations,
    shift: FloatArray,
    turn: FloatArray,
    course: FloatArray,
    far: FloatArray,
) -> None:
    """Fill in the densities of all pairs; those of shifts about a shared motion are left as they are.

    Args:
        pairs: the pairs.
        profiles: of the shifts.
        angles: of turns and courses.
        shift: (R, P) filled with densities in the plane.
        turn: (T, P) filled with densities of a turn, 1 / radian.
        course: (C, P) filled with how much likelier a course is than any.
        far: (P,) filled with the density of what has gone anywhere, place and turn.
    """
    count = len(pairs.label)
    log_distance, less = np.empty(count), np.empty(count)
    for p in range(count):
        log_distance[p] = math.log(max(pairs.distance[p], 1e-300))
        # A course from one heading alone is known half as well, that of a small shift hardly.
        less[p] = pairs.course_known[p] ** 2 / (1.0 + (NEAR / max(pairs.distance[p], 1e-9)) ** 2)
    for r in range(len(shift)):
        kind, length, width = profiles.kind[r], profiles.length[r], profiles.width[r]
        if kind >= Profile.TOGETHER:
            continue
        for p in range(count):
            if pairs.stays[p]:
                shift[r, p] = shift_density(
                    Profile.GAUSSIAN, STANDING, 0.0, pairs.distance[p], log_distance[p]
                )
            elif kind == Profile.AHEAD:
                shift[r, p] = density_ahead(
                    length, width * length, pairs.distance[p], pairs.course[p], pairs.course_known[p]
                )
            elif kind == Profile.EVEN:
                shift[r, p] = pairs.far[p]
            else:
                shift[r, p] = shift_density(kind, length, width, pairs.distance[p], log_distance[p])
        if len(pairs.errors.wide):
            shift_with_errors(kind, length, width, pairs, shift[r])
    any_turn = 1.0 / (2 * math.pi)
    for t in range(len(turn)):
        for p in range(count):
            turn[t, p] = any_turn
            if pairs.turned[p]:
                which = 0 if pairs.stays[p] else t
                cosine = folded(pairs.turn[p], angles.fold[which])
                peak = angles.turn_peak[which] * math.exp(angles.turn[which] * (cosine - 1.0))
                if len(pairs.errors.turn):
                    peak = turn_with_errors(angles.turn[which], angles.fold[which], pairs, p)
                turn[t, p] = angles.outliers * any_turn + (1.0 - angles.outliers) * peak
        if angles.anyone[t]:
            level_rows(pairs, turn[t])
    for p in range(count):
        # What is pushed somewhere keeps its heading, or not; what is carried away does not.
        pushed = 0.5 * any_turn + 0.5 * turn[LOOSELY, p]
        far[p] = 0.5 * pairs.farther[p] * pushed + 0.5 * pairs.far[p] * any_turn
    for c in range(len(course)):
        for p in range(count):
            course[c, p] = 1.0
            if pairs.course_known[p] > 0.0 and not pairs.stays[p]:
                peak = angles.course_peak[c] * math.sqrt(less[p])
                peak *= math.exp(angles.course[c] * less[p] * (pairs.course[p] - 1.0))
                course[c, p] = angles.astray + (1.0 - angles.astray) * peak * 2 * math.pi


@_compile
def view_probability(
    place: FloatArray,
    rise: FloatArray,
    scale: FloatArray,
    offset: FloatArray,
    limits: FloatArray,
    vertical: bool,
    result: FloatArray,
) -> None:
    """Fill (A, M): how probable it is that each label's object, having moved on each scale, is in view.

    Edges are soft, by a part of the scale, so that nothing hangs on the last digit.

    Args:
        place: (M, 2) of the labels seen from the camera: to the right of it, and ahead.
        rise: (M,) of the labels above the eye, along the line of sight's plane.
        scale: (A,) how far objects move.
        offset: (K, 2) equally probable points that stand for the standard normal distribution.
        limits: (6,) angles seen to the left, right, up and down, range, pitch; radians.
        vertical: whether up and down count.
        result: filled.
    """
    left, right, up, down, reach, pitch = limits
    for a in range(len(scale)):
        soft = 0.35 * scale[a]
        for j in range(len(place)):
            total = 0.0
            for k in range(len(offset)):
                x = place[j, 0] + scale[a] * offset[k, 0]
                z = place[j, 1] + scale[a] * offset[k, 1]
                away = math.hypot(x, z)
                edge = reach - away
                limit = right if x >= 0.0 else left
                if limit < math.pi - 1e-9:
                    edge = min(edge, away * (limit - abs(math.atan2(x, z))))
                if vertical:
                    angle = math.atan2(rise[j], away) - pitch
                    edge = min(edge, away * min(up - angle, angle + down))
                total += min(max(0.5 + 0.5 * edge / soft, 0.0), 1.0)
            result[a, j] = total / len(offset)


@_compile
def turned_together(
    pairs: Pairs, angles: Concentrations, t: int, swing: FloatArray, turn: FloatArray
) -> None:
    """Fill (P,) densities of turns about one that all share, of concentration t."""
    any_turn = 1.0 / (2 * math.pi)
    for p in range(len(turn)):
        turn[p] = any_turn
        if pairs.turned[p]:
            cosine = pairs.turn[p]
            if not pairs.stays[p]:
                cosine = cosine * swing[1] + pairs.turn_sine[p] * swing[0]
            peak = angles.turn_peak[t] * math.exp(angles.turn[t] * (cosine - 1.0))
            turn[p] = angles.outliers * any_turn + (1.0 - angles.outliers) * peak


@_compile
def turn_freedom(kappa: float, swing: FloatArray) -> float:
    """Log of the share of the prior of a shared turn that counts: half of it any turn, half about none."""
    if not swing[2] > 0.0:
        return 0.0
    about_none = math.exp(SWINGS * (swing[1] - 1.0)) / (2 * math.pi * scaled_bessel(SWINGS))
    density = 0.5 / (2 * math.pi) + 0.5 * about_none
    return min(math.log(math.sqrt(2 * math.pi / (kappa * max(swing[2], 1.0))) * density), 0.0)


@_inlined
def blend(
    pairs: Pairs,
    profile: FloatArray,
    turn: FloatArray,
    course: FloatArray,
    use_course: bool,
    far: float,
    anywhere: FloatArray,
    weight: FloatArray,
) -> None:
    """Fill (P,) densities of pairs under a motion: of what moves by it, and of what goes anywhere."""
    near = 1.0 - far
    if use_course:
        for p in range(len(weight)):
            weight[p] = near * profile[p] * turn[p] * course[p] + far * anywhere[p]
    else:
        for p in range(len(weight)):
            weight[p] = near * profile[p] * turn[p] + far * anywhere[p]
    for p in range(len(weight)):
        if pairs.stays[p]:
            weight[p] = profile[p] * turn[p]
