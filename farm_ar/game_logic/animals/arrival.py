"""Kernels: animals on their curves, who arrives where and when, and who is sent out and counted."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.game_logic.animals.curve_intersection import (
    NOWHERE,
    ROUNDING,
    Footprint,
    footprint_entry,
    standing_at,
)
from farm_ar.game_logic.animals.routes import Route
from farm_ar.geometry import arc_length
from farm_ar.kernels import compiled
from farm_ar.structs import Struct, Structs, struct_dtype


class Animal(Struct):
    """What is known of an animal; it keeps its place in the array, its slot, while it is on its way."""

    goal: int
    """The label that it wants to get to."""
    into: int
    """The building in which it will arrive, `NOWHERE` for none."""
    start: float
    """When it is, or was, at the start of its curve, seconds."""
    curve: Annotated[FloatArray, (4, 2)]
    """Control points, metres."""


class Due(Struct):
    """When an animal arrives; kept apart because all are asked for that again and again."""

    slot: int
    time: float
    """Seconds."""


class Clock(Struct):
    """Of a flock."""

    now: float
    """Seconds."""
    speed: float
    """Of all animals, metres a second."""
    running: int
    """How many are on their way."""
    next: float
    """When the next arrives."""
    period: float
    """How often a label sends one, seconds."""
    sent: int
    astray: int
    """How many of those that arrived have not got into the building of their label."""


class Counts(Struct):
    """Of one label: its animals that got into a building, into another label's, and that stranded."""

    counted: int
    misplaced: int
    stranded: int


class Herd(NamedTuple):
    """The arrays of a flock.

    Args:
        clocks: (1,) its clock.
        queue: (C,) those on their way in the order in which they were added, then free slots.
        animals: (C,) by slot.
    """

    clocks: Structs[Clock]
    queue: Structs[Due]
    animals: Structs[Animal]


_DUE = struct_dtype(Due)


@compiled
def arrival(curve: FloatArray, along: float, buildings: Structs[Footprint]) -> tuple[int, float]:
    """Where an animal arrives that runs on: in the building where its curve ends, or at its end.

    What else stands in the way does not stop it.

    Args:
        curve: (4, 2) control points, metres.
        along: how far it has run, metres; below 0 while it waits at the start.
        buildings: (N,) footprints of those that it can enter.

    Returns:
        The building, or NOWHERE; and how far along the curve that is, metres, not less than it has run.
    """
    own = np.empty((4, 2))  # for a record's own array all below would be compiled once more
    for i in range(4):
        own[i, 0], own[i, 1] = curve[i, 0], curve[i, 1]
    p = arc_length.polynomial(own)
    knot, travelled = np.empty(arc_length.KNOTS), np.empty(arc_length.KNOTS)
    arc_length.measure(own, knot, travelled)
    begun = max(along, 0.0)
    aim = standing_at(curve[3, 0], curve[3, 1], buildings)
    if aim != NOWHERE:
        now = arc_length.parameter_at(p, knot, travelled, begun) if begun > 0 else 0.0
        entry = footprint_entry(p, now, 1.0, buildings[aim])
        if entry <= 1:
            reached = arc_length.length_at(p, knot, travelled, entry) if entry > now else begun
            return aim, max(reached, begun)
    return NOWHERE, max(travelled[-1], along)


@compiled
def find_arrivals(herd: Herd, buildings: Structs[Footprint]) -> None:
    """Find out when and where animals arrive if everything stays as it stands."""
    clock = herd.clocks[0]
    clock.next = np.inf
    for i in range(clock.running):
        due = herd.queue[i]
        animal = herd.animals[due.slot]
        into, reached = arrival(animal.curve, clock.speed * (clock.now - animal.start), buildings)
        animal.into = into
        due.time = max(animal.start + reached / clock.speed, clock.now)
        clock.next = min(clock.next, due.time)


@compiled
def find_arrivals_on(routes: Structs[Route], buildings: Structs[Footprint]) -> None:
    """Fill in where those who take routes (n, L) arrive, and after how many metres."""
    for k in range(routes.shape[0]):
        for i in range(routes.shape[1]):
            into, reached = arrival(routes[k, i].curve, 0.0, buildings)
            routes[k, i].into, routes[k, i].length = into, reached


@compiled
def hold(herd: Herd, waiting: BoolArray, seconds: float) -> None:
    """Have animals on their way to some of the labels stand where they are for as long.

    Args:
        herd: the flock.
        waiting: (M,) labels whose animals wait.
        seconds: from now on.
    """
    clock = herd.clocks[0]
    clock.next = np.inf
    for i in range(clock.running):
        due = herd.queue[i]
        animal = herd.animals[due.slot]
        if waiting[animal.goal]:
            animal.start += seconds
            due.time += seconds
        clock.next = min(clock.next, due.time)


@compiled
def redirect(herd: Herd, goal_end: FloatArray, changed: BoolArray) -> bool:
    """Split off the rest of the curves that lead to labels now believed elsewhere, and move their ends.

    The last two control points are moved together, as `geometry.move_end` does.

    Args:
        herd: the flock.
        goal_end: (M, 2) where the curves to each label are to end, metres.
        changed: (M,) labels for which that has changed.

    Returns:
        Whether there were any.

    Raises:
        IndexError: an animal's label is not among them; nothing has changed then.
    """
    clock = herd.clocks[0]
    for i in range(clock.running):
        if herd.animals[herd.queue[i].slot].goal >= len(changed):
            raise IndexError("an animal wants to get to a label that is not among those given")
    turned, curve, rest = False, np.empty((1, 4, 2)), np.empty((1, 4, 2))
    along, parameter = np.empty(1), np.empty(1)
    for i in range(clock.running):
        animal = herd.animals[herd.queue[i].slot]
        if changed[animal.goal]:
            turned = True
            for point in range(4):
                for axis in range(2):
                    curve[0, point, axis] = animal.curve[point, axis]
            along[0] = max(clock.speed * (clock.now - animal.start), 0.0)
            arc_length.locate(curve, along, parameter)
            cut(curve, parameter, rest)
            for axis in range(2):
                rest[0, 2, axis] += goal_end[animal.goal, axis] - rest[0, 3, axis]
                rest[0, 3, axis] = goal_end[animal.goal, axis]
            for point in range(4):
                for axis in range(2):
                    animal.curve[point, axis] = rest[0, point, axis]
            animal.start = max(animal.start, clock.now)
    return turned


@compiled
def take_in(herd: Herd, end: float) -> int:
    """Take those off the table who arrive by the time `end`, seconds, and set the clock to it.

    Those who arrived come next in the queue after the ones still on their way, in the order of the flock.

    Returns:
        How many arrived.
    """
    clock, queue = herd.clocks[0], herd.queue
    clock.now = end
    if clock.next > end:
        return 0
    live, kept, gone, following = clock.running, 0, 0, np.inf
    for i in range(live):
        if queue[i].time <= end:
            gone += 1
    arrived = np.empty(gone, _DUE)
    gone = 0
    for i in range(live):
        if queue[i].time <= end:
            arrived[gone] = queue[i]
            gone += 1
        else:
            queue[kept] = queue[i]
            following = min(following, queue[kept].time)
            kept += 1
    for i in range(gone):
        queue[kept + i] = arrived[i]
    clock.running, clock.next = kept, following
    return gone


@compiled
def run(herd: Herd, routes: Structs[Route], counts: Structs[Counts], end: float) -> bool:
    """Let the game's animals run until the time `end`: send out those that are due, count those that arrive.

    The label in place k of n sends its j-th animal at (j + k / n) periods, on its route j modulo the number
    of routes.

    Args:
        herd: the flock.
        routes: (n, L) of the labels that send animals.
        counts: (N,) of all labels.
        end: seconds.

    Returns:
        Whether all have been sent out; otherwise there was no room for more in the arrays.
    """
    clock, queue = herd.clocks[0], herd.queue
    n, side_by_side = routes.shape[0], routes.shape[1]
    while True:
        place, turn = clock.sent % n, clock.sent // n
        leaves = (turn + place / n) * clock.period
        if not leaves < end:
            break
        route = routes[place, turn % side_by_side]
        time = leaves + route.length / clock.speed
        if time <= end:  # it comes and goes at once
            count(counts, clock, route.goal, route.into)
            clock.sent += 1
            continue
        if clock.running == len(queue):
            return False
        due = queue[clock.running]
        animal = herd.animals[due.slot]
        animal.goal, animal.into, animal.start = route.goal, route.into, leaves
        for i in range(4):
            animal.curve[i, 0], animal.curve[i, 1] = route.curve[i, 0], route.curve[i, 1]
        due.time = time
        clock.next = min(clock.next, time)
        clock.running += 1
        clock.sent += 1
    if clock.next > end:
        clock.now = end
        return True
    arrived = take_in(herd, end)
    for i in range(clock.running, clock.running + arrived):
        animal = herd.animals[queue[i].slot]
        count(counts, clock, animal.goal, animal.into)
    return True


@compiled
def count(counts: Structs[Counts], clock: Clock, label: int, into: int) -> None:
    """Count an animal of a label that arrived in a building, or NOWHERE."""
    if into == NOWHERE:
        counts[label].stranded += 1
        clock.astray += 1
    else:
        counts[label].counted += 1
        if into != label:
            counts[label].misplaced += 1
            clock.astray += 1


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
        if abs(x) + abs(z) <= ROUNDING:
            x, z = p[2] + 3 * p[3] * t, p[6] + 3 * p[7] * t
        if abs(x) + abs(z) <= ROUNDING:
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
        for i in range(4):
            for axis in range(2):
                rest[a, i, axis] = curve[a, i, axis]
        for level in range(3, 0, -1):
            for i in range(level):
                for axis in range(2):
                    rest[a, i, axis] += t * (rest[a, i + 1, axis] - rest[a, i, axis])
        rest[a, 0, 0], rest[a, 0, 1] = arc_length.point_at(arc_length.polynomial(curve[a]), t)
