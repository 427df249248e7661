"""What a world gives: pairs of looks, with what every detection of the second really is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.scenes import Bounds, Camera, Detections, Detector, FieldOfView, Layout, Scene, Snapshot, observe

Truth = tuple[str | None, ...]
"""The label that each detection really is; None for a false detection and for what is new."""


class Example(NamedTuple):
    """What was known, what is seen later, and which label each detection really is."""

    scene: Scene
    snapshot: Snapshot
    truth: Truth


Make = Callable[[np.random.Generator, int], list[Example]]
"""Makes as many examples as asked for with a generator."""


@dataclass(frozen=True)
class Row:
    """One row of the benchmark.

    Args:
        name: its name.
        about: what it is, in a few words.
        make: makes its examples.
        all_in_view: whether nothing can be out of view, so that a detection answered none is a mistake
            unless it is new or false.
    """

    name: str
    about: str
    make: Make
    all_in_view: bool = True


@dataclass(frozen=True)
class Area:
    """The rectangle of the plane in which a world lies, metres; nothing leaves it if it is closed."""

    low: tuple[float, float]
    high: tuple[float, float]
    closed: bool = True

    @property
    def size(self) -> FloatArray:
        """(2,) its extents in x and z."""
        return np.subtract(self.high, self.low)

    @property
    def middle(self) -> FloatArray:
        """(2,) its centre."""
        return np.add(self.low, self.high) / 2

    def scene(self, name: str, layout: Layout) -> Scene:
        """A scene with this area as its bounds; without any where it is open."""
        width, depth = self.size.tolist()
        return Scene(
            name, layout=layout, bounds=Bounds.rectangle(width, depth, self.low) if self.closed else None
        )

    def camera(self) -> Camera:
        """A camera in the middle that sees all of the area, and no more than it must."""
        reach = float(np.hypot(*self.size)) / 2
        return Camera(self.middle, np.array(0.0), FieldOfView(np.pi, np.pi, 1.05 * reach))


class Objects(NamedTuple):
    """N objects at one time: names, categories, (N, 2) positions, (N,) headings, (N, 3) sizes."""

    labels: Sequence[str]
    category: Sequence[str]
    position: FloatArray
    yaw: FloatArray
    size: FloatArray

    def layout(self) -> Layout:
        """The objects as a layout."""
        return Layout(tuple(self.labels), tuple(self.category), self.position, self.yaw, self.size)

    def at(self, position: FloatArray, yaw: FloatArray) -> Objects:
        """The same objects in other poses."""
        return self._replace(position=position, yaw=yaw)

    def bare(self) -> Objects:
        """The same without headings and sizes, which are then not known."""
        return self._replace(yaw=np.full_like(self.yaw, np.nan), size=np.full_like(self.size, np.nan))

    def some(self, chosen: IntArray | BoolArray) -> Objects:
        """Those at some indices, or where a mask is true."""
        index = np.arange(len(self.labels))[chosen]
        return Objects(
            [self.labels[i] for i in index],
            [self.category[i] for i in index],
            self.position[index],
            self.yaw[index],
            self.size[index],
        )


def seen_as(
    area: Area,
    name: str,
    known: Objects,
    now: Objects,
    rng: np.random.Generator,
    camera: Camera | None = None,
    detector: Detector | None = None,
) -> Example:
    """One example: what was known at first, and what a camera sees later.

    Args:
        area: the bounds.
        name: of the scene.
        known: the first look.
        now: what is really there at the second; labels that the first look lacks are new objects.
        rng: puts the detections in an order without information, and drives the detector.
        camera: that of the second look; one that sees the whole area by default.
        detector: what goes wrong; by default nothing.
    """
    view = area.camera() if camera is None else camera
    snapshot, truth = observe(now.layout(), view, detector or Detector(), rng)
    old = set(known.labels)
    order = rng.permutation(len(truth))
    seen = snapshot.detections
    detections = Detections(
        tuple(seen.category[i] for i in order),
        seen.position[order],
        seen.yaw[order],
        seen.size[order],
    )
    labels = tuple(truth[i] if truth[i] in old else None for i in order)
    return Example(area.scene(name, known.layout()), Snapshot(view, detections), labels)


def spaced_points(
    area: Area, number: int, apart: float, rng: np.random.Generator, tries: int = 400
) -> FloatArray:
    """(number, 2) places in an area at least so far apart, metres; closer where there is no room."""
    places = np.empty((number, 2))
    for k in range(number):
        drawn = rng.uniform(area.low, area.high, (tries, 2))
        if not k:
            places[0] = drawn[0]
            continue
        gap = np.linalg.norm(drawn[:, None] - places[:k], axis=-1).min(axis=1)
        enough = np.flatnonzero(gap >= apart)
        places[k] = drawn[enough[0] if len(enough) else gap.argmax()]
    return places


def boxes(number: int, size: tuple[float, float, float]) -> FloatArray:
    """(number, 3) the same width, height and depth."""
    return np.tile(np.asarray(size, dtype=np.float64), (number, 1))


def towards(vector: FloatArray) -> FloatArray:
    """(...) headings along (..., 2) vectors of (x, z)."""
    heading: FloatArray = np.arctan2(vector[..., 0], vector[..., 1])
    return heading


def limited(vector: FloatArray, most: FloatArray | float) -> FloatArray:
    """(..., 2) vectors no longer than `most`."""
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    cut: FloatArray = vector * np.minimum(1.0, np.asarray(most)[..., None] / np.maximum(length, 1e-12))
    return cut
