"""A snapshot: one camera and what it detected, without identities; and many of them as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from farm_ar.arrays import (
    ANGLE,
    POSITION,
    SHARE,
    SIDE,
    TIME,
    BoolArray,
    FloatArray,
    IntArray,
    Record,
    first_wrong,
    read_only,
)
from farm_ar.errors import SnapshotError
from farm_ar.scenes.camera import Camera
from farm_ar.scenes.kinds import is_text
from farm_ar.scenes.layout import unknown
from farm_ar.scenes.uncertainty import Uncertainty
from farm_ar.scenes.worlds import OURS, World

UNKNOWN = -1
"""Code of a category that is not known, and index of a label that is none."""

_LIMITS = {
    "position": POSITION,
    "yaw": ANGLE,
    "size": SIDE,
    "elevation": POSITION,
    "confidence": SHARE,
    "tilt": ANGLE,
}


@dataclass(frozen=True, eq=False)
class Detections(Record):
    """N objects that were seen, without identity.

    Args:
        category: N non-empty categories; None where it is not known.
        position: (N, 2) pivots as (x, z), metres, at most 1e6 either way.
        yaw: (N,) headings, radians, at most 1e6 turns either way; NaN where not known.
        size: (N, 3) width, height, depth, metres, 1e-6 to 1e6; three NaN where not known.
        elevation: (N,) heights of the pivots above the floor, metres, as positions; 0 by default.
        confidence: (N,) of the detector, 0 to 1; 1 by default.
        ids: N names of the detections, distinct and not empty; "0", "1", ... by default.
        track_id: N names that a tracker keeps from one snapshot to the next, distinct and not empty; None for
            a detection without one. All without one by default.
        broken: N reasons why a pose cannot be used, whose position is then NaN; None for a sound one, as by
            default.
        tilt: (N, 2) pitch and roll, radians, as a layout's; None, the default, where all stand upright.
        uncertainty: how far the poses can be trusted; None, the default, where the detector does not know.

    Raises:
        SnapshotError: a value is out of its limits, a category or a name is empty, a name is repeated, or the
            shapes do not agree.
    """

    category: tuple[str | None, ...]
    position: FloatArray
    yaw: FloatArray
    size: FloatArray
    elevation: FloatArray = None  # type: ignore[assignment]  # filled in below
    confidence: FloatArray = None  # type: ignore[assignment]
    ids: tuple[str, ...] = None  # type: ignore[assignment]
    track_id: tuple[str | None, ...] = None  # type: ignore[assignment]
    broken: tuple[str | None, ...] = None  # type: ignore[assignment]
    tilt: FloatArray | None = None
    uncertainty: Uncertainty | None = None

    def __post_init__(self) -> None:
        n = len(self.category)
        if self.uncertainty is not None and len(self.uncertainty) != n:
            expected = f"must be that of {n} detections"
            raise SnapshotError("detections.uncertainty", expected, len(self.uncertainty))
        object.__setattr__(self, "category", tuple(self.category))
        ids = tuple(str(i) for i in range(n)) if self.ids is None else tuple(self.ids)
        object.__setattr__(self, "ids", ids)
        tracks = (None,) * n if self.track_id is None else tuple(self.track_id)
        object.__setattr__(self, "track_id", tracks)
        object.__setattr__(self, "broken", (None,) * n if self.broken is None else tuple(self.broken))
        self._check_names()
        shapes = {"position": (n, 2), "yaw": (n,), "size": (n, 3), "elevation": (n,), "confidence": (n,)}
        defaults = {"elevation": 0.0, "confidence": 1.0}
        if self.tilt is not None:
            shapes["tilt"] = (n, 2)
        for name, shape in shapes.items():
            value = getattr(self, name)
            if value is None and name in defaults:
                value = np.full(shape, defaults[name])
            array = read_only(value, np.float64, empty=(0, *shape[1:]))
            if array.shape != shape:
                raise SnapshotError(f"detections.{name}", f"must have shape {shape}", array.shape)
            object.__setattr__(self, name, array)
            right = _LIMITS[name].allow(array) | unknown(name, array)
            if name != "confidence":
                for i in self.faulty:
                    right[i] = right[i] | np.isnan(array[i])
            where = first_wrong(right)
            if where is not None:
                field = f"detections[{where[0]}].{name}"
                raise SnapshotError(field, _LIMITS[name].expected, array[where[0]].tolist())

    def _check_names(self) -> None:
        for i, category in enumerate(self.category):
            if category is not None and not is_text(category):
                raise SnapshotError(f"detections[{i}].category", "must be a category or None", category)
        n, ids = len(self.category), self.ids
        if len(set(ids)) != n or len(ids) != n or not all(map(is_text, ids)):
            raise SnapshotError("detections.id", f"must be {n} different names", list(ids))
        if len(self.broken) != n:
            raise SnapshotError("detections.broken", f"must be {n} reasons, or None for each", self.broken)
        tracks = [track for track in self.track_id if track is not None]
        right = len(set(tracks)) == len(tracks) and all(map(is_text, tracks))
        if not right or len(self.track_id) != n:
            expected = f"must be {n} different names, None for a detection without one"
            raise SnapshotError("detections.track_id", expected, list(self.track_id))

    def __len__(self) -> int:
        return len(self.category)

    @property
    def faulty(self) -> tuple[int, ...]:
        """The detections whose pose cannot be used."""
        return tuple([i for i, reason in enumerate(self.broken or ()) if reason is not None])

    def at(self, index: IntArray) -> Detections:
        """Some of them, each once, with all that is known of them."""
        kept: dict[str, Any] = {
            name: tuple([value[i] for i in index]) if isinstance(value, tuple) else value[index]
            for name, value in vars(self).items()
            if name != "uncertainty" and value is not None
        }
        kept.setdefault("tilt", None)
        uncertainty = None if self.uncertainty is None else self.uncertainty.at(index)
        return Detections.trusted(**kept, uncertainty=uncertainty)


@dataclass(frozen=True, eq=False)
class Snapshot(Record):
    """One camera and its detections.

    Args:
        camera: where it was taken from.
        detections: what was seen.
        timestamp: when, in seconds from any moment; None where not known.
        world: how its file writes poses, for what is said of them; our own frame and metres by default.
        assumed: fields of the camera's view that its file does not give, so that the paper's are taken.

    Raises:
        SnapshotError: the camera is a batch of cameras, or the time is not a finite number.
    """

    camera: Camera
    detections: Detections
    timestamp: float | None = None
    world: World = OURS
    assumed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.timestamp is not None:
            object.__setattr__(self, "timestamp", float(self.timestamp))
            if not TIME.allow(self.timestamp):
                raise SnapshotError("timestamp", TIME.expected, self.timestamp)
        if self.camera.batch_shape:
            raise SnapshotError("camera", "must be a single camera", self.camera.batch_shape)


@dataclass(frozen=True, eq=False)
class SnapshotBatch(Record):
    """B snapshots as arrays, each padded to the K detections of the fullest.

    Only the first `count[b]` detections of row b exist; what stands beyond them means nothing.

    Args:
        camera: a batch of B cameras.
        count: (B,) detections in each.
        categories: names that `category` indexes.
        category: (B, K) codes into `categories`, `UNKNOWN` where not known.
        position: (B, K, 2) metres.
        yaw: (B, K) radians; NaN where not known.
        size: (B, K, 3) metres; NaN where not known.
        elevation: (B, K) metres.
        truth: (B, K) index of the label that each detection really is, `UNKNOWN` for a false one; None
            where it is not known.
        tilt: (B, K, 2) radians; None where all stand upright.
        uncertainty: (B, K) how far the poses can be trusted; None where no detector knows.

    Raises:
        SnapshotError: a value that exists is out of its limits, or the shapes do not agree.
    """

    camera: Camera
    count: IntArray
    categories: tuple[str, ...]
    category: IntArray
    position: FloatArray
    yaw: FloatArray
    size: FloatArray
    elevation: FloatArray
    truth: IntArray | None = None
    tilt: FloatArray | None = None
    uncertainty: Uncertainty | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "categories", tuple(self.categories))
        if len(self.camera.batch_shape) != 1:
            raise SnapshotError("camera", "must be a batch of shape (B,)", self.camera.batch_shape)
        row = (len(self.camera.yaw), *np.shape(self.category)[-1:])
        shapes = {"category": row, "position": (*row, 2), "yaw": row, "size": (*row, 3), "elevation": row}
        shapes |= {"count": row[:1]} | ({} if self.truth is None else {"truth": row})
        shapes |= {} if self.tilt is None else {"tilt": (*row, 2)}
        whole = ("category", "count", "truth")
        for name, shape in shapes.items():
            array = read_only(getattr(self, name), np.int64 if name in whole else np.float64)
            if array.shape != shape:
                raise SnapshotError(name, f"must have shape {shape}", array.shape)
            object.__setattr__(self, name, array)
        if self.uncertainty is not None and self.uncertainty.visible.shape != row:
            raise SnapshotError("uncertainty", f"must be of shape {row}", self.uncertainty.visible.shape)
        self._check_values()

    def _check_values(self) -> None:
        detections = self.category.shape[1]
        right = (self.count >= 0) & (self.count <= detections)
        self._require("count", right, f"must be from 0 to {detections}")
        padding = np.arange(detections) >= self.count[:, None]
        right = (self.category >= UNKNOWN) & (self.category < len(self.categories))
        self._require("category", right, f"must be from {UNKNOWN} to {len(self.categories) - 1}")
        if self.truth is not None:
            self._require("truth", self.truth >= UNKNOWN, "must be the index of a label or UNKNOWN")
        for name in ("position", "yaw", "size", "elevation", *(() if self.tilt is None else ("tilt",))):
            values = getattr(self, name)
            beyond = padding if values.ndim == 2 else padding[..., None]
            right = _LIMITS[name].allow(values) | unknown(name, values) | beyond
            self._require(name, right, _LIMITS[name].expected)

    def _require(self, name: str, right: BoolArray, expected: str) -> None:
        where = first_wrong(right)
        if where is not None:
            raise SnapshotError(f"{name}{list(where)}", expected, getattr(self, name)[where].item())

    def __len__(self) -> int:
        return len(self.count)

    def snapshot(self, index: int) -> Snapshot:
        """One of the snapshots, its detections with default ids and confidence."""
        n = int(self.count[index])
        codes = self.category[index, :n]
        detections = Detections(
            category=tuple(None if code == UNKNOWN else self.categories[code] for code in codes),
            position=self.position[index, :n],
            yaw=self.yaw[index, :n],
            size=self.size[index, :n],
            elevation=self.elevation[index, :n],
            tilt=None if self.tilt is None else self.tilt[index, :n],
            uncertainty=None if self.uncertainty is None else self.uncertainty.at((index, slice(n))),
        )
        return Snapshot(self.camera.at(index), detections)

    def true_labels(self, index: int, labels: Sequence[str]) -> tuple[str | None, ...]:
        """The names, out of `labels`, of what was really seen in one snapshot; None for a false detection.

        Raises:
            SnapshotError: the truth is not known.
        """
        if self.truth is None:
            raise SnapshotError("truth", "must be known", None)
        row = self.truth[index, : self.count[index]]
        return tuple(None if label == UNKNOWN else labels[label] for label in row)

    @classmethod
    def stack(cls, snapshots: Sequence[Snapshot]) -> SnapshotBatch:
        """Snapshots as a batch, without their ids and confidence.

        Raises:
            SnapshotError: there are none, or their cameras differ in field of view, or in whether their
                height is known.
        """
        if not snapshots:
            raise SnapshotError("snapshots", "must be at least one", len(snapshots))
        seen = [snapshot.detections for snapshot in snapshots]
        categories = tuple(sorted({name for one in seen for name in one.category if name is not None}))
        codes = {name: i for i, name in enumerate(categories)} | {None: UNKNOWN}
        count = np.array([len(one) for one in seen], dtype=np.int64)
        shape = (len(seen), int(count.max()))
        category = np.full(shape, UNKNOWN, dtype=np.int64)
        poses = {
            "position": np.zeros((*shape, 2)),
            "yaw": np.zeros(shape),
            "size": np.ones((*shape, 3)),
            "elevation": np.zeros(shape),
        }
        if any(one.tilt is not None for one in seen):
            poses["tilt"] = np.zeros((*shape, 2))
        for b, one in enumerate(seen):
            category[b, : len(one)] = [codes[name] for name in one.category]
            for name, array in poses.items():
                value = getattr(one, name)
                array[b, : len(one)] = 0.0 if value is None else value
        camera = _stack_cameras([snapshot.camera for snapshot in snapshots])
        uncertainty = _stack_uncertainties([one.uncertainty for one in seen], shape)
        return cls(camera, count, categories, category, truth=None, uncertainty=uncertainty, **poses)


def _stack_uncertainties(every: Sequence[Uncertainty | None], shape: tuple[int, int]) -> Uncertainty | None:
    """(B, K) of several snapshots' detections; None where none of them says any."""
    if all(one is None for one in every):
        return None
    arrays = {name: np.array(value) for name, value in vars(Uncertainty.unknown(*shape)).items()}
    for b, one in enumerate(every):
        if one is not None:
            for name, array in arrays.items():
                array[b, : len(one)] = getattr(one, name)
    return Uncertainty(**arrays)


def _stack_cameras(cameras: Sequence[Camera]) -> Camera:
    fov = cameras[0].fov
    heights = [camera.height for camera in cameras if camera.height is not None]
    for b, camera in enumerate(cameras):
        if camera.fov != fov:
            raise SnapshotError(f"snapshots[{b}].camera.fov", f"must be the first one's, {fov}", camera.fov)
    if heights and len(heights) < len(cameras):
        raise SnapshotError(
            "snapshots", "must all have a camera height, or none", f"{len(heights)} that have"
        )
    return Camera(
        position=np.stack([camera.position for camera in cameras]),
        yaw=np.stack([camera.yaw for camera in cameras]),
        fov=fov,
        height=np.stack(heights) if heights else None,
        pitch=np.stack([camera.pitch for camera in cameras]),
    )
