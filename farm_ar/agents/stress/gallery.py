"""Which failures the gallery shows: the extremes of each kind, and others as different as can be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from farm_ar.agents.stress.study import Study
from farm_ar.sweeps import Row

GALLERY, GALLERY_OF_MANY = 6, 3
"""Failures of each kind and rule; of more than two rules."""

Order = Callable[[Row], Any]

ORDERS: dict[str, tuple[str, Order]] = {
    "cheapest": ("cheapest", lambda row: row["cheapest"]["effort"]),
    "worst": ("worst", lambda row: (-row["worst"]["wrong"], row["worst"]["effort"])),
    "likeliest": ("cheapest", lambda row: row["cheapest"]["surprise"]),
}
"""By kind: which of a row's failures is meant, and by what rows are ordered."""


class Shown(NamedTuple):
    """A failure of the gallery.

    Args:
        kind: as what it is shown.
        row: the attack that found it.
        failure: what it found.
    """

    kind: str
    row: Row
    failure: dict[str, Any]


def gallery(study: Study) -> list[Shown]:
    """The cheapest, the worst and the likeliest failures of each re-identifier.

    The first of a kind is always the extreme one. Beside it stand those of the better half that differ most
    from what is shown already: of another case, with other objects misread, or misread in another way.
    """
    shown: list[Shown] = []
    number = GALLERY if len(study.options.reids) <= 2 else GALLERY_OF_MANY
    for reid in study.options.reids:
        rows = [row for row in study.attacked if row["reid"] == reid and row["cheapest"] is not None]
        before: list[Shown] = []
        for kind, (which, order) in ORDERS.items():
            ranked = [Shown(kind, row, row[which]) for row in sorted(rows, key=order)]
            before += _different(ranked, number, before)
        shown += before
    return shown


def _different(ranked: Sequence[Shown], number: int, before: Sequence[Shown]) -> list[Shown]:
    """At most `number` of them, one of each case."""
    chosen: list[Shown] = []
    better = list(ranked[: max(number, len(ranked) // 2)])
    while better and len(chosen) < number:
        seen = [*before, *chosen]
        cases = [one.row["case"] for one in seen]
        ways = [_way_of(one.failure) for one in seen]

        def familiar(one: Shown, cases: list[int] = cases, ways: list[Any] = ways) -> tuple[int, int]:
            return cases.count(one.row["case"]), ways.count(_way_of(one.failure))

        best = better[0] if not chosen else min(better, key=familiar)
        chosen.append(best)
        better = [one for one in better if one.row["case"] != best.row["case"]]
    return sorted(chosen, key=lambda one: next(k for k, other in enumerate(ranked) if other is one))


def _way_of(failure: Mapping[str, Any]) -> tuple[str, frozenset[str]]:
    """In which way which objects are misread."""
    misread = dict(failure["misread"])
    if None in misread.values():
        return "no label", frozenset(misread)
    return "in a cycle" if set(misread) == set(misread.values()) else "in a path", frozenset(misread)
