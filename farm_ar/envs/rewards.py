"""The rewards, by name: what an agent gains from what its step did."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple


class Standing(NamedTuple):
    """What the rewards look at.

    Args:
        wrong: number of wrong labels.
        ambiguity: half the sum over objects in view of 1 - margin / 0.3, of a snapshot as things stand.
        miscounts: animals so far that did not get into the building of their colour.
        endpoint_error: sum over labels of the metres from believed to true place, as a share of the diagonal.
        clutter: half the sum over objects of 1 - margin / 0.3, were they known to stand as they do.
    """

    wrong: int
    ambiguity: float
    miscounts: int
    endpoint_error: float
    clutter: float = 0.0


NOTHING_YET = Standing(0, 0.0, 0, 0.0)
"""At the start of an episode, for a reward that looks at wrong labels only."""

MARGIN_SHARE = 0.5
"""What a unit of ambiguity, or of clutter, is worth beside a wrong label."""


def _identity(before: Standing, after: Standing) -> float:
    return float(after.wrong - before.wrong)


def _margin(before: Standing, after: Standing) -> float:
    return _identity(before, after) + MARGIN_SHARE * (after.ambiguity - before.ambiguity)


def _clutter(before: Standing, after: Standing) -> float:
    return _identity(before, after) + MARGIN_SHARE * (after.clutter - before.clutter)


def _miscount(before: Standing, after: Standing) -> float:
    return float(after.miscounts - before.miscounts)


def _endpoint(before: Standing, after: Standing) -> float:
    return after.endpoint_error - before.endpoint_error


HARM: dict[str, Callable[[Standing, Standing], float]] = {
    "identity": _identity,
    "margin": _margin,
    "clutter": _clutter,
    "miscount": _miscount,
    "endpoint": _endpoint,
}
"""The harm that a step did, by name of the reward."""
