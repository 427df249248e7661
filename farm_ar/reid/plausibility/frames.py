"""Whether a snapshot is written down in another frame, unit or convention than the map."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.geometry import bearing, direction, distance
from farm_ar.geometry.angles import wrap
from farm_ar.reid.plausibility.finding import Finding
from farm_ar.reid.plausibility.patterns import (
    ANYWHERE,
    LEAST_SHIFT,
    MOST_DETECTIONS,
    Places,
    Variant,
    log_evidence,
    log_mean,
    places_of,
)
from farm_ar.reid.plausibility.sizes import UNITS
from farm_ar.reid.registration import RigidMotion, register
from farm_ar.scenes import UNKNOWN, Camera, Scene, Snapshot, World

TELLING = 6.5
"""Logarithm of the ratio of likelihoods from which on a snapshot is believed to be written down wrongly."""

RIVAL = 2.0
"""By how much the ratio of another may fall short of the best one's, and it is still worth a word."""

FITTING = 2.0
"""Logarithm of how much better headings taken as radians must explain a snapshot than none at all."""

NATURAL, WAYS = 0.05, 12
"""Probability of each way in which all things may have moved alike; how many turns and steps are tried."""

MILD = (float(np.deg2rad(20)), 3.0)
"""Turn, radians, and shift, by the labels' spacing, up to which it may be the things that moved."""

SELDOM = 1e-3
"""Probability that a snapshot is written down wrongly."""

RADIAN = float(np.rad2deg(1.0))

FEWEST, MOST_LABELS, MOST_CANDIDATES, BEST = 3, 200, 2000, 3
"""Detections from which on, and labels up to which, a motion of the frame is looked for; motions that are
proposed, and refined."""

TOLERANCE = 0.3
"""By how much two distances may differ, by the labels' spacing, and be of one pair."""

FAR = 0.5
"""By how much a motion of the frame must shift a detection, by the labels' spacing, to matter."""

VIEW_SLACK = 0.3
"""By what angle a label may lie outside the view, radians, and still be likely to be detected."""

_SAID = {
    "mirrored": "the detections fit the map far better mirrored ({how}): declare the frames (unity, "
    "openxr, ros), or convert with farm_ar.geometry.convert_pose",
    "units": "the positions fit the map far better {how}: give both in one unit, metres in Python",
    "radians": "the headings fit the map far better {how}: files give degrees, Python takes radians",
    "headings": "the headings fit the map far better {how}: yaw is {yaw}",
    "frame": "the detections fit the map far better {how}: if the frames differ, use frame='unknown'",
}

Hypotheses = Mapping[str, list[tuple[str, Variant]]]
"""By kind: ways in which a snapshot may really have been meant, each with its name."""


def check_frames(scene: Scene, snapshot: Snapshot, category: IntArray) -> Iterator[Finding]:
    """The way of writing the snapshot down wrongly that explains it far better than its being right.

    Args:
        scene: the scene.
        snapshot: the snapshot, all positions finite and all categories known in the scene.
        category: (N,) codes of the categories, `UNKNOWN` where not known.
    """
    found = ratios(scene, snapshot, category)
    most = max((one.ratio for one in found), default=0.0)
    for one in found:
        if one.ratio > max(TELLING, most - RIVAL):
            odds = SELDOM * np.exp(min(one.ratio, 100.0))
            doubt = float(odds / (1 + odds)) if one.spoils else 0.0
            said = _SAID[one.kind].format(how=one.how, yaw=snapshot.world.yaw_words)
            yield Finding(one.kind, said, doubt=doubt)


class Ratio(NamedTuple):
    """How much better a snapshot is explained if it was written down in some wrong way than as given.

    Args:
        ratio: of the likelihoods, their logarithm.
        kind: of the way.
        how: in words.
        spoils: whether an answer to the snapshot as given is then worth nothing.
    """

    ratio: float
    kind: str
    how: str
    spoils: bool


def ratios(scene: Scene, snapshot: Snapshot, category: IntArray) -> list[Ratio]:
    """The best way of each kind in which a snapshot may have been written down wrongly."""
    seen, n = snapshot.detections, len(category)
    if not n or not len(scene.layout):
        return []
    some = np.linspace(0, n - 1, min(n, MOST_DETECTIONS)).astype(np.int64)
    position, yaw, category = seen.position[some], seen.yaw[some], category[some]
    places = places_of(scene)
    given = Variant(position, yaw, 0.0)
    every = _conventions(places, given, snapshot.world)
    natural = [given, *_natural(places, given), Variant(position, np.full_like(yaw, np.nan), 0.0)]
    wrong = [one for several in every.values() for _, one in several]
    evidence = log_evidence(places, category, [*natural, *wrong])
    as_given, without_headings = evidence[0], evidence[len(natural) - 1]
    likely = _in_view(places, snapshot.camera)
    if likely.any():
        as_given = np.logaddexp(as_given, log_evidence(places, category, [given], likely)[0]) - np.log(2)
    moved = list(_moved(places, category, given, snapshot.world))
    right = np.logaddexp.reduce([as_given, *evidence[1 : len(natural) - 1]])
    mild = [one.ratio + np.log(NATURAL) for one in moved if not one.spoils]
    found = {one.kind: one._replace(ratio=float(one.ratio - right)) for one in moved if one.kind}
    start = len(natural)
    right = np.logaddexp.reduce([right, *mild])
    for kind, several in every.items():
        mine = evidence[start : start + len(several)]
        start += len(several)
        # Headings near 0 are unlikely to be degrees if the map's are not; but then they must fit the map's.
        if kind == "radians" and mine[0] - several[0][1].log_volume < without_headings + FITTING:
            continue
        how = several[int(mine.argmax())][0]
        ratio = Ratio(float(log_mean(mine[None])[0] - right), kind, how, kind != "headings")
        found[kind] = max(found.get(kind, ratio), ratio)
    return list(found.values())


def _natural(places: Places, given: Variant) -> Iterator[Variant]:
    """What may happen to all things alike: they turn as one, or go ahead as one."""
    position, yaw = given.position, given.yaw
    turns = np.arange(1, WAYS) * 2 * np.pi / WAYS
    steps = places.spacing * np.geomspace(0.5, max(places.extent / places.spacing, 1.0), WAYS // 2)
    ahead = np.where(np.isnan(yaw)[:, None], 0.0, direction(np.nan_to_num(yaw)))
    for turn in turns:
        yield Variant(position, yaw + turn, float(np.log(NATURAL / WAYS)))
    for step in steps:
        yield Variant(position - step * ahead, yaw, float(np.log(NATURAL / WAYS)))


def _in_view(places: Places, camera: Camera) -> FloatArray:
    """(M,) 1 for labels that the camera may see, if they have not moved far; 0 for others."""
    fov = camera.fov
    off = bearing(camera.position, camera.yaw, places.position)
    near = distance(camera.position, places.position) <= fov.range_m + places.spacing
    return np.asarray(
        near & (off <= fov.right + VIEW_SLACK) & (off >= -fov.left - VIEW_SLACK), dtype=np.float64
    )


def _conventions(places: Places, given: Variant, world: World) -> Hypotheses:
    """The ways that have no number to be found: mirrored, another unit, radians, headings another way."""
    position, yaw = given.position, given.yaw
    corners = places.position if places.bounds is None else places.bounds.corners
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    mirrored: list[tuple[str, Variant]] = []
    for pivot in (np.zeros(2), middle):
        mirrored += _mirrored(position, yaw, pivot, world)
    for turned in (np.pi / 2 - yaw, yaw, -yaw):
        exchanged = " and ".join(sorted(world.floor_axes))
        mirrored.append((f"{exchanged} exchanged", Variant(position[:, ::-1], turned, 0.0, True)))
    units = []
    coordinates = np.count_nonzero(position)  # what is exactly 0 is so in any unit
    for name, metres in UNITS.items():
        for factor, how in ((metres, f"taken as {name}"), (1 / metres, f"with the map taken as {name}")):
            units.append((how, Variant(position * factor, yaw, coordinates * float(np.log(factor)))))
    ways = {
        "negated": -yaw,
        f"as {'90' if world.frame == 'unity' else '-90'}° less themselves": np.pi / 2 - yaw,
        "as 180° less themselves": np.pi - yaw,
    }
    every = {
        "mirrored": mirrored,
        "units": units,
        "headings": [(how, Variant(position, turned, 0.0, True)) for how, turned in ways.items()],
    }
    telling = np.count_nonzero(np.nan_to_num(yaw))
    if telling >= 2 and np.nanmax(np.abs(yaw)) <= 2 * np.pi / RADIAN:
        volume = telling * float(np.log(RADIAN))
        every["radians"] = [("taken as radians, not degrees", Variant(position, yaw * RADIAN, volume))]
    return every


def _mirrored(
    position: FloatArray, yaw: FloatArray, pivot: FloatArray, world: World
) -> Iterator[tuple[str, Variant]]:
    for axis, sides in zip(world.floor_axes, ((-1.0, 1.0), (1.0, -1.0)), strict=True):
        for turned in (-yaw, np.pi - yaw, yaw):
            there = pivot + (position - pivot) * sides
            yield f"{axis} the other way", Variant(there, turned, 0.0, True)


class _Motion(NamedTuple):
    """A motion of the frame and the logarithm of how much of what was possible it is."""

    motion: RigidMotion
    log_share: float


def _moved(places: Places, category: IntArray, given: Variant, world: World) -> Iterator[Ratio]:
    """A frame moved as a whole, mirrored or not, with the evidence in place of a ratio."""
    if len(category) < FEWEST or len(places.yaw) > MOST_LABELS:
        return
    mirror = given.position * [1.0, -1.0]
    for kind, position, headings in (
        ("frame", given.position, (given.yaw,)),
        ("mirrored", mirror, (np.pi - given.yaw, -given.yaw, given.yaw)),
    ):
        found = _best_motion(places, category, position)
        if found is None:
            continue
        motion, log_share = found
        there = motion.position(position)
        mirrored = kind == "mirrored"
        variants = [Variant(there, motion.yaw(yaw), log_share, mirrored) for yaw in headings]
        evidence = float(log_mean(log_evidence(places, category, variants)[None])[0])
        shift = np.linalg.norm(there - given.position, axis=1)
        turn = float(wrap(motion.turn))
        mild = kind == "frame" and abs(turn) < MILD[0] and float(shift.mean()) < MILD[1] * places.spacing
        origin = world.floor(np.zeros(2)) * (1.0, 1.0 if kind == "frame" else -1.0)
        how = _motion_words(motion, origin, world)
        how = how if kind == "frame" else f"{world.floor_axes[1]} the other way, then {how}"
        matters = float(shift.max()) > FAR * places.spacing
        yield Ratio(evidence, kind if matters else "", how, not mild)


def _motion_words(motion: RigidMotion, origin: FloatArray, world: World) -> str:
    """A motion of the frame in the axes and units of the snapshot's file, about its origin (2,)."""
    there = motion.position(origin[None])[0]
    turn = np.rad2deg(wrap(motion.turn)) * (1 if world.frame == "unity" else -1)
    return f"turned by {turn:.0f}° about the origin and shifted by {world.point(there)}"


def _best_motion(places: Places, category: IntArray, position: FloatArray) -> _Motion | None:
    """The rigid motion that best takes the detections to labels, of those that pairs of them propose."""
    allowed = (category[:, None] == UNKNOWN) | (category[:, None] == places.category)
    proposed = _proposed(places, allowed, position)
    if proposed is None:
        return None
    width = LEAST_SHIFT * places.spacing * 5
    scores = _scores(places, allowed, proposed.position(position), width)
    best: tuple[float, RigidMotion] | None = None
    for k in np.argsort(-scores, kind="stable")[:BEST]:
        motion = RigidMotion(proposed.pivot[k], proposed.shift[k], proposed.turn[k])
        for _ in range(3):
            motion = _refined(places, allowed, position, motion, width)
        score = float(_scores(places, allowed, motion.position(position)[None], width)[0])
        if best is None or score > best[0]:
            best = score, motion
    assert best is not None
    return _Motion(best[1], _log_share(places, allowed, position, best[1], width))


def _proposed(places: Places, allowed: BoolArray, position: FloatArray) -> RigidMotion | None:
    """Motions that take the detections farthest apart to two labels as far apart."""
    between = np.linalg.norm(position[:, None] - position, axis=-1)
    known = np.linalg.norm(places.position[:, None] - places.position, axis=-1)
    order = np.argsort(-np.triu(between, 1), axis=None, kind="stable")[:3]
    pivots, shifts, turns = [], [], []
    for a, b in zip(*np.unravel_index(order, between.shape), strict=True):
        if not between[a, b] > 0:
            continue
        near = np.abs(known - between[a, b]) <= TOLERANCE * places.spacing
        first, second = np.nonzero(near & allowed[a][:, None] & allowed[b] & (known > 0))
        step = 1 + len(first) // MOST_CANDIDATES
        first, second = first[::step], second[::step]
        towards = places.position[second] - places.position[first]
        mine = position[b] - position[a]
        turns.append(np.arctan2(towards[:, 0], towards[:, 1]) - np.arctan2(mine[0], mine[1]))
        middle = (position[a] + position[b]) / 2
        shifts.append((places.position[first] + places.position[second]) / 2 - middle)
        pivots.append(np.broadcast_to(middle, shifts[-1].shape))
    if not turns or not sum(map(len, turns)):
        return None
    return RigidMotion(np.concatenate(pivots), np.concatenate(shifts), np.concatenate(turns))


def _weights(places: Places, allowed: BoolArray, position: FloatArray, width: float) -> FloatArray:
    """(..., N, M) densities of places (..., N, 2) around the labels that each may be."""
    square = ((position[..., :, None, :] - places.position) ** 2).sum(axis=-1)
    density: FloatArray = np.where(allowed, np.exp(-square / (2 * width**2)), 0.0) / (2 * np.pi * width**2)
    return density


def _scores(places: Places, allowed: BoolArray, position: FloatArray, width: float) -> FloatArray:
    near = _weights(places, allowed, position, width).sum(axis=-1) / allowed.sum(axis=-1)
    total: FloatArray = np.log((1 - ANYWHERE) * near + ANYWHERE / places.extent**2).sum(axis=-1)
    return total


def _shares(places: Places, allowed: BoolArray, there: FloatArray, width: float) -> FloatArray:
    """(N, M) probability that each detection is each label's object, stayed there."""
    weight = (1 - ANYWHERE) * _weights(places, allowed, there, width) / allowed.sum(axis=-1, keepdims=True)
    share: FloatArray = weight / (weight.sum(axis=1, keepdims=True) + ANYWHERE / places.extent**2)
    return share


def _refined(
    places: Places, allowed: BoolArray, position: FloatArray, motion: RigidMotion, width: float
) -> RigidMotion:
    share = _shares(places, allowed, motion.position(position), width)
    total = share.sum(axis=1)
    if np.count_nonzero(total > 1e-3) < 2:
        return motion
    target = share @ places.position / np.maximum(total, 1e-300)[:, None]
    pivot = (total[:, None] * position).sum(axis=0) / total.sum()
    return register(position, target, total / width**2, pivot).motion


def _log_share(
    places: Places, allowed: BoolArray, position: FloatArray, motion: RigidMotion, width: float
) -> float:
    """Logarithm of the prior probability of all motions that fit about as well (Laplace's approximation)."""
    there = motion.position(position)
    share = _shares(places, allowed, there, width)
    total = float(share.sum())
    if not total > 0:
        return -np.inf
    square = ((there[:, None] - places.position) ** 2).sum(axis=-1)
    spread = np.sqrt((share * square).sum() / (2 * total)) + LEAST_SHIFT * places.spacing
    weight = share.sum(axis=1)
    middle = (weight[:, None] * there).sum(axis=0) / total
    arm = (
        np.sqrt((weight * ((there - middle) ** 2).sum(axis=-1)).sum() / total) + places.spacing * LEAST_SHIFT
    )
    shift = float(np.linalg.norm(motion.about(places.position.mean(axis=0)).shift))
    extent = places.extent
    prior = np.log(extent / (2 * np.pi * (extent**2 + shift**2) ** 1.5)) - np.log(2 * np.pi)
    turns = min(2 * np.pi, np.sqrt(2 * np.pi / total) * spread / arm)
    return float(prior + np.log(2 * np.pi * spread**2 / total) + np.log(turns))
