"""Kernels: the animals of environments in a batch, as `FarmGame` plays them."""

from __future__ import annotations

from math import ceil, fabs, inf

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.envs.batched.snapshots import read_poses
from farm_ar.envs.batched.state import Batch, Choices, Herds, Scenery, Table, Work
from farm_ar.game_logic.animals import arrival
from farm_ar.game_logic.animals.arrival import Herd
from farm_ar.game_logic.animals.curve_intersection import NOWHERE, Footprint, footprints, standing_at
from farm_ar.game_logic.animals.obstacle_avoidance import Buildings
from farm_ar.game_logic.animals.routes import lead
from farm_ar.game_logic.belief import SAME
from farm_ar.game_logic.farm_game import WARM_UP_S
from farm_ar.geometry.angles import wrap_angle
from farm_ar.kernels import compiled
from farm_ar.structs import Structs

_FROM_START = -2
"""In place of how often the table had changed: animals know where they arrive as it was at the start."""


@compiled(inline="always")
def herd_of(b: int, herds: Herds) -> Herd:
    """The animals of one environment."""
    return Herd(herds.clocks[b : b + 1], herds.queue[b], herds.animals[b])


@compiled
def send_out(b: int, choices: Choices, scenery: Scenery, herds: Herds, table: Table) -> None:
    """Set clocks back to when the first animals have left, as `FarmGame._warm_up` does."""
    clock, n = herds.clocks[b], len(scenery.movable)
    clock.next, clock.running, clock.astray = inf, 0, 0
    clock.period = n / choices.animals_a_second
    each = ceil(WARM_UP_S / clock.period)
    clock.sent, clock.now = -n * each, -each * clock.period
    table.until = clock.now + -clock.now
    table.led, table.known, table.foresaw = False, -1, False


@compiled
def same(one: Structs[Footprint], other: Structs[Footprint]) -> bool:
    """Whether footprints (M,) are the same; one that is none is like another that is none."""
    for i in range(len(one)):
        if one[i].x != one[i].x and other[i].x != other[i].x:
            continue
        if (
            one[i].x != other[i].x
            or one[i].z != other[i].z
            or one[i].sine != other[i].sine
            or one[i].cosine != other[i].cosine
        ):
            return False
    return True


@compiled
def look_ahead(
    b: int,
    believed: FloatArray,
    facing: FloatArray,
    table: Table,
    choices: Choices,
    scenery: Scenery,
    herds: Herds,
    work: Work,
) -> None:
    """Have everybody know who arrives where, as `FarmGame._look_ahead` does.

    Args:
        b: the environment.
        believed: (M, 2) where labels are believed to be, metres.
        facing: (M,) how they are believed to be turned, radians.
        table: of the environment.
        choices: what was chosen.
        scenery: the scene.
        herds: the animals.
        work: holds where everything stands.
    """
    enterable = ~scenery.fixed
    if not table.led:
        buildings = Buildings(believed.copy(), facing.copy(), scenery.size, enterable)
        lead(herds.routes[b], herds.spread[b], choices.shed, buildings, scenery.bows, scenery.room)
    stand = footprints(work.position, work.yaw, scenery.size, enterable)
    if not (table.foresaw and same(herds.buildings[b], stand)):
        arrival.find_arrivals(herd_of(b, herds), stand)
        table.foresaw = True
        for i in range(len(stand)):
            herds.buildings[b, i] = stand[i]
    arrival.find_arrivals_on(herds.routes[b], stand)
    table.led = True


@compiled
def run(b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, work: Work) -> bool:
    """Let the animals run until the time that was set; whether there was room for all of them."""
    table = batch.tables[b]
    if table.known != batch.states[b].changes:
        read_poses(b, batch, choices, work)
        look_ahead(b, batch.believed[b], batch.facing[b], table, choices, scenery, herds, work)
        table.known = batch.states[b].changes
    return arrival.run(herd_of(b, herds), herds.routes[b], herds.counts[b], table.until)


@compiled
def run_from_start(
    b: int, table: Table, choices: Choices, scenery: Scenery, herds: Herds, work: Work
) -> bool:
    """The same before an episode began, when all stood, and was believed, where it was at its start.

    Where animals are lazy, only those are sent out that may go astray: the others come and go at once.
    """
    if table.known == -1:
        work.position[:] = herds.start[b]
        for i in range(len(work.yaw)):
            work.yaw[i] = wrap_angle(herds.start_yaw[b, i])
        if choices.lazy:
            look_ahead_of_few(b, herds.start[b], herds.start_yaw[b], True, choices, scenery, herds, work)
        else:
            look_ahead(b, herds.start[b], herds.start_yaw[b], table, choices, scenery, herds, work)
        table.known = _FROM_START
    if not arrival.run(herd_of(b, herds), herds.routes[b], herds.counts[b], table.until):
        return False
    herds.clocks[b].now, herds.clocks[b].astray, table.known = 0.0, 0, -1
    return True


@compiled
def look_ahead_of_few(
    b: int,
    believed: FloatArray,
    facing: FloatArray,
    leads: bool,
    choices: Choices,
    scenery: Scenery,
    herds: Herds,
    work: Work,
) -> None:
    """Find where those arrive whose labels, by `work.stray`, may lead them astray.

    Args:
        b: the environment.
        believed: (M, 2) where labels are believed to be, metres.
        facing: (M,) how they are believed to be turned, radians.
        leads: whether routes have yet to lead there.
        choices: what was chosen.
        scenery: the scene.
        herds: the animals.
        work: holds where everything stands.
    """
    enterable = ~scenery.fixed
    buildings = Buildings(believed.copy(), facing.copy(), scenery.size, enterable)
    stand, routes = footprints(work.position, work.yaw, scenery.size, enterable), herds.routes[b]
    for i in range(len(stand)):
        herds.buildings[b, i] = stand[i]
    for k in range(len(scenery.movable)):
        if work.stray[scenery.movable[k]]:
            few = routes[k : k + 1]
            if leads:
                lead(few, herds.spread[b, k : k + 1], choices.shed, buildings, scenery.bows, scenery.room)
            arrival.find_arrivals_on(few, stand)
        else:
            for i in range(routes.shape[1]):
                routes[k, i].into, routes[k, i].length = routes[k, i].goal, -inf


@compiled
def play_few(b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, work: Work) -> None:
    """After the only visit: find where the few animals arrive that may go astray, and play on."""
    herd, table = herd_of(b, herds), batch.tables[b]
    read_poses(b, batch, choices, work)
    changed_since_start(b, batch, herds, work.changed)
    turned = arrival.redirect(herd, batch.believed[b], work.changed)
    stand = footprints(work.position, work.yaw, scenery.size, ~scenery.fixed)
    if turned or not same(herds.buildings[b], stand):
        arrival.find_arrivals(herd, stand)
    leads = bool(work.changed.any())
    look_ahead_of_few(b, batch.believed[b], batch.facing[b], leads, choices, scenery, herds, work)
    table.until, table.known = herds.clocks[b].now + choices.play_seconds, batch.states[b].changes


@compiled
def redirect(b: int, batch: Batch, herds: Herds, changed: BoolArray) -> None:
    """Move the ends of paths to labels that are now believed elsewhere, as `FarmGame.end_visit` does."""
    if changed.any():
        table = batch.tables[b]
        if arrival.redirect(herd_of(b, herds), batch.believed[b], changed):
            table.foresaw = False
        table.led, table.known = False, -1


@compiled
def changed_since_start(b: int, batch: Batch, herds: Herds, changed: BoolArray) -> None:
    """Fill in which labels are believed elsewhere than at the start."""
    for j in range(len(changed)):
        moved = max(
            fabs(batch.believed[b, j, 0] - herds.start[b, j, 0]),
            fabs(batch.believed[b, j, 1] - herds.start[b, j, 1]),
        )
        changed[j] = max(moved, fabs(wrap_angle(batch.facing[b, j] - herds.start_yaw[b, j]))) > SAME


@compiled
def may_stray(b: int, batch: Batch, choices: Choices, scenery: Scenery, work: Work) -> bool:
    """Whether the place where a label is believed to be does not lie in its own building.

    Only animals on their way to such a label are miscounted; where no time passes, only those that are in
    another building then. `work.stray` is filled with which labels these are.
    """
    read_poses(b, batch, choices, work)
    stand, found = footprints(work.position, work.yaw, scenery.size, ~scenery.fixed), False
    for j in scenery.movable:
        into = standing_at(batch.believed[b, j, 0], batch.believed[b, j, 1], stand)
        work.stray[j] = into != j and (into != NOWHERE or choices.play_seconds > 0)
        found = found or work.stray[j]
    return found
