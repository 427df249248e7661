"""The simulated worlds: repeatable, sound, and each as it says."""

import numpy as np
import pytest

from farm_ar.benchmark.worlds import ROWS, Example
from farm_ar.geometry import wrap
from farm_ar.scenes import visible

COUNT = 12


def made(name: str, count: int = COUNT, seed: int = 3) -> list[Example]:
    return ROWS[name].make(np.random.default_rng(seed), count)


def digest(examples: list[Example]) -> list[bytes]:
    return [
        array.tobytes()
        for scene, snapshot, _ in examples
        for array in (scene.layout.position, scene.layout.yaw, scene.layout.size,
                      snapshot.detections.position, snapshot.detections.yaw, snapshot.detections.size)
    ]  # fmt: skip


def shifts(example: Example) -> np.ndarray:
    """How far each detection of a known label has moved, (K, 2)."""
    scene, snapshot, truth = example
    pairs = [(i, scene.layout.labels.index(label)) for i, label in enumerate(truth) if label is not None]
    seen, known = np.transpose(pairs)
    return snapshot.detections.position[seen] - scene.layout.position[known]


@pytest.mark.parametrize("name", ROWS)
def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(name: str):
    first, again, other = made(name), made(name), made(name, seed=4)
    assert digest(first) == digest(again)
    assert [e.truth for e in first] == [e.truth for e in again]
    assert digest(first) != digest(other)


@pytest.mark.parametrize("name", ROWS)
def test_every_row_has_as_many_examples_as_asked_for_with_distinct_true_labels_of_their_category(name: str):
    examples = made(name)
    assert len(examples) == COUNT
    for scene, snapshot, truth in examples:
        category = dict(zip(scene.layout.labels, scene.layout.category, strict=True))
        known = [label for label in truth if label is not None]
        assert len(truth) == len(snapshot.detections) > 0
        assert len(set(known)) == len(known)
        for label, seen in zip(truth, snapshot.detections.category, strict=True):
            assert label is None or category[label] == seen


@pytest.mark.parametrize("name", [name for name, row in ROWS.items() if row.all_in_view])
def test_where_all_is_in_view_the_camera_sees_every_place_of_the_reference_layout(name: str):
    for scene, snapshot, _ in made(name):
        if name != "rescan":  # whose camera stands in the drifted frame
            assert visible(scene.layout, snapshot.camera).all()


@pytest.mark.parametrize("name", ROWS)
def test_the_order_of_the_detections_tells_nothing_of_the_labels(name: str):
    ups = downs = 0
    for scene, _, truth in made(name, 40):
        index = [scene.layout.labels.index(label) for label in truth if label is not None]
        steps = np.diff(index)
        ups, downs = ups + int((steps > 0).sum()), downs + int((steps < 0).sum())
    assert abs(ups - downs) < 5 * np.sqrt(ups + downs)


def test_players_run_no_faster_than_they_can():
    for gap, name in ((1, "players-1s"), (4, "players-4s")):
        far = np.concatenate([np.linalg.norm(shifts(e), axis=1) for e in made(name)])
        assert far.max() <= 7.5 * gap + 0.1
        assert np.median(far) > 0.5


def test_six_of_eleven_players_of_each_team_are_detected_and_twelve_are_in_the_zoomed_view():
    for example in made("players-half-2s"):
        assert example.snapshot.detections.category.count("red") == 6
        assert example.snapshot.detections.category.count("blue") == 6
    assert [len(e.truth) for e in made("players-zoom-2s")] == [12] * COUNT


def test_people_come_and_go_in_a_corridor_and_not_in_the_crowd():
    corridor, crowd = made("corridor-4s", 40), made("crowd-1.2s")
    assert 0.05 < np.mean([label is None for e in corridor for label in e.truth]) < 0.5
    assert np.mean([len(e.scene.layout) for e in crowd]) > 33


def test_people_walk_along_their_headings():
    turns = []
    for scene, snapshot, truth in made("crossing-1.2s"):
        for i, label in enumerate(truth):
            if label is not None:
                j = scene.layout.labels.index(label)
                step = snapshot.detections.position[i] - scene.layout.position[j]
                turns.append(float(wrap(np.arctan2(step[0], step[1]) - scene.layout.yaw[j])))
    assert np.median(np.abs(turns)) < np.deg2rad(20)


def test_fish_in_pixels_are_the_same_fish():
    metres, pixels = made("fish-1s"), made("fish-pixels-1s")
    for a, b in zip(metres, pixels, strict=True):
        assert a.truth == b.truth
        np.testing.assert_allclose(shifts(b), 1280 * shifts(a), atol=1e-9)
        np.testing.assert_allclose(b.snapshot.detections.size, 1280 * a.snapshot.detections.size)


def test_fish_swim_as_a_school():
    aligned = []
    for scene, _, _ in made("fish-0.25s"):
        ahead = np.stack([np.sin(scene.layout.yaw), np.cos(scene.layout.yaw)], axis=1)
        aligned.append(np.linalg.norm(ahead.mean(axis=0)))
    assert np.mean(aligned) > 0.5  # for headings at random about .3


def test_most_things_of_a_flat_stay_exactly_and_some_go_far():
    far = np.concatenate([np.linalg.norm(shifts(e), axis=1) for e in made("flat", 40)])
    assert 0.5 < np.mean(far == 0) < 0.85
    assert 0.02 < np.mean(far > 1) < 0.2


def test_only_things_with_a_twin_are_left_in_the_row_of_twins():
    for scene, _, _ in made("flat-twins"):
        assert min(scene.layout.category.count(name) for name in scene.layout.categories) > 1


@pytest.mark.parametrize("percent", [5, 10, 20, 30])
def test_chairs_move_by_ten_centimetres_and_their_sides_are_measured_with_the_error_said(percent: int):
    examples = made(f"sizes-{percent}", 60)
    for example in examples:
        np.testing.assert_allclose(np.linalg.norm(shifts(example), axis=1), 0.1)
    for side in (lambda e: e.scene.layout.size, lambda e: e.snapshot.detections.size):
        error = np.concatenate([np.log(side(e) / (0.45, 0.9, 0.5)).ravel() for e in examples])
        assert abs(error.std() / (percent / 100) - 1) < 0.1


def test_what_stays_in_a_rescan_is_moved_rigidly_with_the_camera():
    for example in made("rescan"):
        scene, snapshot, truth = example
        seen = snapshot.detections.position
        known = scene.layout.position[[scene.layout.labels.index(label) for label in truth]]
        turn = float(snapshot.camera.yaw)
        back = seen - snapshot.camera.position
        back = np.stack([back[:, 0] * np.cos(turn) - back[:, 1] * np.sin(turn),
                         back[:, 1] * np.cos(turn) + back[:, 0] * np.sin(turn)], axis=1)  # fmt: skip
        middle = np.array([0.25, 0.75])
        assert np.mean(np.linalg.norm(back + middle - known, axis=1) < 0.15) > 0.6


def test_things_leave_and_come_where_the_row_says_so():
    left, new = made("lounge-left", 40), made("lounge-new", 40)
    gone = sum(len(e.scene.layout) - len(e.truth) for e in left) / sum(len(e.scene.layout) for e in left)
    assert 0.05 < gone < 0.15
    assert all(label is not None for e in left for label in e.truth)
    assert 1 < np.mean([e.truth.count(None) for e in new]) < 2
