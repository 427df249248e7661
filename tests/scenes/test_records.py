"""What holds of everything a scene and a snapshot are made of."""

from dataclasses import FrozenInstanceError, fields
from typing import Any

import numpy as np
import pytest

from farm_ar.scenes import (
    PAPER_FIELD_OF_VIEW,
    PERFECT,
    Camera,
    CameraPath,
    Detections,
    Gaussian,
    Layout,
    LayoutNoise,
    Scene,
    Site,
    Snapshot,
    SnapshotBatch,
    Template,
    Weights,
)

CAMERA = Camera([0, 0], 0)
LAYOUT = Layout(("a",), ("chair",), [(0, 0)], [0], [(1, 1, 1)])
SNAPSHOT = Snapshot(CAMERA, Detections(("chair",), [(0, 0)], [0], [(1, 1, 1)]))
WITH_ARRAYS = [
    CAMERA,
    LAYOUT,
    SNAPSHOT,
    SNAPSHOT.detections,
    SnapshotBatch.stack([SNAPSHOT]),
    CameraPath(np.arange(8).reshape(4, 2)),
    Scene("room", (1, 1), LAYOUT),
]
VALUES = [
    PAPER_FIELD_OF_VIEW,
    PERFECT,
    Gaussian(),
    LayoutNoise(),
    Site("S", 0, 0),
    Template("chair", 0, (1, 1, 1)),
    Weights(1),
]


@pytest.mark.parametrize("record", WITH_ARRAYS + VALUES, ids=lambda record: type(record).__name__)
def test_no_field_can_be_replaced(record: Any):
    for field in fields(record):
        with pytest.raises(FrozenInstanceError):
            setattr(record, field.name, None)


@pytest.mark.parametrize("record", WITH_ARRAYS, ids=lambda record: type(record).__name__)
def test_what_holds_arrays_is_equal_to_itself_only_and_can_be_a_key(record: Any):
    again = type(record)(**{field.name: getattr(record, field.name) for field in fields(record)})
    assert record != again
    assert len({record, again}) == 2


@pytest.mark.parametrize("record", VALUES, ids=lambda record: type(record).__name__)
def test_what_holds_numbers_only_is_equal_to_what_holds_the_same(record: Any):
    again = type(record)(*(getattr(record, field.name) for field in fields(record)))
    assert record == again
    assert hash(record) == hash(again)
