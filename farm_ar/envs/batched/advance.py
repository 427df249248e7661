"""The kernel in which environments of a batch take a step or begin, as `FarmToTableEnv` does."""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.borrowing import borrowed
from farm_ar.envs.batched import herds as animals
from farm_ar.envs.batched.actions import act, fill_mask
from farm_ar.envs.batched.generator import begin, begin_visit, draw_camera, objects_of
from farm_ar.envs.batched.kinds import RewardKind, Stage
from farm_ar.envs.batched.rewards import begin_step, foresight, paid
from farm_ar.envs.batched.snapshots import look, sight_of
from farm_ar.envs.batched.state import (
    Batch,
    Choices,
    Environments,
    Given,
    Herds,
    Output,
    Scenery,
    Sight,
    Work,
)
from farm_ar.envs.batched.streams import Stream
from farm_ar.envs.features import Believed, Float32Array, Found, read_table_in
from farm_ar.game_logic.physics.state import Limits
from farm_ar.geometry.camera import Eye
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import Workspace
from farm_ar.structs import Structs, struct_dtype

Everything = tuple[Batch, Scenery, Herds, Given, Output, Work, Sight]
"""What environments consist of, and what a thread works in."""

_EYE, _LIMITS, _STREAM = struct_dtype(Eye), struct_dtype(Limits), struct_dtype(Stream)


@compiled(inline="always")
def read(b: int, batch: Batch, scenery: Scenery, numbers: Float32Array, space: Workspace) -> None:
    """Fill in the features of a table, (L,), as `Features.read` does."""
    table = batch.tables[b]
    table.least_margin, table.ambiguity, table.expected_wrong = read_table_in(
        batch.places[b],
        Believed(batch.believed[b], batch.facing[b]),
        batch.eyes[b : b + 1],
        objects_of(b, batch),
        scenery.features,
        Found(batch.pose[b], batch.margin[b], batch.right[b], batch.cost[b]),
        numbers,
        space,
    )


@compiled(inline="always")
def end_visit(
    b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, work: Work, sight: Sight
) -> int:
    """The snapshot, and what becomes of paths; the stage that comes next."""
    table = batch.tables[b]
    look(b, batch, choices, scenery, work, sight)
    if choices.animals_a_second > 0:
        if not choices.lazy:
            animals.redirect(b, batch, herds, work.changed)
            table.until = herds.clocks[b].now + choices.play_seconds
            return Stage.PLAY
        if animals.may_stray(b, batch, choices, scenery, work):
            animals.send_out(b, choices, scenery, herds, table)
            return Stage.LATE
    next_visit(b, batch, choices, scenery, work)
    return Stage.CLOSE


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
        batch.pose[b] = np.nan
    begin_visit(table, choices)


@compiled(inline="always")
def show(
    b: int,
    batch: Batch,
    choices: Choices,
    scenery: Scenery,
    herds: Herds,
    output: Output,
    work: Work,
    space: Workspace,
) -> None:
    """Fill in the observation, and what `info` has beside the reward."""
    table, report, numbers = batch.tables[b], output.reports[b], output.numbers[b]
    read(b, batch, scenery, numbers, space)
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


@compiled(inline="always")
def room_to_work(m: int, tan: tuple[FloatArray, np.ndarray, int]) -> Work:
    """What a thread works in, for M objects."""
    return Work(
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


@compiled(inline="always")
def take_action(b: int, action: FloatArray, choices: Choices, everything: Everything) -> int:
    """Carry out an action, and end the visit if it is over; the stage that comes next."""
    batch, scenery, herds, _, output, work, sight = everything
    table = batch.tables[b]
    begin_step(b, batch, choices, scenery, herds)
    over = act(b, action, batch, choices, scenery, work)
    if choices.reward in (RewardKind.MARGIN, RewardKind.SHAPED):
        read(b, batch, scenery, output.numbers[b], sight.space)
        table.foreseen = foresight(table, choices)
    return end_visit(b, batch, choices, scenery, herds, work, sight) if over else Stage.CLOSE


@compiled(inline="always")
def play(b: int, batch: Batch, choices: Choices, scenery: Scenery, herds: Herds, work: Work) -> bool:
    """Let animals run before an episode (`Stage.WARM_UP`) or after a visit, first those that were late.

    Returns:
        Whether there was room for all of them; then the next stage is set.
    """
    table = batch.tables[b]
    if table.stage != Stage.PLAY and not animals.run_from_start(b, table, choices, scenery, herds, work):
        return False
    if table.stage == Stage.WARM_UP:
        table.known, table.stage = batch.states[b].changes, Stage.SHOW
        return True
    if table.stage == Stage.LATE:
        animals.play_few(b, batch, choices, scenery, herds, work)
        table.stage = Stage.PLAY
    if not animals.run(b, batch, choices, scenery, herds, work):
        return False
    next_visit(b, batch, choices, scenery, work)
    table.stage = Stage.CLOSE
    return True


@compiled
def advance(
    first: int,
    end: int,
    actions: FloatArray,
    choice: Structs[Choices],
    environments: Environments,
    tan: tuple[FloatArray, np.ndarray, int],
) -> int:
    """Have environments from `first` to `end` go through the stages that they are in.

    Returns:
        How many have not got through, because there was no room for more animals.
    """
    batch, scenery, herds, given, output = environments
    work = room_to_work(len(scenery.kind), tan)
    sight = sight_of(scenery, work)
    everything = (batch, scenery, herds, given, output, work, sight)
    return go_on(first, end, actions, choice, everything)


@compiled
def go_on(first: int, end: int, actions: FloatArray, choice: Structs[Choices], everything: Everything) -> int:
    """`advance`, with all that it works on."""
    actions, choice = borrowed(actions), borrowed(choice)
    everything = borrowed(everything)
    batch, scenery, herds, given, output, work, sight = everything
    choices, lacking = choice[0], 0
    for b in range(first, end):
        table = batch.tables[b]
        if table.stage == Stage.LATE:  # there was no room for all
            animals.may_stray(b, batch, choices, scenery, work)
        elif table.stage == Stage.ACT:
            table.stage = take_action(b, actions[b], choices, everything)
        if table.stage in (Stage.LATE, Stage.PLAY) and not play(b, batch, choices, scenery, herds, work):
            lacking += 1
            continue
        if table.stage == Stage.CLOSE:
            output.reward[b] = paid(b, batch, choices, scenery, herds, output.reports[b])
            output.over[b] = table.over
            show(b, batch, choices, scenery, herds, output, work, sight.space)
            table.stage = Stage.DONE
            if table.over and choices.same_step:
                keep_last(b, output)
                table.stage = Stage.BEGIN
        if table.stage == Stage.BEGIN:
            begin(b, batch, choices, scenery, herds, given, work)
            table.stage = Stage.SHOW
            if choices.animals_a_second > 0 and not choices.lazy:
                animals.send_out(b, choices, scenery, herds, table)
                table.stage = Stage.WARM_UP
        if table.stage == Stage.WARM_UP and not play(b, batch, choices, scenery, herds, work):
            lacking += 1
            continue
        if table.stage == Stage.SHOW:
            table.moved = 0.0
            report = output.reports[b]
            report.terms[0] = report.terms[1] = report.effort_cost = 0.0
            show(b, batch, choices, scenery, herds, output, work, sight.space)
            table.stage = Stage.DONE
    return lacking
