"""Snapshot files: read, written back, and refused in one line when something is wrong."""

import copy
import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import SnapshotError
from farm_ar.scenes import (
    PAPER_FIELD_OF_VIEW,
    Camera,
    Detections,
    FieldOfView,
    Snapshot,
    load_snapshot,
    save_snapshot,
    snapshot_from_dict,
    snapshot_to_dict,
)

EXAMPLE: dict[str, Any] = {
    "camera": {
        "x": 1,
        "z": -2,
        "y": 1.6,
        "yaw_deg": 90,
        "pitch_deg": -20,
        "fov_left_deg": 35,
        "fov_right_deg": 34,
        "fov_up_deg": 20,
        "fov_down_deg": 25,
        "range_m": 3,
    },
    "detections": [
        {
            "id": "a",
            "category": "chair",
            "x": 2,
            "z": -1.5,
            "y": 0.1,
            "yaw_deg": 45,
            "size_whd": [0.4, 1, 0.5],
        },
        {
            "id": "b",
            "category": None,
            "x": 2.5,
            "z": -2,
            "yaw_deg": 400,
            "size_whd": [0.5, 1, 0.4],
            "confidence": 0.25,
        },
    ],
}

MISSING = object()


def changed(path: tuple[str | int, ...], value: Any) -> dict[str, Any]:
    data = copy.deepcopy(EXAMPLE)
    place: Any = data
    for step in path[:-1]:
        place = place[step]
    if value is MISSING:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return data


def test_every_value_of_a_file_is_read():
    snapshot = snapshot_from_dict(EXAMPLE)
    camera, seen = snapshot.camera, snapshot.detections
    assert camera.position.tolist() == [1, -2]
    assert (float(camera.yaw), float(camera.height)) == (np.pi / 2, 1.6)
    assert float(camera.pitch) == pytest.approx(-np.pi / 9)
    fov = camera.fov
    assert np.rad2deg([fov.left, fov.right, fov.up, fov.down]) == pytest.approx([35, 34, 20, 25])
    assert fov.range_m == 3
    assert seen.ids == ("a", "b")
    assert seen.category == ("chair", None)
    assert seen.position.tolist() == [[2, -1.5], [2.5, -2]]
    assert seen.elevation.tolist() == [0.1, 0]
    np.testing.assert_allclose(seen.yaw, [np.pi / 4, 400 * np.pi / 180])
    assert seen.size.tolist() == [[0.4, 1, 0.5], [0.5, 1, 0.4]]
    assert seen.confidence.tolist() == [1, 0.25]


def test_height_pitch_field_of_view_and_ids_may_be_left_out():
    data = {
        "camera": {"x": 1, "z": 2, "yaw_deg": 0},
        "detections": [{"x": 0, "z": 0, "yaw_deg": 0, "size_whd": [1, 1, 1]}] * 2,
    }
    snapshot = snapshot_from_dict(data)
    assert snapshot.camera.height is None
    assert snapshot.camera.pitch == 0
    assert snapshot.camera.fov == PAPER_FIELD_OF_VIEW
    assert snapshot.detections.ids == ("0", "1")
    assert snapshot.detections.category == (None, None)
    assert snapshot.detections.elevation.tolist() == [0, 0]


def test_a_snapshot_may_be_empty():
    snapshot = snapshot_from_dict(EXAMPLE | {"detections": []})
    assert len(snapshot.detections) == 0
    assert snapshot.detections.position.shape == (0, 2)
    assert snapshot_to_dict(snapshot)["detections"] == []


def test_a_file_may_say_what_it_is():
    assert len(snapshot_from_dict({"description": "Monday", **EXAMPLE}).detections) == 2


@st.composite
def snapshots(draw: st.DrawFn) -> Snapshot:
    metres, angles = st.floats(-50, 50), st.floats(-10, 10)
    half_turn, quarter = st.floats(0, np.pi), st.floats(0, np.pi / 2)
    vertical = draw(st.one_of(st.just((None, None)), st.tuples(quarter, quarter)))
    camera = Camera(
        [draw(metres), draw(metres)],
        draw(angles),
        FieldOfView(draw(half_turn), draw(half_turn), draw(st.floats(0.1, 100)), *vertical),
        draw(st.none() | metres),
        draw(angles),
    )
    ids = draw(st.lists(st.text(min_size=1, max_size=8), max_size=6, unique=True))

    def each(values: st.SearchStrategy[Any]) -> list[Any]:
        return draw(st.lists(values, min_size=len(ids), max_size=len(ids)))

    detections = Detections(
        tuple(each(st.none() | st.text(min_size=1, max_size=8))),
        each(st.tuples(metres, metres)),
        each(angles),
        each(st.tuples(*[st.floats(1e-3, 20)] * 3)),
        each(metres),
        each(st.floats(0, 1)),
        tuple(ids),
    )
    return Snapshot(camera, detections)


@given(snapshots())
def test_a_snapshot_that_is_written_and_read_is_the_same_snapshot(tmp_path_factory, snapshot):
    path = tmp_path_factory.getbasetemp() / "snapshot.json"
    save_snapshot(snapshot, path)
    written, again = path.read_bytes(), load_snapshot(path)
    one, other = snapshot.detections, again.detections
    assert (one.ids, one.category) == (other.ids, other.category)
    for name in ("position", "size", "elevation", "confidence"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_allclose(one.yaw, other.yaw, atol=1e-13)
    camera, other_camera = snapshot.camera, again.camera
    np.testing.assert_array_equal(camera.position, other_camera.position)
    np.testing.assert_allclose([camera.yaw, camera.pitch], [other_camera.yaw, other_camera.pitch], atol=1e-13)
    assert camera.height == other_camera.height
    for name in ("left", "right", "range_m", "up", "down"):
        assert getattr(camera.fov, name) == pytest.approx(getattr(other_camera.fov, name), abs=1e-13)
    save_snapshot(again, path)
    assert path.read_bytes() == written


BROKEN = [
    (("camera",), MISSING, "camera", "got nothing"),
    (("camera",), None, "camera", "got None"),
    (("camera", "x"), MISSING, "camera.x", "got nothing"),
    (("camera", "z"), np.nan, "camera.z", "got nan"),
    (("camera", "y"), None, "camera.y", "got None"),
    (("camera", "y"), np.inf, "camera.y", "got inf"),
    (("camera", "yaw_deg"), "90", "camera.yaw_deg", "got '90'"),
    (("camera", "yaw_deg"), True, "camera.yaw_deg", "got True"),
    (("camera", "pitch_deg"), [], "camera.pitch_deg", "got []"),
    (("camera", "fov_left_deg"), 200, "camera.fov_left_deg", "got 200"),
    (("camera", "fov_up_deg"), MISSING, "camera.fov_up_deg", "got nothing"),
    (("camera", "range_m"), -3, "camera.range_m", "got -3"),
    (("camera", "range_m"), np.inf, "camera.range_m", "got inf"),
    (("camera", "speed_m_s"), 1, "camera.speed_m_s", "got 1"),
    (("detections",), MISSING, "detections", "got nothing"),
    (("detections",), {}, "detections", "got {}"),
    (("detections", 0), "chair", "detections[0]", "got 'chair'"),
    (("detections", 1, "id"), "a", "detections[1].id", "got 'a'"),
    (("detections", 1, "id"), 1, "detections[1].id", "got 1"),
    (("detections", 1, "id"), "", "detections[1].id", "got ''"),
    (("detections", 0, "category"), "", "detections[0].category", "got ''"),
    (("detections", 0, "category"), 3, "detections[0].category", "got 3"),
    (("detections", 0, "x"), np.nan, "detections[0].x", "got nan"),
    (("detections", 0, "z"), None, "detections[0].z", "got None"),
    (("detections", 1, "yaw_deg"), np.inf, "detections[1].yaw_deg", "got inf"),
    (("detections", 1, "y"), "low", "detections[1].y", "got 'low'"),
    (("detections", 1, "size_whd"), [1, 0, 1], "detections[1].size_whd", "got [1, 0, 1]"),
    (("detections", 1, "confidence"), 1.01, "detections[1].confidence", "got 1.01"),
    (("detections", 1, "confidence"), np.nan, "detections[1].confidence", "got nan"),
    (("detections", 1, "label"), "7", "detections[1].label", "got '7'"),
    (("detection",), [], "detection", "got []"),
]  # fmt: skip


@pytest.mark.parametrize(("path", "value", "field", "end"), BROKEN)
def test_a_broken_file_gives_one_line_with_the_file_the_field_and_the_value(
    tmp_path, path, value, field, end
):
    file = tmp_path / "broken.json"
    file.write_text(json.dumps(changed(path, value)))
    with pytest.raises(SnapshotError) as problem:
        load_snapshot(file)
    text = str(problem.value)
    assert text.startswith(f"broken.json: {field}: must ")
    assert text.endswith(end)
    assert "\n" not in text
