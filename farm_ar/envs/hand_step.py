"""A step of the steered hand, compiled: what it does, and at once what there is to say of the table then."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs.meeting import RIVALS
from farm_ar.envs.reading import READ_AT, pages, read_table
from farm_ar.game_logic import chipmunk, plane, steering
from farm_ar.game_logic.plane import Addresses


@chipmunk.compiled
def steer_and_read(
    handle: Addresses,
    state: FloatArray,
    box: FloatArray,
    visit: FloatArray,
    queue: FloatArray,
    animal: FloatArray,
    clock: FloatArray,
    lane: FloatArray,
    counts: IntArray,
    vx: float,
    vz: float,
    spin: float,
    closed: bool,
    ticks: int,
    sheet: FloatArray,
    met: IntArray,
    numbers: npt.NDArray[np.float32],
) -> bool:
    """`steering.steer`, and a `Reading` brought up to date where it was so before.

    Args:
        handle: as for `steering.steer`, and so on.
        state: likewise.
        box: likewise.
        visit: likewise.
        queue: likewise.
        animal: likewise.
        clock: likewise.
        lane: likewise.
        counts: likewise.
        vx: likewise.
        vz: likewise.
        spin: likewise.
        closed: likewise.
        ticks: likewise.
        sheet: of the reading.
        met: of the reading.
        numbers: of the reading; they end with what `steering.tell` has of the hand.

    Returns:
        As `steering.steer`.
    """
    before, told = state[plane.CHANGES], numbers[len(numbers) - steering.TOLD :]
    eventful = steering.steer(
        handle, state, box, visit, queue, animal, clock, lane, counts, vx, vz, spin, closed, ticks, told
    )
    if state[plane.CHANGES] != before and sheet[READ_AT] == before:
        summary, fixed, where, dimension, known = pages(sheet, len(met), met.shape[1] - RIVALS)
        eye = visit[steering.EYE_AT : steering.OUTCOME_AT]
        read_table(box, where, eye, met, dimension, fixed, known, numbers, summary)
        summary[READ_AT] = state[plane.CHANGES]
    return bool(eventful)
