"""The file of a session: read whole or refused in one line, written whole or not at all."""

import copy
import json
import multiprocessing
import os
import signal
import time
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from farm_ar.cli.scenes import KINDS
from farm_ar.errors import SessionError
from farm_ar.reid import LikelihoodReid, Session
from farm_ar.reid.session.documents import SESSION
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot


def _snapshot(shift=0.0, tracks=("t0", "t1", None)):
    place = np.array([[0.0, 0.0], [2.0, 0.5], [4.0, -1.0]]) + shift
    seen = Detections(
        ("chair",) * 3, place, np.array([0.1, np.nan, 2.0]), np.full((3, 3), 0.5), track_id=tracks
    )
    return Snapshot(Camera(np.array([2.0, -4.0]), 0.0, FieldOfView(3.0, 3.0, 50.0)), seen, 12.5)


def _session():
    seen = _snapshot().detections
    layout = Layout(("a", "b", "c"), seen.category, seen.position, seen.yaw, seen.size)
    session = Session(Scene("room", (6.0, 5.0), layout), switch_rate=0.05)
    session.align(_snapshot(), ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    session.identify(_snapshot(0.1))
    session.correct({"2": "new"})
    session.confirm()
    session.commit()
    session.identify(_snapshot(0.2))
    return session


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    path = tmp_path_factory.mktemp("session") / "good.json"
    _session().save(path)
    return json.loads(path.read_text())


def _load(tmp_path, data):
    path = tmp_path / "session.json"
    path.write_text(data if isinstance(data, str) else json.dumps(data))
    return Session.load(path)


def test_a_file_is_of_its_schema_and_loads_to_the_same(good, tmp_path):
    jsonschema.validate(good, SESSION.schema())
    assert KINDS["session"] == "farm_ar.reid.session.documents:SESSION"
    session = _load(tmp_path, good)
    session.save(tmp_path / "again.json")
    assert json.loads((tmp_path / "again.json").read_text()) == good
    answer, other = session.identify(_snapshot(0.2)), _session().identify(_snapshot(0.2))
    assert answer.labels == other.labels
    assert answer.probability == pytest.approx(other.probability, abs=1e-9)


def _changed(good, path, value):
    data = copy.deepcopy(good)
    target = data
    for key in path[:-1]:
        target = target[key]
    if value is None and path[-1] in target:
        del target[path[-1]]
    else:
        target[path[-1]] = value
    return data


@pytest.mark.parametrize(
    ("path", "value", "field"),
    [
        (("version",), 2, "version"),
        (("version",), None, "version"),
        (("scene",), [], "scene"),
        (("scene", "objects", 0, "label"), "b", "scene.objects"),
        (("scene", "objects", 0, "x"), 1e300, "scene.objects[0].x"),
        (("reid",), "os:system", "reid"),
        (("reid",), 7, "reid"),
        (("switch_rate",), 2, "switch_rate"),
        (("events",), {}, "events"),
        (("events", 0), 3, "events[0]"),
        (("events", 0, "event"), "forget", "events[0].event"),
        (("events", 0, "event"), ["aligned"], "events[0].event"),
        (("events", 0, "x"), 1e300, "events[0].x"),
        (("events", 0, "more"), 1, "events[0].more"),
        (("events", 1, "labels"), ["a"], "events[1].labels"),
        (("events", 1, "labels", 0), {}, "events[1].labels[0]"),
        (("events", 1, "tracks"), [], "events[1].labels, tracks"),
        (("events", 1, "tracks", 0, "belief"), {"a": 7}, "events[1].tracks[0].belief.a"),
        (("events", 1, "snapshot", "detections", 1, "id"), "0", "events[1].snapshot.detections[1].id"),
        (("events", 1, "snapshot", "camera"), None, "events[1].snapshot.camera"),
        (("events", 2, "labels"), {"9": "new"}, "events[2].detection"),
        (("events", 2, "labels"), {"0": "b", "1": "b"}, "events[2].labels"),
        (("events", 3, "labels"), ["a", "a", None], "events[3].labels[0]"),
        (("events", 3, "learnt"), {"snapshots": -1}, "events[3].learnt.snapshots"),
        (("events", 3, "learnt"), {"snapshots": 1}, "events[3].disorder"),
        (("events", 3, "learnt", "motion"), [[1], [2, 3]], "events[3].disorder"),
        (("events", 3, "learnt", "rates"), "x", "events[3].disorder"),
        (("events", 1), {"event": "committed"}, "events[1].session"),
        (("events", 1), {"event": "confirmed", "labels": []}, "events[1].session"),
    ],
)
def test_a_broken_file_is_one_error_that_names_the_field(good, tmp_path, path, value, field):
    with pytest.raises(SessionError) as caught:
        _load(tmp_path, _changed(good, path, value))
    said = str(caught.value)
    assert "session.json" in said
    assert field in said
    assert "\n" not in said


@pytest.mark.parametrize(
    ("path", "value", "field"),
    [
        (("known",), [], "known"),
        (("known", "seen"), {"a": [1, 2, 0, 0]}, "known.seen.a"),
        (("known", "frame", "x"), 1e300, "known.frame.x"),
        (("known", "learnt"), {"snapshots": 1}, "known.disorder"),
        (("known", "look", "labels"), ["a"], "known.labels"),
        (("known", "look", "labels"), ["a", "a", None], "known.labels[0]"),
        (("known", "look", "tracks"), [], "known.look.tracks"),
        (("known", "look", "snapshot", "detections", 1, "id"), "0", "known.snapshot.detections[1].id"),
    ],
)
def test_a_broken_file_of_what_is_final_is_one_error_too(tmp_path, path, value, field):
    session = _session()
    session.settle(4)
    session.save(tmp_path / "good.json")
    good = json.loads((tmp_path / "good.json").read_text())
    jsonschema.validate(good, SESSION.schema())
    with pytest.raises(SessionError) as caught:
        _load(tmp_path, _changed(good, path, value))
    assert f"session.json: {field}: " in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "null",
        "[]",
        "{",
        '{"version": 1}',
        "[" * 10**5,
        '{"a": 1, "a": 2}',
        "NaN",
        "\ud7ff" * 3,
        '"\\ud800"',
    ],
)
def test_what_is_no_session_at_all_is_refused(tmp_path, text):
    with pytest.raises(SessionError, match=r"session\.json"):
        _load(tmp_path, text)
    with pytest.raises(SessionError, match="readable"):
        Session.load(tmp_path / "none.json")


def test_every_value_may_be_anything_and_nothing_else_is_raised(good, tmp_path):
    """Each value in turn is replaced by several that are wrong, or right by chance."""

    def paths(value, path=()):
        yield path
        if isinstance(value, dict):
            for key in value:
                yield from paths(value[key], (*path, key))
        if isinstance(value, list):
            for i in range(min(len(value), 2)):
                yield from paths(value[i], (*path, i))

    every = [path for path in paths(good) if path]
    for path in every:
        for value in (None, "b", -1, [], {}, 1e308, True, [[]]):
            data = copy.deepcopy(good)
            target = data
            for key in path[:-1]:
                target = target[key]
            target[path[-1]] = value
            try:
                session = _load(tmp_path, data)
                session.identify(_snapshot(0.3))
            except SessionError:
                continue


def test_what_was_learnt_under_other_options_is_left_out_and_nothing_else(good, tmp_path):
    data = _changed(
        good, ("events", 3, "learnt"), {"snapshots": 1, "motion": [1.0], "rates": [], "sizes": []}
    )
    session = _load(tmp_path, data)
    assert session.identify(_snapshot(0.2)).labels[:2] == ("a", "b")
    session.confirm()
    assert session.state.learnt.snapshots == 1


def test_a_method_of_ones_own_is_not_written_and_has_to_be_given(tmp_path):
    session = Session(_session().scene, LikelihoodReid)
    path = tmp_path / "own.json"
    session.save(path)
    assert json.loads(path.read_text())["reid"] is None
    with pytest.raises(SessionError, match="where no method is given"):
        Session.load(path)
    assert Session.load(path, LikelihoodReid).scene.layout.labels == session.scene.layout.labels
    assert Session.load(path, "spatial").scene.name == "room"


def _save_again_and_again(path):
    session = _session()
    for i in range(10**6):
        session.identify(_snapshot(0.001 * (i % 50)))
        session.confirm()
        session.save(path)


def test_a_kill_during_save_leaves_a_whole_file(tmp_path):
    path = tmp_path / "session.json"
    _session().save(path)
    for wait in (0.05, 0.11, 0.02):
        process = multiprocessing.get_context("fork").Process(target=_save_again_and_again, args=(path,))
        process.start()
        time.sleep(1.0 + wait)
        os.kill(process.pid, signal.SIGKILL)
        process.join()
        assert Session.load(path).scene.name == "room"


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "session.json"
    session = _session()
    session.save(path)
    before = path.read_bytes()
    monkeypatch.setattr(Path, "replace", _full)
    with pytest.raises(OSError, match="full"):
        session.save(path)
    assert path.read_bytes() == before
    assert [one.name for one in tmp_path.iterdir()] == ["session.json"]


def _full(*_):
    raise OSError("full")
