"""Kernels: the snapshot that ends a visit, and what is believed then, as `Tracker.look` does it."""

from __future__ import annotations

from math import fabs

import numpy as np

from farm_ar.envs.batched import streams
from farm_ar.envs.batched.acting import true_yaw
from farm_ar.envs.batched.starting import aim
from farm_ar.envs.batched.state import Batch, Choices, Scenery, Work
from farm_ar.game_logic.belief import SAME
from farm_ar.game_logic.visibility import look_over
from farm_ar.geometry.angles import wrap_angle
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import Answer, Known, Seen
from farm_ar.reid.assignment.assessment import assess_batch
from farm_ar.scenes import UNKNOWN


@compiled
def read_poses(b: int, batch: Batch, choices: Choices, work: Work) -> None:
    """Fill in where everything is."""
    for i in range(len(work.yaw)):
        body = batch.bodies[b, i]
        work.position[i, 0], work.position[i, 1] = body.x, body.z
        work.yaw[i] = true_yaw(b, i, batch, choices)


@compiled
def look(b: int, batch: Batch, choices: Choices, scenery: Scenery, work: Work) -> None:
    """Take a snapshot, identify what is in it, and believe the answer.

    Args:
        b: the environment.
        batch: all of them; accuracy, beliefs, holders and wrong labels are brought up to date.
        choices: likewise chosen for all.
        scenery: the scene.
        work: filled with the poses, and with which labels' believed poses changed.
    """
    table, m, changed = batch.tables[b], len(scenery.kind), work.changed
    read_poses(b, batch, choices, work)
    work.eyes[0] = batch.eyes[b]
    if choices.head_noise > 0:
        eye = work.eyes[0]
        aim(eye, eye.yaw + choices.head_noise * streams.normal(table.stream))
    count = look_over(work.eyes, work.position, scenery.elevation, work.seen, work.order)
    changed[:] = False
    batch.pose[b] = np.nan  # what was found out spoke of other beliefs
    table.accuracy = 1.0
    if count == 0:
        return
    seen, answer = detections(count, scenery, work), unanswered(count)
    assess_batch(seen, labels(b, batch, scenery), scenery.rule, answer)
    right = 0
    for k in range(count):
        i, j = work.order[k], answer.label[0, k]
        if j == i:
            right += 1
        if j != UNKNOWN and not scenery.fixed[j]:
            moved = max(
                fabs(work.position[i, 0] - batch.believed[b, j, 0]),
                fabs(work.position[i, 1] - batch.believed[b, j, 1]),
            )
            changed[j] = max(moved, fabs(wrap_angle(work.yaw[i] - batch.facing[b, j]))) > SAME
            batch.believed[b, j, 0], batch.believed[b, j, 1] = work.position[i, 0], work.position[i, 1]
            batch.facing[b, j], batch.holder[b, j] = work.yaw[i], i
    table.accuracy, table.wrong = right / count, 0
    for j in range(m):
        if batch.holder[b, j] != j:
            table.wrong += 1


@compiled
def detections(count: int, scenery: Scenery, work: Work) -> Seen:
    """What is seen, from left to right, as `seen_at` has it."""
    number, order = np.empty(1, dtype=np.int64), np.empty((1, count), dtype=np.int64)
    position, yaw, sides = np.empty((1, count, 2)), np.empty((1, count)), np.empty((1, count, 3))
    category = np.empty((1, count), dtype=np.int64)
    number[0] = count
    for k in range(count):
        i = work.order[k]
        order[0, k], category[0, k], yaw[0, k] = k, scenery.kind[i], work.yaw[i]
        position[0, k, 0], position[0, k, 1] = work.position[i, 0], work.position[i, 1]
        for axis in range(3):
            sides[0, k, axis] = scenery.log_sides[i, axis]
    return Seen(number, np.zeros((1, 2)), position, yaw, sides, category, order)


@compiled
def labels(b: int, batch: Batch, scenery: Scenery) -> Known:
    """The labels where they are believed to be, as `known_at` has them."""
    m = len(scenery.kind)
    return Known(
        batch.believed[b].reshape(1, m, 2),
        batch.facing[b].reshape(1, m),
        scenery.kind,
        scenery.size_of,
        scenery.sides,
        np.zeros(m, dtype=np.int64),
        np.empty((0, 2)),
        np.arange(m).reshape(1, m),
    )


@compiled
def unanswered(count: int) -> Answer:
    """Room for the answer on one snapshot, without margins and costs."""
    label, runner_up = np.empty((1, count), dtype=np.int64), np.empty((0, count), dtype=np.int64)
    label[:] = UNKNOWN
    candidates, widened = np.empty(1, dtype=np.int64), np.empty(1, dtype=np.bool_)
    cost, margin = np.empty((1, count)), np.empty((0, count))
    return Answer(label, cost, candidates, widened, margin, runner_up, np.empty((0, 0, 0)))
