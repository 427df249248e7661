"""The arrays that the compiled kernels of `RelationalReid` take and fill."""

from __future__ import annotations

from typing import NamedTuple

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.reid.likelihood.records import Eyes, Found, Labels, Reach, Ways


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


class Frame(NamedTuple):
    """Detections in a frame, and what is known of labels that move alone in it.

    Args:
        sight: the detections.
        reach: where the labels may be found.
        alone: the weight of each, and how probably it is not seen.
    """

    sight: Sight
    reach: Reach
    alone: Ways


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


class Outcome(NamedTuple):
    """What K models say of a snapshot.

    Args:
        evidence: (K,) log evidence of each model, its prior and the motion's included.
        likely: (K,) log probability of the motion before anything was seen, and of those that do as well.
        chance: (K, N, M + 1) marginal probabilities under each.
        unseen: (K, M) probability that each label is not seen.
    """

    evidence: FloatArray
    likely: FloatArray
    chance: FloatArray
    unseen: FloatArray


class Work(NamedTuple):
    """What one step of fitting a motion needs.

    Args:
        use: (K,) the models to consider.
        weight: (K, N, M) of each label; changed where it is used.
        together: (K, N, G) share of it that is due to moving as one.
        log_unseen: (K,) log probability that no label is seen.
        to_row: (N, M) messages of belief propagation: where to start from, and where it ended.
        none: (N,) weight of no label.
        sums: (K, 7) what the likeliest motion follows from, as `add_pair` has it.
    """

    use: BoolArray
    weight: FloatArray
    together: FloatArray
    log_unseen: FloatArray
    to_row: FloatArray
    none: FloatArray
    sums: FloatArray


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
