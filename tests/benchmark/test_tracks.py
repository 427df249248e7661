"""Tracks of others: MOT-challenge text and tables, as pairs of looks."""

from pathlib import Path

import numpy as np
import pytest

from farm_ar.benchmark.tracks import name_of, pairs_of, read_tracks
from farm_ar.errors import OptionError

MOT = """1,1,10,20,4,6,1,-1,-1,-1
1,2,100,40,10,20,1,-1,-1,-1
2,1,12,20,4,6,1,-1,-1,-1
2,2,98,40,10,20,1,-1,-1,-1
3,2,96,40,10,20,1,-1,-1,-1
3,7,50,50,2,2,1,-1,-1,-1
3,9,0,0,2,2,0,-1,-1,-1
"""

OBSMAT = """
 7.8000000e+02 1.0 8.4568443e+00 0.0 3.5880664e+00 1.67 0.0 0.17
 7.8000000e+02 2.0 1.0 0.0 2.0 1.67 0.0 0.17
 7.8600000e+02 1.0 9.1257081e+00 0.0 3.6584268e+00 1.67 0.0 0.17
 7.8600000e+02 2.0 1.5 0.0 2.5 1.67 0.0 0.17
"""


def written(tmp_path: Path, text: str, name: str = "walk.txt") -> Path:
    path = tmp_path / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def test_boxes_of_mot_text_stand_on_their_lower_middle_with_z_upwards(tmp_path: Path):
    tracks = read_tracks(written(tmp_path, MOT), "mot")
    assert tracks.frame.tolist() == [1, 1, 2, 2, 3, 3]  # the line to be ignored is not there
    assert tracks.position[0].tolist() == [12, -26]
    assert tracks.position[1].tolist() == [105, -60]
    assert set(tracks.category) == {"object"}


def test_places_in_the_world_are_taken_where_every_line_has_one(tmp_path: Path):
    text = "1,1,10,20,4,6,1,4.5,5.5,0\n1,2,1,2,3,4,1,-2,0,0\n"
    assert read_tracks(written(tmp_path, text), "mot").position.tolist() == [[4.5, 5.5], [-2, 0]]
    text = text.replace("-2,0,0", "-1,-1,-1")
    assert read_tracks(written(tmp_path, text), "mot").position.tolist() == [[12, -26], [2.5, -6]]


def test_lines_of_nine_columns_have_a_class(tmp_path: Path):
    text = "1,1,10,20,4,6,1,1,0.5\n1,2,1,2,3,4,1,3,1\n"
    assert read_tracks(written(tmp_path, text), "mot").category == ("class 1", "class 3")


def test_a_table_without_a_header_is_read_by_the_numbers_of_its_columns(tmp_path: Path):
    columns = {"frame": "1", "id": "2", "x": "3", "z": "5"}
    tracks = read_tracks(written(tmp_path, OBSMAT), "table", columns)
    assert tracks.frame.tolist() == [780, 780, 786, 786]
    assert tracks.identity == ("1", "2", "1", "2")
    np.testing.assert_allclose(tracks.position[0], [8.4568443, 3.5880664])


@pytest.mark.parametrize("sign", [",", ";", "\t", " "])
def test_a_table_with_a_header_is_read_by_its_names(tmp_path: Path, sign: str):
    text = f"Time{sign}id{sign}x{sign}y{sign}yaw_deg{sign}type\n0.5{sign}a{sign}1{sign}2{sign}90{sign}car\n"
    tracks = read_tracks(written(tmp_path, text), "table")
    assert (tracks.frame.tolist(), tracks.identity, tracks.category) == ([0.5], ("a",), ("car",))
    assert tracks.position.tolist() == [[1, 2]]
    assert tracks.yaw.tolist() == [np.pi / 2]


def test_what_is_in_the_first_frame_is_known_and_what_came_in_has_no_label(tmp_path: Path):
    row = pairs_of(read_tracks(written(tmp_path, MOT), "mot"), 2, 1, 10, "given")
    assert (row.name, len(row)) == ("walk-2", 1)
    scene, snapshot, truth = row.examples[0]
    assert scene.layout.labels == ("1", "2")
    assert sorted(truth, key=str) == ["2", None]
    assert np.isnan(snapshot.detections.yaw).all()
    assert snapshot.detections.position[truth.index("2")].tolist() == [101, -60]
    known = scene.layout.position
    far = np.linalg.norm(np.vstack([known, snapshot.detections.position]) - snapshot.camera.position, axis=1)
    assert far.max() < snapshot.camera.fov.range_m


def test_headings_of_motion_point_from_the_sighting_before(tmp_path: Path):
    row = pairs_of(read_tracks(written(tmp_path, MOT), "mot"), 1, 1, 10, "motion")
    first, second = row.examples
    assert np.isnan(first.scene.layout.yaw).all()
    np.testing.assert_allclose(second.scene.layout.yaw, [np.pi / 2, -np.pi / 2])


def test_pairs_are_as_far_apart_and_as_many_as_asked_for(tmp_path: Path):
    lines = [f"{frame},{i},{frame + 9 * i},{i}" for frame in range(40) for i in range(3)]
    tracks = read_tracks(written(tmp_path, "frame,id,x,y\n" + "\n".join(lines)), "table")
    assert len(pairs_of(tracks, 5, 1, 1000, "given")) == 35
    assert len(pairs_of(tracks, 5, 10, 1000, "given")) == 4
    assert len(pairs_of(tracks, 5, 1, 7, "given")) == 7


def test_a_file_whose_name_says_nothing_has_its_folders_name(tmp_path: Path):
    assert name_of(written(tmp_path, "", "MOT16-02/gt/gt.txt")) == "MOT16-02"
    assert name_of(written(tmp_path, "", "seq eth/obsmat.txt")) == "seq-eth"
    assert name_of(written(tmp_path, "", "zara01.csv")) == "zara01"


@pytest.mark.parametrize(
    ("form", "text", "message"),
    [
        ("mot", "1,1,2,3\n", r"walk.txt: line 1: must be frame, id, left"),
        ("mot", "1,1,10,20,4,six,1,-1,-1,-1\n", "walk.txt: line 1, column 6: must be a number, got 'six'"),
        ("mot", MOT + MOT.splitlines()[0], "walk.txt: line 8: must not have an object twice"),
        ("mot", "1,1,1e7,20,4,6,1,-1,-1,-1\n", "walk.txt: line 1: must be finite, from -1e6 to 1e6 metres"),
        ("mot", "", "walk.txt: file: must have sightings, got 'none'"),
        ("table", "", "walk.txt: file: must have lines, got 'none'"),
        ("table", "frame,id,x\n1,1,1\n", r"walk.txt: --columns: must say which column is z \(frame, id, x\)"),
        ("table", "frame,id,x,y\n1,1,1\n", "walk.txt: line 2: must have 4 cells, got 3"),
        ("table", "frame,id,x,y\n1,1,nan,1\n", "walk.txt: line 2, column 3: must be a number, got 'nan'"),
        (
            "table",
            "1 1 1 1\n",
            r"walk.txt: --columns: must say which column is frame \(numbers from 1 to 4\)",
        ),
    ],
)
def test_a_wrong_file_is_one_line_that_names_the_place(tmp_path: Path, form: str, text: str, message: str):
    with pytest.raises(OptionError, match=f"^{message}"):
        read_tracks(written(tmp_path, text), form)


def test_a_column_that_is_not_there_is_named(tmp_path: Path):
    with pytest.raises(OptionError, match=r"--columns x: must be one of frame, id, x, y, got 'px'"):
        read_tracks(written(tmp_path, "frame,id,x,y\n1,1,1,1\n"), "table", {"x": "px"})


def test_a_gap_that_no_two_frames_have_is_refused(tmp_path: Path):
    tracks = read_tracks(written(tmp_path, MOT), "mot")
    with pytest.raises(OptionError, match=r"^--gap: must be a distance between two frames of walk"):
        pairs_of(tracks, 50, 1, 10, "given")


def test_objects_with_long_numbers_are_not_taken_for_one(tmp_path: Path):
    table = "frame,id,x,z\n0,1234567,0,0\n0,1234568,3,0\n0,1.5,6,0\n"
    assert read_tracks(written(tmp_path, table), "table").identity == ("1234567", "1234568", "1.5")
    mot = "1,1234567,10,20,4,6,1,-1,-1,-1\n1,1234568,100,40,10,20,1,-1,-1,-1\n"
    assert read_tracks(written(tmp_path, mot), "mot").identity == ("1234567", "1234568")
