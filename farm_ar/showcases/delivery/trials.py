"""Deliveries in many rearranged rooms, by method."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.envs.delivery import Courier, Delivery, DeliveryConfig, Room
from farm_ar.envs.delivery.delivery import start_of
from farm_ar.showcases.result import Report, Row, Shown, column, number, percent, points

METHODS = ("naive", "spatial", "likelihood", "adaptive")
"""naive drives to where the target was, and delivers to the chair that stands nearest to there."""

SURE = 0.8
"""Probability from which on a delivery counts as a confident one."""


@dataclass(frozen=True)
class Trial:
    """One delivery.

    Args:
        layout: its number.
        method: how chairs were identified.
        right: whether the right chair got it.
        wrong: whether another one did.
        touches: how often the robot touched something.
        driven_m: length of its way, metres.
        shortest_m: of the shortest way to the right chair, metres.
        seconds: how long it took.
        goals: how many goals were issued; each cancels the one before.
        sure: probability of the chair that got it being the right one; NaN where the method has none.
    """

    layout: int
    method: str
    right: bool
    wrong: bool
    touches: int
    driven_m: float
    shortest_m: float
    seconds: float
    goals: int
    sure: float


Watcher = Callable[[Delivery, Courier], None]


def begin(config: DeliveryConfig, seed: int, layout: int) -> Delivery:
    """A room rearranged at random, the robot in it; the same for every method."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(layout,)))
    scene = config.known()
    room = Room(scene)
    moved = room.rearranged(config.noise(), rng)
    return Delivery(config, scene, moved, start_of(room, moved, rng), rng)


def deliver(
    method: str, seed: int, layout: int, watch: Watcher = lambda now, courier: None, confirm: float = SURE
) -> Trial:
    """One delivery, from the start to the hand-over or until the time is up.

    Args:
        method: one of `METHODS`, or the name of any re-identifier.
        seed: of all randomness, with the layout.
        layout: its number.
        watch: called after every step.
        confirm: as for `Courier`.
    """
    naive = method == "naive"
    config = DeliveryConfig(reid="last-known" if naive else method)
    now, courier = begin(config, seed, layout), Courier(naive, confirm)
    watch(now, courier)
    while now.delivered is None and now.seconds < config.seconds:
        now.step(*courier.act(now.knowledge()))
        watch(now, courier)
    return Trial(
        layout,
        method,
        right=now.delivered == now.target,
        wrong=now.delivered not in (None, now.target),
        touches=now.robot.touches,
        driven_m=round(now.robot.driven, 4),
        shortest_m=round(now.shortest(), 4),
        seconds=round(now.seconds, 1),
        goals=len(courier.goals),
        sure=round(courier.sure, 4),
    )


def show_deliveries(
    out: Path, layouts: int, seed: int, report: Report, methods: Sequence[str] = METHODS
) -> Shown:
    """Deliver in many layouts by every method, and sum up."""
    trials: list[Trial] = []
    for i in range(layouts):
        trials += [deliver(method, seed, i) for method in methods]
        report("Delivering", (i + 1) / layouts)
    rows = {method: [asdict(t) for t in trials if t.method == method] for method in methods}
    shown = Shown(f"Deliveries to chair 4 of 4 to 7 in {layouts} rearranged labs")
    shown.rows = [_summary(method, of, rows["spatial"]) for method, of in rows.items()]
    touches = sum(trial.touches for trial in trials)
    shown.notes = [
        f"Touched chairs, tables or walls: {touches} times in {len(trials)} deliveries.",
        "SPL: success weighted by shortest / driven (Anderson et al. 2018).",
        "wrong and sure: wrong deliveries with a probability of 80% or more.",
    ]
    shown.write(out, "delivery", [asdict(trial) for trial in trials])
    return shown


def _summary(method: str, trials: list[Row], paper: list[Row]) -> Row:
    right, wrong = column(trials, "right"), column(trials, "wrong")
    sure = np.nan_to_num(column(trials, "sure"))
    known = np.isfinite(column(trials, "sure")).any()
    return {
        "method": method,
        "wrong chair": percent(wrong),
        "right chair": percent(right),
        "nobody": percent(1 - right - wrong),
        "wrong less spatial's": "" if method == "spatial" else points(wrong, column(paper, "wrong")),
        "wrong and sure": percent(wrong * (sure >= SURE)) if known else "",
        "SPL": number(success_by_length(trials)),
        "driven / shortest": f"{np.median(_ratio(trials)):.2f}",
        "seconds": f"{np.median(column(trials, 'seconds')):.0f}",
    }


def success_by_length(trials: list[Row]) -> FloatArray:
    """(N,) success x shortest / max(shortest, driven) of each delivery (Anderson et al. 2018)."""
    shortest, driven = column(trials, "shortest_m"), column(trials, "driven_m")
    longest = np.maximum(shortest, driven)
    share: FloatArray = np.where(longest > 0, shortest / np.where(longest > 0, longest, 1.0), 1.0)
    return column(trials, "right") * share


def _ratio(trials: list[Row]) -> FloatArray:
    """Driven by shortest of the right deliveries that had at least half a metre to go."""
    kept = (column(trials, "right") > 0) & (column(trials, "shortest_m") >= 0.5)
    ratio: FloatArray = (column(trials, "driven_m") / np.maximum(column(trials, "shortest_m"), 1e-9))[kept]
    return ratio if len(ratio) else np.array([np.nan])
