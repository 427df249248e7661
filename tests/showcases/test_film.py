"""Films: what happens in the demonstrations, and the files that are made of them."""

import csv

import cv2
import numpy as np
import pytest

from farm_ar.game_logic.render_state import RenderState
from farm_ar.showcases import ScriptRecorder, film_script, load_script
from farm_ar.showcases import film as film_module

SHORT = """
title = "A short one"
gaze = "S1"
ending_s = 0.5

[[visits]]
play_s = 0.5

[[visits.moves]]
building = "yellow-coop"
by = [-0.02, 0.03]
caption = "Away with it"
"""


@pytest.fixture
def states(monkeypatch) -> list[RenderState]:
    """The states of which pictures would be made, in place of the pictures."""
    kept: list[RenderState] = []

    class Recorder:
        def __init__(self, scene, height):
            pass

        def frame(self, state):
            kept.append(state)
            return np.zeros((2, 2, 3), dtype=np.uint8)

    monkeypatch.setattr(film_module, "GameFrames", Recorder)
    return kept


@pytest.mark.parametrize("name", ["demonstration-1", "demonstration-2"])
def test_a_demonstration_ends_as_the_paper_says_with_every_label_on_its_own_building(states, name):
    screening = ScriptRecorder(load_script(name))
    list(screening.frames())
    film = screening.film
    assert film.right == len(film.detections) == {"demonstration-1": 7, "demonstration-2": 5}[name]
    last = states[-1]
    assert not last.wrong.any()
    np.testing.assert_allclose(last.believed.position, last.truth.position, atol=1e-6)


def test_demonstration_1_leaves_the_buildings_as_in_figure_17b(states):
    list(ScriptRecorder(load_script("demonstration-1")).frames())
    before, after = states[0].truth, states[-1].truth
    place = {label: after.position[after.index(label)] for label in after.labels}
    was = {label: before.position[before.index(label)] for label in before.labels}
    np.testing.assert_allclose(place["blue-coop"], was["cyan-hutch"], atol=0.03)
    np.testing.assert_allclose(place["cyan-hutch"], was["blue-coop"], atol=0.03)
    assert place["magenta-hutch"][0] < place["cyan-hutch"][0]
    assert abs(place["magenta-hutch"][1] - place["cyan-hutch"][1]) < 0.05
    assert 0.02 < place["yellow-coop"][1] - was["yellow-coop"][1] < 0.1


def test_demonstration_2_swaps_and_turns_as_in_figure_18b(states):
    list(ScriptRecorder(load_script("demonstration-2")).frames())
    before, after = states[0].truth, states[-1].truth
    orange, white = after.index("orange-coop"), after.index("white-hutch")
    np.testing.assert_allclose(after.position[orange], before.position[white], atol=0.03)
    np.testing.assert_allclose(after.position[white], before.position[orange], atol=0.03)
    turned = np.abs(after.yaw - before.yaw)[[orange, white]]
    assert np.all(np.rad2deg(turned) > 20)


def test_animals_and_time_stand_still_while_the_hand_is_in_view(states):
    list(ScriptRecorder(load_script("demonstration-1")).frames())
    frozen = [state for state in states if state.phase == "hand"]
    assert len(frozen) > 60
    assert len({state.seconds for state in frozen}) == 1
    for state in frozen:
        np.testing.assert_array_equal(state.animal, frozen[0].animal)


def test_the_belief_does_not_change_before_the_snapshot(states):
    list(ScriptRecorder(load_script("demonstration-1")).frames())
    frozen = [state for state in states if state.phase == "hand"]
    np.testing.assert_array_equal(frozen[-1].believed.position, frozen[0].believed.position)


def test_the_same_script_is_filmed_the_same_way(states, tmp_path):
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    for _ in range(2):
        list(ScriptRecorder(load_script(path)).frames())
    half = len(states) // 2
    for a, b in zip(states[:half], states[half:], strict=True):
        np.testing.assert_array_equal(a.animal, b.animal)
        np.testing.assert_array_equal(a.truth.position, b.truth.position)
        np.testing.assert_array_equal(a.camera.position, b.camera.position)


def test_a_film_becomes_a_video_a_gif_key_frames_and_tables(tmp_path):
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    told: list[tuple[str, float]] = []
    film, paths = film_script(
        load_script(path), "short", tmp_path / "out", report=lambda what, share: told.append((what, share))
    )
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert shares[0] < 0.1
    assert told[-2][0] == "Making a GIF of short"
    assert told[-1] == ("Filmed short", 1.0)
    names = {file.name for file in paths}
    assert {"short.mp4", "short.gif", "short-1-before.png", "short-1-hand.png", "short-1-after.png"} <= names
    video = cv2.VideoCapture(str(tmp_path / "out" / "short.mp4"))
    assert int(video.get(cv2.CAP_PROP_FRAME_COUNT)) == film.frames
    assert int(video.get(cv2.CAP_PROP_FRAME_HEIGHT)) == 480
    video.release()
    with (tmp_path / "out" / "short-snapshots.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(film.detections) == 7
    assert all(row["given"] == row["truth"] for row in rows)
    with (tmp_path / "out" / "short-counters.csv").open() as file:
        labels = [row["label"] for row in csv.DictReader(file) if row["after"] == "end"]
    assert len(labels) == 10
    assert any(label.startswith("Yellow Chicken Coop (") for label in labels)
    assert film.key_frames["1-before"].shape == film.key_frames["1-hand"].shape
