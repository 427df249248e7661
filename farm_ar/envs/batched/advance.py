"""The kernel in which environments of a batch take a step or begin, as `FarmToTableEnv` does."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.envs.batched import herds as animals
from farm_ar.envs.batched import streams
from farm_ar.envs.batched.acting import act, fill_mask, true_yaw
from farm_ar.envs.batched.looking import look
from farm_ar.envs.batched.starting import draw_camera, draw_layout
from farm_ar.envs.batched.state import (
    ACT,
    BEGIN,
    CLOSE,
    CLUTTER,
    DONE,
    ENDPOINT,
    LATE,
    MARGIN,
    MISCOUNT,
    PLAY,
    SHAPED,
    SHOW,
    STILL,
    WARM_UP,
    Batch,
    Choices,
    Given,
    Herds,
    Output,
    Report,
    Scenery,
    Table,
    Work,
)
from farm_ar.envs.batched.streams import Stream
from farm_ar.envs.features import MARGIN_SCALE, Believed, Float32Array, Found, read_table
from farm_ar.envs.placement import within
from farm_ar.envs.rewards import MARGIN_SHARE
from farm_ar.envs.table import Objects, introduce, line_up
from farm_ar.game_logic.animals.routes import PATH_SPREAD_M
from farm_ar.game_logic.physics.state import Limits
from farm_ar.geometry.angles import wrap_angle
from farm_ar.geometry.camera import Eye
from farm_ar.geometry.rectangles import length
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import assess_objects, known_objects
from farm_ar.structs import Structs, struct_dtype

_EYE, _LIMITS, _STREAM = struct_dtype(Eye), struct_dtype(Limits), struct_dtype(Stream)

_BLOCK, _DEEPEST = 128, 64


@compiled(inline="always")
def objects_of(b: int, batch: Batch) -> Objects:
    """The objects of one environment as they are met."""
    return Objects(batch.number[b], batch.kind[b], batch.fixed[b], batch.rivals[b])


@compiled(inline="always")
def read(b: int, batch: Batch, scenery: Scenery, numbers: Float32Array) -> None:
    """Fill in what there is to say of a table, (L,), as `Features.read` does."""
    table = batch.tables[b]
    table.least_margin, table.ambiguity, table.expected_wrong = read_table(
        batch.places[b],
        Believed(batch.believed[b], batch.facing[b]),
        batch.eyes[b : b + 1],
        objects_of(b, batch),
        scenery.features,
        Found(batch.pose[b], batch.margin[b], batch.right[b], batch.cost[b]),
        numbers,
    )


@compiled(inline="always")
def begin(
    b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, given: Given, work: Work
) -> None:
    """Begin an episode, up to the animals, as `FarmToTableEnv.reset` does."""
    table, eye, m = batch.tables[b], batch.eyes[b], len(scenery.kind)
    if given.has[0]:
        work.position[:], work.yaw[:] = given.position, given.yaw
    elif choices.layouts == STILL:
        work.position[:], work.yaw[:] = scenery.position, scenery.yaw
    else:
        draw_layout(table.stream, choices, scenery, work)
    if given.has[1]:
        batch.eyes[b] = given.eyes[0]
    else:
        batch.eyes[b] = scenery.eyes[0]
        draw_camera(table.stream, eye, choices, scenery, work)
    for i in range(m):
        body = batch.bodies[b, i]
        body.x, body.z = work.position[i, 0], work.position[i, 1]
        body.angle = -(wrap_angle(work.yaw[i]) if choices.game else work.yaw[i])
        batch.believed[b, i, 0], batch.believed[b, i, 1] = body.x, body.z
        batch.facing[b, i], batch.holder[b, i] = work.yaw[i], i
    if choices.game:
        for k in range(herds.spread.shape[1]):
            for i in range(herds.spread.shape[2]):
                herds.spread[b, k, i] = PATH_SPREAD_M * streams.normal(table.stream)
        herds.clocks[b].astray = 0
        herds.start[b], herds.start_yaw[b] = work.position, work.yaw
    angle = np.empty(m)
    line_up(eye, work.position, scenery.kind, scenery.fixed, angle, work.order)
    introduce(work.order, scenery.kind, scenery.fixed, objects_of(b, batch))
    batch.pose[b] = np.nan
    state = batch.states[b]
    state.metres, state.radians, state.changes, state.ticks = 0.0, 0.0, 0, 0
    table.visits_left, table.accuracy, table.over, table.wrong = choices.visits, 1.0, False, 0
    begin_visit(table, choices)


@compiled(inline="always")
def begin_visit(table: Table, choices: Choices) -> None:
    """A whole budget and all moves."""
    table.metres, table.radians, table.effort = choices.budget_m, choices.budget_rad, choices.budget
    table.moves_left = choices.moves


@compiled(inline="always")
def measure(b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, work: Work) -> float:
    """The first number whose rise is paid for."""
    if choices.reward == MISCOUNT:
        return float(herds.clocks[b].astray)
    if choices.reward == ENDPOINT:
        error = np.empty(len(scenery.kind))
        for i in range(len(error)):
            body = batch.bodies[b, i]
            error[i] = length(batch.believed[b, i, 0] - body.x, batch.believed[b, i, 1] - body.z)
        return numpy_sum(error) / choices.diagonal_m
    return float(batch.tables[b].wrong)


@compiled
def block_sum(values: FloatArray, first: int, n: int) -> float:
    """NumPy's sum of at most `_BLOCK` numbers: eight sums at a time."""
    total: float = 0.0
    if n < 8:
        for k in range(n):
            total += values[first + k]
        return total
    part, whole = np.empty(8), n - n % 8
    for k in range(8):
        part[k] = values[first + k]
    for i in range(8, whole, 8):
        for k in range(8):
            part[k] += values[first + i + k]
    total += ((part[0] + part[1]) + (part[2] + part[3])) + ((part[4] + part[5]) + (part[6] + part[7]))
    for i in range(whole, n):
        total += values[first + i]
    return total


@compiled
def numpy_sum(values: FloatArray) -> float:
    """`values.sum()` to the last bit: NumPy halves what is longer than a block."""
    ahead, depth = np.empty((_DEEPEST, 3), dtype=np.int64), np.empty(_DEEPEST, dtype=np.int64)
    total, waiting, held = np.empty(_DEEPEST), 1, 0
    ahead[0, 0], ahead[0, 1], ahead[0, 2] = 0, len(values), 0
    while waiting > 0:
        waiting -= 1
        first, n, deep = ahead[waiting, 0], ahead[waiting, 1], ahead[waiting, 2]
        if n > _BLOCK:
            half = n // 2
            half -= half % 8
            ahead[waiting, 0], ahead[waiting, 1], ahead[waiting, 2] = first + half, n - half, deep + 1
            ahead[waiting + 1, 0], ahead[waiting + 1, 1], ahead[waiting + 1, 2] = first, half, deep + 1
            waiting += 2
            continue
        found = block_sum(values, first, n)
        while held > 0 and depth[held - 1] == deep:  # its other half
            held -= 1
            found, deep = total[held] + found, deep - 1
        total[held], depth[held] = found, deep
        held += 1
    whole: float = total[0]
    return whole


@compiled
def clutter(b: int, batch: Batch, choices: Choices, scenery: Scenery) -> float:
    """What `rewards.clutter` measures."""
    n = len(scenery.movable)
    position, yaw, kind = np.empty((n, 2)), np.empty(n), np.empty(n, dtype=np.int64)
    sides, size_of = np.empty((n, 3)), np.arange(n)
    for k in range(n):
        i = batch.number[b, k]
        position[k, 0], position[k, 1] = batch.bodies[b, i].x, batch.bodies[b, i].z
        yaw[k], kind[k] = true_yaw(b, i, batch, choices), scenery.kind[i]
        for axis in range(3):
            sides[k, axis] = scenery.log_sides[i, axis]
    known = known_objects(position.copy(), yaw.copy(), kind, size_of, sides)
    answer = assess_objects(position, yaw, np.arange(n), known, scenery.clutter_rule, False)
    share = np.empty(n)
    for k in range(n):
        margin = answer.margin[0, k]
        share[k] = margin if margin != margin else 1 - within(margin / MARGIN_SCALE, 0.0, 1.0)
    return numpy_sum(share) / 2


@compiled(inline="always")
def foresight(table: Table, choices: Choices) -> float:
    """What the reward foresees of the snapshot to come."""
    return table.ambiguity if choices.reward == MARGIN else table.expected_wrong


@compiled(inline="always")
def begin_step(b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, work: Work) -> None:
    """Measure what is paid for, before."""
    table = batch.tables[b]
    table.before[0] = measure(b, batch, choices, scenery, herds, work)
    table.before[1] = 0.0
    if choices.reward in (MARGIN, SHAPED):
        table.before[1] = foresight(table, choices)
    elif choices.reward == CLUTTER:
        table.before[1] = clutter(b, batch, choices, scenery)


@compiled(inline="always")
def end_visit(b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, work: Work) -> int:
    """The snapshot, and what becomes of paths; the stage that comes next."""
    table = batch.tables[b]
    look(b, batch, choices, scenery, work)
    if choices.animals_a_second > 0:
        if not choices.lazy:
            animals.redirect(b, batch, herds, work.changed)
            table.until = herds.clocks[b].now + choices.play_seconds
            return PLAY
        if animals.may_stray(b, batch, choices, scenery, work):
            animals.send_out(b, choices, scenery, herds, table)
            return LATE
    next_visit(b, batch, choices, scenery, work)
    return CLOSE


@compiled(inline="always")
def next_visit(b: int, batch: Batch, choices: Choices, scenery: Scenery, work: Work) -> None:
    """Count a visit, and begin another if there is one, as `FarmToTableEnv._finish_visit` does."""
    table = batch.tables[b]
    if choices.visits > 0:
        table.visits_left -= 1
        table.over = table.visits_left == 0
    if table.over:
        return
    if choices.new_gaze:
        batch.eyes[b] = scenery.eyes[0]
        draw_camera(table.stream, batch.eyes[b], choices, scenery, work)
    begin_visit(table, choices)


@compiled(inline="always")
def paid(
    b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, work: Work, report: Report
) -> float:
    """Fill in the terms of the reward, and add them up, as `Reward.paid` does."""
    table = batch.tables[b]
    now = measure(b, batch, choices, scenery, herds, work)
    report.terms[0] = choices.sign * (now - table.before[0]) if now != table.before[0] else 0.0
    report.terms[1] = 0.0
    if choices.reward in (MARGIN, CLUTTER, SHAPED):
        now = clutter(b, batch, choices, scenery) if choices.reward == CLUTTER else table.foreseen
        if now != table.before[1]:
            scale = 1.0 if choices.reward == SHAPED else MARGIN_SHARE
            report.terms[1] = choices.sign * scale * (now - table.before[1])
    report.effort_cost = -choices.effort_weight * table.moved if table.moved != 0 else 0.0
    total = float(report.terms[0])
    if choices.reward in (MARGIN, CLUTTER, SHAPED):
        total += report.terms[1]
    return total + report.effort_cost


@compiled(inline="always")
def show(
    b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, output: Output, work: Work
) -> None:
    """Fill in the observation, and what `info` has beside the reward."""
    table, report, numbers = batch.tables[b], output.reports[b], output.numbers[b]
    read(b, batch, scenery, numbers)
    at = choices.budget_at
    if choices.by_effort:
        numbers[at] = numbers[at + 1] = table.effort / choices.budget
    else:
        numbers[at], numbers[at + 1] = table.metres / choices.budget_m, table.radians / choices.budget_rad
    numbers[at + 2] = table.moves_left / choices.moves
    numbers[at + 3] = table.visits_left / choices.visits if choices.visits > 0 else 1.0
    report.accuracy, report.wrong_labels = table.accuracy, table.wrong
    report.paper_margin, report.effort = table.least_margin, table.moved
    report.miscounts = herds.clocks[b].astray if choices.game else 0
    report.phase = 0 if table.over else 1
    if output.masks.shape[1] > 0:
        fill_mask(b, batch, choices, scenery, work, output.masks[b])


@compiled(inline="always")
def keep_last(b: int, output: Output) -> None:
    """Keep what an episode ended with, before another one begins."""
    output.last_numbers[b] = output.numbers[b]
    output.last_reports[b] = output.reports[b]
    output.last_masks[b] = output.masks[b]


@compiled
def advance(
    first: int,
    end: int,
    actions: FloatArray,
    batch: Batch,
    choice: Structs[Choices],
    scenery: Scenery,
    herds: Herds,
    given: Given,
    output: Output,
    tan: tuple[FloatArray, np.ndarray, int],
) -> int:
    """Have environments from `first` to `end` go through the stages that they are in.

    Returns:
        How many have not got through, because there was no room for more animals.
    """
    m = len(scenery.kind)
    work = Work(
        np.empty((m, 2)),
        np.empty(m),
        np.empty(m, dtype=np.bool_),
        np.empty(m, dtype=np.int64),
        np.empty(m, dtype=np.int64),
        np.empty((m, 2)),
        np.empty(m),
        tan[0].copy(),
        tan[1].copy(),
        tan[2],
        np.empty(1, _EYE),  # type: ignore[arg-type]
        np.empty(1, _STREAM),  # type: ignore[arg-type]
        np.empty(m, dtype=np.bool_),
        np.empty(m, dtype=np.bool_),
        np.zeros(1, _LIMITS),  # type: ignore[arg-type]
    )
    choices, lacking = choice[0], 0
    for b in range(first, end):
        table = batch.tables[b]
        resumed = table.stage == LATE
        if table.stage == ACT:
            begin_step(b, batch, choices, scenery, herds, work)
            over = act(b, actions[b], batch, choices, scenery, work)
            if choices.reward in (MARGIN, SHAPED):
                read(b, batch, scenery, output.numbers[b])
                table.foreseen = foresight(table, choices)
            table.stage = CLOSE
            if over:
                table.stage = end_visit(b, batch, choices, scenery, herds, work)
        if table.stage == LATE:
            if resumed:
                animals.may_stray(b, batch, choices, scenery, work)
            if not animals.run_from_start(b, table, choices, scenery, herds, work):
                lacking += 1
                continue
            animals.play_few(b, batch, choices, scenery, herds, work)
            table.stage = PLAY
        if table.stage == PLAY:
            if not animals.run(b, batch, choices, scenery, herds, work):
                lacking += 1
                continue
            next_visit(b, batch, choices, scenery, work)
            table.stage = CLOSE
        if table.stage == CLOSE:
            output.reward[b] = paid(b, batch, choices, scenery, herds, work, output.reports[b])
            output.over[b] = table.over
            show(b, batch, choices, scenery, herds, output, work)
            table.stage = DONE
            if table.over and choices.same_step:
                keep_last(b, output)
                table.stage = BEGIN
        if table.stage == BEGIN:
            begin(b, batch, choices, scenery, herds, given, work)
            table.stage = SHOW
            if choices.animals_a_second > 0 and not choices.lazy:
                animals.send_out(b, choices, scenery, herds, table)
                table.stage = WARM_UP
        if table.stage == WARM_UP:
            if not animals.run_from_start(b, table, choices, scenery, herds, work):
                lacking += 1
                continue
            table.known = batch.states[b].changes
            table.stage = SHOW
        if table.stage == SHOW:
            table.moved = 0.0
            report = output.reports[b]
            report.terms[0] = report.terms[1] = report.effort_cost = 0.0
            show(b, batch, choices, scenery, herds, output, work)
            table.stage = DONE
    return lacking
