"""Kernels: the snapshot that ends a visit, and what is believed then, as `Tracker.look` does it."""

from __future__ import annotations

from math import fabs

import numpy as np

from farm_ar.envs.batched import streams
from farm_ar.envs.batched.actions import true_yaw
from farm_ar.envs.batched.generator import aim
from farm_ar.envs.batched.state import Batch, Choices, Scenery, Sight, Work
from farm_ar.game_logic.belief import SAME
from farm_ar.game_logic.visibility import look_over
from farm_ar.geometry.angles import wrap_angle
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import Answer, Known, Seen, workspace_for
from farm_ar.reid.assignment.assessment import assess_one
from farm_ar.scenes import UNKNOWN


@compiled
def read_poses(b: int, batch: Batch, choices: Choices, work: Work) -> None:
    """Fill in where everything is."""
    for i in range(len(work.yaw)):
        body = batch.bodies[b, i]
        work.position[i, 0], work.position[i, 1] = body.x, body.z
        work.yaw[i] = true_yaw(b, i, batch, choices)


@compiled
def look(b: int, batch: Batch, choices: Choices, scenery: Scenery, work: Work, sight: Sight) -> None:
    """Take a snapshot, identify what is in it, and believe the answer.

    Args:
        b: the environment.
        batch: all of them; accuracy, beliefs, holders and wrong labels are brought up to date.
        choices: likewise chosen for all.
        scenery: the scene.
        work: filled with the poses, and with which labels' believed poses changed.
        sight: views of it, and room for the answer.
    """
    table, m, changed = batch.tables[b], len(scenery.kind), work.changed
    read_poses(b, batch, choices, work)
    work.eyes[0] = batch.eyes[b]
    if choices.head_noise > 0:
        eye = work.eyes[0]
        aim(eye, eye.yaw + choices.head_noise * streams.normal(table.stream))
    count = look_over(work.eyes, work.position, scenery.elevation, work.seen, work.order)
    changed[:] = False
    table.accuracy = 1.0
    if count == 0:
        return
    sight.seen.number[0], sight.answer.label[:] = count, UNKNOWN
    assess_one(0, sight.seen, labels(b, batch, scenery, sight), scenery.model, sight.answer, sight.space)
    right = 0
    for k in range(count):
        i = work.order[k]
        j = sight.answer.label[0, i]
        if j == i:
            right += 1
        if j != UNKNOWN and not scenery.fixed[j]:
            moved = max(
                fabs(work.position[i, 0] - batch.believed[b, j, 0]),
                fabs(work.position[i, 1] - batch.believed[b, j, 1]),
            )
            changed[j] = max(moved, fabs(wrap_angle(work.yaw[i] - batch.facing[b, j]))) > SAME
            if moved != 0 or work.yaw[i] != batch.facing[b, j]:
                batch.pose[b, j] = np.nan  # what was found out of it spoke of another belief
            batch.believed[b, j, 0], batch.believed[b, j, 1] = work.position[i, 0], work.position[i, 1]
            batch.facing[b, j], batch.holder[b, j] = work.yaw[i], i
    table.accuracy, table.wrong = right / count, 0
    for j in range(m):
        if batch.holder[b, j] != j:
            table.wrong += 1


@compiled(inline="always")
def sight_of(scenery: Scenery, work: Work) -> Sight:
    """Room to identify what is seen, from left to right, as `seen_at` has it."""
    m, kinds = len(scenery.kind), 0
    for kind in scenery.kind:
        kinds = max(kinds, kind + 1)
    seen = Seen(
        np.empty(1, dtype=np.int64),
        np.zeros((1, 2)),
        work.position.reshape(1, m, 2),
        work.yaw.reshape(1, m),
        scenery.log_sides.reshape(1, m, 3),
        scenery.kind.reshape(1, m),
        work.order.reshape(1, m),
    )
    answer = Answer(
        np.empty((1, m), dtype=np.int64),
        np.empty((1, m)),
        np.empty(1, dtype=np.int64),
        np.empty(1, dtype=np.bool_),
        np.empty((0, m)),
        np.empty((0, m), dtype=np.int64),
        np.empty((0, 0, 0)),
    )
    return Sight(
        seen,
        np.zeros(m, dtype=np.int64),
        np.empty((0, 2)),
        np.arange(m).reshape(1, m),
        answer,
        workspace_for(m, m, True, max(kinds, len(scenery.sides))),
    )


@compiled(inline="always")
def labels(b: int, batch: Batch, scenery: Scenery, sight: Sight) -> Known:
    """The labels where they are believed to be, as `known_at` has them."""
    return Known(
        batch.believed[b : b + 1],
        batch.facing[b : b + 1],
        scenery.kind,
        scenery.size_of,
        scenery.sides,
        sight.site,
        sight.sites,
        sight.order,
    )
