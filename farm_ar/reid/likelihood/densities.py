"""Compiled densities of `LikelihoodReid`: of places, headings and looks, and of what is in view."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.likelihood.motions import WALL
from farm_ar.reid.likelihood.records import Eyes, Found, Known, Labels, Models, View

CHANGES_HEIGHT = 0.1
"""Share of the objects that are moved to another height, where look-alikes stand at different ones."""

ROOT_TWO_PI = math.sqrt(2 * math.pi)

_compile = compiled(error_model="numpy")


@_compile
def normal_cdf(x: float) -> float:
    """Probability that a standard normal variable is below x."""
    return 0.5 * math.erfc(-x / math.sqrt(2.0))


@_compile
def axis_density(x: float, mean: float, side: float, motion_sd: float, detection_sd: float) -> float:
    """`axis_log_density`, without the logarithm, of one coordinate."""
    sd = math.sqrt(motion_sd * motion_sd + detection_sd * detection_sd)
    free = math.exp(-0.5 * ((x - mean) / sd) ** 2) / (sd * ROOT_TWO_PI)
    near = WALL * detection_sd
    if motion_sd == 0.0 or side == math.inf or not (abs(x) <= near or abs(x - side) <= near):
        return free
    narrow = motion_sd * detection_sd / sd
    between = mean + (x - mean) * (motion_sd / sd) ** 2
    free *= normal_cdf((side - between) / narrow) - normal_cdf(-between / narrow)
    low = normal_cdf(-mean / motion_sd) * math.exp(-0.5 * (x / detection_sd) ** 2)
    high = normal_cdf((mean - side) / motion_sd) * math.exp(-0.5 * ((x - side) / detection_sd) ** 2)
    return free + (low + high) / (detection_sd * ROOT_TWO_PI)


@_compile
def hidden(found: Found, b: int, ex: float, ez: float, x: float, z: float) -> bool:
    """Whether the line from the eye to a place passes over the footprint of a detection.

    What the eye or the place itself is within hides nothing, nor does what has no known heading or size.
    """
    for i in range(found.number[b]):
        if math.isnan(found.yaw[b, i] + found.half[b, i, 0]):
            continue
        sine, cosine = math.sin(found.yaw[b, i]), math.cos(found.yaw[b, i])
        near, far = 0.0, 1.0
        eye_within, place_within = True, True
        for axis in range(2):
            # Along the footprint's width, then its depth.
            ax, az = (cosine, -sine) if axis == 0 else (sine, cosine)
            half = found.half[b, i, axis]
            start = (ex - found.position[b, i, 0]) * ax + (ez - found.position[b, i, 1]) * az
            end = (x - found.position[b, i, 0]) * ax + (z - found.position[b, i, 1]) * az
            eye_within = eye_within and abs(start) <= half
            place_within = place_within and abs(end) <= half
            if abs(end - start) <= 1e-12 * half:
                if abs(start) > half:
                    far = -1.0
            else:
                one, other = (-half - start) / (end - start), (half - start) / (end - start)
                near, far = max(near, min(one, other)), min(far, max(one, other))
        if near <= far and not eye_within and not place_within:
            return True
    return False


@_compile
def view_probability(
    known: Known, labels: Labels, eyes: Eyes, found: Found, first: int, last: int, result: FloatArray
) -> None:
    """Fill (A, M): how probable it is that each label's object, having moved on each scale, is in view.

    Args:
        known: how it moves, and what a camera sees.
        labels: where it moves from.
        eyes: the cameras.
        found: the detections, which may hide it.
        first: the first of the cameras, any of which may see it.
        last: the one after the last of them.
        result: filled.
    """
    # Arrays are taken out of their records once: each time, their users would be counted.
    offset, scale, view = known.models.offset, known.models.translation_sd, known.camera
    position, elevation, room = labels.position, labels.elevation, labels.room
    eye = np.empty((last - first, 7))
    for b in range(first, last):
        eye[b - first, 0], eye[b - first, 1] = eyes.position[b, 0], eyes.position[b, 1]
        eye[b - first, 2], eye[b - first, 3] = math.sin(eyes.yaw[b]), math.cos(eyes.yaw[b])
        eye[b - first, 4] = eyes.height[b]
        eye[b - first, 5], eye[b - first, 6] = math.sin(eyes.pitch[b]), math.cos(eyes.pitch[b])
    sine, cosine = eye[0, 2], eye[0, 3]
    points, farthest = len(offset), 0.0
    for q in range(points):
        farthest = max(farthest, math.hypot(offset[q, 0], offset[q, 1]))
    for j in range(len(position)):
        for a in range(len(scale)):
            sd = scale[a]
            result[a, j] = 0.0
            reach, near = view.range_m + farthest * sd, False
            for b in range(len(eye)):
                x, z = position[j, 0] - eye[b, 0], position[j, 1] - eye[b, 1]
                near = near or not x * x + z * z > reach * reach
            if not near:
                continue
            inside = 0
            for q in range(points):
                right, ahead = sd * offset[q, 0], sd * offset[q, 1]
                x = position[j, 0] + cosine * right + sine * ahead
                z = position[j, 1] + cosine * ahead - sine * right
                if room[0] < math.inf:
                    x, z = min(max(x, 0.0), room[0]), min(max(z, 0.0), room[1])
                for b in range(len(eye)):
                    if in_view(view, eye, b, x, elevation[j], z) and not (
                        view.occlusion and hidden(found, first + b, eye[b, 0], eye[b, 1], x, z)
                    ):
                        inside += 1
                        break
            result[a, j] = inside / points


@_compile
def in_view(view: View, eye: FloatArray, b: int, x: float, y: float, z: float) -> bool:
    """Whether camera b sees a place, metres, if nothing hides it.

    Args:
        view: what every camera sees.
        eye: (B, 7) x, z, sine and cosine of the yaw, height, sine and cosine of the pitch.
        b: the camera.
        x: of the place.
        y: of the place.
        z: of the place.
    """
    dx, dz, sine, cosine = x - eye[b, 0], z - eye[b, 1], eye[b, 2], eye[b, 3]
    square = dx * dx + dz * dz
    right, ahead = dx * cosine - dz * sine, dx * sine + dz * cosine
    limit = view.right if right >= 0.0 else view.left
    if square > view.range_m * view.range_m or ahead < limit * math.sqrt(square):
        return False
    if view.vertical:
        above, rise, level = y - eye[b, 4], eye[b, 5], eye[b, 6]
        up, forward = above * level - ahead * rise, above * rise + ahead * level
        return forward > 0.0 and -view.down <= math.atan2(up, forward) <= view.up
    return True


@_compile
def side_error(table: FloatArray, code: IntArray, known_code: IntArray, gap: FloatArray) -> float:
    """The error that the logarithms of the sides seem to have; 0 where nothing is known of it.

    Among M look-alikes measured inexactly one is nearer in size than the right one. The least of M squares is
    compared with what it is in the middle for an error of 1; the median over the detections gives the error.

    Args:
        table: (C + 1, C) probability of each detected category for each true one.
        code: (N,) detected categories.
        known_code: (M,) those of the labels.
        gap: (N, M) sums of squares of what the logarithms of the sides differ by; NaN where not known.
    """
    error, count = np.empty(len(gap)), 0  # in rising order
    for i in range(len(gap)):
        least, alike = np.inf, 0
        for j in range(gap.shape[1]):
            if table[code[i], known_code[j]] > 0.0 and not math.isnan(gap[i, j]):
                least, alike = min(least, gap[i, j]), alike + 1
        if alike > 0:
            # Where x is small, a sum of 3 squares is below x with a probability of 0.266 x^1.5.
            one, place = least / ((1.0 - 0.5 ** (1.0 / alike)) / 0.266) ** (2.0 / 3.0), count
            while place > 0 and error[place - 1] > one:
                error[place] = error[place - 1]
                place -= 1
            error[place] = one
            count += 1
    return math.sqrt((error[(count - 1) // 2] + error[count // 2]) / 2) if count > 0 else 0.0


@_compile
def look(known: Known, found: Found, b: int, like: FloatArray, nothing: FloatArray) -> None:
    """Fill in how likely the detections' looks and heights are.

    A size that is not known on either side is as likely as that of the right object is on average. What has
    no label looks like one of the labels' objects that it may look like, and is anywhere and turned anyhow.

    Args:
        known: the labels, the detector and the view.
        found: the detections.
        b: the snapshot.
        like: (N, M) filled for each label.
        nothing: (N,) filled with the density of a detection without a label, for each that is expected.
    """
    detecting, table, code, sides = known.detecting, known.detecting.category, found.category, found.sides
    known_code, known_sides, height = known.labels.category, known.labels.sides, known.labels.elevation
    elevation = found.elevation
    n, m = like.shape
    gap = np.empty((n, m))
    for i in range(n):
        for j in range(m):
            gap[i, j] = 0.0
            for k in range(3):
                gap[i, j] += (sides[b, i, k] - known_sides[j, k]) ** 2
    side_sd = max(float(detecting.log_side_sd), side_error(table, code[b, :n], known_code, gap))
    for i in range(n):
        every, squared = 0.0, 0.0
        for j in range(m):
            squares = 3.0 if math.isnan(gap[i, j]) else gap[i, j] / side_sd**2
            one = table[code[b, i], known_code[j]] * math.exp(-0.5 * squares)
            rise = (elevation[b, i] - height[j]) / detecting.height_sd
            if not math.isnan(rise):
                one *= CHANGES_HEIGHT + (1 - CHANGES_HEIGHT) * math.exp(-0.5 * rise * rise)
            like[i, j] = one
            every += one
            squared += one * one
        # Labels that it does not look like do not count, however many they are.
        nothing[i] = squared / every / (known.camera.area * 2 * math.pi) if every > 0.0 else 0.0


@_compile
def translation_density(known: Known, labels: Labels, found: Found, b: int, result: FloatArray) -> None:
    """Fill (A, N, M): density of each place that was detected in snapshot b for each scale and label.

    Where the detector says that it knows a place less exactly than is usual, it is believed.
    """
    scale, usual = known.models.translation_sd, known.detecting.position_sd
    stood, fixed, room = labels.position, labels.fixed, labels.room
    position, spread, cross = found.position[b], found.spread[b], found.cross[b]
    for a in range(len(scale)):
        sd = scale[a]
        for i in range(result.shape[1]):
            for j in range(len(fixed)):
                moved = 0.0 if fixed[j] else sd
                density = 1.0
                for axis in range(2):
                    density *= axis_density(
                        position[i, axis],
                        stood[j, axis],
                        room[axis],
                        moved,
                        max(usual, spread[i, axis]),
                    )
                if cross[i] != 0.0:
                    x, z = position[i, 0] - stood[j, 0], position[i, 1] - stood[j, 1]
                    one = moved * moved + max(usual, spread[i, 0]) ** 2
                    other = moved * moved + max(usual, spread[i, 1]) ** 2
                    density = correlated(density, x, z, one, other, cross[i])
                result[a, i, j] = density


@_compile
def correlated(density: float, x: float, z: float, one: float, other: float, cross: float) -> float:
    """Density of a shift whose coordinates go together, from that of coordinates that do not.

    Args:
        density: without the correlation; larger than a normal one where there are walls.
        x: of the shift, metres.
        z: likewise.
        one: variance of x.
        other: that of z.
        cross: their covariance.
    """
    alone = math.exp(-0.5 * (x * x / one + z * z / other)) / (2 * math.pi * math.sqrt(one * other))
    left = one * other - cross * cross
    square = (other * x * x - 2 * cross * x * z + one * z * z) / left
    both = math.exp(-0.5 * square) / (2 * math.pi * math.sqrt(left))
    return both * min(density / alone, 1e100) if alone > 0.0 else both


@_compile
def heading_density(models: Models, labels: Labels, found: Found, b: int, result: FloatArray) -> None:
    """Fill (B, N, M): density of each heading that was detected in snapshot b for each scale and label.

    What the detector says of its uncertainty counts, and so does the second most probable heading.
    """
    yaw, spread, rival, weight = found.yaw[b], found.spread[b], found.rival[b], found.rival_weight[b]
    table_density(models, labels, yaw, result)
    usual = models.turn_sd[0]
    scales = len(result)
    for i in range(result.shape[1]):
        more = max(spread[i, 2] ** 2 - usual**2, 0.0)
        if math.isnan(yaw[i]) or (more == 0.0 and weight[i] == 0.0):
            continue
        for j in range(len(labels.yaw)):
            period = labels.period[j]
            if period == 0.0 or math.isnan(labels.yaw[j]):
                continue
            for a in range(scales):
                sd = math.sqrt(models.turn_sd[0 if labels.fixed[j] else a] ** 2 + more)
                one = turn_density(yaw[i] - labels.yaw[j], period, sd)
                other = turn_density(rival[i] - labels.yaw[j], period, sd) if weight[i] > 0.0 else 0.0
                result[a, i, j] = (1.0 - weight[i]) * one + weight[i] * other


@_compile
def turn_density(turn: float, period: float, sd: float) -> float:
    """`heading_log_density`, without the logarithm, of one turn of an object with a period above 0."""
    turn -= period * round(turn / period)
    if sd < period / 3:  # a sum over periods where narrow, over harmonics where wide
        total = 0.0
        for k in range(-2, 3):
            total += math.exp(-0.5 * ((turn - k * period) / sd) ** 2)
        return total * period / (2 * math.pi) / (sd * ROOT_TWO_PI)
    total = 1.0
    for k in range(1, 4):
        wave = k * 2 * math.pi / period
        total += 2 * math.exp(-0.5 * (wave * sd) ** 2) * math.cos(wave * turn)
    return max(total, 1e-300) / (2 * math.pi)


@_compile
def table_density(models: Models, labels: Labels, yaw: FloatArray, result: FloatArray) -> None:
    """Fill (B, N, M): density of each heading (N or more,), of the usual noise, by the tables."""
    tables, stood, periods, fixed, kind = (
        models.heading,
        labels.yaw,
        labels.period,
        labels.fixed,
        labels.table,
    )
    scales, _, size = tables.shape
    for i in range(result.shape[1]):
        for j in range(len(stood)):
            period = periods[j]
            turn = yaw[i] - stood[j]
            if period == 0.0 or math.isnan(turn):
                for b in range(scales):
                    result[b, i, j] = 1.0 / (2 * math.pi)
                continue
            turn = abs(turn - period * round(turn / period))
            place = turn / (period / 2) * (size - 1)
            if not 0.0 <= place <= size - 1:  # no angle that rounding cannot bring within half a period
                place = size - 1.0
            low = min(int(place), size - 2)
            part = place - low
            for b in range(scales):
                scale, one = 0 if fixed[j] else b, kind[j]
                below = tables[scale, one, low]
                result[b, i, j] = below + part * (tables[scale, one, low + 1] - below)
