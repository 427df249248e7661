"""Failures of stress tests on the page: those that come along, those of a run, and what is refused."""

import json

import numpy as np
import pytest

from farm_ar.agents.stress import ReportError, replay_failure
from farm_ar.agents.stress.study import known_case
from farm_ar.cli.page import export as command
from farm_ar.envs import save_trace
from farm_ar.errors import OptionError
from farm_ar.geometry import wrap
from farm_ar.web.export import export
from farm_ar.web.gallery import cards_of, read_gallery, recorded_failure, shipped_gallery
from farm_ar.web.game import Game
from farm_ar.web.recordings import demonstrations


@pytest.mark.parametrize("failure", shipped_gallery(), ids=lambda one: f"{one['reid']}-{one['case']}")
def test_what_comes_along_fools_the_method_as_it_says(failure) -> None:
    again = replay_failure(failure)
    assert again.wrong == failure["wrong"] > 0
    assert again.distance == pytest.approx(failure["effort"])
    recording = recorded_failure(failure)
    first, last = recording["frames"][0], recording["frames"][-1]
    (said,) = [one["snapshot"] for one in recording["frames"] if "snapshot" in one]
    assert sum(not one["right"] for one in said["detections"]) == failure["wrong"]
    assert first["objects"] == first["believed"]
    np.testing.assert_allclose(
        np.array(last["objects"]), np.column_stack([failure["position"], failure["yaw"]]), atol=1e-4
    )
    labels = [one["label"] for one in recording["objects"]]
    for one in said["detections"]:
        if one["label"] is not None:
            i = labels.index(one["label"])
            assert last["believed"][i] == last["objects"][one["object"]]
            assert (i in last["wrong"]) == (not one["right"])
    json.dumps(recording, allow_nan=False)


def test_a_recording_carries_one_building_after_the_other_and_nothing_jumps() -> None:
    failure = max(shipped_gallery(), key=lambda one: one["wrong"])
    poses = np.array([one["objects"] for one in recorded_failure(failure)["frames"]])
    steps = np.linalg.norm(np.diff(poses[..., :2], axis=0), axis=-1)
    assert (steps > 1e-3).sum(axis=1).max() == 1
    assert steps.max() < 0.15


def test_a_recording_turns_what_is_moved_the_short_way() -> None:
    failure = dict(shipped_gallery()[0])
    poses = [
        np.array([one["objects"] for one in recorded_failure({**failure, "yaw": yaw})["frames"]])
        for yaw in (failure["yaw"], [one + 2 * np.pi for one in failure["yaw"]])
    ]
    for one in poses:
        assert np.abs(wrap(np.diff(one[..., 2], axis=0))).sum(axis=0).max() < np.pi + 1e-3


def write(folder, **other):
    report = {"failures": [{**dict(shipped_gallery()[0]), **other}]}
    (folder / "stress.json").write_text(json.dumps(report))
    return folder


def test_a_run_of_the_stress_test_is_read_by_its_folder_or_its_file(tmp_path) -> None:
    write(tmp_path)
    assert read_gallery(tmp_path) == read_gallery(tmp_path / "stress.json")
    (card,) = cards_of(read_gallery(tmp_path)).values()
    failure = shipped_gallery()[0]
    assert [[*ends[2:]] for ends in card["ways"]] == np.round(failure["position"], 4).tolist()
    assert card["title"].startswith(f"{failure['reid']}: {failure['wrong']} wrong")


def test_a_card_says_how_far_things_are_moved_all_together() -> None:
    failures = shipped_gallery()
    for failure, card in zip(failures, cards_of(failures).values(), strict=True):
        case = known_case(failure["scene"], failure["case"], failure["jitter"], failure["seed"])
        ways = np.array(card["ways"])
        turn = np.array(failure["yaw"]) - case.layout.yaw
        diagonal = np.hypot(card["width"], card["depth"])
        metres = np.hypot(*(ways[:, 2:] - ways[:, :2]).T).sum() + diagonal * np.abs(np.sin(turn / 2)).sum()
        assert float(card["title"].split()[-2]) == pytest.approx(100 * metres, abs=0.6)


def test_a_room_of_another_size_is_shown_too(tmp_path) -> None:
    layout = known_case("L1", 0, "none", 0).layout
    position, yaw = layout.position.tolist(), layout.yaw.tolist()
    position[0][0] += 0.5
    other = {"scene": "L1", "jitter": "none", "case": 0, "position": position, "yaw": yaw}
    failures = read_gallery(write(tmp_path, **other))
    (card,) = cards_of(failures).values()
    assert card["moved"] == [0]
    recording = recorded_failure(failures[0])
    assert recording["frames"][0]["camera"]["height"] > 0


@pytest.mark.parametrize(
    ("other", "error", "field"),
    [
        ({"reid": "my_module:MyReid"}, OptionError, "gallery"),
        ({"reid": "<script>alert(1)</script>"}, OptionError, "gallery"),
        ({"yaw": [0.0]}, ReportError, "yaw"),
        ({"position": [[0.1, 0.1]], "yaw": [0.0]}, OptionError, "position"),
        ({"scene": "nowhere"}, OptionError, "scene"),
        ({"wrong": -1}, ReportError, "wrong"),
    ],
)
def test_what_cannot_be_shown_is_refused_by_name(tmp_path, other, error, field) -> None:
    with pytest.raises(error, match=field):
        cards_of(read_gallery(write(tmp_path, **other)))


def test_a_folder_without_a_stress_test_is_refused(tmp_path) -> None:
    with pytest.raises(ReportError, match=r"stress\.json"):
        read_gallery(tmp_path)


def test_poses_without_anything_in_view_are_no_recording_and_overlapping_ones_are_counted(tmp_path) -> None:
    (failure,) = read_gallery(write(tmp_path, position=11 * [[-50.0, -50.0]]))
    with pytest.raises(OptionError, match="position: must leave an object in view"):
        recorded_failure(failure)
    (failure,) = read_gallery(write(tmp_path, position=11 * [[0.5, 0.5]]))
    recording = recorded_failure(failure)
    (said,) = [one["snapshot"] for one in recording["frames"] if "snapshot" in one]
    count = sum(not one["right"] for one in said["detections"])
    assert recording["title"].startswith(f"{failure['reid']} gives {count} wrong label{'s' * (count != 1)} ")


def test_an_episode_takes_no_other_recordings_name(tmp_path) -> None:
    trace = Game(seed=1).trace()
    for name in (next(iter(demonstrations())), "failure-0"):
        with pytest.raises(OptionError, match="trace: must have another name"):
            export(tmp_path, {name: trace})
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        save_trace(trace, tmp_path / folder / "mine.json")
    traces = [tmp_path / folder / "mine.json" for folder in ("a", "b")]
    with pytest.raises(OptionError, match="--trace: must be files of different names"):
        command(tmp_path / "page", traces)
