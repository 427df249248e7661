"""The arrays that the compiled kernels of `RelationalReid` take and fill."""

from __future__ import annotations

from typing import NamedTuple

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.reid.likelihood.records import Detecting, Eyes, Found, Labels, Models, View


class Known(NamedTuple):
    """What does not change from one snapshot to the next.

    Args:
        labels: where they stood.
        models: of how each label moves.
        detecting: of the detector.
        camera: what every camera sees.
        sharpness: (B,) concentration of the headings on each scale of rotation, 1 / rad^2.
    """

    labels: Labels
    models: Models
    detecting: Detecting
    camera: View
    sharpness: FloatArray


class Sight(NamedTuple):
    """N detections, seen by one camera or by several between them.

    Args:
        eyes: the cameras.
        found: the detections, a row for each camera, all alike.
        like: (N, M) likelihood of each detection's looks for each label.
        nothing: (N,) density of a detection without a label, for each that is expected.
    """

    eyes: Eyes
    found: Found
    like: FloatArray
    nothing: FloatArray


class Reach(NamedTuple):
    """Where labels may be found, from where they are taken to stand, on each scale of motion.

    Args:
        place: (A, N, M) density of each detection's place.
        heading: (B, N, M) density of each detection's heading.
        inside: (A, M) probability of being in view.
    """

    place: FloatArray
    heading: FloatArray
    inside: FloatArray


class Alone(NamedTuple):
    """How likely each label is for each detection under each of K models, if it moved alone.

    Args:
        density: (K, N, M) of the detections' poses.
        inside: (K, M) probability of being in view.
        weight: (K, N, M) of each label, relative to its not being seen.
        log_unseen: (K, M) log probability of not being seen.
    """

    density: FloatArray
    inside: FloatArray
    weight: FloatArray
    log_unseen: FloatArray


class Group(NamedTuple):
    """Labels that may have moved as one, and how they may have.

    Args:
        label: (G,) which labels.
        member: (G,) probability that each is one of them.
        labels: (G,) room for where they stand when they have moved.
        pivot: (2,) what the motion turns about, metres.
        shift_precision: of each coordinate of the pivot's shift, 1 / m^2; its mean is 0.
        turn_concentration: of the turn, 1 / rad^2; its mean is 0.
    """

    label: IntArray
    member: FloatArray
    labels: Labels
    pivot: FloatArray
    shift_precision: float
    turn_concentration: float


class Groups(NamedTuple):
    """Q groups, each around its first label, of up to G labels.

    Args:
        size: (Q,) how many labels each has.
        label: (Q, G) which.
        member: (Q, G) probability that each is one of them.
        shift_precision: (Q,) as in `Group`.
        turn_concentration: (Q,) likewise.
    """

    size: IntArray
    label: IntArray
    member: FloatArray
    shift_precision: FloatArray
    turn_concentration: FloatArray


class Outcome(NamedTuple):
    """What K models say of a snapshot.

    Args:
        evidence: (K,) log evidence of each model, its prior included.
        chance: (K, N, M + 1) marginal probabilities under each.
        unseen: (K, M) probability that each label is not seen.
    """

    evidence: FloatArray
    chance: FloatArray
    unseen: FloatArray


class Search(NamedTuple):
    """How motions of a group are looked for.

    Args:
        translation_scale: index of the scale of translation at which they are judged.
        rotation_scale: that of rotation.
        wide: share of the labels that may have moved on the widest scales instead.
        longest: farthest that a label may have moved with its group, metres.
        most_turned: radians.
        tolerance: by how much two detections' distance may differ from that of two labels, metres.
    """

    translation_scale: int
    rotation_scale: int
    wide: float
    longest: float
    most_turned: float
    tolerance: float
