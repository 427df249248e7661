"""The arrays that the compiled kernels of `LikelihoodReid` take and fill."""

from __future__ import annotations

from typing import NamedTuple

from farm_ar.arrays import BoolArray, FloatArray, IntArray


class Labels(NamedTuple):
    """The M labels of a scene.

    Args:
        position: (M, 2) metres.
        yaw: (M,) radians.
        elevation: (M,) metres.
        category: (M,) codes, from 0.
        sides: (M, 3) sorted logarithms of the sides.
        period: (M,) of symmetry, radians; 0 where no turn can be seen.
        table: (M,) which heading table is each label's.
        fixed: (M,) what never moves.
        room: (2,) width and depth of the room in whose frame all poses are, metres; infinite for no walls.
    """

    position: FloatArray
    yaw: FloatArray
    elevation: FloatArray
    category: IntArray
    sides: FloatArray
    period: FloatArray
    table: IntArray
    fixed: BoolArray
    room: FloatArray


class Models(NamedTuple):
    """The K models that are averaged: mixtures of up to P of the A x B scales of motion, and rates.

    Args:
        translation_sd: (A,) metres; the first is that of what never moves, 0.
        part: (K, P, 2) which translation and which rotation scale.
        share: (K, P) of the parts; 0 for none.
        log_prior: (K,) of the models.
        detect_rate: (K,) probability that what is in view is detected.
        none_rate: (K,) expected detections a snapshot of what has no label.
        heading: (B, U, G) density of a turn for each scale, kind of symmetry and G turns from 0 to half a
            period; the first scale is that of what never moves.
        turn_sd: (B,) of the headings on each scale, the detector's noise included, radians.
        sharpness: (B,) their concentration, 1 / rad^2.
        offset: (Q, 2) equally probable points that stand for the standard normal distribution: to the right
            of a camera's heading and along it, so that they turn with it; symmetric about it.
    """

    translation_sd: FloatArray
    part: IntArray
    share: FloatArray
    log_prior: FloatArray
    detect_rate: FloatArray
    none_rate: FloatArray
    heading: FloatArray
    turn_sd: FloatArray
    sharpness: FloatArray
    offset: FloatArray


class Detecting(NamedTuple):
    """What is known of the detector and of what goes.

    Args:
        position_sd: metres.
        log_side_sd: of the logarithms of the sides.
        category: (C + 1, C) probability of a detected category, the last row that of none, for each true one.
        gone_rate: probability that a label's object is gone.
        height_sd: by which heights distinguish labels, metres; infinite where they do not.
    """

    position_sd: float
    log_side_sd: float
    category: FloatArray
    gone_rate: float
    height_sd: float


class View(NamedTuple):
    """What a camera sees.

    Args:
        left: cosine of the angle seen to the left of its heading.
        right: cosine of that to the right.
        range_m: metres.
        up: angle above its line of sight, radians.
        down: angle below it, radians.
        vertical: whether these two limits count.
        area: over which what has no label may be, square metres.
        occlusion: whether what stands behind a detection counts as not in view.
    """

    left: float
    right: float
    range_m: float
    up: float
    down: float
    vertical: bool
    area: float
    occlusion: bool


class Known(NamedTuple):
    """What does not change from one snapshot to the next.

    Args:
        labels: where they stood.
        models: of how each label moves.
        detecting: of the detector.
        camera: what every camera sees.
    """

    labels: Labels
    models: Models
    detecting: Detecting
    camera: View


class Eyes(NamedTuple):
    """Where B snapshots were taken from: position (B, 2), yaw, pitch and height (B,)."""

    position: FloatArray
    yaw: FloatArray
    pitch: FloatArray
    height: FloatArray


class Found(NamedTuple):
    """The detections of B snapshots, rows padded to K.

    Args:
        number: (B,) detections in each.
        position: (B, K, 2) metres.
        yaw: (B, K) radians.
        category: (B, K) codes, `UNKNOWN` where not known.
        sides: (B, K, 3) sorted logarithms of the sides.
        half: (B, K, 2) half the width and depth, metres.
        elevation: (B, K) metres; NaN where not known.
        false: (B, K) false detections like it that are to be expected, by the detector's own confidence.
        spread: (B, K, 3) SDs of x, z, metres, and of the yaw, radians, as the detector has them; 0 where it
            does not know.
        cross: (B, K) covariance of the errors of x and z, square metres.
        rival: (B, K) the second most probable heading, radians.
        rival_weight: (B, K) its probability; 0 for none.
    """

    number: IntArray
    position: FloatArray
    yaw: FloatArray
    category: IntArray
    sides: FloatArray
    half: FloatArray
    elevation: FloatArray
    false: FloatArray
    spread: FloatArray
    cross: FloatArray
    rival: FloatArray
    rival_weight: FloatArray


class Reach(NamedTuple):
    """Where M labels may be found, from where they are taken to stand, on each scale of motion.

    Args:
        place: (A, N, M) density of each detection's place.
        heading: (B, N, M) density of each detection's heading.
        inside: (A, M) probability of being in view.
    """

    place: FloatArray
    heading: FloatArray
    inside: FloatArray


class Ways(NamedTuple):
    """What K models say of N detections of M labels.

    Args:
        weight: (K, N, M) of each label, relative to its not being seen; rows are divided by their largest.
        none: (K, N) of no label, likewise.
        unseen: (K, M) probability that each label is not seen.
        log_unseen: (K,) log probability that none is.
        each: (K, N, M + 1) marginals under each model that counts.
        posterior: (K,) probability of each model.
    """

    weight: FloatArray
    none: FloatArray
    unseen: FloatArray
    log_unseen: FloatArray
    each: FloatArray
    posterior: FloatArray


class Answer(NamedTuple):
    """What is found out of B snapshots; the last three are filled only as far as they have room.

    Args:
        label: (B, K) index of the label of each detection, `UNKNOWN` for none.
        cost: (B, K) expected errors, 1 less the probability of the label; NaN for none.
        margin: (B, K) rise of their sum if the detection must give up its label; NaN where it has none.
        runner_up: (B, K) the label it then has, `UNKNOWN` for none.
        confidence: (B, K) probability of what was answered, a label or none.
        exact: (B,) whether the marginals of the most probable model are exact.
        probability: (B or 0, K, M + 1) of each label and of none.
        gone: (B or 0, M) probability that a label's object is gone.
        posterior: (B or 0, K) probability of each model.
    """

    label: IntArray
    cost: FloatArray
    margin: FloatArray
    runner_up: IntArray
    confidence: FloatArray
    exact: BoolArray
    probability: FloatArray
    gone: FloatArray
    posterior: FloatArray
