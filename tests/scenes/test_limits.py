"""What enters a record is bounded, so that nothing behind it overflows or turns for ever."""

import numpy as np
import pytest

from farm_ar.errors import InputError
from farm_ar.scenes import (
    Camera,
    CameraPath,
    Detections,
    FieldOfView,
    Layout,
    Scene,
    Site,
    SnapshotBatch,
    Template,
    Weights,
)

TURNS = 2 * np.pi * 1e6


def layout(position=(0.0, 0.0), yaw=0.0, size=(1.0, 1.0, 1.0), elevation=0.0):
    return Layout(("a",), ("chair",), [position], [yaw], [size], [elevation])


def detections(position=(0.0, 0.0), yaw=0.0, size=(1.0, 1.0, 1.0), elevation=0.0):
    return Detections(("chair",), [position], [yaw], [size], [elevation])


def batch(position=(0.0, 0.0), yaw=0.0, size=(1.0, 1.0, 1.0), elevation=0.0):
    camera = Camera([[0.0, 0.0]], [0.0])
    return SnapshotBatch(camera, [1], ("chair",), [[0]], [[position]], [[yaw]], [[size]], [[elevation]])


def scene(size=(1.0, 1.0), speed=1.0, site=(0.0, 0.0)):
    return Scene("room", size, layout(), (Site("S", *site),), camera_speed=speed)


CASES = [
    *[
        (make, changes)
        for make in (layout, detections, batch)
        for changes in (
            {"position": (1e6, 0.0)},
            {"position": (0.0, -1e6)},
            {"yaw": TURNS},
            {"yaw": -TURNS},
            {"size": (1.0, 1e6, 1.0)},
            {"elevation": -1e6},
        )
    ],
    (Camera, {"position": (1e6, 0.0), "yaw": 0.0}),
    (Camera, {"position": (0.0, 0.0), "yaw": TURNS}),
    (Camera, {"position": (0.0, 0.0), "yaw": 0.0, "height": 1e6}),
    (Camera, {"position": (0.0, 0.0), "yaw": 0.0, "pitch": -TURNS}),
    (FieldOfView, {"left": 1.0, "right": 1.0, "range_m": 1e9}),
    (CameraPath, {"points": ((0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1e6, 0.0))}),
    (scene, {"size": (1e6, 1.0)}),
    (scene, {"speed": 1e6}),
    (scene, {"site": (-1e6, 0.0)}),
    (Template, {"category": "chair", "yaw": TURNS, "size": (1.0, 1.0, 1.0)}),
    (Template, {"category": "chair", "yaw": 0.0, "size": (1.0, 1.0, 1e6)}),
    (Weights, {"translation": 1e6}),
]
"""What can just be made; twice the largest of its numbers is refused."""


def grown(value, factor):
    if isinstance(value, tuple):
        return tuple(grown(one, factor) for one in value)
    return value * factor if isinstance(value, float) and abs(value) >= 1e6 else value


@pytest.mark.parametrize(("make", "values"), CASES)
def test_the_largest_value_is_taken_and_a_larger_one_is_refused(make, values):
    make(**values)
    unknown = make in (layout, detections, batch) and "yaw" in values  # NaN is a heading not known
    for factor in (1.0001, 1e14, 1e300, np.inf, *(() if unknown else (np.nan,))):
        with pytest.raises(InputError, match=r"must .*, got "):
            make(**{name: grown(value, factor) for name, value in values.items()})


@pytest.mark.parametrize("make", [layout, detections, batch])
def test_a_side_as_thin_as_nothing_is_refused(make):
    make(size=(1e-6, 1.0, 1.0))
    with pytest.raises(InputError, match=r"size.*must be positive metres, from 1e-6 to 1e6"):
        make(size=(9e-7, 1.0, 1.0))
