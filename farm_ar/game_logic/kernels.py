"""Compiled kernels of the animals: arc length along cubic Béziers, and the first footprint on the way.

A curve is worked with as its polynomials: x(t) = p[0] + p[1] t + p[2] t² + p[3] t³, and z(t) alike with p[4]
to p[7]. Its arc length is tabulated at up to KNOTS parameters, closer together where it nearly stops (at a
cusp), so that lengths are right to rounding everywhere. Where a curve enters a footprint is solved for, not
stepped up to: no corner is clipped so slightly that it is missed.

"""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.game_logic.compiling import compiled

KNOTS = 64
"""Entries of a table of arc length: room for some even steps and for many where a curve nearly stops."""

RUNNING, NOWHERE = -2, -1
"""In place of a building: still on the way; come to the end of the curve inside nothing."""

SLOT, DUE, TURN = range(3)
"""Columns of a queue of animals: the row of what is known of one; when it arrives, seconds, kept here because
all are asked for that again and again; how many columns there are."""

GOAL, INTO, ZERO, CURVE, ANIMAL = 0, 1, 2, 3, 11
"""Columns of what is known of an animal: the label that it wants to get to; the building in which it will
arrive; when it is, or was, at the start of its curve, seconds; the curve; how many columns there are."""

NOW, PACE, RUNNERS, NEXT, PERIOD, SENT, ASTRAY, CLOCKS = range(8)
"""Places in a flock's clock: the time, seconds; metres a second; how many are on their way; when the next
arrives; how often a label sends one; how many have been sent; how many of those that arrived have not got
into the building of their label; how many places there are."""

LANE = 11
"""Columns of a lane."""

Polynomial = tuple[float, float, float, float, float, float, float, float]

_EVEN_STEPS = 8
_TOLERANCE = 1e-14  # error of a table's step, as a part of the length around the control points
_PIECES = 4  # of a curve, looked at one by one for whether they can meet a footprint
_LOOKS = 8  # at a curve, at equal steps of the parameter
_ROUNDING = 1e-12  # metres that do not count
_CONVERGED = 1e-8  # a step of Newton's method this small leaves an error of rounding

# Eight-point Gauss-Legendre quadrature on [0, 1].
_NODES, _WEIGHTS = (1 + np.polynomial.legendre.leggauss(8)[0]) / 2, np.polynomial.legendre.leggauss(8)[1] / 2


@compiled
def polynomial(curve: FloatArray) -> Polynomial:
    """Coefficients of a curve of control points (4, 2)."""
    x0, x1, x2, x3 = curve[0, 0], curve[1, 0], curve[2, 0], curve[3, 0]
    z0, z1, z2, z3 = curve[0, 1], curve[1, 1], curve[2, 1], curve[3, 1]
    xb, xc, xd = 3 * (x1 - x0), 3 * (x2 - 2 * x1 + x0), x3 - x0 - 3 * (x2 - x1)
    zb, zc, zd = 3 * (z1 - z0), 3 * (z2 - 2 * z1 + z0), z3 - z0 - 3 * (z2 - z1)
    return x0, xb, xc, xd, z0, zb, zc, zd


@compiled
def speed(p: Polynomial, t: float) -> float:
    """Length of a curve's derivative, metres per unit of the parameter."""
    x, z = p[1] + t * (2 * p[2] + 3 * p[3] * t), p[5] + t * (2 * p[6] + 3 * p[7] * t)
    length: float = np.sqrt(x * x + z * z)
    return length


@compiled
def stretch(p: Polynomial, begin: float, end: float, part: FloatArray) -> float:
    """Length of a curve between two parameters by one quadrature, metres.

    Args:
        p: the curve.
        begin: parameter.
        end: parameter.
        part: (8,) to work in: what is added up is computed first, so that a processor does several at once.
    """
    # As many times as there is room: of a loop whose end is known beforehand, Numba takes one at a time.
    for k in range(len(part)):
        part[k] = speed(p, begin + (end - begin) * _NODES[k])
    total = 0.0
    for k in range(len(_NODES)):
        total += _WEIGHTS[k] * part[k]
    return (end - begin) * total


@compiled
def turning_points(b: float, c: float, d: float) -> tuple[float, float]:
    """Where from -1 to 1 b + 2 c t + 3 d t² is zero; 2, beyond every curve, for a root that is not there."""
    inside = c * c - 3 * b * d
    if inside < 0:
        return 2.0, 2.0
    q = -(c + np.copysign(np.sqrt(inside), c))
    first = q / (3 * d) if d != 0 and abs(q) <= abs(3 * d) else 2.0
    return first, b / q if q != 0 and abs(b) <= abs(q) else 2.0


@compiled
def measure_one(curve: FloatArray, knot: FloatArray, travelled: FloatArray) -> None:
    """Tabulate the arc length of a curve: steps are halved until two quadratures agree with one.

    The first steps end where x or z turns round, too. An exact cusp is such a place, and a quadrature across
    it may be wrong without showing it.

    Args:
        curve: (4, 2) control points, metres.
        knot: (KNOTS,) filled with parameters rising from 0 to 1, then 1 to the end.
        travelled: (KNOTS,) filled with the length up to each, metres.
    """
    ends, part = np.empty(KNOTS), np.empty(len(_NODES))
    p = polynomial(curve)
    around = 0.0
    for i in range(3):
        around += np.hypot(curve[i + 1, 0] - curve[i, 0], curve[i + 1, 1] - curve[i, 1])
    for i in range(_EVEN_STEPS):
        ends[i] = 1 - i / _EVEN_STEPS
    waiting, used = _EVEN_STEPS, 1
    x_turns, z_turns = turning_points(p[1], p[2], p[3]), turning_points(p[5], p[6], p[7])
    for turn in (x_turns[0], x_turns[1], z_turns[0], z_turns[1]):
        if 0 < turn < 1:
            place = waiting
            while ends[place - 1] < turn:
                ends[place] = ends[place - 1]
                place -= 1
            ends[place] = turn
            waiting += 1
    begin = length = 0.0
    knot[0] = travelled[0] = 0.0
    while waiting > 0:
        end = ends[waiting - 1]
        middle = (begin + end) / 2
        step = stretch(p, begin, end, part)
        error = abs(step - stretch(p, begin, middle, part) - stretch(p, middle, end, part))
        if error > _TOLERANCE * around and used + waiting < KNOTS:
            ends[waiting] = middle
            waiting += 1
            continue
        length += step
        knot[used], travelled[used] = end, length
        begin = end
        used += 1
        waiting -= 1
    knot[used:], travelled[used:] = 1.0, length


@compiled
def measure(
    curve: FloatArray, along: FloatArray, parameter: FloatArray, knot: FloatArray, travelled: FloatArray
) -> None:
    """Tabulate the arc length of curves, and find where on them animals are.

    Args:
        curve: (A, 4, 2) control points, metres.
        along: (A,) how far along them the animals are, metres.
        parameter: (A,) filled with the parameters there.
        knot: (A, KNOTS) filled with parameters rising from 0 to 1, then 1 to the end.
        travelled: (A, KNOTS) filled with the length up to each, metres.
    """
    for a in range(len(curve)):
        measure_one(curve[a], knot[a], travelled[a])
        parameter[a] = parameter_at(polynomial(curve[a]), knot[a], travelled[a], max(along[a], 0.0))


@compiled
def locate(curve: FloatArray, along: FloatArray, parameter: FloatArray) -> None:
    """Fill in the parameters (A,) of curves (A, 4, 2) after (A,) metres."""
    knot, travelled = np.empty(KNOTS), np.empty(KNOTS)
    for a in range(len(curve)):
        parameter[a] = 0.0
        if along[a] > 0:
            measure_one(curve[a], knot, travelled)
            parameter[a] = parameter_at(polynomial(curve[a]), knot, travelled, along[a])


@compiled
def last_below(values: FloatArray, value: float) -> int:
    """Index of the last of rising values (K,) that is not above `value`, at most K - 2."""
    i = 0  # from the front: most tables have few steps
    while i < len(values) - 2 and values[i + 1] <= value:
        i += 1
    return i


@compiled
def length_at(p: Polynomial, knot: FloatArray, travelled: FloatArray, t: float) -> float:
    """Length of a curve up to a parameter, by its table (KNOTS,), metres."""
    i = last_below(knot, t)
    length: float = travelled[i] + stretch(p, knot[i], t, np.empty(len(_NODES)))
    return length


@compiled
def parameter_at(p: Polynomial, knot: FloatArray, travelled: FloatArray, length: float) -> float:
    """Parameter at which a curve is so many metres long, by its table (KNOTS,); 1 beyond its end.

    Between two entries of the table the first guess takes the speed to change evenly; then Newton's method,
    by bisection where that would leave the two.
    """
    if length >= travelled[-1]:
        return 1.0
    i = last_below(travelled, length)
    low: float = knot[i]
    high: float = knot[i + 1]
    wanted = length - travelled[i]
    if wanted <= 0:
        return low
    share = wanted / (travelled[i + 1] - travelled[i])
    slow, fast = speed(p, low), speed(p, high)
    lean = (fast - slow) / (fast + slow) if fast + slow > 0 else 0.0
    root: float = np.sqrt(max((1 - lean) ** 2 + 4 * lean * share, 0.0))
    t: float = low + (high - low) * 2 * share / (1 - lean + root)
    part = np.empty(len(_NODES))
    while True:
        excess = stretch(p, knot[i], t, part) - wanted
        if excess > 0:
            high = t
        else:
            low = t
        here = speed(p, t)
        step = -excess / here if here > 0 else 2.0
        if abs(step) <= _CONVERGED:
            return min(max(t + step, low), high)
        t = t + step if low < t + step < high else (low + high) / 2
        if not low < t < high:
            return t


@compiled
def strip_entry(a: float, b: float, c: float, d: float, half: float, begin: float, end: float) -> float:
    """First parameter at which a cubic, monotone from `begin` to `end`, is within ±half; 2 for never."""
    first, last = a + begin * (b + begin * (c + begin * d)), a + end * (b + end * (c + end * d))
    if abs(first) <= half:
        return begin
    side = 1.0 if first > 0 else -1.0
    level = side * half
    if side * (last - level) > 0:
        return 2.0
    low, high = begin, end
    t = begin + (end - begin) * (level - first) / (last - first)
    for _ in range(100):
        outside = side * (a + t * (b + t * (c + t * d)) - level)
        if outside > 0:
            low = t
        else:
            high = t
        slope = side * (b + t * (2 * c + 3 * d * t))
        after = t - outside / slope if slope < 0 else 2.0
        if abs(after - t) <= 1e-16:
            break
        t = after if low < after < high else (low + high) / 2
        if not low < t < high:
            return high
    return t


@compiled
def hull(a: float, b: float, c: float, d: float, begin: float, end: float) -> tuple[float, float]:
    """Least and greatest control point of a cubic's part from `begin` to `end`: it stays between the two."""
    third = (end - begin) / 3
    first, last = a + begin * (b + begin * (c + begin * d)), a + end * (b + end * (c + end * d))
    second = first + third * (b + begin * (2 * c + 3 * d * begin))
    before_last = last - third * (b + end * (2 * c + 3 * d * end))
    return min(first, second, before_last, last), max(first, second, before_last, last)


@compiled
def footprint_entry(p: Polynomial, begin: float, end: float, box: FloatArray) -> float:
    """First parameter from `begin` to `end` at which a curve is in a footprint, edges included; 2 for never.

    In the footprint's own axes the curve is cut where either coordinate turns round. On each piece both are
    monotone: each enters its strip at most once, and the later of the two enters the footprint, if the other
    has not left by then.

    Args:
        p: the curve.
        begin: where to look from.
        end: where to look to.
        box: (8,) a row of `boxes`.
    """
    x, z, sine, cosine, half_width, half_depth = box[0], box[1], box[2], box[3], box[4], box[5]
    xa, xb = cosine * (p[0] - x) - sine * (p[4] - z), cosine * p[1] - sine * p[5]
    xc, xd = cosine * p[2] - sine * p[6], cosine * p[3] - sine * p[7]
    za, zb = sine * (p[0] - x) + cosine * (p[4] - z), sine * p[1] + cosine * p[5]
    zc, zd = sine * p[2] + cosine * p[6], sine * p[3] + cosine * p[7]
    misses = True
    for k in range(_PIECES):
        # Cheap: most curves that miss do so by their control points, a piece of the curve at a time.
        first, last = begin + (end - begin) * (k / _PIECES), begin + (end - begin) * ((k + 1) / _PIECES)
        least, most = hull(xa, xb, xc, xd, first, last)
        if least > half_width + 2 * _ROUNDING or most < -half_width - 2 * _ROUNDING:
            continue
        least, most = hull(za, zb, zc, zd, first, last)
        if not (least > half_depth + 2 * _ROUNDING or most < -half_depth - 2 * _ROUNDING):
            misses = False
            break
    if misses:
        return 2.0
    x_turns, z_turns = turning_points(xb, xc, xd), turning_points(zb, zc, zd)
    while True:
        stop = end
        for turn in (x_turns[0], x_turns[1], z_turns[0], z_turns[1]):
            if begin < turn < stop:
                stop = turn
        t = strip_entry(xa, xb, xc, xd, half_width, begin, stop)
        if t <= stop:
            t = max(t, strip_entry(za, zb, zc, zd, half_depth, begin, stop))
        if t <= stop:
            across, ahead = xa + t * (xb + t * (xc + t * xd)), za + t * (zb + t * (zc + t * zd))
            if abs(across) <= half_width + _ROUNDING and abs(ahead) <= half_depth + _ROUNDING:
                return t
        if stop >= end:
            return 2.0
        begin = stop


@compiled
def boxes(position: FloatArray, yaw: FloatArray, size: FloatArray, obstacles: BoolArray) -> FloatArray:
    """Footprints of N buildings as `footprint_entry` wants them.

    Returns:
        (N, 8) x and z of the centre, sine and cosine of the yaw, half the width and half the depth, how far
        the footprint reaches along x and along z; nowhere (NaN) for those that are no obstacles.
    """
    box = np.full((len(yaw), 8), np.nan)
    for i in range(len(yaw)):
        if obstacles[i]:
            sine, cosine = np.sin(yaw[i]), np.cos(yaw[i])
            width, depth = size[i, 0] / 2, size[i, 2] / 2
            box[i, 0], box[i, 1], box[i, 2], box[i, 3] = position[i, 0], position[i, 1], sine, cosine
            box[i, 4], box[i, 5] = width, depth
            box[i, 6] = abs(cosine) * width + abs(sine) * depth + _ROUNDING
            box[i, 7] = abs(sine) * width + abs(cosine) * depth + _ROUNDING
    return box


@compiled
def first_building(p: Polynomial, begin: float, end: float, box: FloatArray) -> tuple[int, float]:
    """The first of the footprints (N, 8) that a curve is in from `begin` to `end`, and at which parameter.

    NOWHERE and 2 if there is none; of several at once the one with the least index.
    """
    first, entry = NOWHERE, 2.0
    least_x, most_x = hull(p[0], p[1], p[2], p[3], begin, end)
    least_z, most_z = hull(p[4], p[5], p[6], p[7], begin, end)
    for i in range(len(box)):
        x, z, reach_x, reach_z = box[i, 0], box[i, 1], box[i, 6], box[i, 7]
        if (
            x - reach_x <= most_x
            and x + reach_x >= least_x
            and z - reach_z <= most_z
            and z + reach_z >= least_z
        ):
            t = footprint_entry(p, begin, min(end, entry), box[i])
            if t < entry:
                first, entry = i, t
    return first, entry


@compiled
def standing_at(x: float, z: float, box: FloatArray) -> int:
    """Which of the footprints (N, 8) a point is in, edges included; of several the least, NOWHERE if none."""
    for i in range(len(box)):
        dx, dz, sine, cosine = x - box[i, 0], z - box[i, 1], box[i, 2], box[i, 3]
        if abs(dx * cosine - dz * sine) <= box[i, 4] and abs(dx * sine + dz * cosine) <= box[i, 5]:
            return i
    return NOWHERE


@compiled
def stays_on(p: Polynomial, table: FloatArray) -> bool:
    """Whether a whole curve is on a table from (0, 0) to (2,)."""
    for axis in range(2):
        a, b, c, d = p[4 * axis], p[4 * axis + 1], p[4 * axis + 2], p[4 * axis + 3]
        for turn in turning_points(b, c, d):
            t = min(max(turn, 0.0), 1.0)
            if not 0 <= a + t * (b + t * (c + t * d)) <= table[axis]:
                return False
        if not (0 <= a <= table[axis] and 0 <= a + b + c + d <= table[axis]):
            return False
    return True


@compiled
def glimpsed(p: Polynomial, box: FloatArray) -> float:
    """A parameter at which a curve is in a footprint (8,), if a quick look finds one; else 2."""
    for k in range(1, _LOOKS):
        t = k / _LOOKS
        dx, dz = point_at(p, t)
        dx, dz = dx - box[0], dz - box[1]
        if abs(dx * box[3] - dz * box[2]) <= box[4] and abs(dx * box[2] + dz * box[3]) <= box[5]:
            return t
    return 2.0


@compiled
def in_the_way(p: Polynomial, goal: int, own: FloatArray, box: FloatArray, likely: int) -> int:
    """A footprint that a curve is in before it is in its goal's; NOWHERE if there is none.

    Args:
        p: the curve.
        goal: the building it leads to.
        own: (8,) the footprint of that.
        box: (N, 8) the footprints.
        likely: the one to look at first, because it was in the way of a similar curve; NOWHERE for none.
    """
    least_x, most_x = hull(p[0], p[1], p[2], p[3], 0.0, 1.0)
    least_z, most_z = hull(p[4], p[5], p[6], p[7], 0.0, 1.0)
    for k in range(-1, len(box)):
        i = likely if k < 0 else k
        if i in (goal, NOWHERE) or (k >= 0 and i == likely):
            continue
        x, z, reach_x, reach_z = box[i, 0], box[i, 1], box[i, 6], box[i, 7]
        if (
            x - reach_x <= most_x
            and x + reach_x >= least_x
            and z - reach_z <= most_z
            and z + reach_z >= least_z
        ):
            # Quick: in it by now and never at the goal so far, whenever it came in.
            t = glimpsed(p, box[i])
            if t <= 1 and footprint_entry(p, 0.0, t, own) > t:
                return i
            t = footprint_entry(p, 0.0, 1.0, box[i])
            if t <= 1 and footprint_entry(p, 0.0, t, own) > t:
                return i
    return NOWHERE


@compiled
def dodge(
    curve: FloatArray, aside: FloatArray, bows: FloatArray, goal: IntArray, box: FloatArray, table: FloatArray
) -> None:
    """Bow curves out so that they lead past other buildings; those for which no bow does stay as they are.

    Args:
        curve: (K, 4, 2) control points, metres; the inner two are moved.
        aside: (K, 2) unit vectors along which they are moved.
        bows: (C,) by how much they may be, in order of preference, metres.
        goal: (K,) the building that each curve leads to.
        box: (3, N, 8) footprints to keep clear of: at first; if no bow does; and if that may leave the table.
            The goal's own is taken from the last.
        table: (2,) width and depth of the table, metres.
    """
    for k in range(len(curve)):
        dodge_one(curve[k], aside[k, 0], aside[k, 1], bows, goal[k], box, table)


@compiled
def dodge_one(
    curve: FloatArray,
    aside_x: float,
    aside_z: float,
    bows: FloatArray,
    goal: int,
    box: FloatArray,
    table: FloatArray,
) -> None:
    """`dodge` for one curve, (4, 2)."""
    bowed, own = np.empty((4, 2)), box[2, goal]
    for ask in range(len(box)):
        blocker = NOWHERE
        for bow in bows:
            bowed[:] = curve
            for i in range(1, 3):
                bowed[i, 0] += bow * aside_x
                bowed[i, 1] += bow * aside_z
            p = polynomial(bowed)
            if ask < 2 and not stays_on(p, table):
                continue
            # What was in the way of the last is most likely in the way of the next.
            blocker = in_the_way(p, goal, own, box[ask], blocker)
            if blocker == NOWHERE:
                curve[:] = bowed
                return


@compiled
def footprints_to_dodge(
    position: FloatArray,
    yaw: FloatArray,
    size: FloatArray,
    enterable: BoolArray,
    clearance: float,
    wall: float,
) -> FloatArray:
    """The (3, N, 8) footprints that `dodge` keeps clear of.

    Args:
        position: (N, 2) centres, metres.
        yaw: (N,) headings, radians.
        size: (N, 3) width, height, depth, metres.
        enterable: (N,) buildings that an animal can enter.
        clearance: how far to keep from these at first, metres.
        wall: how far a curve may run inside the front of others, metres.
    """
    n = len(yaw)
    wide, narrow, box = size.copy(), size.copy(), np.empty((3, n, 8))
    for i in range(n):
        if enterable[i]:
            wide[i] += 2 * clearance
        else:
            wide[i] -= 2 * wall
            narrow[i] -= 2 * wall
    everything = np.ones(n, dtype=np.bool_)
    box[0], box[1] = boxes(position, yaw, wide, everything), boxes(position, yaw, narrow, everything)
    box[2] = boxes(position, yaw, narrow, enterable)
    return box


@compiled
def lead(
    lane: FloatArray,
    spread: FloatArray,
    shed: int,
    position: FloatArray,
    yaw: FloatArray,
    size: FloatArray,
    enterable: BoolArray,
    shape: FloatArray,
    bows: FloatArray,
    table: FloatArray,
) -> None:
    """Lead lanes from the shed's door to buildings, as `paths.running_curve` and `paths.clear_curve` do.

    Args:
        lane: (n, L, LANE) lanes; their curves are filled in.
        spread: (n, L) how far each bows out to the right, metres.
        shed: index of the shed.
        position: (N, 2) centres of the buildings, metres.
        yaw: (N,) headings, radians.
        size: (N, 3) width, height, depth, metres.
        enterable: (N,) buildings that an animal can enter.
        shape: (4,) a handle's length as a part of the way, by how much more control points move than the
            curve's middle, the clearance and the wall.
        bows: (C,) by how much curves may be bowed, in order of preference, metres.
        table: (2,) width and depth of the table, metres.
    """
    box = footprints_to_dodge(position, yaw, size, enterable, shape[2], shape[3])
    sine, cosine = np.sin(yaw[shed]), np.cos(yaw[shed])
    start_x, start_z = (
        position[shed, 0] + size[shed, 2] / 2 * sine,
        position[shed, 1] + size[shed, 2] / 2 * cosine,
    )
    curve = np.empty((4, 2))
    for k in range(lane.shape[0]):
        goal = int(lane[k, 0, 0])
        way_x, way_z = position[goal, 0] - start_x, position[goal, 1] - start_z
        way = np.sqrt(way_x * way_x + way_z * way_z)
        handle = shape[0] * way
        right_x, right_z = (way_z / way, -way_x / way) if way > 0 else (1.0, 0.0)
        end_sine, end_cosine = np.sin(yaw[goal]), np.cos(yaw[goal])
        for i in range(lane.shape[1]):
            bow = shape[1] * spread[k, i]
            curve[0, 0], curve[0, 1] = start_x, start_z
            curve[1, 0], curve[1, 1] = (
                start_x + handle * sine + bow * right_x,
                start_z + handle * cosine + bow * right_z,
            )
            curve[2, 0] = position[goal, 0] + handle * end_sine + bow * right_x
            curve[2, 1] = position[goal, 1] + handle * end_cosine + bow * right_z
            curve[3, 0], curve[3, 1] = position[goal, 0], position[goal, 1]
            dodge_one(curve, right_x, right_z, bows, goal, box, table)
            lane[k, i, 3:] = curve.reshape(8)


@compiled
def arrival(curve: FloatArray, along: float, box: FloatArray) -> tuple[int, float]:
    """Where an animal arrives that runs on: in the building where its curve ends, or at its end.

    What else stands in the way does not stop it.

    Args:
        curve: (4, 2) control points, metres.
        along: how far it has run, metres; below 0 while it waits at the start.
        box: (N, 8) footprints from `boxes`.

    Returns:
        The building, or NOWHERE; and how far along the curve that is, metres, not less than it has run.
    """
    p = polynomial(curve)
    knot, travelled = np.empty(KNOTS), np.empty(KNOTS)
    measure_one(curve, knot, travelled)
    begun = max(along, 0.0)
    aim = standing_at(curve[3, 0], curve[3, 1], box)
    if aim != NOWHERE:
        now = parameter_at(p, knot, travelled, begun) if begun > 0 else 0.0
        entry = footprint_entry(p, now, 1.0, box[aim])
        if entry <= 1:
            reached = length_at(p, knot, travelled, entry) if entry > now else begun
            return aim, max(reached, begun)
    return NOWHERE, max(travelled[-1], along)


@compiled
def foresee(queue: FloatArray, animal: FloatArray, clock: FloatArray, box: FloatArray) -> None:
    """Find out when and where animals arrive if everything stays as it stands.

    Args:
        queue: (C, TURN) those on their way in the order in which they were added, then nobody; `DUE` is
            filled in.
        animal: (C, ANIMAL) what is known of each, by slot; `INTO` is filled in.
        clock: (CLOCKS,) the flock's clock; `NEXT` is brought up to date.
        box: (N, 8) footprints from `boxes`.
    """
    now, pace = clock[NOW], clock[PACE]
    clock[NEXT] = np.inf
    for i in range(int(clock[RUNNERS])):
        slot = int(queue[i, SLOT])
        curve = animal[slot, CURVE:].reshape(4, 2)
        along = pace * (now - animal[slot, ZERO])
        into, reached = arrival(curve, along, box)
        animal[slot, INTO] = into
        queue[i, DUE] = max(animal[slot, ZERO] + reached / pace, now)
        clock[NEXT] = min(clock[NEXT], queue[i, DUE])


@compiled
def redirect(
    queue: FloatArray, animal: FloatArray, clock: FloatArray, goal_end: FloatArray, changed: BoolArray
) -> bool:
    """Split off the rest of the curves that lead to labels now believed elsewhere, and move their ends.

    The last two control points are moved together, as `geometry.move_end` does.

    Args:
        queue: (C, TURN) as in `foresee`.
        animal: (C, ANIMAL) likewise; the curves are changed.
        clock: (CLOCKS,) likewise.
        goal_end: (M, 2) where the curves to each label are to end, metres.
        changed: (M,) labels for which that has changed.

    Returns:
        Whether there were any.

    Raises:
        IndexError: an animal's label is not among them; nothing has changed then.
    """
    for i in range(int(clock[RUNNERS])):
        if animal[int(queue[i, SLOT]), GOAL] >= len(changed):
            raise IndexError("an animal wants to get to a label that is not among those given")
    turned, curve, rest = False, np.empty((1, 4, 2)), np.empty((1, 4, 2))
    along, parameter = np.empty(1), np.empty(1)
    for i in range(int(clock[RUNNERS])):
        slot = int(queue[i, SLOT])
        goal = int(animal[slot, GOAL])
        if changed[goal]:
            turned = True
            curve[0] = animal[slot, CURVE:].reshape(4, 2)
            along[0] = max(clock[PACE] * (clock[NOW] - animal[slot, ZERO]), 0.0)
            locate(curve, along, parameter)
            cut(curve, parameter, rest)
            for axis in range(2):
                rest[0, 2, axis] += goal_end[goal, axis] - rest[0, 3, axis]
                rest[0, 3, axis] = goal_end[goal, axis]
            animal[slot, CURVE:] = rest.reshape(8)
            animal[slot, ZERO] = max(animal[slot, ZERO], clock[NOW])
    return turned


@compiled
def lanes_end(lane: FloatArray, box: FloatArray) -> None:
    """Fill in where those who take lanes (n, L, LANE) arrive, and after how many metres."""
    for k in range(lane.shape[0]):
        for i in range(lane.shape[1]):
            into, reached = arrival(lane[k, i, 3:].reshape(4, 2), 0.0, box)
            lane[k, i, 1], lane[k, i, 2] = into, reached


@compiled
def take_in(queue: FloatArray, clock: FloatArray, end: float) -> int:
    """Take those off the table who arrive by the time `end`, and set the clock to it.

    Args:
        queue: (C, TURN) as in `foresee`; brought up to date. Those who arrived come next after the ones still
            on their way, in the order of the flock.
        clock: (CLOCKS,) likewise.
        end: seconds.

    Returns:
        How many.
    """
    clock[NOW] = end
    if clock[NEXT] > end:
        return 0
    live, kept, gone, following = int(clock[RUNNERS]), 0, 0, np.inf
    for i in range(live):
        if queue[i, DUE] <= end:
            gone += 1
    arrived = np.empty((gone, TURN))
    gone = 0
    for i in range(live):
        due = queue[i, DUE]
        if due <= end:
            arrived[gone, SLOT], arrived[gone, DUE] = queue[i, SLOT], due
            gone += 1
        else:
            queue[kept, SLOT], queue[kept, DUE] = queue[i, SLOT], due
            kept += 1
            following = min(following, due)
    queue[kept:live] = arrived
    clock[RUNNERS], clock[NEXT] = kept, following
    return gone


@compiled
def run(
    queue: FloatArray,
    animal: FloatArray,
    clock: FloatArray,
    lane: FloatArray,
    counts: IntArray,
    end: float,
) -> bool:
    """Let the game's animals run until the time `end`: send out those that are due, count those that arrive.

    The label in place k of n sends its j-th animal at (j + k / n) periods, on its lane j modulo the number
    of lanes.

    Args:
        queue: (C, TURN) as in `foresee`; brought up to date.
        animal: (C, ANIMAL) likewise.
        clock: (CLOCKS,) likewise.
        lane: (n, L, LANE) the lanes: label, building where it ends, length up to there, control points.
        counts: (3, N) how many have got in, of these into another label's building, and have stranded, by
            label.
        end: seconds.

    Returns:
        Whether all have been sent out; otherwise there was no room in the arrays, and nothing else happened.
    """
    n, lanes = lane.shape[:2]
    while True:
        sent = int(clock[SENT])
        place, turn = sent % n, sent // n
        leaves = (turn + place / n) * clock[PERIOD]
        if not leaves < end:
            break
        live = int(clock[RUNNERS])
        if live == len(queue):
            return False
        slot = int(queue[live, SLOT])
        own = lane[place, turn % lanes]
        animal[slot, GOAL], animal[slot, INTO] = own[0], own[1]
        animal[slot, ZERO], queue[live, DUE] = leaves, leaves + own[2] / clock[PACE]
        animal[slot, CURVE:] = own[3:]
        clock[NEXT] = min(clock[NEXT], queue[live, DUE])
        clock[RUNNERS], clock[SENT] = live + 1, sent + 1
    if clock[NEXT] > end:
        clock[NOW] = end
        return True
    arrived = take_in(queue, clock, end)
    first = int(clock[RUNNERS])
    for i in range(first, first + arrived):
        slot = int(queue[i, SLOT])
        label, into = int(animal[slot, GOAL]), int(animal[slot, INTO])
        if into == NOWHERE:
            counts[2, label] += 1
            clock[ASTRAY] += 1
        else:
            counts[0, label] += 1
            if into != label:
                counts[1, label] += 1
                clock[ASTRAY] += 1
    return True


@compiled
def point_at(p: Polynomial, t: float) -> tuple[float, float]:
    """Where a curve is at a parameter, metres."""
    return p[0] + t * (p[1] + t * (p[2] + t * p[3])), p[4] + t * (p[5] + t * (p[6] + t * p[7]))


@compiled
def stand(curve: FloatArray, parameter: FloatArray, point: FloatArray, heading: FloatArray) -> None:
    """Where animals are and where they run to.

    Args:
        curve: (A, 4, 2) control points, metres.
        parameter: (A,) the curve's parameter at each animal.
        point: (A, 2) filled with the points, metres.
        heading: (A,) filled with the headings, radians; where a curve stands still for a moment, those just
            after it; 0 on a curve without length.
    """
    for a in range(len(curve)):
        p, t = polynomial(curve[a]), parameter[a]
        point[a, 0], point[a, 1] = point_at(p, t)
        x, z = p[1] + t * (2 * p[2] + 3 * p[3] * t), p[5] + t * (2 * p[6] + 3 * p[7] * t)
        if abs(x) + abs(z) <= _ROUNDING:
            x, z = p[2] + 3 * p[3] * t, p[6] + 3 * p[7] * t
        if abs(x) + abs(z) <= _ROUNDING:
            x, z = p[3], p[7]
        heading[a] = np.arctan2(x, z)


@compiled
def cut(curve: FloatArray, parameter: FloatArray, rest: FloatArray) -> None:
    """Cut off what lies behind animals (de Casteljau).

    Args:
        curve: (A, 4, 2) control points, metres.
        parameter: (A,) where to cut each.
        rest: (A, 4, 2) filled with the control points of what lies ahead, beginning exactly where `stand`
            says, metres.
    """
    for a in range(len(curve)):
        t = parameter[a]
        rest[a] = curve[a]
        for level in range(3, 0, -1):
            for i in range(level):
                for axis in range(2):
                    rest[a, i, axis] += t * (rest[a, i + 1, axis] - rest[a, i, axis])
        rest[a, 0, 0], rest[a, 0, 1] = point_at(polynomial(curve[a]), t)
