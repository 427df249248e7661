"""What each request does to a session, and what it is answered."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from typer.testing import CliRunner

from farm_ar.cli.program import app
from farm_ar.geometry import convert_points
from farm_ar.reid import identify
from farm_ar.reid.costs import dimension_cost, rotation_cost, total_cost, translation_cost
from farm_ar.reid.session import Session
from farm_ar.scenes import Layout, Scene, Weights, builtin_scene, scene_from_dict, snapshot_from_dict, visible
from farm_ar.service.methods import OPTIONS, method_of
from farm_ar.service.store import Store
from tests.service.conftest import Asked, Values, lab, layout_body, seen_in, served_anew, snapshot_body


def test_a_detection_gets_the_label_cost_and_margin_of_the_method(asked: Asked) -> None:
    scene = lab()
    snapshot = seen_in(scene, 0.2, kept=5)
    asked.good("layout", layout_body(scene, method="spatial"))
    reply = asked.good("snapshots", snapshot_body(snapshot, timestamp=12.5))
    expected = identify(scene, snapshot, "spatial")
    assert [one["id"] for one in reply["detections"]] == list(expected.labels)
    assert [one["cost"] for one in reply["detections"]] == pytest.approx(expected.cost.tolist(), rel=1e-9)
    assert [one["margin"] for one in reply["detections"]] == pytest.approx(expected.margin.tolist(), rel=1e-9)
    assert [one["detection"] for one in reply["detections"]] == [f"d{i}" for i in range(5)]
    assert reply["header"] == {"stamp": 12.5, "frame_id": "unity"}
    in_view = visible(scene.layout, snapshot.camera, occlusion=True)
    places = zip(scene.layout.labels, in_view, strict=True)
    assert reply["missing"] == [name for name, here in places if here and name not in expected.labels]
    assert reply["missing"]


def test_alternatives_are_the_other_labels_by_probability(asked: Asked) -> None:
    scene = lab()
    snapshot = seen_in(scene, 0.3)
    asked.good("layout", layout_body(scene, method="likelihood"))
    reply = asked.good("snapshots", snapshot_body(snapshot))
    make, _ = method_of("likelihood", {})
    expected = identify(scene, snapshot, make)
    assert expected.probability is not None
    some = 0
    for i, one in enumerate(reply["detections"]):
        row = dict(zip([*expected.candidates, None], expected.probability[i].tolist(), strict=True))
        assert one["confidence"] == pytest.approx(expected.confidence[i], rel=1e-6)
        row.pop(one["id"])
        best = sorted(row.items(), key=lambda item: -item[1])[:3]
        assert [(a["id"], pytest.approx(a["confidence"])) for a in one["alternatives"]] == [
            pair for pair in best if pair[1] >= 1e-3
        ]
        some += len(one["alternatives"])
    assert some


@pytest.mark.parametrize("frame", ["openxr", "ros"])
def test_the_same_world_in_another_frame_gets_the_same_labels_and_costs(asked: Asked, frame: str) -> None:
    scene = lab()
    snapshot = seen_in(scene, 0.15)
    bodies = layout_body(scene, method="spatial"), snapshot_body(snapshot)
    asked.good("layout", bodies[0])
    ours = asked.good("snapshots", bodies[1])
    theirs = [json.loads(json.dumps(body)) for body in bodies]
    for body in theirs:
        body["frame"] = frame
        for name in ("name", "templates", "camera_path", "sites"):
            body.pop(name, None)
    theirs[0]["bounds"] = [_there(point, frame) for point in [[0, 0], [9, 0], [9, 9], [0, 9]]]
    theirs[0].pop("size_m", None)
    assert scene.room is not None
    w, d = scene.room
    theirs[0]["bounds"] = [_there(point, frame) for point in ([0, 0], [w, 0], [w, d], [0, d])]
    for one in [*theirs[0]["objects"], *theirs[1]["detections"], theirs[1]["camera"]]:
        _move(one, frame)
    asked.good("layout", theirs[0], "other")
    reply = asked.good("snapshots", theirs[1], "other")
    assert reply["header"]["frame_id"] == frame
    for here, there in zip(ours["detections"], reply["detections"], strict=True):
        assert (here["id"], here["detection"]) == (there["id"], there["detection"])
        assert there["cost"] == pytest.approx(here["cost"], rel=1e-9, abs=1e-12)


def _there(point: Any, frame: str) -> list[float]:
    x, z = point
    return [x, -z] if frame == "openxr" else [z, -x]


def _move(one: dict[str, Any], frame: str) -> None:
    x, y, z = one["x"], one.get("y", 0.0), one["z"]
    one["x"], one["y"], one["z"] = (x, y, -z) if frame == "openxr" else (z, -x, y)
    one["yaw_deg"] = -one["yaw_deg"]


@pytest.mark.parametrize("frame", ["unity", "openxr", "ros"])
def test_the_state_is_given_in_the_frame_that_is_asked_for(asked: Asked, frame: str) -> None:
    scene = lab()
    asked.good("layout", layout_body(scene))
    state = asked.state(frame)
    assert state["header"]["frame_id"] == frame
    layout = scene.layout
    ours = np.column_stack([layout.position[:, 0], layout.elevation, layout.position[:, 1]])
    expected = convert_points(ours, "unity", frame)
    axis = {"unity": (0, 1, 0), "openxr": (0, -1, 0), "ros": (0, 0, -1)}[frame]
    for j, one in enumerate(state["objects"]):
        assert [one["pose"]["position"][c] for c in "xyz"] == pytest.approx(expected[j].tolist())
        turn = [one["pose"]["orientation"][c] for c in "xyzw"]
        assert turn == pytest.approx(
            [*(np.sin(layout.yaw[j] / 2) * np.array(axis)), np.cos(layout.yaw[j] / 2)]
        )
        assert [one["size"][c] for c in "xyz"] == pytest.approx(layout.size[j].tolist())


def test_a_body_without_a_frame_is_refused(asked: Asked) -> None:
    body = layout_body(lab())
    del body["frame"]
    assert asked.refused("layout", body) == (
        422,
        {
            "field": "frame",
            "expected": "must be one of unity, openxr, ros",
            "got": "nothing",
            "message": "frame: must be one of unity, openxr, ros, got nothing",
        },
    )


POSES = {
    "not unit": ({"quaternion": [0, 0, 0, 2.0]}, "must be a unit quaternion"),
    "mirrors": (
        {"matrix": [[-1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]]},
        "must be a rotation, which is right-handed: this one mirrors",
    ),
    "scaled": ({"matrix": [[2, 0, 0, 1], [0, 2, 0, 0], [0, 0, 2, 1], [0, 0, 0, 1]]}, "must be rigid"),
}


@pytest.mark.parametrize("kind", POSES)
def test_a_pose_in_another_convention_is_refused(asked: Asked, kind: str) -> None:
    pose, expected = POSES[kind]
    scene = lab()
    asked.good("layout", layout_body(scene))
    body = snapshot_body(seen_in(scene))
    one = body["detections"][1]
    del one["yaw_deg"]
    if "matrix" in pose:
        for axis in "xyz":
            one.pop(axis, None)
    one |= pose
    status, error = asked.refused("snapshots", body)
    assert status == 422
    assert error["field"] == f"detections[1].{next(iter(pose))}"
    assert error["expected"].startswith(expected)


@pytest.mark.parametrize("value", [None, "here", float("nan"), float("inf"), 1e300, [1]])
def test_a_broken_pose_is_answered_null_with_a_reason_and_the_others_are_identified(
    asked: Asked, value: object
) -> None:
    scene = lab()
    asked.good("layout", layout_body(scene, method="spatial"))
    body = snapshot_body(seen_in(scene))
    body["detections"][2]["x"] = value
    reply = asked.good("snapshots", body)
    broken = reply["detections"].pop(2)
    assert broken["id"] is None
    assert "pose is broken" in broken["reason"]
    assert broken["detection"] not in reply["new"]
    assert [one["id"] for one in reply["detections"]] == [
        label for i, label in enumerate(scene.layout.labels) if i != 2
    ]
    assert all(one["reason"] is None for one in reply["detections"])


@pytest.mark.parametrize(("tilt", "said"), [(4.0, False), (6.0, True)])
def test_a_tilt_beyond_five_degrees_is_reported(asked: Asked, tilt: float, said: bool) -> None:
    scene = lab()
    asked.good("layout", layout_body(scene, method="spatial"))
    body = snapshot_body(seen_in(scene))
    half = np.deg2rad(tilt) / 2
    for frame, axis in (("unity", 0), ("openxr", 2), ("ros", 1)):
        one = json.loads(json.dumps(body))
        one["frame"] = frame
        if frame == "ros":
            for d in [*one["detections"], one["camera"]]:
                d["y"], d["z"] = d["z"], d.get("y", 0.0)
        lean = np.zeros(4)
        lean[axis], lean[3] = np.sin(half), np.cos(half)
        del one["detections"][0]["yaw_deg"]
        one["detections"][0]["quaternion"] = lean.tolist()
        asked.good("layout", layout_body(scene, method="spatial-3d"), "in-space")
        assert not any("tilted" in text for text in asked.good("snapshots", one, "in-space")["warnings"])
        asked.good("delete", b"", "in-space")
        warnings = [text for text in asked.good("snapshots", one)["warnings"] if "tilted" in text]
        assert warnings == (
            ["detections d0: tilted by up to 6°, of which only the heading counts"] if said else []
        )


def test_what_is_confirmed_is_the_layout_from_here_on_and_undo_takes_it_back(asked: Asked) -> None:
    scene = lab()
    asked.good("layout", layout_body(scene, method="spatial"))
    before = asked.state()
    snapshot = seen_in(scene, 0.2)
    seen = asked.good("snapshots", snapshot_body(snapshot))
    swap = {"d0": scene.layout.labels[1], "d1": scene.layout.labels[0]}
    reply = asked.good("confirm", {"revision": 1, "snapshot": seen["snapshot"], "labels": swap})
    assert reply["revision"] == 2
    expected = Session(scene, "spatial")
    expected.identify(snapshot)
    expected.correct(swap)
    expected.confirm()
    expected.commit()
    after = asked.state()
    assert [(one["pose"]["position"]["x"], one["pose"]["position"]["z"]) for one in after["objects"]] == [
        tuple(place) for place in expected.scene.layout.position.tolist()
    ]
    assert after["history"][0]["labels"] == swap
    undone = asked.good("undo", {"revision": 2})
    assert undone["revision"] == 3
    assert undone["undone"]["did"] == "confirm"
    assert asked.state()["objects"] == before["objects"]
    assert asked.state()["history"] == []
    assert asked.refused("undo", {"revision": 3})[0] == 422


def test_a_new_label_enrols_an_object(asked: Asked) -> None:
    scene = lab()
    asked.good("layout", layout_body(scene, method="spatial"))
    body = snapshot_body(seen_in(scene))
    body["detections"].append({**body["detections"][0], "id": "extra", "x": 0.4, "z": 0.4})
    seen = asked.good("snapshots", body)
    asked.good("confirm", {"revision": 1, "snapshot": seen["snapshot"], "labels": {"extra": "newcomer"}})
    assert "newcomer" in [one["id"] for one in asked.state()["objects"]]


def test_labels_of_another_category_need_force_and_doubted_ones_are_named(asked: Asked) -> None:
    scene = builtin_scene("farm")
    layout = scene.layout
    other = next(j for j, name in enumerate(layout.category) if name != layout.category[0])
    asked.good("layout", layout_body(scene, method="likelihood"))
    halfway = (layout.position + np.roll(layout.position, 1, axis=0)) / 2
    body = snapshot_body(seen_in(scene))
    for one, (x, z) in zip(body["detections"], halfway.tolist(), strict=True):
        one["x"], one["z"] = x, z
    seen = asked.good("snapshots", body)
    unsure = {one["detection"] for one in seen["detections"] if one["id"] and one["confidence"] < 0.5}
    decided = {"revision": 1, "snapshot": seen["snapshot"], "labels": {"d0": layout.labels[other]}}
    status, error = asked.refused("confirm", decided)
    assert (status, "category" in error["expected"]) == (422, True)
    reply = asked.good("confirm", {**decided, "force": True})
    assert unsure
    assert set(reply["doubted"]) == unsure - {"d0"}


def test_an_anchor_alone_says_where_the_frame_is(asked: Asked) -> None:
    scene = lab()
    asked.good("layout", layout_body(scene, method="spatial"))
    # The marker is at the app's origin, and in the map at (2, 1), turned by 90 degrees to its right.
    anchor = {"here": {"x": 0, "z": 0, "yaw_deg": 0}, "map": {"x": 2, "z": 1, "yaw_deg": 90}}
    reply = asked.good("align", {"frame": "unity", "revision": 1, "anchor": anchor})
    assert reply["aligned"]
    assert reply["revision"] == 2
    origin = reply["origin"]
    assert [origin["position"][c] for c in "xyz"] == pytest.approx([2, 0, 1], abs=1e-9)
    root = np.sqrt(0.5)
    assert [origin["orientation"][c] for c in "xyzw"] == pytest.approx([0, root, 0, root])
    # A point (x, z) of the app is then (2 + z, 1 - x) in the map; the inverse of it for what is seen.
    body = snapshot_body(seen_in(scene))
    for one in [*body["detections"], body["camera"]]:
        one["x"], one["z"] = 1 - one["z"], one["x"] - 2
        one["yaw_deg"] -= 90
    seen = asked.good("snapshots", body)
    assert [one["id"] for one in seen["detections"]] == list(scene.layout.labels)
    assert max(one["cost"] for one in seen["detections"]) < 1e-9


def test_an_anchor_in_another_frame_is_converted(asked: Asked) -> None:
    scene = lab()
    asked.good("layout", layout_body(scene))
    anchor = {"here": {"x": 0, "z": 0, "yaw_deg": 0}, "map": {"x": 2, "z": -1, "yaw_deg": -90}}
    reply = asked.good("align", {"frame": "openxr", "revision": 1, "anchor": anchor})
    assert [reply["origin"]["position"][c] for c in "xyz"] == pytest.approx([2, 0, -1], abs=1e-9)
    root = np.sqrt(0.5)
    assert [reply["origin"]["orientation"][c] for c in "xyzw"] == pytest.approx([0, -root, 0, root])


def test_alignment_by_what_stands_where_is_taken_only_if_certain(asked: Asked) -> None:
    scene = lab()
    asked.good("layout", layout_body(scene))
    body = snapshot_body(seen_in(scene, kept=1), revision=1)
    reply = asked.good("align", body)
    assert not reply["aligned"]
    assert reply["reason"]
    assert (reply["revision"], reply["origin"]) == (1, None)


def test_several_snapshots_are_fused(asked: Asked) -> None:
    scene = lab()
    asked.good("layout", layout_body(scene, method="spatial"))
    halves = [snapshot_body(seen_in(scene, 0.02)), snapshot_body(seen_in(scene, 0.02))]
    halves[0]["detections"] = halves[0]["detections"][:5]
    halves[1]["detections"] = halves[1]["detections"][3:]
    reply = asked.good("snapshots", {"snapshots": halves})
    assert sorted(one["id"] for one in reply["detections"]) == sorted(scene.layout.labels)
    by_detection = {
        (seen["snapshot"], seen["detection"]): one["id"]
        for one in reply["detections"]
        for seen in one["seen"]
    }
    expected = {(0, f"d{i}"): scene.layout.labels[i] for i in range(5)}
    expected |= {(1, f"d{i}"): scene.layout.labels[i] for i in range(3, len(scene.layout))}
    assert by_detection == expected
    asked.good("confirm", {"revision": 1, "snapshot": reply["snapshot"]})
    halves[0]["detections"][1]["x"] = None
    *_, broken = asked.good("snapshots", {"snapshots": halves})["detections"]
    assert (broken["id"], broken["seen"]) == (None, [{"snapshot": 0, "detection": "d1"}])


def test_two_clients_lose_no_decision(asked: Asked) -> None:
    scene = lab()
    asked.good("layout", layout_body(scene, method="spatial"))
    one = asked.good("snapshots", snapshot_body(seen_in(scene, 0.1)))
    other = asked.good("snapshots", snapshot_body(seen_in(scene, 0.2)))
    # The first client's snapshot is no longer the last one: its confirmation would be of the other's.
    status, error = asked.refused("confirm", {"revision": 1, "snapshot": one["snapshot"]})
    assert (status, error["field"]) == (409, "snapshot")
    asked.good("confirm", {"revision": 1, "snapshot": other["snapshot"]})
    for action, body in (("confirm", {"snapshot": other["snapshot"]}), ("undo", {}), ("align", ANCHORED)):
        status, error = asked.refused(action, {"revision": 1, **body})
        assert (status, error["field"]) == (409, "revision")
    status, error = asked.refused("confirm", {"revision": 2, "snapshot": other["snapshot"]})
    assert (status, error["field"]) == (409, "snapshot")
    status, error = asked.refused("layout", layout_body(scene))
    assert (status, error["field"]) == (409, "revision")
    assert asked.good("layout", layout_body(scene, revision=2))["revision"] == 3


HERE = {"x": 0, "z": 0, "yaw_deg": 0}
ANCHORED = {"frame": "unity", "anchor": {"here": HERE, "map": HERE}}


def test_what_was_decided_survives_and_what_was_only_seen_does_not(tmp_path: Path) -> None:
    path, scene = tmp_path / "sessions.sqlite", lab()
    first = served_anew(path)
    first.good("layout", layout_body(scene, method="nearest", options={"gate_categories": False}))
    seen = first.good("snapshots", snapshot_body(seen_in(scene, 0.1)))
    first.good("confirm", {"revision": 1, "snapshot": seen["snapshot"]})
    known = first.state()
    first.good("snapshots", snapshot_body(seen_in(scene, 0.3)))
    first.service.store.close()
    second = served_anew(path)
    again = second.state()
    for name in ("objects", "revision", "history", "method", "options", "lost"):
        assert again[name] == known[name]
    assert again["last"] is None
    assert second.good("undo", {"revision": 2})["revision"] == 3
    original = [one["pose"]["position"]["x"] for one in second.state()["objects"]]
    assert original == pytest.approx(scene.layout.position[:, 0].tolist())
    second.good("delete")
    assert second.refused("undo", {"revision": 3})[0] == 404
    second.service.store.close()
    assert served_anew(path).service.names == []


def test_only_one_service_uses_a_store(tmp_path: Path) -> None:
    first = served_anew(tmp_path / "sessions.sqlite")
    with pytest.raises(ValueError, match="must be used by one service only"):
        served_anew(tmp_path / "sessions.sqlite")
    first.service.store.close()


def test_every_method_answers_and_has_its_own_options(asked: Asked) -> None:
    scene = lab()
    for name in OPTIONS:
        begun = asked.good("layout", layout_body(scene, method=name), name)
        assert begun["method"] == name
        reply = asked.good("snapshots", snapshot_body(seen_in(scene, 0.001)), name)
        assert [one["id"] for one in reply["detections"]] == list(scene.layout.labels), name
    for options, field in (
        ({"threshold": 2}, "options.threshold"),
        ({"min_confidence": 0.5}, "options.min_confidence"),
        ([], "options"),
        ({"weights": "none"}, "options.weights"),
    ):
        status, error = asked.refused("layout", layout_body(scene, method="spatial", options=options), "x")
        assert (status, error["field"]) == (422, field)
    for method in ("module:Class", "os:system", 3, None):
        assert asked.refused("layout", layout_body(scene, method=method), "x")[1]["field"] == "method"


def test_the_service_counts_what_is_hidden_as_out_of_view() -> None:
    _, options = method_of("likelihood", {})
    assert options["occlusion"] is True


def test_options_reach_the_method(asked: Asked) -> None:
    scene = lab()
    asked.good("layout", layout_body(scene, method="likelihood", options={"min_confidence": 1.0}))
    reply = asked.good("snapshots", snapshot_body(seen_in(scene, 0.3)))
    assert all(one["id"] is None for one in reply["detections"] if one["confidence"] < 1)
    assert any(one["id"] is None for one in reply["detections"])
    assert set(reply["new"]) == {one["detection"] for one in reply["detections"] if one["id"] is None}


def test_without_checks_there_are_no_warnings_of_frames_and_the_same_labels(asked: Asked) -> None:
    scene = builtin_scene("classroom")
    body = snapshot_body(seen_in(scene))
    for one in body["detections"]:
        one["x"], one["z"] = one["x"] + 2.0, one["z"] - 1.0
    replies = []
    for checks in (True, False):
        asked.good("layout", layout_body(scene, method="spatial", checks=checks), f"room-{checks}")
        replies.append(asked.good("snapshots", body, f"room-{checks}"))
    checked, unchecked = replies
    assert any("frame" in text for text in checked["warnings"])
    assert unchecked["warnings"] == []
    assert [one["id"] for one in unchecked["detections"]] == [one["id"] for one in checked["detections"]]
    assert asked.refused("layout", layout_body(scene, checks="no"), "x")[1]["field"] == "checks"
    assert asked.refused("layout", layout_body(scene, switch_rate=2), "x")[1]["field"] == "switch_rate"


def test_limits_are_kept() -> None:
    scene = lab()
    few = served_anew(most_objects=3)
    assert few.refused("layout", layout_body(scene))[0] == 413
    small = served_anew(most_detections=3, most_fused=2, most_sessions=1)
    small.good("layout", layout_body(scene))
    snapshot = snapshot_body(seen_in(scene))
    assert small.refused("snapshots", snapshot)[0] == 413
    assert small.refused("snapshots", {"snapshots": [snapshot]})[0] == 413
    assert small.refused("snapshots", {"snapshots": [{**snapshot, "detections": []}] * 3})[0] == 413
    assert small.refused("layout", layout_body(scene), "another")[0] == 429
    many = served_anew(most_objects=600)
    layout = scene.layout
    crowd = Scene(
        name="crowd",
        layout=Layout(
            labels=tuple(map(str, range(500))),
            category=("chair",) * 500,
            position=np.random.default_rng(0).uniform(0, 50, (500, 2)),
            yaw=np.zeros(500),
            size=np.tile(layout.size[:1], (500, 1)),
        ),
    )
    many.good("layout", layout_body(crowd))
    body = snapshot_body(seen_in(crowd))
    status, error = many.refused("snapshots", body)
    assert (status, error["field"]) == (422, "method")


@pytest.mark.parametrize("name", ["", "a/b", "../x", "x" * 65, "-a", "ä", "a b"])
def test_a_session_has_a_plain_name(asked: Asked, name: str) -> None:
    assert asked.refused("layout", layout_body(lab()), name)[0] == 422


def test_vectors_are_written_by_a_command_and_are_the_methods_answers(tmp_path: Path) -> None:
    """The answers against those of SciPy's assignment of the costs that the readable equations give."""
    path = tmp_path / "vectors.json"
    result = CliRunner().invoke(app, ["conformance-vectors", "--out", str(path), "--number", "60"])
    assert result.exit_code == 0, result.output
    written = json.loads(path.read_text())
    assert len(written["vectors"]) == 60
    checked = 0
    for one in written["vectors"]:
        scene, seen = scene_from_dict(one["layout"]), snapshot_from_dict(one["snapshot"]).detections
        layout, known = scene.layout, set(scene.layout.categories)
        category = seen.category if layout.names_categories else (None,) * len(seen)
        if any(name is not None and name not in known for name in category) or len(seen) > len(layout):
            continue
        weights = scene.weights or Weights.of_area(scene.area)
        cost = total_cost(
            translation_cost(seen.position, layout.position, scene.diagonal),
            rotation_cost(seen.yaw, layout.yaw),
            dimension_cost(seen.size, layout.size),
            weights.translation,
            weights.rotation,
        )
        gate = [[name is not None and name != other for other in layout.category] for name in category]
        cost[np.array(gate).reshape(cost.shape)] = 1e6
        rows, columns = linear_sum_assignment(cost)
        given = cost[rows, columns]
        if given.max() >= 1e6:
            continue
        assert [layout.labels[j] for j in columns] == one["labels"]
        np.testing.assert_allclose(given, one["costs"], rtol=1e-9, atol=1e-12)
        checked += 1
    assert checked > 30


def decide(asked: Asked, scene: Scene, shift: float) -> Values:
    seen = asked.good("snapshots", snapshot_body(seen_in(scene, shift)))
    return asked.good("confirm", {"revision": seen["revision"], "snapshot": seen["snapshot"]})


@pytest.mark.parametrize("method", ["spatial", "adaptive"])
def test_only_so_many_decisions_are_kept_to_be_undone(tmp_path: Path, method: str) -> None:
    """And what is known is what it is where all are kept, also after a kill."""
    scene = lab()
    short = served_anew(tmp_path / "short.sqlite", most_history=3)
    long = served_anew(most_history=100)
    size = 0
    for asked in (short, long):
        asked.good("layout", layout_body(scene, method=method))
        anchored = {**ANCHORED, "anchor": {"here": HERE, "map": {"x": 0.001, "z": 0, "yaw_deg": 0.01}}}
        asked.good("align", {**anchored, "revision": 1})
        for k in range(8):
            decide(asked, scene, 0.01 * (k + 1))
            if asked is short and k == 3:
                size = len(json.dumps(asked.service.session("room").row()))
    assert len(json.dumps(short.service.session("room").row())) < 1.1 * size
    short.service.store.close()
    short = served_anew(tmp_path / "short.sqlite", most_history=3)
    for undone in range(4):
        states = short.state(), long.state()
        assert len(states[0]["history"]) == 3 - undone
        assert states[0]["history"] == states[1]["history"][6:]
        assert [state["final"] for state in states] == [6, 0]
        assert states[0]["lost"] == states[1]["lost"]
        for mine, other in zip(*(state["objects"] for state in states), strict=True):
            assert mine["id"] == other["id"]
            for axis in "xyz":
                here, there = (one["pose"]["position"][axis] for one in (mine, other))
                assert here == pytest.approx(there, abs=1e-9)
        replies = [asked.good("snapshots", snapshot_body(seen_in(scene, 0.2))) for asked in (short, long)]
        rows = [[(one["id"], one["cost"]) for one in reply["detections"]] for reply in replies]
        for one, two in zip(*rows, strict=True):
            assert one == (two[0], pytest.approx(two[1], rel=1e-6, abs=1e-9))
        revision = states[0]["revision"]
        if undone < 3:
            for asked in (short, long):
                asked.good("undo", {"revision": revision})
    status, error = short.refused("undo", {"revision": revision})
    assert status == 422
    assert error["expected"] == "must have a decision to undo"
    assert error["got"] == "'6 that are final: only the last ones are kept to be undone'"
    assert short.state()["revision"] == revision
    short.service.store.close()


def test_a_revision_is_never_used_twice_by_sessions_of_one_name(tmp_path: Path) -> None:
    """What a client decides on a session that was deleted and begun again is refused."""
    path, scene = tmp_path / "sessions.sqlite", lab()
    body = layout_body(scene, method="spatial")
    asked = served_anew(path)
    revisions = [asked.good("layout", body)["revision"]]
    for again in range(3):
        old = asked.good("snapshots", snapshot_body(seen_in(scene, 0.1)))
        revisions.append(
            asked.good("confirm", {"revision": old["revision"], "snapshot": old["snapshot"]})["revision"]
        )
        asked.good("delete")
        assert asked.refused("undo", {"revision": revisions[-1]})[0] == 404
        if again == 1:  # also where the service is started anew in between
            asked.service.store.close()
            asked = served_anew(path)
        status, reply = asked("layout", body)
        assert status == 201
        for revision in revisions:
            for action, more in (
                ("undo", {}),
                ("align", ANCHORED),
                ("confirm", {"snapshot": old["snapshot"]}),
            ):
                status, error = asked.refused(action, {"revision": revision, **more})
                assert (status, error["field"]) == (409, "revision")
            assert asked.refused("layout", {**body, "revision": revision})[0] == 409
        revisions.append(reply["revision"])
    assert revisions == sorted(set(revisions))
    assert asked.good("layout", body, "another")["revision"] == 1
    asked.service.store.close()


def test_of_many_deleted_sessions_the_revisions_do_not_come_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only some of the names are kept, so that the file does not grow; the others begin beyond them all."""
    monkeypatch.setattr("farm_ar.service.store.REMEMBERED", 3)
    store = Store(None)
    last: dict[str, int] = {}
    rng = np.random.default_rng(0)
    for _ in range(200):
        name = f"s{rng.integers(12)}"
        begun = store.ended(name) + 1
        assert begun > last.get(name, 0)
        last[name] = begun + int(rng.integers(4))
        store.delete(name, last[name])
        assert len(store._base.execute("select * from ended").fetchall()) <= 4
    young = served_anew()
    young.service.store.delete("a", 7)
    assert young.service.store.ended("a") == 7
    assert young.service.store.ended("b") == 0
    store.close()


LONG = "x" * 257


@pytest.mark.parametrize(
    ("action", "place", "field"),
    [
        ("layout", ("objects", 1, "label"), "objects[1].label"),
        ("layout", ("objects", 1, "category"), "objects[1].category"),
        ("layout", ("name",), "name"),
        ("layout", ("method",), "method"),
        ("layout", ("options", LONG), "options"),
        ("layout", ("symmetry_deg", LONG), "symmetry_deg"),
        ("layout", (LONG,), "body"),
        ("snapshots", ("detections", 2, "id"), "detections[2].id"),
        ("snapshots", ("detections", 2, "track_id"), "detections[2].track_id"),
        ("snapshots", ("detections", 2, "category"), "detections[2].category"),
        ("snapshots", ("frame",), "frame"),
        ("confirm", ("labels", "d0"), "labels.d0"),
        ("confirm", ("labels", LONG), "labels"),
        ("confirm", ("snapshot",), "snapshot"),
    ],
)
def test_strings_that_are_too_long_are_refused(
    asked: Asked, action: str, place: tuple[str | int, ...], field: str
) -> None:
    scene = lab()
    asked.good("layout", layout_body(scene, method="spatial"))
    seen = asked.good("snapshots", snapshot_body(seen_in(scene)))
    whole: dict[str, Values] = {
        "layout": {**layout_body(scene, method="spatial"), "options": {}, "symmetry_deg": {}},
        "snapshots": snapshot_body(seen_in(scene)),
        "confirm": {"revision": 1, "snapshot": seen["snapshot"], "labels": {}},
    }
    for text, said in ((LONG, "256 characters, not 257"), ("ä\\" + "y" * 1_000_000, "not 1000002")):
        body = json.loads(json.dumps(whole[action]))
        inner: Any = body
        for step in place[:-1]:
            inner = inner[step]
        inner[text if place[-1] == LONG else place[-1]] = text
        status, error = asked.refused(action, body, "other" if action == "layout" else "room")
        assert (status, error["field"]) == (413, field)
        assert said in error["expected"]
        assert len(error["message"]) < 300
    assert asked.state()["revision"] == 1


def test_strings_of_the_greatest_length_and_notes_are_taken(asked: Asked) -> None:
    body = layout_body(lab(), method="spatial", description="how it came about " * 100)
    label = body["objects"][0]["label"] = "\u00e9" * 256
    asked.good("layout", body)
    assert asked.state()["objects"][0]["id"] == label
