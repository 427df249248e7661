"""What a method inferred about how objects had moved, in words."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.reid.adaptive import AdaptiveReid
from farm_ar.reid.adaptive.hypotheses import FAMILIES
from farm_ar.reid.base import Reidentifier
from farm_ar.reid.likelihood.method import LikelihoodReid
from farm_ar.reid.relational.method import RelationalReid
from farm_ar.scenes import Snapshot

LEAST, MOST = 0.05, 3
"""The least probability of what is reported, and how many ways of moving are."""

_ALONE, _AHEAD = ("gaussian", "exponential", "student"), ("forward", "ahead")
_WAYS = {
    "forward": "ahead along its heading, all by about the same distance",
    "ahead": "ahead along its heading, each by another distance",
    "together": "all by one shift",
    "together, turning": "all by one shift and turn",
    "together, and ahead": "all by one shift, and each ahead along its heading",
    "stay or move": "most hardly, some to anywhere",
    "nudged or moved": "most hardly, some to anywhere",
}
"""Families of motions of `AdaptiveReid`, by the beginning of their names, in words."""


def beliefs(reid: Reidentifier, snapshot: Snapshot) -> tuple[str, ...]:
    """What a method infers about how the objects in a snapshot have moved, a sentence each.

    Args:
        reid: the method; nothing is said of those that do not average over motions.
        snapshot: what was seen, in the scene's frame; at least one detection, each one that it can identify.
    """
    if isinstance(reid, AdaptiveReid):
        return _of_adaptive(reid, snapshot)
    if isinstance(reid, RelationalReid):
        return (_of_relations(reid, snapshot), _of_likelihood(reid, snapshot))
    return (_of_likelihood(reid, snapshot),) if isinstance(reid, LikelihoodReid) else ()


def _of_adaptive(reid: AdaptiveReid, snapshot: Snapshot) -> tuple[str, ...]:
    posterior = reid._posterior(snapshot, None)
    every, motion = posterior.every, posterior.which[:, 0]
    metres = every.scale[every.motions.scale[motion]] * reid._known.spacing
    headed = bool(posterior.problem.pairs.turned.any())
    ways = [_way(FAMILIES[f].name, headed) for f in every.family[motion].tolist()]
    share: dict[str, float] = defaultdict(float)
    far: dict[str, float] = defaultdict(float)
    for way, part, length in zip(ways, posterior.share.tolist(), metres.tolist(), strict=True):
        share[way] += part
        far[way] += part * float(np.log(length))
    likeliest = sorted(share, key=lambda way: -share[way])[:MOST]
    told = [
        f"{way}, by about {snapshot.world.length(float(np.exp(far[way] / share[way])))} ({share[way]:.0%})"
        for way in likeliest
        if share[way] >= LEAST or way == likeliest[0]
    ]
    moved = f"Inferred motion of each object: {'; or '.join(told)}."
    if not headed:
        return (moved,)
    return (moved, _headings(every.motions.heading[motion], posterior.share, reid.options.turn_sds))


def _way(family: str, headed: bool) -> str:
    """A family of motions in words; without headings what goes ahead goes anywhere."""
    if family in _ALONE or (not headed and family.startswith(_AHEAD)):
        return "on its own"
    known = [name for name in _WAYS if family.startswith(name)]
    return _WAYS[max(known, key=len)] if known else family


def _headings(heading: IntArray, share: FloatArray, sds: tuple[float, ...]) -> str:
    """How exactly headings are kept, as inferred."""
    blind = float(share[heading == len(sds)].sum())
    told = heading < len(sds)
    if blind > 1 - LEAST:
        return "Headings: uninformative."
    weight = share[told] / share[told].sum()
    sd = float(np.exp(weight @ np.log(np.array(sds)[heading[told]])))
    kept = f"kept to about {np.rad2deg(sd):.0f}°"
    if blind < LEAST:
        return f"Headings: {kept}."
    ways = [(blind, "uninformative"), (1 - blind, kept)]
    first, second = (f"{way} ({part:.0%})" for part, way in sorted(ways, reverse=True))
    return f"Headings: {first}, or {second}."


def _of_likelihood(reid: LikelihoodReid, snapshot: Snapshot) -> str:
    found = reid.posterior(snapshot)
    far, turn = snapshot.world.length(found.translation_sd), np.rad2deg(found.rotation_sd)
    return f"Inferred motion of each object, on its own: by about {far} along x and z, turned by {turn:.0f}°."


def _of_relations(reid: RelationalReid, snapshot: Snapshot) -> str:
    words = {"alone": "none", "drift": "the whole frame's"}
    told = [
        f"{words.get(one.kind) or f'that of the objects around {one.label}'} ({one.probability:.0%})"
        for one in reid.relations(snapshot)[:MOST]
        if one.probability >= LEAST
    ]
    return f"Inferred motion that objects share: {'; or '.join(told)}."
