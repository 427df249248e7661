"""What an estimator is judged by, on frames whose errors are known."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from farm_ar.errors import SnapshotError
from farm_ar.rendering import HOLOLENS_2, View
from farm_ar.scenes import Detections
from farm_ar.vision import PoseEstimates, PoseEstimator
from farm_ar.vision.scoring import (
    CLAIMED,
    COLUMNS,
    Frame,
    evaluate,
    farm_meshes,
    frame_files,
    match,
    read_frame,
    table_rows,
)

NOTHING = np.zeros((360, 640, 3), np.uint8)


def frame(count, seed=0):
    rng = np.random.default_rng(seed)
    place = np.array([(0.15 * (k % 8) + 0.1, 0.2 * (k // 8) + 0.1) for k in range(count)])
    view = View(HOLOLENS_2, np.array([0.6, 0.45, -0.3]), 0.0, -0.5)
    category = tuple(("coop", "hutch")[k % 2] for k in range(count))
    no = np.zeros(count, bool)
    return Frame("f", NOTHING, view, category, place, rng.uniform(-3, 3, count), np.ones(count), no, no)


def estimates(category, position, yaw, rival=None, sd=(0.01, 0.1)):
    n = len(category)
    spread = np.zeros((n, 3, 3))
    spread[:, [0, 1, 2], [0, 1, 2]] = np.square([sd[0], sd[0], sd[1]])
    seen = Detections(tuple(category), np.asarray(position), np.asarray(yaw), np.full((n, 3), 0.1))
    second = np.full(n, np.nan) if rival is None else np.asarray(rival)
    weight = np.where(np.isnan(second), np.nan, 0.3)
    return PoseEstimates(seen, spread, np.ones(n), second, weight)


class Fixed(PoseEstimator):
    """Answers the same whatever is asked."""

    def __init__(self, answer):
        self.answer = answer

    def estimate(self, image, camera, meshes):
        return self.answer


def test_errors_that_are_put_in_come_out():
    truth = frame(10)
    position, yaw = truth.position.copy(), truth.yaw.copy()
    position[0] += [0.03, 0.04 - 1e-9]  # 5 cm: just found
    position[1] += [0.0, 0.051]  # missed, and false
    yaw[2] += np.deg2rad(21)
    yaw[3] += np.pi
    rival = np.full(10, np.nan)
    rival[3] = truth.yaw[3]
    position[4:] += [0.003, 0.0]
    found = match(truth, estimates(truth.category, position, yaw, rival))
    assert found.found.tolist() == [True, False] + 8 * [True]
    np.testing.assert_allclose(found.away[[0, 4]], [0.05, 0.003])
    assert found.false == 1
    row = evaluate(Fixed(estimates(truth.category, position, yaw, rival)), [truth], farm_meshes())[0]
    claimed = row.rows[CLAIMED]
    assert claimed.things == 10
    assert claimed.missed == pytest.approx(0.1)
    assert row.false == pytest.approx(0.1)
    assert claimed.flipped == pytest.approx(2 / 9)
    assert claimed.rescued == pytest.approx(1 / 2)
    assert claimed.away_cm[0] == pytest.approx(0.3)
    # 5 cm at an SD of 1 cm is outside of the 90% region; the six of 0.3 cm are inside.
    assert claimed.covered == pytest.approx(6 / 7)


def test_a_thing_is_found_once_and_by_its_own_category_only():
    truth = frame(2)  # a coop and a hutch
    twice = estimates(("coop", "coop"), [truth.position[0], truth.position[0] + 0.01], truth.yaw)
    found = match(truth, twice)
    assert found.found.tolist() == [True, False]
    assert found.away[0] == 0.0
    assert found.false == 1
    swapped = match(truth, estimates(("hutch", "coop"), truth.position, truth.yaw))
    assert not swapped.found.any()
    assert swapped.false == 2


def test_the_pairing_is_the_best_of_all():
    truth = replace(frame(2), category=("coop", "coop"), position=np.array([[0.0, 0.0], [0.04, 0.0]]))
    found = match(truth, estimates(("coop", "coop"), [[0.03, 0.0], [-0.02, 0.0]], truth.yaw))
    assert found.order.tolist() == [1, 0]
    np.testing.assert_allclose(found.away, [0.02, 0.01])


def test_things_are_counted_by_how_much_is_seen_and_fixed_ones_are_not():
    truth = replace(
        frame(8),
        visible=np.array([1.0, 0.6, 0.59, 0.4, 0.39, 0.1, 0.09, 1.0]),
        fixed=np.arange(8) == 7,
        touching=np.arange(8) == 3,
    )
    none = estimates((), np.zeros((0, 2)), np.zeros(0))
    found, _ = evaluate(Fixed(none), [truth, truth], farm_meshes())
    assert [row.things for row in found.rows.values()] == [8, 4, 4, 4, 2]
    assert all(row.missed == 1.0 for row in found.rows.values())
    cells = table_rows(found)
    assert all(len(row) == len(COLUMNS) for row in cells)
    assert cells[0][:4] == [CLAIMED, "8", "100.0%", "0.0%"]
    assert cells[0][4] == ""


def test_frames_are_read_back_from_a_folder_and_what_is_wrong_is_named(tmp_path):
    with pytest.raises(SnapshotError, match="frames"):
        frame_files(tmp_path)
    image = np.arange(4 * 6 * 3, dtype=np.uint8).reshape(4, 6, 3)
    cv2.imwrite(str(tmp_path / "a.png"), image[..., ::-1])
    data = {
        "image": "a.png",
        "camera": {"x": 1.0, "y": 0.5, "z": -1.0, "yaw_deg": 90.0, "pitch_deg": -30.0},
        "intrinsics": {"fx": 5.0, "fy": 5.0, "cx": 2.5, "cy": 1.5, "width": 6, "height": 4},
        "objects": [
            {"category": "coop", "x": 0.1, "z": 0.2, "yaw_deg": 180.0, "visible": 0.5, "touching": True}
        ],
        "hand_pixels": 3,
    }
    (tmp_path / "a.json").write_text(json.dumps(data))
    assert frame_files(tmp_path) == [tmp_path / "a.json"]
    one = read_frame(tmp_path / "a.json")
    assert (one.image == image).all()
    assert one.view.yaw == pytest.approx(np.pi / 2)
    assert one.view.eye.tolist() == [1.0, 0.5, -1.0]
    assert one.yaw.tolist() == [pytest.approx(np.pi)]
    assert (one.category, one.hand_pixels, one.touching.tolist()) == (("coop",), 3, [True])
    del data["objects"][0]["x"]
    (tmp_path / "a.json").write_text(json.dumps(data))
    with pytest.raises(SnapshotError, match=r"a\.json: frame: .*'x'"):
        read_frame(tmp_path / "a.json")
