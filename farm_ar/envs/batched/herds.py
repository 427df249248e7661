"""Kernels: the animals of environments in a batch, as `FarmGame` plays them."""

from __future__ import annotations

from math import ceil, fabs, inf

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.envs.batched.looking import read_poses
from farm_ar.envs.batched.state import Batch, Choices, Herds, Scenery, Table, Work
from farm_ar.game_logic.animals import arrival
from farm_ar.game_logic.animals.arrival import Herd
from farm_ar.game_logic.animals.curve_intersection import NOWHERE, Footprint, footprints, standing_at
from farm_ar.game_logic.animals.obstacle_avoidance import Buildings
from farm_ar.game_logic.animals.routes import lead
from farm_ar.game_logic.belief import SAME
from farm_ar.game_logic.farm_game import WARM_UP_S
from farm_ar.game_logic.physics import chipmunk
from farm_ar.geometry.angles import wrap_angle
from farm_ar.structs import Structs

_FROM_START = -2
"""In place of how often the table had changed: animals know where they arrive as it was at the start."""


@chipmunk.compiled
def herd_of(b: int, herds: Herds) -> Herd:
    """The animals of one environment."""
    return Herd(herds.clocks[b : b + 1], herds.queue[b], herds.animals[b])


@chipmunk.compiled
def send_out(b: int, choices: Choices, scenery: Scenery, herds: Herds, table: Table) -> None:
    """Set clocks back to when the first animals have left, as `FarmGame._warm_up` does."""
    clock, n = herds.clocks[b], len(scenery.movable)
    clock.next, clock.running, clock.astray = inf, 0, 0
    clock.period = n / choices.animals_a_second
    each = ceil(WARM_UP_S / clock.period)
    clock.sent, clock.now = -n * each, -each * clock.period
    table.until = clock.now + -clock.now
    table.led, table.known, table.foresaw = False, -1, False


@chipmunk.compiled
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


@chipmunk.compiled
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
        arrival.foresee(herd_of(b, herds), stand)
        table.foresaw = True
        for i in range(len(stand)):
            herds.buildings[b, i] = stand[i]
    arrival.foresee_routes(herds.routes[b], stand)
    table.led = True


@chipmunk.compiled
def run(b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, work: Work) -> bool:
    """Let the animals run until the time that was set; whether there was room for all of them."""
    table = batch.tables[b]
    if table.known != batch.states[b].changes:
        read_poses(b, batch, choices, work)
        look_ahead(b, batch.believed[b], batch.facing[b], table, choices, scenery, herds, work)
        table.known = batch.states[b].changes
    return arrival.run(herd_of(b, herds), herds.routes[b], herds.counts[b], table.until)


@chipmunk.compiled
def run_from_start(
    b: int, table: Table, choices: Choices, scenery: Scenery, herds: Herds, work: Work
) -> bool:
    """The same before an episode began, when all stood, and was believed, where it was at its start."""
    if table.known == -1:
        work.position[:] = herds.start[b]
        for i in range(len(work.yaw)):
            work.yaw[i] = wrap_angle(herds.start_yaw[b, i])
        look_ahead(b, herds.start[b], herds.start_yaw[b], table, choices, scenery, herds, work)
        table.known = _FROM_START
    if not arrival.run(herd_of(b, herds), herds.routes[b], herds.counts[b], table.until):
        return False
    herds.clocks[b].now, herds.clocks[b].astray, table.known = 0.0, 0, -1
    return True


@chipmunk.compiled
def redirect(b: int, batch: Batch, herds: Herds, changed: BoolArray) -> None:
    """Move the ends of paths to labels that are now believed elsewhere, as `FarmGame.end_visit` does."""
    if changed.any():
        table = batch.tables[b]
        if arrival.redirect(herd_of(b, herds), batch.believed[b], changed):
            table.foresaw = False
        table.led, table.known = False, -1


@chipmunk.compiled
def changed_since_start(b: int, batch: Batch, herds: Herds, changed: BoolArray) -> None:
    """Fill in which labels are believed elsewhere than at the start."""
    for j in range(len(changed)):
        moved = max(
            fabs(batch.believed[b, j, 0] - herds.start[b, j, 0]),
            fabs(batch.believed[b, j, 1] - herds.start[b, j, 1]),
        )
        changed[j] = max(moved, fabs(wrap_angle(batch.facing[b, j] - herds.start_yaw[b, j]))) > SAME


@chipmunk.compiled
def may_stray(b: int, batch: Batch, choices: Choices, scenery: Scenery, work: Work) -> bool:
    """Whether the place where a label is believed to be lies in a building that is not its own.

    Where time does not go on, only an animal on its way to such a label may be in the wrong building at once.
    """
    read_poses(b, batch, choices, work)
    stand = footprints(work.position, work.yaw, scenery.size, ~scenery.fixed)
    for j in scenery.movable:
        into = standing_at(batch.believed[b, j, 0], batch.believed[b, j, 1], stand)
        if into not in (NOWHERE, j):
            return True
    return False
