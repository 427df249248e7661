"""Attacks that ask blindly: the paper's noise, a quasi-random sequence, the same displacements everywhere."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm, qmc

from farm_ar.agents.attacks.trial import Trial
from farm_ar.arrays import FloatArray, IntArray
from farm_ar.envs.table import meeting_order

BATCH = 64

CONSTANT_SEED = 20251
"""Of the displacements that `constant` tries, the same in every case."""

CONSTANTS = 24
"""How many those are."""


def random_noise(trial: Trial, rng: np.random.Generator) -> None:
    """The paper's noise on all objects, T and R drawn anew each time, scaled below the least so far."""
    layout, scene = trial.case.layout, trial.case.scene
    while trial.left > 0:
        shape = (BATCH, len(layout))
        sd = np.exp(rng.uniform(np.log(0.002), np.log(0.3), (2, BATCH, 1)))
        shift = sd[0, ..., None] * scene.diagonal * rng.normal(size=(*shape, 2))
        turn = sd[1] * np.pi * rng.normal(size=shape)
        if not _ask_scaled(trial, shift, turn, rng.random(BATCH)):
            return


def halton(trial: Trial, rng: np.random.Generator) -> None:
    """Displacements of one to three objects in view, spread evenly by a scrambled Halton sequence."""
    case, layout = trial.case, trial.case.layout
    seen = np.flatnonzero(case.in_view & layout.movable)
    sequence = qmc.Halton(13, seed=rng)
    while trial.left > 0 and seen.size:
        values = sequence.random(BATCH)
        shift, turn = np.zeros((BATCH, len(layout), 2)), np.zeros((BATCH, len(layout)))
        number = 1 + np.floor(3 * values[:, 12]).astype(np.int64)
        for k in range(3):
            mover = seen[np.floor(values[:, 4 * k] * len(seen)).astype(np.int64)]
            row = np.flatnonzero(number > k)
            step = norm.ppf(np.clip(values[:, 4 * k + 1 : 4 * k + 4], 1e-6, 1 - 1e-6))
            shift[row, mover[row]] = 0.1 * case.scene.diagonal * step[row, :2]
            turn[row, mover[row]] = 0.3 * step[row, 2]
        if not _ask_scaled(trial, shift, turn, values[:, 11]):
            return


def constant(trial: Trial, rng: np.random.Generator) -> None:
    """The same few displacements in every case, by place in the camera's order, each at many scales.

    What they reach is reached without looking; the generator is not used.
    """
    case, layout = trial.case, trial.case.layout
    order = _meeting_order(trial)
    shared = np.random.default_rng(CONSTANT_SEED)
    for _ in range(CONSTANTS):
        shift, turn = np.zeros((len(layout), 2)), np.zeros(len(layout))
        step = shared.normal(size=(12, 3)) * (shared.random(12) < 0.3)[:, None]
        number = min(12, len(order))
        shift[order[:number]] = 0.1 * case.scene.diagonal * step[:number, :2]
        turn[order[:number]] = 0.3 * step[:number, 2]
        scale = np.linspace(0.0, 2.0, 33)[1:]
        trial.ask(layout.position + scale[:, None, None] * shift, layout.yaw + scale[:, None] * turn)


def _ask_scaled(trial: Trial, shift: FloatArray, turn: FloatArray, share: FloatArray) -> bool:
    """Ask about displacements scaled to a share of the least effort so far; False if none could be asked."""
    layout = trial.case.layout
    shift = np.where(layout.fixed[:, None], 0.0, shift)
    turn = np.where(layout.fixed, 0.0, turn)
    effort = trial.effort(layout.position + shift, layout.yaw + turn)
    scale = np.minimum(1.0, share * trial.least / np.maximum(effort, 1e-12))
    before = trial.asked
    trial.ask(layout.position + scale[:, None, None] * shift, layout.yaw + scale[:, None] * turn)
    return trial.asked > before or trial.least > 1e-3


def _meeting_order(trial: Trial) -> IntArray:
    """The movable objects in view, by kind and from left to right."""
    case = trial.case
    order = meeting_order(case.layout, case.camera)
    return order[case.in_view[order] & case.layout.movable[order]]
