"""Snapshots from a stream: each as soon as it is whole, and a bad one costs no more than itself."""

import io
import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import InputError, SnapshotError
from farm_ar.scenes import read_snapshots, streams


def snapshot(x: float = 1.0, **more: Any) -> dict[str, Any]:
    detections = [{"id": "a", "x": x, "z": 1}, {"id": "b", "x": 2, "z": 2, "yaw_deg": 30}]
    return {"camera": {"x": 0, "z": 0, "yaw_deg": 0}, "detections": detections, **more}


def read(text: str | bytes) -> list[Any]:
    """The x of the first detection of each snapshot, or the error's text."""
    data = text.encode() if isinstance(text, str) else text
    found = list(read_snapshots(io.BytesIO(data)))
    return [
        str(one) if isinstance(one, InputError) else float(one.detections.position[0, 0]) for one in found
    ]


FORMS = [
    lambda one: json.dumps(one),
    lambda one: json.dumps(one, indent=1),
    lambda one: json.dumps(one, indent=1).replace("\n", "\r\n"),
    lambda one: json.dumps(one).replace('"detections"', '\n"detections"').replace("}, {", "},\n{"),
]


@given(st.lists(st.tuples(st.sampled_from(FORMS), st.floats(-100, 100)), min_size=1, max_size=5))
def test_snapshots_are_lines_or_documents_of_many_lines_in_any_order(written):
    text = "\n\n".join(form(snapshot(x)) for form, x in written)
    assert read(text) == [x for _, x in written]
    assert read("\ufeff" + text + "\n") == [x for _, x in written]


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ("no JSON", "line 2: file: must be JSON, got 'Expecting value"),
        ('{"camera": {"x": 0', "line 2: file: must be JSON, got "),
        ('{"camera": {"x": 0, "z": 0, "yaw_deg": 0}, "detections": [{"id": "a', "line 2: file: must be JSON"),
        ("[1, 2]", "line 2: file: must be a JSON object, got [1, 2]"),
        ("{}", "line 2: camera: must be a JSON object, got nothing"),
        (json.dumps(snapshot(camra=1)), "line 2: camra: must not be there"),
        ('{"camera": 1, "camera": 2}', "line 2: file: must be JSON, got 'the field camera twice in one obj"),
        (json.dumps(snapshot() | {"camera": {"x": None}}), "line 2: camera.x: must be a number"),
        ("[" * 100_000, "line 2: file: must be JSON, got "),
    ],
)
def test_a_bad_line_is_one_error_and_the_rest_goes_on(bad, message):
    good = json.dumps(snapshot())
    first, error, last = read(f"{good}\n{bad}\n{good}\n")
    assert (first, last) == (1.0, 1.0)
    assert error.startswith(f"standard input: {message}")


def test_a_line_in_another_encoding_is_an_error_of_its_own():
    good = json.dumps(snapshot()).encode()
    assert read(good + b"\n\xff\xfe{}\n" + good)[1] == (
        "standard input: line 2: file: must be JSON in UTF-8, got 'another encoding'"
    )


@pytest.mark.parametrize("text", ["", "\n \n"])
def test_an_empty_stream_is_an_error(text):
    assert read(text) == ["standard input: file: must hold at least one snapshot, got 'nothing'"]


@pytest.mark.parametrize(
    ("broken", "reason"),
    [
        ({"x": None, "z": 1}, "x: must be a number from -1e9 to 1e9, got None"),
        ({"x": float("nan"), "z": 1}, "x: must be a number from -1e9 to 1e9, got nan"),
        ({"x": 1e300, "z": 1}, "x: must be a number from -1e9 to 1e9, got 1e+300"),
        ({"x": 5e6, "z": 1}, "x: must be "),
        ({"x": 1}, "z: must be a number "),
        ({"x": 1, "z": 1, "quaternion": [0, 0, 0, 0]}, "quaternion: must be a unit quaternion "),
        ({"x": 1, "z": 1, "quaternion": [0, None, 0, 1]}, "quaternion: must be 4 numbers [x, y, z, w], got"),
        ({"matrix": np.zeros((4, 4)).tolist()}, "matrix: must be 4 rows"),
        ({"x": 1, "z": 1, "size_whd": [0, 1, 1]}, "size_whd: must be 3 positive numbers"),
    ],
)
def test_a_broken_pose_names_its_field_and_leaves_the_others_as_they_are(broken, reason):
    file = snapshot()
    file["detections"].insert(1, {"id": "lost", "category": "chair", **broken})
    (found,) = read_snapshots(io.BytesIO(json.dumps(file).encode()))
    seen = found.detections
    assert seen.ids == ("a", "lost", "b")
    assert seen.category == (None, "chair", None)
    assert np.isnan(seen.position).tolist() == [[False] * 2, [True] * 2, [False] * 2]
    assert seen.yaw[2] == pytest.approx(np.pi / 6)
    assert (seen.broken[0], seen.broken[2]) == (None, None)
    assert seen.broken[1].startswith(reason)


def test_what_else_is_wrong_with_a_detection_is_an_error():
    file = snapshot()
    file["detections"][1] = {"id": "b", "x": None, "z": 1, "confidence": 7}
    file["detections"].append({"id": "a", "x": None, "z": 1})
    (found,) = read_snapshots(io.BytesIO(json.dumps(file).encode()))
    assert isinstance(found, SnapshotError)
    assert found.field == "detections[1].confidence"


def test_a_snapshot_is_there_before_the_next_line_comes():
    class Slow(io.RawIOBase):
        def __init__(self) -> None:
            self.lines = [json.dumps(snapshot(k)).encode() + b"\n" for k in range(3)]
            self.given = 0

        def readline(self, size: int = -1) -> bytes:
            self.given += 1
            return self.lines[self.given - 1] if self.given <= 3 else b""

    slow = Slow()
    for k, found in enumerate(read_snapshots(slow)):  # type: ignore[arg-type]
        assert slow.given == k + 1
        assert found.detections.position[0, 0] == k


def test_a_long_document_of_many_lines_is_not_tried_at_each(monkeypatch):
    lengths = []
    may_go_on = streams._may_go_on
    monkeypatch.setattr(streams, "_may_go_on", lambda text: lengths.append(len(text)) or may_go_on(text))
    many = [{"id": str(i), "x": i, "z": 0} for i in range(500)]
    text = json.dumps(snapshot() | {"detections": many}, indent=1)
    assert read(text + "\n" + json.dumps(snapshot(3.0))) == [0, 3]
    assert sum(lengths) < 6 * len(text)
