"""Compiled: animals on their curves, who arrives where and when, and who is sent out and counted."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.game_logic import arc_length, entering
from farm_ar.kernels import compiled

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
    p = arc_length.polynomial(curve)
    knot, travelled = np.empty(arc_length.KNOTS), np.empty(arc_length.KNOTS)
    arc_length.measure_one(curve, knot, travelled)
    begun = max(along, 0.0)
    aim = entering.standing_at(curve[3, 0], curve[3, 1], box)
    if aim != entering.NOWHERE:
        now = arc_length.parameter_at(p, knot, travelled, begun) if begun > 0 else 0.0
        entry = entering.footprint_entry(p, now, 1.0, box[aim])
        if entry <= 1:
            reached = arc_length.length_at(p, knot, travelled, entry) if entry > now else begun
            return aim, max(reached, begun)
    return entering.NOWHERE, max(travelled[-1], along)


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
def lanes_end(lane: FloatArray, box: FloatArray) -> None:
    """Fill in where those who take lanes (n, L, LANE) arrive, and after how many metres."""
    for k in range(lane.shape[0]):
        for i in range(lane.shape[1]):
            into, reached = arrival(lane[k, i, 3:].reshape(4, 2), 0.0, box)
            lane[k, i, 1], lane[k, i, 2] = into, reached


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
            arc_length.locate(curve, along, parameter)
            cut(curve, parameter, rest)
            for axis in range(2):
                rest[0, 2, axis] += goal_end[goal, axis] - rest[0, 3, axis]
                rest[0, 3, axis] = goal_end[goal, axis]
            animal[slot, CURVE:] = rest.reshape(8)
            animal[slot, ZERO] = max(animal[slot, ZERO], clock[NOW])
    return turned


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
        Whether all have been sent out; otherwise there was no room for more in the arrays.
    """
    n, lanes = lane.shape[:2]
    while True:
        sent = int(clock[SENT])
        place, turn = sent % n, sent // n
        leaves = (turn + place / n) * clock[PERIOD]
        if not leaves < end:
            break
        own = lane[place, turn % lanes]
        due = leaves + own[2] / clock[PACE]
        if due <= end:  # it comes and goes at once
            count(counts, clock, int(own[0]), int(own[1]))
            clock[SENT] = sent + 1
            continue
        live = int(clock[RUNNERS])
        if live == len(queue):
            return False
        slot = int(queue[live, SLOT])
        animal[slot, GOAL], animal[slot, INTO], animal[slot, ZERO] = own[0], own[1], leaves
        animal[slot, CURVE:] = own[3:]
        queue[live, DUE] = due
        clock[NEXT] = min(clock[NEXT], due)
        clock[RUNNERS], clock[SENT] = live + 1, sent + 1
    if clock[NEXT] > end:
        clock[NOW] = end
        return True
    arrived = take_in(queue, clock, end)
    first = int(clock[RUNNERS])
    for i in range(first, first + arrived):
        slot = int(queue[i, SLOT])
        count(counts, clock, int(animal[slot, GOAL]), int(animal[slot, INTO]))
    return True


@compiled
def count(counts: IntArray, clock: FloatArray, label: int, into: int) -> None:
    """Count an animal of a label that arrived in a building, or NOWHERE."""
    if into == entering.NOWHERE:
        counts[2, label] += 1
        clock[ASTRAY] += 1
    else:
        counts[0, label] += 1
        if into != label:
            counts[1, label] += 1
            clock[ASTRAY] += 1


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
        p, t = arc_length.polynomial(curve[a]), parameter[a]
        point[a, 0], point[a, 1] = arc_length.point_at(p, t)
        x, z = p[1] + t * (2 * p[2] + 3 * p[3] * t), p[5] + t * (2 * p[6] + 3 * p[7] * t)
        if abs(x) + abs(z) <= entering.ROUNDING:
            x, z = p[2] + 3 * p[3] * t, p[6] + 3 * p[7] * t
        if abs(x) + abs(z) <= entering.ROUNDING:
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
        rest[a, 0, 0], rest[a, 0, 1] = arc_length.point_at(arc_length.polynomial(curve[a]), t)
