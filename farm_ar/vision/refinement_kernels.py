"""Compiled kernels of refinement: a thing as a pose would show it, and how improbable the pixels then are."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.rendering.kernels import Faces, Lens, Nearness, rasterise
from farm_ar.structs import Structs

Pieces = tuple[FloatArray, IntArray, int]
"""Corners and pieces of a thing, and how many pieces there are."""

Eye = tuple[FloatArray, FloatArray, Structs[Lens]]
"""Where the camera is, its axes in the world, and its lens."""

Around = tuple[Nearness, Nearness, Nearness]
"""(H, W) nearness of other objects, (H, W, 3) the image, (H, W) what each pixel costs without the thing."""

VARIANCE = 30.0
"""That of a colour on one piece, at the least, of 255 squared: noise."""

OWN_COLOUR = 4.0
"""What a piece costs whose colour is not known before, nats."""

RING_PX = 9
"""How far around a pixel the background is looked at."""

FEW_PX = 8
"""Pixels of background below which those behind the thing itself are looked at, too."""

OVERALL_PX = 4.0
"""Pixels as many as which the mean of all background counts."""

_compile = compiled(error_model="numpy")


@_compile
def background(image: Nearness, region: IntArray, own: BoolArray, regions: int) -> Nearness:
    """(H, W) nats that each pixel costs without the thing: as its neighbour's piece, or as what is around.

    Args:
        image: (H, W, 3).
        region: (H, W) piece of another thing that a pixel shows, -1 for none.
        own: (H, W) where the thing itself is thought to be.
        regions: how many pieces there are.
    """
    height, width = region.shape
    count = 0
    for row in range(height):
        for column in range(width):
            count += region[row, column] < 0 and not own[row, column]
    # Sums of the background's weight, colours and squares from the corner to each pixel, and of each piece.
    sums, piece = np.zeros((height + 1, width + 1, 7)), np.zeros((regions + 1, 7))
    line = np.empty(7)
    for row in range(height):
        line[:] = 0.0
        for column in range(width):
            k = region[row, column]
            weight = 1.0 if k < 0 and not own[row, column] else 0.0
            if count < FEW_PX:
                weight = 1e-3 + (1.0 if k < 0 else 0.0)
            line[0] += weight
            if k >= 0:
                piece[k, 0] += 1.0
            for c in range(3):
                value = float(image[row, column, c])
                line[1 + c] += weight * value
                line[4 + c] += weight * value * value
                if k >= 0:
                    piece[k, 1 + c] += value
                    piece[k, 4 + c] += value * value
            for i in range(7):
                sums[row + 1, column + 1, i] = sums[row, column + 1, i] + line[i]
    found = np.empty((height, width), np.float32)
    total = sums[height, width]
    for row in range(height):
        top, low = max(row - RING_PX, 0), min(row + RING_PX + 1, height)
        for column in range(width):
            left, right = max(column - RING_PX, 0), min(column + RING_PX + 1, width)
            k, nats = region[row, column], 0.0
            for c in range(3):
                if k >= 0:
                    weight, first, second = piece[k, 0], piece[k, 1 + c], piece[k, 4 + c]
                else:
                    a, b, d, e = sums[low, right], sums[top, right], sums[low, left], sums[top, left]
                    share = OVERALL_PX / total[0]
                    weight = a[0] - b[0] - d[0] + e[0] + OVERALL_PX
                    first = a[1 + c] - b[1 + c] - d[1 + c] + e[1 + c] + share * total[1 + c]
                    second = a[4 + c] - b[4 + c] - d[4 + c] + e[4 + c] + share * total[4 + c]
                mean = first / weight
                variance = max(second / weight - mean * mean, 0.0) + VARIANCE
                off = float(image[row, column, c]) - mean
                nats += 0.5 * math.log(variance) + off * off / (2 * variance)
            found[row, column] = nats
    return found


@_compile
def cost_of(pose: FloatArray, solid: Pieces, camera: Eye, around: Around) -> float:
    """How improbable pixels are with a thing at a pose, less how improbable they are without it, nats."""
    (_, piece, pieces), (others, image, nothing) = solid, around
    face, top, left = show(pose, solid, camera, others)
    sums = np.zeros((pieces, 7))
    total = 0.0
    for row in range(face.shape[0]):
        for column in range(face.shape[1]):
            k = face[row, column]
            if k < 0:
                continue
            s = piece[k]
            total -= nothing[top + row, left + column]
            sums[s, 0] += 1.0
            for c in range(3):
                value = float(image[top + row, left + column, c])
                sums[s, 1 + c] += value
                sums[s, 4 + c] += value * value
    for s in range(pieces):
        number = sums[s, 0]
        if number < 1.0:
            continue
        for c in range(3):
            mean = sums[s, 1 + c] / number
            variance = max(sums[s, 4 + c] / number - mean * mean, 0.0)
            spread = variance + VARIANCE
            total += 0.5 * number * (math.log(spread) + variance / spread)
        total += OWN_COLOUR
    return total


@_compile
def pixels_of(pose: FloatArray, solid: Pieces, camera: Eye, others: Nearness) -> int:
    """How many pixels show a thing at a pose."""
    return int((show(pose, solid, camera, others)[0] >= 0).sum())


@_compile
def show(pose: FloatArray, solid: Pieces, camera: Eye, others: Nearness) -> tuple[Faces, int, int]:
    """(h, w) which triangle of a thing at a pose each pixel around it shows, -1 for none; the first pixel."""
    (corners, _, _), (eye, turn, lens) = solid, camera
    place = np.empty_like(corners)
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    near, fx, fy, cx, cy = lens[0].near, lens[0].fx, lens[0].fy, lens[0].cx, lens[0].cy
    u_least, u_most, v_least, v_most = 1e9, -1e9, 1e9, -1e9
    for k in range(len(corners)):
        for i in range(3):
            x = cosine * corners[k, i, 0] + sine * corners[k, i, 2] + pose[0] - eye[0]
            y = corners[k, i, 1] - eye[1]
            z = cosine * corners[k, i, 2] - sine * corners[k, i, 0] + pose[1] - eye[2]
            for c in range(3):
                place[k, i, c] = turn[c, 0] * x + turn[c, 1] * y + turn[c, 2] * z
            ahead = place[k, i, 2]
            if ahead < near:  # cut there; it may be anywhere
                u_least, u_most, v_least, v_most = -1e9, 1e9, -1e9, 1e9
                continue
            u, v = fx * place[k, i, 0] / ahead + cx, fy * place[k, i, 1] / ahead + cy
            u_least, u_most = min(u_least, u), max(u_most, u)
            v_least, v_most = min(v_least, v), max(v_most, v)
    top, low = int(max(v_least, 0.0)), int(min(v_most + 2.0, float(others.shape[0])))
    left, right = int(max(u_least, 0.0)), int(min(u_most + 2.0, float(others.shape[1])))
    if low <= top or right <= left:
        return np.empty((0, 0), np.int32), 0, 0
    nearness, face = others[top:low, left:right].copy(), np.full((low - top, right - left), -1, np.int32)
    part = lens.copy()
    part[0].cx -= left
    part[0].cy -= top
    rasterise(place, part, 0, nearness, face)
    return face, top, left


@_compile
def search(
    pose: FloatArray, steps: FloatArray, halvings: int, solid: Pieces, camera: Eye, around: Around
) -> float:
    """Move a pose downhill, with steps that are halved; the cost where it ends. The pose is changed."""
    least = cost_of(pose, solid, camera, around)
    step, trial, side = steps.copy(), pose.copy(), np.ones(3)
    for _ in range(halvings):
        came = -1  # along which axis the pose came to be what it is: the way back leads uphill
        for _ in range(3):
            better = False
            for axis in range(3):
                for turn in range(1 if axis == came else 2):
                    trial[:] = pose
                    trial[axis] += side[axis] * step[axis]
                    cost = cost_of(trial, solid, camera, around)
                    if cost < least:
                        least, better, came = cost, True, axis
                        pose[:] = trial
                        break
                    if turn == 0 and axis != came:
                        side[axis] = -side[axis]
            if not better:
                break
        step *= 0.5
    return least


@_compile
def best_of(
    pose: FloatArray,
    toward: FloatArray,
    reach: float,
    best: FloatArray,
    solid: Pieces,
    camera: Eye,
    around: Around,
) -> None:
    """Fill in those of 45 poses around one that cost least.

    Args:
        pose: (3,) x, z and yaw.
        toward: (2,) unit vector along the ray from the eye on the plane.
        reach: metres.
        best: (S, 3), filled in.
        solid: the thing.
        camera: the camera.
        around: what is around it.
    """
    cost = np.empty(45)
    poses = np.empty((45, 3))
    for n in range(45):
        along, across, turn = n // 9 - 2, n // 3 % 3 - 1, n % 3 - 1
        ahead, beside = 0.5 * reach * along, 0.4 * reach * across
        poses[n, 0] = pose[0] + toward[0] * ahead + toward[1] * beside
        poses[n, 1] = pose[1] + toward[1] * ahead - toward[0] * beside
        poses[n, 2] = pose[2] + 0.25 * turn
        cost[n] = cost_of(poses[n], solid, camera, around)
    for s in range(len(best)):
        n = int(cost.argmin())
        best[s] = poses[n]
        cost[n] = np.inf
