"""Compiled densities of `LikelihoodReid`: of places, headings and looks, and of what is in view."""

from __future__ import annotations

import math

from farm_ar.arrays import FloatArray
from farm_ar.kernels import compiled
from farm_ar.reid.likelihood.motions import WALL
from farm_ar.reid.likelihood.records import Detecting, Eyes, Found, Labels, Models, View

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
            if abs(end - start) < 1e-12:
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
    labels: Labels, models: Models, view: View, eyes: Eyes, found: Found, b: int, result: FloatArray
) -> None:
    """Fill (A, M): how probable it is that each label's object, having moved on each scale, is in view."""
    points = len(models.offset)
    sine, cosine = math.sin(eyes.yaw[b]), math.cos(eyes.yaw[b])
    rise, level = math.sin(eyes.pitch[b]), math.cos(eyes.pitch[b])
    ex, ez = eyes.position[b, 0], eyes.position[b, 1]
    west = 0.0 if labels.room[0] < math.inf else -math.inf
    south = 0.0 if labels.room[1] < math.inf else -math.inf
    farthest = 0.0
    for q in range(points):
        farthest = max(farthest, math.hypot(models.offset[q, 0], models.offset[q, 1]))
    for j in range(len(labels.yaw)):
        above = labels.elevation[j] - eyes.height[b]
        x, z = labels.position[j, 0], labels.position[j, 1]
        away = math.hypot(x - ex, z - ez)
        for a in range(len(models.translation_sd)):
            sd = models.translation_sd[a]
            result[a, j] = 0.0
            if away > view.range_m + farthest * sd:
                continue
            inside = 0
            for q in range(points):
                dx = min(max(x + sd * models.offset[q, 0], west), labels.room[0]) - ex
                dz = min(max(z + sd * models.offset[q, 1], south), labels.room[1]) - ez
                square = dx * dx + dz * dz
                right, ahead = dx * cosine - dz * sine, dx * sine + dz * cosine
                limit = view.right if right >= 0.0 else view.left
                seen = square <= view.range_m * view.range_m and ahead >= limit * math.sqrt(square)
                if seen and view.vertical:
                    up, forward = above * level - ahead * rise, above * rise + ahead * level
                    seen = forward > 0.0 and -view.down <= math.atan2(up, forward) <= view.up
                if seen and view.occlusion:
                    seen = not hidden(found, b, ex, ez, ex + dx, ez + dz)
                if seen:
                    inside += 1
            result[a, j] = inside / points


@_compile
def likeness(
    labels: Labels, detecting: Detecting, category: int, sides: FloatArray, result: FloatArray
) -> None:
    """Fill (M,): how likely a detection's category and size are for each label's object.

    A size that is not known on either side is as likely as that of the right object is on average.
    """
    for j in range(len(result)):
        total = 0.0
        for k in range(3):
            total += (sides[k] - labels.sides[j, k]) ** 2
        like = detecting.category[category, labels.category[j]]
        squares = 3.0 if math.isnan(total) else total / detecting.log_side_sd**2
        result[j] = like * math.exp(-0.5 * squares)


@_compile
def translation_density(
    labels: Labels, models: Models, detecting: Detecting, position: FloatArray, result: FloatArray
) -> None:
    """Fill (A, N, M): density of each detection's place for each scale and label."""
    for a in range(len(models.translation_sd)):
        sd = models.translation_sd[a]
        for i in range(result.shape[1]):
            for j in range(len(labels.yaw)):
                moved = 0.0 if labels.fixed[j] else sd
                density = 1.0
                for axis in range(2):
                    density *= axis_density(
                        position[i, axis],
                        labels.position[j, axis],
                        labels.room[axis],
                        moved,
                        detecting.position_sd,
                    )
                result[a, i, j] = density


@_compile
def heading_density(labels: Labels, models: Models, yaw: FloatArray, result: FloatArray) -> None:
    """Fill (B, N, M): density of each detection's heading for each scale and label, from the tables."""
    scales, _, size = models.heading.shape
    for i in range(len(yaw)):
        for j in range(len(labels.yaw)):
            period = labels.period[j]
            turn = yaw[i] - labels.yaw[j]
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
                scale = 0 if labels.fixed[j] else b
                table = models.heading[scale, labels.table[j]]
                result[b, i, j] = table[low] + part * (table[low + 1] - table[low])
