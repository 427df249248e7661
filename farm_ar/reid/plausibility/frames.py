"""Whether a snapshot is written down in another frame, unit or convention than the map."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.geometry import bearing, direction, distance
from farm_ar.geometry.angles import wrap
from farm_ar.reid.plausibility.finding import Finding
from farm_ar.reid.plausibility.motions import EQUAL, best_motions
from farm_ar.reid.plausibility.patterns import (
    MOST_DETECTIONS,
    Places,
    Variant,
    log_evidence,
    log_mean,
    may_be,
    places_of,
)
from farm_ar.reid.plausibility.sizes import UNITS
from farm_ar.reid.registration import RigidMotion
from farm_ar.scenes import Camera, Scene, Snapshot, World

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

FEWEST, MOST_LABELS = 3, 200
"""Detections from which on, and labels up to which, a motion of the frame is looked for."""

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
    negated, less, around = -yaw, np.pi / 2 - yaw, np.pi - yaw
    mirrored: list[tuple[str, Variant]] = []
    for pivot in (np.zeros(2), middle):
        mirrored += _mirrored(position, (negated, around, yaw), pivot, world)
    exchanged, there = " and ".join(sorted(world.floor_axes)), position[:, ::-1]
    for turned in (less, yaw, negated):
        mirrored.append((f"{exchanged} exchanged", Variant(there, turned, 0.0, True)))
    units = []
    coordinates = np.count_nonzero(position)  # what is exactly 0 is so in any unit
    for name, metres in UNITS.items():
        for factor, how in ((metres, f"taken as {name}"), (1 / metres, f"with the map taken as {name}")):
            units.append((how, Variant(position * factor, yaw, coordinates * float(np.log(factor)))))
    ways = {
        "negated": negated,
        f"as {'90' if world.frame == 'unity' else '-90'}° less themselves": less,
        "as 180° less themselves": around,
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
    position: FloatArray, headings: Sequence[FloatArray], pivot: FloatArray, world: World
) -> Iterator[tuple[str, Variant]]:
    for axis, sides in zip(world.floor_axes, ((-1.0, 1.0), (1.0, -1.0)), strict=True):
        there = pivot + (position - pivot) * sides
        for turned in headings:
            yield f"{axis} the other way", Variant(there, turned, 0.0, True)


def _moved(places: Places, category: IntArray, given: Variant, world: World) -> Iterator[Ratio]:
    """A frame moved as a whole, mirrored or not, with the evidence in place of a ratio."""
    if len(category) < FEWEST or len(places.yaw) > MOST_LABELS:
        return
    mirror = given.position * [1.0, -1.0]
    for kind, position, headings in (
        ("frame", given.position, (given.yaw,)),
        ("mirrored", mirror, (np.pi - given.yaw, -given.yaw, given.yaw)),
    ):
        best: tuple[float, RigidMotion] | None = None
        for one, log_share in _best_motions(places, category, position):
            there = one.position(position)
            variants = [Variant(there, one.yaw(yaw), log_share, kind == "mirrored") for yaw in headings]
            mine = float(log_mean(log_evidence(places, category, variants)[None])[0])
            best = (mine, one) if best is None or mine > best[0] + EQUAL else best
        if best is None:
            continue
        evidence, motion = best
        there = motion.position(position)
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


def _best_motions(
    places: Places, category: IntArray, position: FloatArray
) -> Iterator[tuple[RigidMotion, float]]:
    """The rigid motions that best take the detections to labels; and logarithms of their shares of all."""
    position, allowed = np.ascontiguousarray(position), may_be(places, category)
    for found in best_motions(position, allowed, places.position, places.spacing, places.extent):
        yield RigidMotion(found[:2], found[2:4], found[4]), float(found[5])
