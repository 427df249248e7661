"""Snapshots from a stream, one JSON document after another: a bad one costs no more than itself."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, BinaryIO

import numpy as np

from farm_ar.errors import InputError, SnapshotError
from farm_ar.scenes.files import MOST_BYTES, json_in
from farm_ar.scenes.json_files import snapshot_from_dict
from farm_ar.scenes.snapshot import Detections, Snapshot

POSE_FIELDS = (
    *("x", "y", "z", "yaw_deg", "yaw_rad", "quaternion", "matrix", "size_whd"),
    *("covariance", "visible", "runner_up"),
)
"""The fields of a detection that say its pose and size."""

_OF_POSE = re.compile(rf"detections\[(\d+)\]\.({'|'.join(POSE_FIELDS)})\b.*")


def read_snapshots(stream: BinaryIO, name: str = "standard input") -> Iterator[Snapshot | InputError]:
    """Each snapshot of a stream as soon as it is whole, or what is wrong with it.

    A snapshot is a line (JSON Lines), or a document of several lines. A detection whose pose is broken is
    kept, with NaN for its pose: it cannot be identified, but the others can.

    Args:
        stream: UTF-8, with or without a byte order mark.
        name: what errors call it.
    """
    for _, found in numbered_snapshots(stream, name):
        yield found


def numbered_snapshots(
    stream: BinaryIO, name: str = "standard input"
) -> Iterator[tuple[int, Snapshot | InputError]]:
    """What `read_snapshots` gives, each with the number of the line where it begins; 0 for no line."""
    number = 0
    for number, text in _documents(stream):
        where = f"{name}: line {number}"
        if isinstance(text, str):
            try:
                yield number, tolerant_snapshot(json_in(text), where)
            except SnapshotError as problem:
                yield number, problem
            except (ValueError, RecursionError) as problem:
                yield number, SnapshotError("file", "must be JSON", str(problem), where)
        else:
            yield number, SnapshotError("file", text[0], text[1], where)
    if not number:
        yield 0, SnapshotError("file", "must hold at least one snapshot", "nothing", name)


def tolerant_snapshot(data: object, source: str | None = None) -> Snapshot:
    """A snapshot of which some detections may have a broken pose, which becomes NaN, with the reason.

    Raises:
        SnapshotError: anything else cannot be used; names the field.
    """
    try:
        return snapshot_from_dict(data, source)
    except SnapshotError as problem:
        if not _OF_POSE.fullmatch(problem.field):
            raise
    assert isinstance(data, Mapping)
    entries, broken = list(data["detections"]), dict[int, str]()
    for i, entry in enumerate(entries):
        try:
            snapshot_from_dict({**data, "detections": [entry]}, source)
        except SnapshotError as problem:
            if not (field := _OF_POSE.fullmatch(problem.field)):
                continue  # the whole snapshot, read below, says where it is
            alone = SnapshotError(problem.field[field.start(2) :], problem.expected, problem.got)
            broken[i] = str(alone)
            rest = {key: value for key, value in entry.items() if key not in POSE_FIELDS}
            entries[i] = rest | dict.fromkeys("xy" if data.get("frame") == "ros" else "xz", 0.0)
    snapshot = snapshot_from_dict({**data, "detections": entries}, source)
    seen = snapshot.detections
    changes: dict[str, Any] = {}
    for name in ("position", "yaw", "size", "elevation"):
        values = np.array(getattr(seen, name))
        values[list(broken)] = np.nan
        changes[name] = values
    changes["broken"] = tuple([broken.get(i) for i in range(len(seen))])
    return replace(snapshot, detections=Detections.trusted(**vars(seen) | changes))


def _documents(stream: BinaryIO) -> Iterator[tuple[int, str | tuple[str, str]]]:
    """The text of each document and the number of its first line; or what is expected, and what came.

    A line that is a snapshot by itself ends whatever came before it unfinished.
    """
    first, waiting, tried = 1, "", 0
    for number in range(1, 2**62):
        line = stream.readline(MOST_BYTES + 1)
        if len(line) > MOST_BYTES or len(waiting) + len(line) > MOST_BYTES:
            yield first, (f"must be at most {MOST_BYTES >> 20} MiB", "more")
            return
        try:
            text = line.decode("utf-8-sig" if number == 1 else "utf-8")
        except UnicodeDecodeError:
            yield number, ("must be JSON in UTF-8", "another encoding")
            continue
        whole = _is_snapshot(text)
        if waiting and (whole or not line):
            yield first, waiting
            waiting = ""
        if not line:
            return
        if whole:
            yield number, text
        elif waiting or text.strip():
            first = first if waiting else number
            waiting, tried = waiting + text, tried if waiting else 0
            # Where it may end, or has doubled: tried at each line, a long document would cost its square.
            if text.rstrip().endswith("}") or len(waiting) > 2 * tried:
                tried = len(waiting)
                if not _may_go_on(waiting):
                    yield first, waiting
                    waiting = ""


def _is_snapshot(text: str) -> bool:
    """Whether a line is an object of its own, and not one inside another."""
    if not text.lstrip().startswith("{"):
        return False
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return False
    return isinstance(found, dict) and not found.keys().isdisjoint(("camera", "detections"))


def _may_go_on(text: str) -> bool:
    """Whether a text that is not JSON may become so by further lines."""
    try:
        json.loads(text)
    except json.JSONDecodeError as problem:
        return problem.pos >= len(text.rstrip()) or problem.msg.startswith("Unterminated string")
    except (ValueError, RecursionError):
        return False
    return False
