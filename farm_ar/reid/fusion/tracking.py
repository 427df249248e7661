"""Several snapshots of a world that does not change between them, fused into one answer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from farm_ar.arrays import FloatArray, IntArray, Record, read_only
from farm_ar.errors import SnapshotError
from farm_ar.geometry import diameter, wrap
from farm_ar.reid.answers import Assurance, Identification
from farm_ar.reid.base import Reidentifier, as_reidentifier
from farm_ar.reid.fusion.association import Association, associate, mean_place, mean_yaw
from farm_ar.reid.fusion.joining import Precision, Seen, precision_of
from farm_ar.scenes import UNKNOWN, Camera, Detections, Snapshot, Uncertainty


@dataclass(frozen=True, eq=False)
class Tracking(Record):
    """What T snapshots say together: K objects, and which label each is.

    Args:
        identifications: the answer to each snapshot in the light of all.
        objects: what was detected, each once: the mean of its detections, exact ones counting more.
        object_of: T arrays, which object each detection is of.
        position_sd: (K,) of each coordinate of an object's place, metres, were the errors of its detections
            independent; NaN after a single snapshot.
        yaw_sd: (K,) of its heading, radians; likewise.
        identification: the answer for the objects. Its `probability` is what each label is believed to be.
    """

    identifications: tuple[Identification, ...]
    objects: Detections
    object_of: tuple[IntArray, ...]
    position_sd: FloatArray
    yaw_sd: FloatArray
    identification: Identification

    def __post_init__(self) -> None:
        object.__setattr__(self, "object_of", tuple(read_only(one, np.int64) for one in self.object_of))
        for name in ("position_sd", "yaw_sd"):
            object.__setattr__(self, name, read_only(getattr(self, name), np.float64))

    def whereabouts(self, label: str) -> Whereabouts:
        """Where a label is believed to be.

        Raises:
            SnapshotError: it is not one of the labels considered.
        """
        answer = self.identification
        candidates = answer.candidates
        if label not in candidates:
            raise SnapshotError("label", f"must be one of {', '.join(candidates)}", label)
        if answer.probability is not None:
            probability = answer.probability[:, candidates.index(label)]
        else:
            probability = np.array([1.0 if given == label else 0.0 for given in answer.labels])
        return Whereabouts(label, probability, self.objects.position, self.objects.yaw)


@dataclass(frozen=True, eq=False)
class Whereabouts(Record):
    """Where one label is believed to be: a distribution over K objects, and not having been seen.

    Args:
        label: whose.
        probability: (K,) of its being each object; what they lack of 1 is that it was not seen.
        position: (K, 2) of the objects, metres.
        yaw: (K,) radians.
    """

    label: str
    probability: FloatArray
    position: FloatArray
    yaw: FloatArray

    def __post_init__(self) -> None:
        for name in ("probability", "position", "yaw"):
            object.__setattr__(self, name, read_only(getattr(self, name), np.float64))

    @property
    def unseen(self) -> float:
        """Probability that it was not seen."""
        return max(0.0, 1.0 - float(self.probability.sum()))

    @property
    def likeliest(self) -> int | None:
        """The object that it most probably is; None if it was more probably not seen."""
        if not len(self.probability) or self.probability.max() < self.unseen:
            return None
        return int(self.probability.argmax())


def track(reid: Reidentifier, snapshots: Sequence[Snapshot]) -> Tracking:
    """Identify what several snapshots show, together.

    Nothing is taken to move between the snapshots, which may come in any order. Their detections are first
    grouped into objects (`associate`); these are then identified at once, so that no label is given to two
    objects of the whole sequence, and every snapshot is answered in the light of all others, earlier ones
    and later ones. One snapshot gives exactly what `identify` gives.

    The method `identify_objects` is given all cameras; by default it takes the objects for a snapshot from
    the last one.

    Args:
        reid: the re-identifier.
        snapshots: at least one; some may be empty.

    Raises:
        SnapshotError: there is no snapshot, or the re-identifier refuses one.
    """
    return track_all([reid], snapshots)[0]


def track_all(reids: Sequence[Reidentifier], snapshots: Sequence[Snapshot]) -> list[Tracking]:
    """What each of several methods says of the same snapshots, as `track` gives it; grouped once for all."""
    if not snapshots:
        raise SnapshotError("snapshots", "must be at least one", len(snapshots))
    if len(snapshots) == 1:
        return [_alone(reid.identify(snapshots[0]), snapshots[0]) for reid in reids]
    found = _associated(snapshots)
    count = np.array([len(one.detections) for one in snapshots])
    object_of = tuple(np.split(found.object_of, np.cumsum(count)[:-1]))
    objects, precision = _fused(snapshots, found)
    cameras = [one.camera for one in snapshots]
    answers = [as_reidentifier(reid).identify_objects(objects, cameras) for reid in reids]
    return [
        Tracking(
            identifications=tuple(_share(answer, index) for index in object_of),
            objects=objects,
            object_of=object_of,
            position_sd=found.position_sd / np.sqrt(_of_each_coordinate(precision.place)),
            yaw_sd=found.yaw_sd / np.sqrt(precision.turn),
            identification=answer,
        )
        for answer in answers
    ]


def objects_of(snapshots: Sequence[Snapshot]) -> tuple[Detections, tuple[IntArray, ...]]:
    """The objects that several snapshots show, each once, and which object each detection is of.

    Args:
        snapshots: at least one, in any order, between which nothing moved.
    """
    if len(snapshots) == 1:
        return snapshots[0].detections, (np.arange(len(snapshots[0].detections)),)
    found = _associated(snapshots)
    count = np.array([len(one.detections) for one in snapshots])
    objects, _ = _fused(snapshots, found)
    return objects, tuple(np.split(found.object_of, np.cumsum(count)[:-1]))


def _alone(answer: Identification, snapshot: Snapshot) -> Tracking:
    """What one snapshot says: how exact its poses are is not known."""
    n = len(snapshot.detections)
    nothing = np.full(n, np.nan)
    return Tracking((answer,), snapshot.detections, (np.arange(n),), nothing, nothing, answer)


def _associated(snapshots: Sequence[Snapshot]) -> Association:
    seen = [one.detections for one in snapshots]
    names = sorted({name for one in seen for name in one.category if name is not None})
    codes = {name: code for code, name in enumerate(names)} | {None: UNKNOWN}
    position = np.concatenate([one.position for one in seen])
    every = Seen(
        np.repeat(np.arange(len(seen)), [len(one) for one in seen]),
        np.array([codes[name] for one in seen for name in one.category], dtype=np.int64),
        position,
        np.concatenate([np.where(_rivals(one)[1] > 0, np.nan, one.yaw) for one in seen]),
        np.log(np.concatenate([one.size for one in seen])),
        _covariances(seen),
    )
    return associate(every, _area(position, [one.camera for one in snapshots]))


def _area(position: FloatArray, cameras: Sequence[Camera]) -> float:
    """Area over which the objects may be strewn: a disc about the cameras and all they saw, square metres."""
    points = np.concatenate([position, np.array([camera.position for camera in cameras])])
    across = diameter(points) + max(camera.fov.range_m for camera in cameras)
    return math.pi / 4 * across**2


def _fused(snapshots: Sequence[Snapshot], found: Association) -> tuple[Detections, Precision]:
    """The objects, each at the mean of its detections, and how exactly each is known."""
    seen = [one.detections for one in snapshots]
    category = [name for one in seen for name in one.category]
    every = {
        name: np.concatenate([getattr(one, name) for one in seen])
        for name in ("position", "yaw", "size", "elevation", "confidence")
    }
    rivals = [np.concatenate(column) for column in zip(*map(_rivals, seen), strict=True)]
    place, turn = precision_of(_covariances(seen), found.position_sd, found.yaw_sd)
    groups = [np.flatnonzero(found.object_of == k) for k in range(found.object_of.max(initial=-1) + 1)]
    known = [[category[i] for i in group if category[i] is not None] for group in groups]
    precision = Precision(
        np.array([place[group].sum(axis=0) for group in groups]).reshape(-1, 3),
        np.array([turn[group].sum() for group in groups]),
    )
    objects = Detections(
        category=tuple(names[0] if names else None for names in known),
        position=np.array([mean_place(every["position"][group], place[group]) for group in groups]),
        yaw=np.array(
            [settled_yaw(every["yaw"][group], turn[group], *(r[group] for r in rivals)) for group in groups]
        ),
        size=np.array([_mean_size(every["size"][group]) for group in groups]),
        elevation=np.array([every["elevation"][group].mean() for group in groups]),
        confidence=np.array([every["confidence"][group].max() for group in groups]),
        tilt=_mean_tilts(seen, groups),
        uncertainty=_mean_uncertainty(seen, groups, found),
    )
    return objects, precision


def _of_each_coordinate(precision: FloatArray) -> FloatArray:
    """(K,) inverses of the mean variances of x and z, from precisions (K, 3) of places."""
    xx, xz, zz = precision.T
    return np.asarray(2 * (xx * zz - xz * xz) / (xx + zz))


def _known(seen: Detections) -> Uncertainty:
    return seen.uncertainty or Uncertainty.unknown(len(seen))


def _covariances(seen: Sequence[Detections]) -> FloatArray:
    """(D, 3, 3) of all detections; of those that say nothing what is usual of the others, or zeros."""
    found = np.concatenate([_known(one).covariance for one in seen])
    said = found.any(axis=(1, 2))
    if said.any() and not said.all():
        place = np.median((found[said, 0, 0] + found[said, 1, 1]) / 2)
        found[~said] = np.diag([place, place, np.median(found[said, 2, 2])])
    return found


def _rivals(seen: Detections) -> tuple[FloatArray, FloatArray]:
    """(N,) second most probable headings, and their probabilities, 0 where there is none."""
    known = _known(seen)
    return known.runner_up_yaw, np.nan_to_num(known.runner_up_weight)


def settled_yaw(yaw: FloatArray, precision: FloatArray, rival: FloatArray, weight: FloatArray) -> float:
    """The mean heading of K detections of one thing, radians, of which some may be their second headings.

    Each heading that is known is tried as the thing's; the one that explains all best decides which of its
    two each detection means.

    Args:
        yaw: (K,) radians; NaN where not known.
        precision: (K,) what each counts.
        rival: (K,) second most probable headings, radians; NaN where there is none.
        weight: (K,) their probabilities.
    """
    tried = np.concatenate([yaw[~np.isnan(yaw)], rival[weight > 0]])
    if not (weight > 0).any() or not len(tried):
        return mean_yaw(yaw, precision)
    other = np.abs(wrap(yaw - tried[:, None])) > np.abs(
        wrap(np.where(weight > 0, rival, yaw) - tried[:, None])
    )
    best = int(np.where(other, np.log(np.maximum(weight, 1e-9)), np.log1p(-weight)).sum(axis=1).argmax())
    meant = np.where(other[best], rival, yaw)
    return mean_yaw(meant, precision)


def _mean_tilts(seen: Sequence[Detections], groups: Sequence[IntArray]) -> FloatArray | None:
    """(K, 2) mean pitch and roll of the detections of each group; None where all stand upright."""
    if all(one.tilt is None for one in seen):
        return None
    every = np.concatenate([np.zeros((len(one), 2)) if one.tilt is None else one.tilt for one in seen])
    return np.array([[mean_yaw(every[group, k], np.ones(len(group))) for k in range(2)] for group in groups])


def _mean_uncertainty(
    seen: Sequence[Detections], groups: Sequence[IntArray], found: Association
) -> Uncertainty | None:
    """That of objects; None where no detector knows any.

    The errors of one thing's detections may be the same in all: as large as the common noise, which lasts, or
    the detector's own. So their mean is known no better than by the mean of their precisions, whatever their
    errors have in common (covariance intersection, Julier and Uhlmann 1997). Of things of which no detection
    says anything, nothing is said. A second heading is that of a detection alone.
    """
    if all(one.uncertainty is None for one in seen):
        return None
    every = [_known(one) for one in seen]
    covariance, visible, yaw, weight = (
        np.concatenate([getattr(one, field.name) for one in every]) for field in fields(Uncertainty)
    )
    common = np.diag([found.position_sd**2, found.position_sd**2, found.yaw_sd**2])
    inverse = np.linalg.inv(_covariances(seen) + common)
    mean = np.array([np.linalg.inv(inverse[group].mean(axis=0)) for group in groups]).reshape(-1, 3, 3)
    nothing = np.array([not covariance[group].any() for group in groups], dtype=bool)
    single = [group if len(group) == 1 else group[:0] for group in groups]
    return Uncertainty(
        np.where(nothing[:, None, None], 0.0, (mean + np.swapaxes(mean, -1, -2)) / 2),
        np.array([visible[group].max() for group in groups]),
        np.array([yaw[group].sum() if len(group) else np.nan for group in single]),
        np.array([weight[group].sum() if len(group) else np.nan for group in single]),
    )


def _mean_size(size: FloatArray) -> FloatArray:
    """(3,) geometric mean of the sizes (K, 3) that are known; NaN where none is."""
    known = size[~np.isnan(size).any(axis=-1)]
    mean: FloatArray = np.exp(np.log(known if len(known) else size).mean(axis=0))
    return mean


def _share(answer: Identification, index: IntArray) -> Identification:
    """The answer for some of the objects."""

    def assured() -> Assurance:
        probability = answer.probability
        return Assurance(
            margin=answer.margin[index],
            runner_up=tuple(answer.runner_up[i] for i in index),
            confidence=answer.confidence[index],
            probability=None if probability is None else probability[index],
            gone=answer.gone,
            warnings=answer.warnings,
        )

    return replace(
        answer,
        labels=tuple(answer.labels[i] for i in index),
        cost=answer.cost[index],
        assurance=assured,
        reason=tuple(answer.reason[i] for i in index),
    )
