"""The usual snapshot is read quickly, to the same bits, and nothing else is."""

from __future__ import annotations

import json
import re
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import InputError
from farm_ar.service.limits import ServiceLimits
from farm_ar.service.usual_form import usual_snapshot
from farm_ar.service.wire import SnapshotBody, parsed, read_snapshots

LIMITS = ServiceLimits()

SEEN: dict[str, Any] = {"id": "a", "category": "chair", "x": 0.5, "z": 1, "yaw_deg": 30.0}
BODY: dict[str, Any] = {
    "frame": "unity",
    "timestamp": 12.5,
    "camera": {"x": 0, "y": 1.6, "z": -1.0, "yaw_deg": 10.0, "fov_left_deg": 40, "fov_right_deg": 40.0},
    "detections": [SEEN, {**SEEN, "id": "b", "y": 0.1, "size_whd": [0.4, 1, 0.5], "confidence": 0.9}],
}

_number = st.floats(-1e3, 1e3) | st.integers(-5, 5)
_detection = st.fixed_dictionaries(
    {"x": _number, "y": _number, "z": _number},
    optional={
        "category": st.sampled_from(["chair", "tafel", "Füße", None]),
        "track_id": st.text("xyzé", max_size=2) | st.none(),
        "id": st.text("ab01", min_size=0, max_size=2),
        "yaw_deg": _number,
        "size_whd": st.lists(st.floats(0, 2) | st.integers(1, 3), min_size=3, max_size=3),
        "confidence": st.floats(0, 1.2),
    },
)
_body = st.fixed_dictionaries(
    {
        "frame": st.sampled_from(["unity", "openxr", "ros", "ros"]),
        "camera": st.fixed_dictionaries(
            {"x": _number, "y": _number, "z": _number, "yaw_deg": _number},
            optional={
                "pitch_deg": _number,
                "fov_left_deg": st.floats(0, 200),
                "range_m": st.floats(0, 10),
                "fov_up_deg": st.floats(0, 90),
                "fov_down_deg": st.floats(0, 90),
            },
        ),
        "detections": st.lists(_detection, max_size=4),
    },
    optional={"timestamp": _number | st.none()},
)


def slow(body: bytes) -> SnapshotBody | str:
    """What `read_snapshots` makes of a body, or what it says is wrong."""
    try:
        return read_snapshots(parsed(body, LIMITS.most_text), LIMITS)
    except InputError as problem:
        return str(problem)


def same(one: object, other: object) -> bool:
    """Whether two records have the same fields, arrays to the last bit, the sign of 0 included."""
    if isinstance(one, np.ndarray):
        assert isinstance(other, np.ndarray)
        return (one.shape, one.dtype, one.tobytes()) == (other.shape, other.dtype, other.tobytes())
    if hasattr(one, "__dataclass_fields__"):
        names = [field.name for field in fields(one)]  # type: ignore[arg-type]
        return type(one) is type(other) and all(same(getattr(one, n), getattr(other, n)) for n in names)
    if isinstance(one, tuple):
        return isinstance(other, tuple) and len(one) == len(other) and all(map(same, one, other))
    return type(one) is type(other) and one == other


@given(_body)
def test_what_is_read_quickly_is_what_is_read(values: dict[str, Any]) -> None:
    body = json.dumps(values, ensure_ascii=False).encode()
    found = usual_snapshot(body, LIMITS)
    if found is not None:
        expected = slow(body)
        assert not isinstance(expected, str), expected
        assert same(tuple(found), tuple(expected))


@pytest.mark.parametrize("frame", ["unity", "openxr", "ros"])
def test_the_usual_snapshot_is_read_quickly(frame: str) -> None:
    camera = {**BODY["camera"], "z": 1.0}
    seen = [{**one, "y": one.get("y", 0.0)} for one in BODY["detections"]]
    body = json.dumps({**BODY, "frame": frame, "camera": camera, "detections": seen}).encode()
    found = usual_snapshot(body, LIMITS)
    assert found is not None
    expected = slow(body)
    assert not isinstance(expected, str)
    assert same(tuple(found), tuple(expected))


def changed(**changes: Any) -> bytes:
    """The usual body with another first detection."""
    return several({**SEEN, **changes}, BODY["detections"][1])


def several(*seen: dict[str, Any]) -> bytes:
    """The usual body with other detections."""
    return json.dumps({**BODY, "detections": list(seen)}).encode()


TEXT = json.dumps(BODY)

OTHERWISE = {
    "a field twice": TEXT.replace('"x": 0.5', '"x": 7.5, "x": 0.5', 1).encode(),
    "a field twice, with a blank": TEXT.replace('"x": 0.5', '"x" : 7.5, "x": 0.5', 1).encode(),
    "a top field twice": TEXT.replace('"frame": "unity"', '"frame": "ros", "frame": "unity"').encode(),
    "a camera's field twice": TEXT.replace('"y": 1.6', '"y": 3, "y": 1.6').encode(),
    "NaN": TEXT.replace("0.5", "NaN", 1).encode(),
    "infinity": TEXT.replace("0.5", "1e999", 1).encode(),
    "minus infinity": TEXT.replace("0.5", "-Infinity", 1).encode(),
    "a long number": TEXT.replace("0.5", "1" * 400, 1).encode(),
    "a leading zero": TEXT.replace("0.5", "00.5", 1).encode(),
    "a trailing comma": TEXT.replace('"yaw_deg": 30.0}', '"yaw_deg": 30.0,}', 1).encode(),
    "more behind it": (TEXT + "{}").encode(),
    "half of it": TEXT[:-20].encode(),
    "a byte order mark": b"\xef\xbb\xbf" + TEXT.encode(),
    "another encoding": TEXT.encode("utf-16"),
    "bytes that are no UTF-8": TEXT.replace("chair", "ch\udcffir", 1).encode("utf-8", "surrogateescape"),
    "an escape": TEXT.replace("chair", "ch\\u0061ir", 1).encode(),
    "half a surrogate pair": TEXT.replace("chair", "\\ud800", 1).encode(),
    "an empty id": changed(id=""),
    "an id twice": changed(id="b"),
    "an id that is a place": several({**SEEN, "id": "1"}, {"x": 1, "z": 2}),
    "a null id": changed(id=None),
    "a number for an id": changed(id=3),
    "a long id": changed(id="a" * 257),
    "a long category": changed(category="ü" * 257),
    "a track twice": several({**SEEN, "track_id": "t"}, {**SEEN, "id": "c", "track_id": "t"}),
    "true for a number": changed(x=True),
    "text for a number": changed(x="1"),
    "null for a number": changed(x=None),
    "no x": json.dumps({**BODY, "detections": [{"z": 1}]}).encode(),
    "far away": changed(x=1e7),
    "many turns": changed(yaw_deg=1e9),
    "two headings": changed(yaw_rad=1.0),
    "a quaternion": several({"x": 1, "z": 1, "quaternion": [0, 0, 0, 1]}),
    "a list for an id": changed(id=[]),
    "an object for an id": changed(id={}),
    "a list for a category": changed(category=["chair"]),
    "an object for a category": changed(category={}),
    "a list for a track": changed(track_id=[1]),
    "a list for a number": changed(x=[1]),
    "lists for sides": changed(size_whd=[[1], [1], [1]]),
    "a list for a frame": json.dumps({**BODY, "frame": ["unity"]}).encode(),
    "two sides": changed(size_whd=[1, 1]),
    "a side of 0": changed(size_whd=[1, 0, 1]),
    "text of three for a size": changed(size_whd="abc"),
    "an object for a size": changed(size_whd={"a": 1, "b": 1, "c": 1}),
    "a confidence above 1": changed(confidence=1.5),
    "an unknown field": changed(colour="red"),
    "no frame": json.dumps({**BODY, "frame": None}).encode(),
    "an unknown frame": json.dumps({**BODY, "frame": "webxr"}).encode(),
    "units": json.dumps({**BODY, "units": "cm"}).encode(),
    "an infinite time": json.dumps({**BODY, "timestamp": 1e16}).encode(),
    "a null time": json.dumps({**BODY, "timestamp": None}).encode(),
    "a wide view": json.dumps({**BODY, "camera": {**BODY["camera"], "fov_left_deg": 181}}).encode(),
    "half a vertical view": json.dumps({**BODY, "camera": {**BODY["camera"], "fov_up_deg": 20}}).encode(),
    "no range": json.dumps({**BODY, "camera": {**BODY["camera"], "range_m": 0}}).encode(),
    "a camera without heading": json.dumps({**BODY, "camera": {"x": 0, "z": 0}}).encode(),
    "a camera that is none": json.dumps({**BODY, "camera": [0, 0]}).encode(),
    "a detection that is none": json.dumps({**BODY, "detections": [3]}).encode(),
    "no detections": json.dumps({**BODY, "detections": None}).encode(),
    "too many detections": json.dumps(
        {**BODY, "detections": [{"x": 1, "z": 1}] * (LIMITS.most_detections + 1)}
    ).encode(),
    "a list": b"[]",
    "nothing": b"",
}  # fmt: skip


@pytest.mark.parametrize("name", OTHERWISE)
def test_what_is_written_otherwise_is_left_to_who_says_what_is_wrong(name: str) -> None:
    assert usual_snapshot(OTHERWISE[name], LIMITS) is None


TOKEN = re.compile(rb'"[^"]*"|-?[0-9.]+|[][{}:,]')
ODD = [
    *rb'null true [] {} [1] {"x":1} "" "x" " { } [ ] : , "x":1,"x" "a:b" "\u0061" /**/'.split(),
    *b"-0 -0.0 1e400 5e-324 1E5 +1 01 .5 1. 18446744073709551616 NaN".split(),
    *(b"", b"\x00", b"\xff", b"\xef\xbb\xbf", b'"\xc3\xbc"', b"\xc2\xa0"),
]


@given(
    st.lists(st.tuples(st.integers(0, 200), st.sampled_from(ODD)), min_size=1, max_size=3),
    st.sampled_from(["unity", "openxr", "ros"]),
)
def test_whatever_is_changed_in_it_is_read_alike_or_left(
    changes: list[tuple[int, bytes]], frame: str
) -> None:
    body = json.dumps(
        {**BODY, "frame": frame, "camera": {**BODY["camera"], "fov_up_deg": 20, "fov_down_deg": 9}}
    )
    tokens = TOKEN.findall(body.encode())
    for place, odd in changes:
        tokens[place % len(tokens)] = odd
    changed_body = b" ".join(tokens)
    found = usual_snapshot(changed_body, LIMITS)
    if found is not None:
        expected = slow(changed_body)
        assert not isinstance(expected, str), expected
        assert same(tuple(found), tuple(expected))
