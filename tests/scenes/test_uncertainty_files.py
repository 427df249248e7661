"""What a detector knows of its errors, in files: in whatever frame and units, and written back."""

import io
import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from farm_ar.errors import SnapshotError
from farm_ar.scenes import (
    SnapshotBatch,
    Uncertainty,
    load_snapshot,
    save_snapshot,
    snapshot_from_dict,
    snapshot_to_dict,
)
from farm_ar.scenes.declarations import SNAPSHOT
from farm_ar.scenes.streams import read_snapshots

CAMERA = {"x": 0, "y": 0, "yaw_deg": 0}
FLOOR = {"ros": ("x", "y", 5), "unity": ("x", "z", 4), "openxr": ("x", "z", 4)}
"""By frame: the coordinates of the floor, and which of the six numbers turns about its upward axis."""


def a_covariance(rng, scale=1.0):
    root = rng.normal(0, 0.1, (3, 3)) * np.array([scale, scale, 1.0])[:, None]
    return root @ root.T


def document(frame, units="m", **fields):
    first, second, _ = FLOOR[frame]
    pose = {first: 30.0, second: 20.0, "yaw_deg": 40.0, "category": "chair"}
    origin = {"x": 5.0, "yaw_deg": 25.0}
    camera = {first: 0.0, second: 0.0, "yaw_deg": 0.0}
    return {"frame": frame, "units": units, "origin": origin, "camera": camera,
            "detections": [pose | fields]}  # fmt: skip


def read(document):
    return snapshot_from_dict(document).detections


@pytest.mark.parametrize("units", ["m", "cm"])
@pytest.mark.parametrize("frame", FLOOR)
def test_errors_go_the_way_of_the_poses_whatever_the_frame_and_units(frame, units):
    """By how much our pose moves when the file's does, the file's covariance becomes ours."""
    rng, (first, second, upward) = np.random.default_rng(2), FLOOR[frame]
    given, step = a_covariance(rng, 1.0 if units == "m" else 100.0), 1e-3

    def pose(change):
        one = document(frame, units)
        one["detections"][0][first] += float(change[0])
        one["detections"][0][second] += float(change[1])
        one["detections"][0]["yaw_deg"] += float(np.rad2deg(change[2]))
        seen = read(one)
        return np.array([*seen.position[0], seen.yaw[0]])

    slope = np.stack([(pose(step * e) - pose(-step * e)) / (2 * step) for e in np.eye(3)], axis=1)
    expected = slope @ given @ slope.T
    small = read(document(frame, units, covariance=given.tolist())).uncertainty
    np.testing.assert_allclose(small.covariance[0], expected, rtol=1e-6, atol=1e-12)
    # As ROS has it: x, y, z and the turns about them, 6 by 6 by rows.
    full, place = rng.normal(0, 1, (6, 6)), ["xyz".index(first), "xyz".index(second), upward]
    full[np.ix_(place, place)] = given
    large = read(document(frame, units, covariance=full.ravel().tolist())).uncertainty
    np.testing.assert_allclose(large.covariance, small.covariance, rtol=1e-12)


@pytest.mark.parametrize("frame", FLOOR)
def test_a_second_heading_is_read_as_the_first_is(frame):
    seen = read(document(frame, runner_up={"yaw_deg": 40.0, "probability": 0.25}, visible=0.6))
    assert seen.uncertainty.runner_up_yaw[0] == pytest.approx(seen.yaw[0])
    assert (seen.uncertainty.runner_up_weight[0], seen.uncertainty.visible[0]) == (0.25, 0.6)
    assert not seen.uncertainty.covariance.any(), "nothing is known of it"


def test_what_is_written_is_read_back_and_fits_the_schema(tmp_path):
    rng = np.random.default_rng(4)
    covariance = np.array([a_covariance(rng) for _ in range(3)])
    covariance = (covariance + covariance.transpose(0, 2, 1)) / 2
    known = Uncertainty(covariance, [1.0, 0.3, 0.9], [np.nan, 1.2, -2.0], [np.nan, 0.4, 0.0])
    plain = snapshot_from_dict(
        {"camera": {"x": 0, "z": 0, "yaw_deg": 0}, "detections": [{"x": k, "z": 1} for k in range(3)]}
    )
    assert plain.detections.uncertainty is None
    assert "covariance" not in json.dumps(snapshot_to_dict(plain))
    told = replace(plain, detections=replace(plain.detections, uncertainty=known))
    save_snapshot(told, tmp_path / "seen.json")
    jsonschema.validate(json.loads((tmp_path / "seen.json").read_text()), SNAPSHOT.schema())
    back = load_snapshot(tmp_path / "seen.json").detections.uncertainty
    for name, value in vars(known).items():
        np.testing.assert_allclose(getattr(back, name), value, rtol=1e-12)
    # As a batch and out of it again, beside one of which nothing is known.
    batch = SnapshotBatch.stack([plain, told])
    for name, value in vars(known).items():
        np.testing.assert_array_equal(getattr(batch.snapshot(1).detections.uncertainty, name), value)
    assert not batch.snapshot(0).detections.uncertainty.covariance.any()
    assert SnapshotBatch.stack([plain]).uncertainty is None


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"covariance": [[1, 0, 0], [0, -1, 0], [0, 0, 1]]}, "covariance: must be a covariance, symmetric"),
        ({"covariance": [[1, 5, 0], [5, 1, 0], [0, 0, 1]]}, "covariance: must be a covariance, symmetric"),
        ({"covariance": [1, 0, 0, 0, 1, 0]}, "covariance: must be 3 rows of 3 numbers"),
        ({"covariance": "large"}, "covariance: must be 3 rows of 3 numbers"),
        ({"covariance": np.diag([1e300, 1, 1]).tolist()}, "covariance: must be a covariance"),
        ({"covariance": np.diag([1e308, 1, 1]).tolist(), "units": "km"}, "covariance: must be a covariance"),
        ({"runner_up": {"yaw_deg": 3, "probability": 0.7}}, r"runner_up\.probability: must be a number"),
        ({"runner_up": {"probability": 0.2}}, r"runner_up\.yaw_deg: must be a number"),
        ({"visible": 1.5}, r"visible: must be a number from 0 to 1"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line_and_costs_a_stream_no_more_than_itself(fields, message):
    fields = dict(fields)
    units = fields.pop("units", "m")
    one = document("unity", units)
    one["detections"].append(one["detections"][0] | fields)
    with pytest.raises(SnapshotError, match=rf"^detections\[1\]\.{message}") as problem:
        snapshot_from_dict(one)
    assert "\n" not in str(problem.value)
    (found,) = read_snapshots(io.BytesIO(json.dumps(one).encode()))
    assert found.detections.broken[0] is None
    assert found.detections.broken[1].startswith(message[:9])
