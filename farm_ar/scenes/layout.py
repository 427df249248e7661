"""A layout: labelled objects with category, pose and size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import (
    ANGLE,
    POSITION,
    SIDE,
    BoolArray,
    FloatArray,
    IntArray,
    Record,
    first_wrong,
    read_only,
)
from farm_ar.errors import SceneError
from farm_ar.scenes.kinds import is_text

NO_CATEGORY = "no category"
"""The category of objects of which none is known: detections of any category may be those."""


def unknown(name: str, values: FloatArray) -> BoolArray:
    """Which values of N objects are rightly NaN: headings (..., N) and whole sizes (..., N, 3)."""
    missing = np.isnan(values)
    if name == "size":
        return missing & missing.all(axis=-1, keepdims=True)
    return missing if name == "yaw" else np.zeros_like(missing)


@dataclass(frozen=True, eq=False)
class Layout(Record):
    """What stood where: N labelled objects, in one arrangement or in a batch of them.

    Labels, categories and sizes belong to the objects and are shared by the whole batch; only the
    poses carry the batch dimensions.

    Args:
        labels: N distinct, non-empty names.
        category: N non-empty categories; objects of one category look alike; `NO_CATEGORY` where not known.
        position: (..., N, 2) pivots as (x, z), metres, at most 1e6 either way.
        yaw: (..., N) headings, radians, at most 1e6 turns either way; NaN where not known.
        size: (N, 3) width, height, depth, metres, 1e-6 to 1e6; three NaN where not known.
        elevation: (N,) heights of the pivots above the floor, metres, as positions; 0 by default.
        fixed: (N,) objects that never move; none by default.
        tilt: (N, 2) pitch and roll of the objects, radians, as `geometry.rotation_matrix` has them; None,
            the default, where all stand upright. `spatial-3d` alone makes use of it.

    Raises:
        SceneError: a label is empty or repeated, a category is empty, a pose or a size is out of its
            limits, or the shapes do not agree.
    """

    labels: tuple[str, ...]
    category: tuple[str, ...]
    position: FloatArray
    yaw: FloatArray
    size: FloatArray
    elevation: FloatArray = None  # type: ignore[assignment]  # filled in below
    fixed: BoolArray = None  # type: ignore[assignment]
    tilt: FloatArray | None = None

    def __post_init__(self) -> None:
        n = len(self.labels)
        elevation = np.zeros(n) if self.elevation is None else self.elevation
        fixed = np.zeros(n, dtype=bool) if self.fixed is None else self.fixed
        values = {
            "labels": tuple(self.labels),
            "category": tuple(self.category),
            "position": read_only(self.position, np.float64, empty=(0, 2)),
            "yaw": read_only(self.yaw, np.float64),
            "size": read_only(self.size, np.float64, empty=(0, 3)),
            "elevation": read_only(elevation, np.float64),
            "fixed": read_only(fixed, np.bool_),
        }
        if self.tilt is not None:
            values["tilt"] = read_only(self.tilt, np.float64, empty=(0, 2))
        for name, value in values.items():
            object.__setattr__(self, name, value)
        self._check_shapes()
        self._check_names()
        self._check_values()

    def _check_shapes(self) -> None:
        n = len(self.labels)
        if len(self.category) != n:
            raise SceneError("category", f"must have one entry per label ({n})", len(self.category))
        shapes: dict[str, tuple[int, ...]] = {"size": (n, 3), "elevation": (n,), "fixed": (n,)}
        if self.tilt is not None:
            shapes["tilt"] = (n, 2)
        for name, shape in shapes.items():
            got = getattr(self, name).shape
            if got != shape:
                raise SceneError(name, f"must have shape {shape}", got)
        if self.yaw.shape[-1:] != (n,) or self.position.shape != (*self.yaw.shape, 2):
            shapes_got = (self.position.shape, self.yaw.shape)
            raise SceneError("position, yaw", f"must have shapes (..., {n}, 2) and (..., {n})", shapes_got)

    def _check_names(self) -> None:
        for name in ("labels", "category"):
            for i, value in enumerate(getattr(self, name)):
                if not is_text(value):
                    raise SceneError(f"{name}[{i}]", "must be a non-empty string of Unicode", value)
        seen: set[str] = set()
        for i, label in enumerate(self.labels):
            if label in seen:
                raise SceneError(f"labels[{i}]", "must not repeat an earlier label", label)
            seen.add(label)

    def _check_values(self) -> None:
        limits = {"position": POSITION, "yaw": ANGLE, "elevation": POSITION, "size": SIDE}
        if self.tilt is not None:
            limits["tilt"] = ANGLE
        for name, limit in limits.items():
            values = getattr(self, name)
            where = first_wrong(limit.allow(values) | unknown(name, values))
            if where is not None:
                raise SceneError(f"{name}{list(where)}", limit.expected, float(values[where]))

    def __len__(self) -> int:
        return len(self.labels)

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """Shape of the batch of arrangements; () for a single one."""
        return self.yaw.shape[:-1]

    @cached_property
    def categories(self) -> tuple[str, ...]:
        """The distinct categories, sorted."""
        return tuple(sorted(set(self.category)))

    @property
    def names_categories(self) -> bool:
        """Whether it says what its objects look like."""
        return self.categories != (NO_CATEGORY,)

    @property
    def partly_named(self) -> bool:
        """Whether it says of some of its objects what they look like, and not of others."""
        return self.names_categories and NO_CATEGORY in self.category

    @cached_property
    def category_code(self) -> IntArray:
        """(N,) index of each object's category in `categories`."""
        code = {name: i for i, name in enumerate(self.categories)}
        return read_only([code[name] for name in self.category], np.int64)

    @cached_property
    def movable(self) -> BoolArray:
        """(N,) objects that can be moved."""
        return read_only(~self.fixed, np.bool_)

    def index(self, label: str) -> int:
        """Index of a label.

        Raises:
            SceneError: no object has it.
        """
        try:
            return self.labels.index(label)
        except ValueError:
            raise SceneError("label", f"must be one of {', '.join(self.labels)}", label) from None

    def with_poses(self, position: npt.ArrayLike, yaw: npt.ArrayLike) -> Layout:
        """The same objects in other poses: position (..., N, 2), yaw (..., N)."""
        return replace(
            self, position=np.asarray(position, dtype=np.float64), yaw=np.asarray(yaw, dtype=np.float64)
        )

    def placed(self, position: FloatArray, yaw: FloatArray) -> Layout:
        """`with_poses` of poses that were worked out, not given: they are not checked, and become read-only.

        Args:
            position: (..., N, 2) metres, within the limits.
            yaw: (..., N) radians, within the limits.
        """
        return self.trusted(**vars(self) | {"position": position, "yaw": yaw})

    def subset(self, indices: Sequence[int] | IntArray | BoolArray) -> Layout:
        """The objects at `indices`, in that order, or those where a mask of N is true."""
        wanted = np.asarray(indices)
        chosen = np.arange(len(self))[wanted if wanted.size else wanted.astype(np.int64)]
        return Layout(
            labels=tuple(self.labels[i] for i in chosen),
            category=tuple(self.category[i] for i in chosen),
            position=self.position[..., chosen, :],
            yaw=self.yaw[..., chosen],
            size=self.size[chosen],
            elevation=self.elevation[chosen],
            fixed=self.fixed[chosen],
            tilt=None if self.tilt is None else self.tilt[chosen],
        )
