"""How objects move: motion models, the prior of an unknown noise level, and densities of poses.

A motion model is a mixture of components, each Gaussian in x, z and heading. One component is the paper's
noise; two, a narrow and a wide one, say that most objects stay and few move far, and have heavy tails.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, ndtr

from farm_ar.arrays import FloatArray
from farm_ar.errors import OptionError
from farm_ar.reid.place import USUAL_LENGTH_M

WALL = 4.0
"""Within how many SDs of the detection noise a detection may be of an object that stands against a wall."""

_LOG_ROOT_TWO_PI = 0.5 * float(np.log(2 * np.pi))


@dataclass(frozen=True)
class Motion:
    """One way of moving: what share of the objects moves so, and how far.

    Args:
        share: of the objects, 0 to 1.
        translation_sd: of x and of z, metres, not negative.
        rotation_sd: of the heading, radians, not negative.

    Raises:
        OptionError: a value is out of its limits.
    """

    share: float
    translation_sd: float
    rotation_sd: float

    def __post_init__(self) -> None:
        if not 0 <= self.share <= 1:
            raise OptionError("share", "must be from 0 to 1", self.share)
        for name in ("translation_sd", "rotation_sd"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise OptionError(name, "must be a number not below 0", value)


@dataclass(frozen=True)
class DetectionNoise:
    """SDs of what the detector adds to a pose: x and z in metres, heading in radians; both positive.

    They are also the finest scale on which poses are compared, so that zero noise needs no special case.

    Raises:
        OptionError: a value is not positive.
    """

    position_sd: float = 0.005
    yaw_sd: float = float(np.deg2rad(0.5))

    @classmethod
    def usual(cls, length: float) -> DetectionNoise:
        """What is assumed in a scene of a length, metres: 5 mm in one of the usual length."""
        return cls(position_sd=cls.position_sd * length / USUAL_LENGTH_M)

    def __post_init__(self) -> None:
        for name in ("position_sd", "yaw_sd"):
            value = getattr(self, name)
            if not 0 < value < np.inf:
                raise OptionError(name, "must be a positive number", value)


def axis_log_density(
    detected: FloatArray, label: FloatArray, side: float | None, motion_sd: float, detection_sd: float
) -> FloatArray:
    """Log density of a detected coordinate: Gaussian motion, kept within the room, seen with Gaussian noise.

    What would leave the room stands against its wall, so a wall holds a probability of its own. A detection
    outside the room, by more than the detection noise explains, is measured without walls.

    Args:
        detected: (..., N) x or z of the detections, metres.
        label: (..., M) the same of the labels.
        side: the room reaches from 0 to here, metres; None for no walls.
        motion_sd: metres, not negative.
        detection_sd: metres, positive.

    Returns:
        (..., N, M) natural logarithms, of 1 / metre.
    """
    x, mean = np.broadcast_arrays(detected[..., :, None], label[..., None, :])
    sd = float(np.hypot(motion_sd, detection_sd))
    density: FloatArray = -0.5 * ((x - mean) / sd) ** 2 - np.log(sd) - _LOG_ROOT_TWO_PI
    if side is None or motion_sd == 0:
        return density
    near = WALL * detection_sd
    against = (np.abs(x) <= near) | (np.abs(x - side) <= near)
    if not against.any():
        return density
    # Where the object really stands, given the detection, if no wall had stopped it.
    narrow = motion_sd * detection_sd / sd
    between = mean + (x - mean) * (motion_sd / sd) ** 2
    free = density + np.log(np.maximum(ndtr((side - between) / narrow) - ndtr(-between / narrow), 1e-300))
    low = log_ndtr(-mean / motion_sd) - 0.5 * (x / detection_sd) ** 2
    high = log_ndtr((mean - side) / motion_sd) - 0.5 * ((x - side) / detection_sd) ** 2
    walls = np.logaddexp(low, high) - np.log(detection_sd) - _LOG_ROOT_TWO_PI
    return np.where(against, np.logaddexp(free, walls), density)


def heading_log_density(turn: FloatArray, period: FloatArray | float, sd: float) -> FloatArray:
    """Log density of a detected heading: wrapped Gaussian, the same after each period of a symmetric object.

    Args:
        turn: (...) detected less known heading, radians; NaN where one of them is not known.
        period: (...) of the object's symmetry, radians: 2 pi for none, 0 where no turn can be seen.
        sd: of motion and detection together, radians, positive.

    Returns:
        (...) natural logarithms, of 1 / radian of a full turn.
    """
    full = 2 * np.pi
    turn, period = np.broadcast_arrays(
        np.asarray(turn, dtype=np.float64), np.asarray(period, dtype=np.float64)
    )
    seen = (period > 0) & ~np.isnan(turn)
    length = np.where(seen, period, full)
    offset = turn - length * np.round(turn / length)
    # Two forms of one sum: over periods where narrow, over harmonics (Poisson summation) where wide.
    harmonic = np.ones(turn.shape)
    direct = np.zeros(turn.shape)
    for k in range(1, 5):
        wave = k * full / length
        harmonic = harmonic + 2 * np.exp(-0.5 * (wave * sd) ** 2) * np.cos(wave * offset)
    nearest = -0.5 * (offset / sd) ** 2
    for k in range(-4, 5):
        direct = direct + np.exp(-0.5 * ((offset - k * length) / sd) ** 2 - nearest)
    narrow = nearest + np.log(direct) - np.log(sd) - _LOG_ROOT_TWO_PI + np.log(length / full)
    wide = np.log(np.maximum(harmonic, 1e-300)) - np.log(full)
    result: FloatArray = np.where(seen, np.where(sd < length / 3, narrow, wide), -np.log(full))
    return result


def motion_log_density(
    detected_position: FloatArray,
    detected_yaw: FloatArray,
    label_position: FloatArray,
    label_yaw: FloatArray,
    motions: Sequence[Motion],
    noise: DetectionNoise,
    room: tuple[float, float] | None = None,
    period: FloatArray | float = 2 * np.pi,
) -> FloatArray:
    """Log density of each detection's pose if it is of each label, under a mixture of motions.

    Args:
        detected_position: (..., N, 2) metres.
        detected_yaw: (..., N) radians.
        label_position: (..., M, 2) metres.
        label_yaw: (..., M) radians.
        motions: the components; their shares need not sum to 1.
        noise: of the detector.
        room: width and depth of the room that nothing leaves, metres; None for no walls.
        period: (..., M) of each label's symmetry, radians: 2 pi for none, 0 where no turn can be seen.

    Returns:
        (..., N, M) natural logarithms, of 1 / (square metre radian).
    """
    turn = detected_yaw[..., :, None] - label_yaw[..., None, :]
    periods = np.asarray(period, dtype=np.float64)[..., None, :] if np.ndim(period) else period
    width, depth = room if room is not None else (None, None)
    total: FloatArray = np.full(turn.shape, -np.inf)
    for motion in motions:
        if motion.share > 0:
            part = np.log(motion.share) + heading_log_density(
                turn, periods, float(np.hypot(motion.rotation_sd, noise.yaw_sd))
            )
            for axis, side in ((0, width), (1, depth)):
                part = part + axis_log_density(
                    detected_position[..., axis],
                    label_position[..., axis],
                    side,
                    motion.translation_sd,
                    noise.position_sd,
                )
            total = np.logaddexp(total, part)
    return total


FEW_MOVED = 0.2
"""Share of the objects that move where most objects stay; `ANYWHERE` included."""

ANYWHERE = 0.1
"""Share of the objects that end up anywhere, with an SD of half the scene's length."""

STAYED = ((0.02, 3.0), (0.1, 10.0))
"""SDs, metres and degrees, of those that stay."""

MOVED_FAR = ((0.8, 60.0), (1.6, 90.0))
"""SDs, metres and degrees, of those that move."""

Mixture = tuple[Motion, ...]


@dataclass(frozen=True)
class NoisePrior:
    """A weak prior over how much objects move: all of them somewhat, or few of them far.

    Metres are those of a scene of the usual length (`place.USUAL_LENGTH_M`); they shrink and grow with it.
    The least of them, and what stays, do not grow beyond the look-alikes' spacing: in a warehouse of many
    objects close together they stay small, and further levels reach down to them.

    Args:
        translation_m: least and greatest SD of x and of z, metres.
        rotation_deg: least and greatest SD of the heading, degrees.
        levels: how many SDs of each are tried at the least, evenly spaced by ratio.
        few_move_far: probability that most objects stay and few move far.

    Raises:
        OptionError: a value is out of its limits.
    """

    translation_m: tuple[float, float] = (0.08, 1.2)
    rotation_deg: tuple[float, float] = (10.0, 140.0)
    levels: tuple[int, int] = (6, 5)
    few_move_far: float = 0.2

    def __post_init__(self) -> None:
        for name in ("translation_m", "rotation_deg"):
            least, greatest = getattr(self, name)
            if not 0 < least <= greatest < np.inf:
                raise OptionError(name, "must be two positive numbers, the smaller first", (least, greatest))
        if len(self.levels) != 2 or min(self.levels) < 1:
            raise OptionError("levels", "must be two whole numbers from 1 on", self.levels)
        if not 0 <= self.few_move_far <= 1:
            raise OptionError("few_move_far", "must be a probability", self.few_move_far)

    def models(self, length: float, fine: float | None = None) -> list[tuple[float, Mixture]]:
        """The probability of each motion model, and its components.

        Args:
            length: of the scene, metres.
            fine: the length by which the least motions are measured, at most the scene's, as by default.
        """
        fine = length if fine is None else fine
        scale, small = length / USUAL_LENGTH_M, fine / USUAL_LENGTH_M
        least, greatest = small * self.translation_m[0], scale * self.translation_m[1]
        shifts = np.geomspace(least, greatest, self._levels(length / fine))
        turns = np.deg2rad(np.geomspace(*self.rotation_deg, self.levels[1]))
        all_move: list[Mixture] = [(Motion(1.0, float(s), float(t)),) for s in shifts for t in turns]
        few_move: list[Mixture] = [
            (
                Motion(1 - FEW_MOVED, small * stay_m, float(np.deg2rad(stay_deg))),
                Motion(FEW_MOVED - ANYWHERE, scale * far_m, float(np.deg2rad(far_deg))),
                Motion(ANYWHERE, length / 2, float(np.deg2rad(self.rotation_deg[1]))),
            )
            for stay_m, stay_deg in STAYED
            for far_m, far_deg in MOVED_FAR
        ]
        families = ((1 - self.few_move_far, all_move), (self.few_move_far, few_move))
        return [(share / len(some), one) for share, some in families if share > 0 for one in some]

    def _levels(self, times: float) -> int:
        """How many levels there are where the least SD is so many times smaller beside the greatest."""
        least, greatest = self.translation_m
        usual = self.levels[0]
        if usual < 2 or greatest == least:
            return usual
        return usual + math.ceil((usual - 1) * math.log(times) / math.log(greatest / least) - 1e-9)


@dataclass(frozen=True)
class Rates:
    """How often what is in view is missed, and how often what is detected has no label: new, or not there.

    Args:
        probability: of these rates, where several are thought possible.
        miss_rate: probability that what is in view is not detected, 0 to below 1.
        none_rate: expected detections a snapshot of what has no label, not negative.

    Raises:
        OptionError: a value is out of its limits.
    """

    probability: float = 1.0
    miss_rate: float = 0.0
    none_rate: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.probability <= 1:
            raise OptionError("probability", "must be above 0 and at most 1", self.probability)
        if not 0 <= self.miss_rate < 1:
            raise OptionError("miss_rate", "must be from 0 to below 1", self.miss_rate)
        if not 0 <= self.none_rate < np.inf:
            raise OptionError("none_rate", "must be a number not below 0", self.none_rate)


MOSTLY_RELIABLE: Sequence[Rates] = (Rates(0.95, 0.02, 0.01), Rates(0.05, 0.15, 0.4))
"""A detector that is most probably good, and may be poor: what is assumed if nothing is said."""
