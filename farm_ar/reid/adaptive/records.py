"""The arrays that the kernels of `AdaptiveReid` take and fill; lengths are in units of the spacing."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from farm_ar.arrays import BoolArray, FloatArray, IntArray


class Profile(IntEnum):
    """Profiles of how far objects move.

    A ring is that of objects that all go about as far, a ray that of speeds from none on (half-normal); ahead
    is Gaussian about a place ahead of each object; even is the same everywhere; the last four are Gaussian
    about a motion that all share: a shift, with a turn, with a speed along each object's own heading, or with
    stretching and shearing.
    """

    GAUSSIAN = 0
    EXPONENTIAL = 1
    STUDENT = 2
    RING = 3
    RAY = 4
    AHEAD = 5
    EVEN = 6
    TOGETHER = 7
    TURNING = 8
    STREAMING = 9
    BENDING = 10


class Profiles(NamedTuple):
    """The R profiles of shifts that are tried.

    Args:
        kind: (R,) which.
        length: (R,) their scale; for a ring its radius.
        width: (R,) SD of the logarithm of a ring's radius; ahead, SD as a share of the length.
    """

    kind: IntArray
    length: FloatArray
    width: FloatArray


class Motions(NamedTuple):
    """The H motions that are tried: a profile, how exactly headings are kept, and how many move anywhere.

    Those that differ in the informativeness of headings only make up a group and stand together.

    Args:
        group: (G + 1,) where each group begins.
        profile: (H,) indices.
        heading: (H,) indices of the concentrations of turns.
        course: (H,) indices of the concentrations of courses about the heading; -1 for any course.
        far: (H,) share of the objects that go anywhere, turned anyhow.
        beyond: (H,) index of the profile by which these go instead; -1 for anywhere.
        scale: (H,) index of the scale, for what is in view.
        log_prior: (H,) natural logarithms.
    """

    group: IntArray
    profile: IntArray
    heading: IntArray
    course: IntArray
    far: FloatArray
    beyond: IntArray
    scale: IntArray
    log_prior: FloatArray


class Concentrations(NamedTuple):
    """Von Mises distributions of angles: of turns and of courses, with a share of outliers each.

    Args:
        turn: (T,) concentrations, one of them 0: headings are uninformative.
        turn_peak: (T,) density at no turn.
        fold: (T,) into how many equal parts of a whole turn: 2 if what is turned by half looks the same, 4 if
            by a quarter.
        shared: (T,) whether turns are counted from one that all share.
        anyone: (T,) whether a heading is that of any of the objects with a turn: it does not identify it.
        course: (C,) concentrations.
        course_peak: (C,) density at the heading.
        outliers: share of turns that are of any size.
        astray: share of courses of any direction.
    """

    turn: FloatArray
    turn_peak: FloatArray
    fold: IntArray
    shared: BoolArray
    anyone: BoolArray
    course: FloatArray
    course_peak: FloatArray
    outliers: float
    astray: float


class Errors(NamedTuple):
    """What detectors say of their errors, for each of P pairs; arrays of none where they say nothing.

    Args:
        wide: (P,) largest variance of the place, square spacings.
        narrow: (P,) least variance.
        along: (P,) squared cosine of the angle between the shift and the direction of the largest.
        turn: (P,) variance of the turn, in periods of the symmetry as `Pairs.turn`.
        rival_turn: (P,) cosine of the turn to the second most probable heading.
        rival_weight: (P,) its probability.
    """

    wide: FloatArray
    narrow: FloatArray
    along: FloatArray
    turn: FloatArray
    rival_turn: FloatArray
    rival_weight: FloatArray


class Pairs(NamedTuple):
    """The P pairs of one of N detections and one of M labels that could be the same, detection by detection.

    Args:
        start: (N + 1,) where each detection's pairs begin.
        label: (P,) indices.
        from_x: (P,) where the label stood.
        from_z: (P,) likewise.
        shift_x: (P,) from there to the detection.
        shift_z: (P,) likewise.
        distance: (P,) between the two places.
        turn: (P,) cosine of the turn, in periods of the symmetry.
        turn_sine: (P,) its sine.
        turned: (P,) whether that is known.
        course: (P,) cosine of the angle from the mean of the two headings to the shift.
        course_known: (P,) how well that is known: 1 with both headings, .5 with one, 0 with none.
        ahead_x: (P,) of the unit vector along the mean of the two headings; 0 where not known.
        ahead_z: (P,) likewise.
        vertical: (A, P) how much likelier the rise is, for each scale, than any; no rows where all is level.
        size: (W, P) how much likelier the sizes are for each reliability of sizes than for any object.
        like: (P,) weight of all else: category, hint.
        stays: (P,) whether the label's object never moves.
        far: (P,) density of a place for what has gone anywhere: even over all places.
        farther: (P,) the same, even by the ratio of distances.
        errors: what detectors say of theirs.
    """

    start: IntArray
    label: IntArray
    from_x: FloatArray
    from_z: FloatArray
    shift_x: FloatArray
    shift_z: FloatArray
    distance: FloatArray
    turn: FloatArray
    turn_sine: FloatArray
    turned: BoolArray
    course: FloatArray
    course_known: FloatArray
    ahead_x: FloatArray
    ahead_z: FloatArray
    vertical: FloatArray
    size: FloatArray
    like: FloatArray
    stays: BoolArray
    far: FloatArray
    farther: FloatArray
    errors: Errors


class Common(NamedTuple):
    """A motion that all share.

    Args:
        x, z: the place about which it turns.
        east, north: the shift.
        xx, xz, zx, zz: where it takes one unit east (first letter x) or north: 1, 0, 0, 1 if all go alike.
        ahead: how far each object goes along its own heading besides.
        total: of how many objects it was found.
        freedom: log of the share that counts of the prior of what it does besides shifting.
    """

    x: float
    z: float
    east: float
    north: float
    xx: float
    xz: float
    zx: float
    zz: float
    ahead: float
    total: float
    freedom: float


class DetectionModel(NamedTuple):
    """What is known of detecting.

    Args:
        in_view: (A, M) probability that each label's object is in view, for each scale of motion.
        anywhere: (M,) the same if it has gone anywhere.
        none: (N,) density of each detection if it has no label, for one such expected.
        unseen: (Q,) rates at which what is in view is missed or gone.
        new: (Q,) expected detections without a label.
        log_rates: (Q,) natural logarithms of the priors of these rates.
        log_sizes: (W,) the same of the reliabilities of sizes.
    """

    in_view: FloatArray
    anywhere: FloatArray
    none: FloatArray
    unseen: FloatArray
    new: FloatArray
    log_rates: FloatArray
    log_sizes: FloatArray


class Sparse(NamedTuple):
    """Weights of N detections for labels, those that are not negligible, detection by detection.

    Args:
        start: (N + 1,) where each detection's weights begin.
        label: (P,) indices.
        pair: (P,) which pair each is.
        weight: (P,) relative to the detection's largest.
        none: (N,) weight of no label.
    """

    start: IntArray
    label: IntArray
    pair: IntArray
    weight: FloatArray
    none: FloatArray


class Table(NamedTuple):
    """Densities of all pairs.

    Args:
        shift: (R, P) of the shifts of each profile, in the plane.
        turn: (T, P) of turns, 1 / radian.
        course: (C, P) how much likelier a course is than any.
        far: (P,) of what has gone anywhere, place and turn.
        penalty: (R,) log of the share of a shared motion's prior that counts.
        swing: (R, 3) of each shared motion: sine and cosine of its turn, and how many headings that rests on.
        angles: of turns and courses.
    """

    shift: FloatArray
    turn: FloatArray
    course: FloatArray
    far: FloatArray
    penalty: FloatArray
    swing: FloatArray
    angles: Concentrations
