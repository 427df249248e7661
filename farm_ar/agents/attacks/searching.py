"""Attacks that search: greedily, by covariance adaptation (CMA-ES), for many different failures (CMA-MAE)."""

from __future__ import annotations

import warnings

import numpy as np

from farm_ar.agents.attacks.surrogate import least_margins
from farm_ar.agents.attacks.trial import EFFORT_BINS, NOT_ASKED, WRONG_BINS, Trial
from farm_ar.agents.packages import package
from farm_ar.arrays import FloatArray, IntArray

MOST_OBJECTS = 12
"""Objects that a search displaces at the most: those in view that stand nearest to others of their kind."""

NOT_ALLOWED = 10.0
"""The value of a displacement that is not allowed; everything that is allowed has a lower one."""


def greedy(trial: Trial, rng: np.random.Generator) -> None:
    """Again and again the small displacement of one object that brings the rule nearest to an error.

    When something is wrong, it begins anew from the untouched table with other small displacements.
    """
    layout, scene = trial.case.layout, trial.case.scene
    movers = search_objects(trial)
    while trial.left > 0 and movers.size:
        position, yaw = layout.position.copy(), layout.yaw.copy()
        step = float(rng.uniform(0.005, 0.06))
        value, before = np.inf, trial.asked
        for _ in range(25):
            tries = np.repeat(movers, 8)
            angle = rng.uniform(0, 2 * np.pi, len(tries))
            next_position = np.repeat(position[None], len(tries), axis=0)
            next_yaw = np.repeat(yaw[None], len(tries), axis=0)
            each = np.arange(len(tries))
            way = step * scene.diagonal * np.stack([np.sin(angle), np.cos(angle)], axis=1)
            next_position[each, tries] += way
            next_yaw[each, tries] += step * rng.normal(size=len(tries))
            fits = np.flatnonzero(trial.allowed(next_position, next_yaw))
            if not fits.size or trial.effort(position[None], yaw[None])[0] >= trial.least:
                break
            margin = least_margins(trial, next_position[fits], next_yaw[fits])
            best = int(np.argmin(margin))
            if margin[best] >= value:
                break
            value = float(margin[best])
            position, yaw = next_position[fits[best]], next_yaw[fits[best]]
            if trial.ask(position[None], yaw[None])[0] > 0:
                break
        if trial.asked == before:
            return


def cma_es(trial: Trial, rng: np.random.Generator) -> None:
    """CMA-ES on the displacements of the objects in view, begun anew with what is left when it has converged.

    Raises:
        MissingPackageError: the package cma is not installed.
    """
    cma = package("cma")
    movers = search_objects(trial)
    while trial.left > 0 and movers.size:
        options = {"seed": int(rng.integers(1, 2**31)), "verbose": -9, "maxfevals": 20 * trial.left}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            search = cma.CMAEvolutionStrategy(rng.normal(0.0, 0.5, 3 * len(movers)), 1.0, options)
            stale = 0
            while trial.left > 0 and not search.stop() and stale < 20:
                asked = trial.asked
                points = search.ask()
                search.tell(points, _values(trial, movers, np.array(points)).tolist())
                stale = stale + 1 if trial.asked == asked else 0
        if stale >= 20:
            return


def ribs(trial: Trial, rng: np.random.Generator) -> None:
    """CMA-MAE: an archive of failures by number of wrong labels and effort, filled by evolution strategies.

    Raises:
        MissingPackageError: the package ribs is not installed.
    """
    archives, emitters, schedulers = (
        package(f"ribs.{name}") for name in ("archives", "emitters", "schedulers")
    )
    movers = search_objects(trial)
    if not movers.size:
        return
    dimension = 3 * len(movers)
    seeds = [int(s) for s in rng.integers(1, 2**31, 4)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        archive = archives.GridArchive(
            solution_dim=dimension,
            dims=(WRONG_BINS, EFFORT_BINS),
            ranges=[(0.0, float(WRONG_BINS)), (0.0, trial.budget)],
            learning_rate=0.1,
            threshold_min=-NOT_ALLOWED - 1,
            seed=seeds[0],
        )
        parts = [
            emitters.EvolutionStrategyEmitter(
                archive,
                x0=np.zeros(dimension),
                sigma0=0.6,
                ranker="imp",
                restart_rule="basic",
                batch_size=16,
                seed=seed,
            )
            for seed in seeds[1:]
        ]
        scheduler = schedulers.Scheduler(archive, parts)
        stale = 0
        while trial.left > 0 and stale < 50:
            asked = trial.asked
            points = scheduler.ask()
            position, yaw = displaced(trial, movers, points)
            wrong = trial.ask(position, yaw)
            effort = trial.effort(position, yaw)
            margin = least_margins(trial, position, yaw)
            worth = np.where(wrong == NOT_ASKED, -NOT_ALLOWED, -margin - effort)
            measures = np.stack([np.maximum(wrong, 0), np.minimum(effort, trial.budget)], axis=1)
            scheduler.tell(worth, measures)
            stale = stale + 1 if trial.asked == asked else 0


def search_objects(trial: Trial) -> IntArray:
    """(M,) the movable objects in view, at most `MOST_OBJECTS`: those nearest to others of their kind."""
    case, layout = trial.case, trial.case.layout
    code = layout.category_code
    apart = np.linalg.norm(layout.position[:, None] - layout.position, axis=-1)
    apart[(code[:, None] != code) | np.eye(len(code), dtype=bool)] = np.inf
    nearest = apart.min(axis=1, initial=np.inf)
    seen = np.flatnonzero(case.in_view & layout.movable)
    chosen: IntArray = seen[np.argsort(nearest[seen], kind="stable")[:MOST_OBJECTS]]
    return chosen


def displaced(trial: Trial, movers: IntArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Poses from what a search says: (B, 3 M) shifts in twentieths of the diagonal and turns in sixths of pi.

    Small values are none: so that most objects stay where they are.
    """
    layout, scene = trial.case.layout, trial.case.scene
    values = np.sign(points) * np.maximum(np.abs(points) - 0.5, 0.0)
    steps = values.reshape(len(points), len(movers), 3)
    position = np.repeat(layout.position[None], len(points), axis=0)
    yaw = np.repeat(layout.yaw[None], len(points), axis=0)
    position[:, movers] += scene.diagonal / 20 * steps[..., :2]
    yaw[:, movers] += np.pi / 6 * steps[..., 2]
    return position, yaw


def _values(trial: Trial, movers: IntArray, points: FloatArray) -> FloatArray:
    """(B,) what CMA-ES makes small: the effort of a failure; 2 + the margin of what is none."""
    position, yaw = displaced(trial, movers, points)
    wrong = trial.ask(position, yaw)
    effort = trial.effort(position, yaw)
    margin = least_margins(trial, position, yaw)
    clear = 2.0 + margin + 0.1 * effort
    return np.where(wrong == NOT_ASKED, NOT_ALLOWED + effort, np.where(wrong > 0, effort, clear))
