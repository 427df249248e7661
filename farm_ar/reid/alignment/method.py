"""`align`: the motion from the snapshot's frame to the map's, and its confidence.

Motions are proposed by pairs of detections that may be pairs of labels and by single poses with headings; the
most promising are refined, weighed, and compared with one another and with there being no such motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from farm_ar.arrays import BoolArray, FloatArray, IntArray, Record
from farm_ar.reid.alignment.evidence import LOOSE_SDS, Found, nothing_stayed, weigh, weigh_exactly
from farm_ar.reid.alignment.kernels import LOOSELY, STEPS, refine
from farm_ar.reid.alignment.problem import Pose, Problem, motion_between, problem_of, proposals
from farm_ar.reid.plausibility import some
from farm_ar.reid.registration import RigidMotion
from farm_ar.scenes import Detections, Scene, Snapshot

CERTAIN = 0.95
"""Confidence from which on an alignment is called certain."""

RIVAL = 0.1
"""How probable another motion must be, by the best, to be an alternative."""

ELSEWHERE, MIRRORED = 0.1, 0.01
"""Probability that the snapshot shows another place, or is uninformative; that its frame is mirrored."""

GROUP, EACH_MORE = 3, 3.0
"""Objects from which on some may have moved as one; how much likelier each object more is to have stayed."""

ANCHORED, ANCHOR_REACH, ANCHOR_TURN = 0.98, 1.0, float(np.deg2rad(15))
"""Probability that an anchor is right; how far the motion may then be off it, by the spacing and radians."""

EXACT = 0.5
"""Probability that an anchor which is right is so exactly."""


@dataclass(frozen=True)
class Alternative:
    """Another motion that may be right.

    Args:
        motion: from the snapshot's frame to the map's.
        probability: that it is right.
    """

    motion: RigidMotion
    probability: float


@dataclass(frozen=True, eq=False)
class Alignment(Record):
    """The motion from a snapshot's frame to the map's, and its confidence.

    Args:
        motion: about the middle of the detections, metres and radians.
        confidence: probability that it is right within 5% of the spacing, there, and 2 degrees; with an
            anchor, that it is what the anchor says.
        matches: N labels, at whose place each detection is; None for what stands elsewhere.
        alternatives: other motions at least a tenth as probable, the most probable first.
        reason: why it is not certain; empty if it is.
        roughly: probability that it is the right one of all motions, however exact.
        anchored: whether it is what an anchor says.
    """

    motion: RigidMotion
    confidence: float
    matches: tuple[str | None, ...]
    alternatives: tuple[Alternative, ...] = ()
    reason: str = ""
    roughly: float = 0.0
    anchored: bool = False

    @property
    def certain(self) -> bool:
        """Whether the motion is right with a probability of `CERTAIN`."""
        return self.confidence >= CERTAIN

    @property
    def ambiguous(self) -> bool:
        """Whether other motions explain the snapshot about as well."""
        return bool(self.alternatives)

    @property
    def inliers(self) -> tuple[int, ...]:
        """The detections that are at a label's place."""
        return tuple(i for i, label in enumerate(self.matches) if label is not None)

    def apply(self, snapshot: Snapshot) -> Snapshot:
        """A snapshot in the map's frame."""
        return moved(snapshot, self.motion)


def align(scene: Scene, snapshot: Snapshot, anchor: tuple[Pose, Pose] | None = None) -> Alignment:
    """The rigid motion from the snapshot's frame to the map's.

    The frames agree in scale and handedness. Lengths count by the spacing of the map's objects, so the answer
    does not depend on the unit, nor on where either frame has its origin.

    Args:
        scene: the map.
        snapshot: camera and detections in a frame of their own.
        anchor: one pose (x, z, yaw), metres and radians, in the snapshot's frame and in the map's: what it
            says is then taken for right to about the spacing and 15 degrees.

    Raises:
        SnapshotError: the anchor is not two poses of finite numbers.
    """
    sound = np.flatnonzero(np.isfinite(snapshot.detections.position).all(axis=1))
    if len(sound) < len(snapshot.detections):
        matches: list[str | None] = [None] * len(snapshot.detections)
        rest = align(scene, some(snapshot, sound), anchor)
        for i, label in zip(sound, rest.matches, strict=True):
            matches[i] = label
        return replace(rest, matches=tuple(matches))
    start = None if anchor is None else motion_between(*anchor)
    problem = problem_of(scene, snapshot)
    found = _found(problem, start)
    if start is None and found is None:
        few = "nothing is in view" if not len(snapshot.detections) else "too few things can be distinguished"
        still = RigidMotion(problem.middle, np.zeros(2), np.array(0.0))
        return Alignment(still, 0.0, (None,) * len(snapshot.detections), reason=few)
    other = None if start is not None else _found(problem_of(scene, _mirrored(snapshot)), None)
    return _answer(problem, found, start, -np.inf if other is None else float(other.evidence.max()))


def moved(snapshot: Snapshot, motion: RigidMotion) -> Snapshot:
    """A snapshot after a motion of its frame: camera and detections."""
    camera, seen = snapshot.camera, snapshot.detections
    return replace(
        snapshot,
        camera=replace(
            camera, position=motion.position(camera.position[None])[0], yaw=camera.yaw + motion.turn
        ),
        detections=Detections.trusted(
            **vars(seen)
            | {
                "position": motion.position(seen.position),
                "yaw": motion.yaw(seen.yaw),
                "uncertainty": seen.uncertainty and seen.uncertainty.turned(float(motion.turn)),
            }
        ),
    )


def _found(problem: Problem, start: RigidMotion | None) -> Found | None:
    """Motions that differ, with their evidence; None where there are none."""
    motions = np.empty((0, 6)) if not problem.fit.size else proposals(problem)
    if start is not None and problem.fit.size:
        motions = np.vstack([problem.scaled(start), motions])
    if not len(motions):
        return None
    match = _paired(problem, motions, STEPS)
    if start is None:
        return weigh(problem, motions, match)
    says = problem.scaled(start)
    exact = weigh_exactly(problem, says[:, :3], _paired(problem, says.copy(), LOOSELY))
    loose = _paired(problem, motions.copy(), LOOSELY)
    fitted = weigh(problem, np.vstack([motions, motions]), np.vstack([match, loose]), LOOSE_SDS)
    return Found(*(np.concatenate(both) for both in zip(exact, fitted, strict=True)))


def _paired(problem: Problem, motions: FloatArray, steps: FloatArray) -> IntArray:
    """(K, N) labels of detections under motions, which are refined in these steps."""
    return refine(motions, problem.seen, problem.known, problem.fit, problem.floor, steps)


def _mirrored(snapshot: Snapshot) -> Snapshot:
    """The snapshot in a frame of the other handedness."""
    camera, seen = snapshot.camera, snapshot.detections
    sign, fov = np.array([-1.0, 1.0]), camera.fov
    return replace(
        snapshot,
        camera=replace(
            camera,
            position=camera.position * sign,
            yaw=-camera.yaw,
            fov=replace(fov, left=fov.right, right=fov.left),
        ),
        detections=replace(seen, position=seen.position * sign, yaw=-seen.yaw),
    )


class _Odds(NamedTuple):
    """Logarithms of what there is to choose from: K motions, the anchor with nothing near it, none."""

    motions: FloatArray
    anchor: float
    none: float
    mirrored: float


def _answer(problem: Problem, found: Found | None, anchor: RigidMotion | None, mirrored: float) -> Alignment:
    """The most probable motion and the alternatives, given the evidence of the mirrored frame."""
    odds = _odds(problem, found, anchor, mirrored)
    if found is not None and anchor is None:  # an anchor says what stayed
        odds = odds._replace(motions=_with_groups(odds.motions, found.match >= 0))
    total = logsumexp([*odds.motions, odds.anchor, odds.none, odds.mirrored])
    share, by_anchor = np.minimum(np.exp(odds.motions - total), 1.0), float(np.exp(odds.anchor - total))
    if found is None or by_anchor > share.max():
        assert anchor is not None
        nothing = (None,) * len(problem.snapshot.detections)
        sure = by_anchor + _by_anchor(problem, found, anchor, share)
        reason = "" if sure >= CERTAIN else _REASONS[2]
        return Alignment(anchor, sure, nothing, reason=reason, roughly=sure, anchored=True)
    order = np.argsort(-share, kind="stable")
    best = int(order[0])
    confidence, roughly = min(float(share[best] * found.close[best]), 1.0), float(share[best])
    others = [k for k in order[1:] if share[k] >= RIVAL * share[best]]
    anchored = anchor is not None and bool(_near(problem, found, anchor)[best])
    if anchor is not None and anchored:
        confidence = roughly = min(by_anchor + _by_anchor(problem, found, anchor, share), 1.0)
    alternatives = tuple(Alternative(problem.rigid(found.motions[k]), float(share[k])) for k in others)
    reason = ""
    if confidence < CERTAIN:
        reason = _REASONS[0 if np.exp(odds.mirrored - total) > 1 - CERTAIN else 1 if alternatives else 2]
    labels = problem.scene.layout.labels
    matches = tuple(None if j < 0 else labels[j] for j in found.match[best])
    motion = problem.rigid(found.motions[best])
    return Alignment(motion, confidence, matches, alternatives, reason, roughly, anchored)


def _near(problem: Problem, found: Found, anchor: RigidMotion) -> BoolArray:
    """(K,) which motions are what an anchor says, as far as it can be trusted."""
    says = problem.scaled(anchor)[0]
    off = np.linalg.norm(found.motions[:, 1:] - says[1:3], axis=1)
    turn = np.abs((found.motions[:, 0] - says[0] + np.pi) % (2 * np.pi) - np.pi)
    near: BoolArray = (off < ANCHOR_REACH) & (turn < ANCHOR_TURN)
    return near


def _by_anchor(problem: Problem, found: Found | None, anchor: RigidMotion, share: FloatArray) -> float:
    """The share of all motions that are what an anchor says."""
    return 0.0 if found is None else float(share[_near(problem, found, anchor)].sum())


def _with_groups(odds: FloatArray, there: BoolArray) -> FloatArray:
    """Odds (K,) if objects may have moved as one: that they are coherent then does not say that they stayed.

    Args:
        odds: logarithms, if each object moves on its own.
        there: (K, N) detections that are at a label's place.
    """
    best = there[odds.argmax()]
    own, its = (there & ~best).sum(axis=1), (best & ~there).sum(axis=1)
    least = odds.max() - np.log(EACH_MORE) * np.maximum(its - own, 0)
    return np.where(own >= GROUP, np.maximum(odds, least), odds)


_REASONS = (
    "mirrored, the snapshot would fit as well or better: does its frame have the map's handedness?",
    "the things look the same from several sides",
    "too few things stand where they stood",
)


def _odds(problem: Problem, found: Found | None, anchor: RigidMotion | None, mirrored: float) -> _Odds:
    """Logarithms of prior and evidence of each possibility."""
    none = float(np.log(ELSEWHERE)) + nothing_stayed(problem)
    mirrored = float(np.log(MIRRORED)) + mirrored
    evidence = np.empty(0) if found is None else found.evidence
    if anchor is None:
        return _Odds(evidence, -np.inf, none, mirrored)
    if found is not None:
        near = _near(problem, found, anchor)
        room = np.pi * ANCHOR_REACH**2 * 2 * ANCHOR_TURN / (2 * np.pi * problem.area)
        about = np.log(np.where(near, ANCHORED * (1 - EXACT) / room, 1 - ANCHORED))
        evidence = evidence + np.where(found.exact, np.log(ANCHORED * EXACT), about)
    return _Odds(evidence, none + float(np.log(ANCHORED)), none + float(np.log(1 - ANCHORED)), mirrored)
