"""Layouts and detections as tables."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import InputError, SceneError, SnapshotError
from farm_ar.scenes import NO_CATEGORY, Camera, Layout, load_layout_csv, load_scene_csv, load_snapshot_csv

HEADER = "id,category,x,z,yaw_deg,w,h,d"
TABLE = f"{HEADER}\nchair 1,chair,1,2.5,90,0.4,1,0.5\ntable,table,-1,0,-400,1.2,0.7,0.8\n"
CAMERA = Camera([1.0, 2.0], 0.5)

LOADERS: list[tuple[Callable[[Path], object], type[InputError]]] = [
    (load_layout_csv, SceneError),
    (lambda path: load_scene_csv(path, (5, 4)), SceneError),
    (lambda path: load_snapshot_csv(path, CAMERA), SnapshotError),
]


@pytest.fixture
def table(tmp_path: Path) -> Callable[..., Path]:
    def write(text: str, encoding: str = "utf-8") -> Path:
        path = tmp_path / "table.csv"
        path.write_bytes(text.encode(encoding))
        return path

    return write


def assert_the_example(layout: Layout) -> None:
    assert layout.labels == ("chair 1", "table")
    assert layout.category == ("chair", "table")
    assert layout.position.tolist() == [[1, 2.5], [-1, 0]]
    np.testing.assert_allclose(layout.yaw, [np.pi / 2, -400 * np.pi / 180])
    assert layout.size.tolist() == [[0.4, 1, 0.5], [1.2, 0.7, 0.8]]
    assert layout.elevation.tolist() == [0, 0]
    assert layout.movable.all()


def test_every_value_of_a_table_is_read(table):
    assert_the_example(load_layout_csv(table(TABLE)))


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + TABLE,
        TABLE.replace("\n", "\r\n"),
        TABLE.replace(",", " , ").replace("\n", " \n"),
        TABLE.replace("chair 1", '"chair 1"').replace(",table", ', "table"'),
        TABLE.replace("\n", "\n\n") + "  \n,,,,,,,\n",
        TABLE.rstrip("\n"),
        TABLE.replace(",", ";").replace(".", ","),
        "sep=;\n" + TABLE.replace(",", ";"),
        "h,d,w,yaw_deg,z,x,category,id\n1,.5,.4,90,2.5,1,chair,chair 1\n.7,.8,1.2,-400,0,-1,table,table\n",
    ],
    ids=[
        "BOM",
        "CRLF",
        "spaces",
        "quotes",
        "blank lines",
        "no end of line",
        "semicolons",
        "sep",
        "another order",
    ],
)
def test_a_table_may_be_written_as_spreadsheets_and_people_do(table, text):
    assert_the_example(load_layout_csv(table(text)))


def test_a_table_may_have_a_column_for_y(table):
    layout = load_layout_csv(table(f"{HEADER},y\na,chair,0,0,0,1,1,1,-0.3\nb,chair,0,0,0,1,1,1,2\n"))
    assert layout.elevation.tolist() == [-0.3, 2]


def test_a_quoted_name_may_have_commas(table):
    assert load_layout_csv(table(f'{HEADER}\n"a, b",chair,0,0,0,1,1,1\n')).labels == ("a, b",)


@pytest.mark.parametrize("header", [HEADER, f"{HEADER},y"])
def test_a_table_with_only_a_header_has_no_objects(table, header):
    assert len(load_layout_csv(table(header))) == 0
    assert len(load_snapshot_csv(table(header), CAMERA).detections) == 0


def test_a_scene_from_a_table_is_the_room_without_sites_named_after_the_file(table):
    scene = load_scene_csv(table(TABLE), (5, 4))
    assert (scene.name, scene.size, scene.sites) == ("table", (5, 4), ())
    assert_the_example(scene.layout)


def test_a_room_without_area_is_refused(table):
    with pytest.raises(
        SceneError, match=r"size_m: must be 2 positive numbers in metres, from 1e-6 to 1e6, got \[5.0, 0.0\]"
    ):
        load_scene_csv(table(TABLE), (5, 0))


def test_a_snapshot_from_a_table_has_the_given_camera_and_may_have_unknown_categories(table):
    snapshot = load_snapshot_csv(table(TABLE.replace(",chair,", ", ,")), CAMERA)
    seen = snapshot.detections
    assert snapshot.camera is CAMERA
    assert seen.ids == ("chair 1", "table")
    assert seen.category == (None, "table")
    assert seen.position.tolist() == [[1, 2.5], [-1, 0]]
    np.testing.assert_allclose(seen.yaw, [np.pi / 2, -400 * np.pi / 180])
    assert seen.size.tolist() == [[0.4, 1, 0.5], [1.2, 0.7, 0.8]]
    assert seen.confidence.tolist() == [1, 1]


@given(
    st.lists(
        st.tuples(*[st.floats(-1e6, 1e6)] * 3, *[st.floats(1e-6, 1e6)] * 3, st.floats(-1e6, 1e6)), max_size=8
    )
)
def test_numbers_are_read_exactly(tmp_path_factory, rows):
    lines = [f"{i},c,{','.join(map(repr, row))}" for i, row in enumerate(rows)]
    path = tmp_path_factory.getbasetemp() / "numbers.csv"
    path.write_text("\n".join([f"{HEADER},y", *lines]))
    layout = load_layout_csv(path)
    values = np.reshape(rows, (-1, 7))
    np.testing.assert_array_equal(layout.position, values[:, :2])
    np.testing.assert_array_equal(layout.yaw, np.deg2rad(values[:, 2]))
    np.testing.assert_array_equal(layout.size, values[:, 3:6])
    np.testing.assert_array_equal(layout.elevation, values[:, 6])


def line(**changes: str) -> str:
    cells = {"id": "b", "category": "chair", "x": "1", "z": "2", "yaw_deg": "0", "w": "1", "h": "1", "d": "1"}
    return f"{HEADER}\na,chair,0,0,0,1,1,1\n\n{','.join((cells | changes).values())}\n"


FORM = "must be id,category,x,z,yaw_deg,w,h,d in any order (...)"
TABS = FORM.replace(" in", ", with commas (or semicolons) between them, not tabs, in", 1)


@pytest.mark.parametrize(("load", "error"), LOADERS)
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", f"header: {FORM}, got ''"),
        ("\n\n", f"header: {FORM}, got ''"),
        ("a,chair,0,0,0,1,1,1\n", f"header: {FORM}, got 'a,chair,0,0,0,1,1,1'"),
        (HEADER.replace(",d", ""), f"header: {FORM}, got 'id,category,x,z,yaw_deg,w,h'"),
        (HEADER.replace("yaw_deg", "yaw"), f"header: {FORM}, got 'id,category,x,z,yaw,w,h,d'"),
        (f"{HEADER},colour", f"header: {FORM}, got '{HEADER},colour'"),
        (f"{HEADER},x", f"header: {FORM}, got '{HEADER},x'"),
        (f"{HEADER},y,y", f"header: {FORM}, got '{HEADER},y,y'"),
        (
            HEADER.replace(",", "\t"),
            f"header: {TABS}, got {HEADER.replace(',', chr(9))!r}",
        ),
        (
            line(x="1,60").replace(",", ";").replace("1;60", "1.600,5"),
            "line 4, x: must be a finite number, got '1.600,5'",
        ),
        (
            line(x='"1,60"'),
            "line 4, x: must be a finite number with a decimal point, not a comma, got '1,60'",
        ),
        (line(x="1_2"), "line 4, x: must be a finite number, got '1_2'"),
        (line(x="١٢"), "line 4, x: must be a finite number, got '١٢'"),
        (line(x="1e7"), "line 4, x: must be a finite number, from -1e6 to 1e6, got '1e7'"),
        (line(yaw_deg="1e20"), "line 4, yaw_deg: must be a finite number, from -3.6e8 to 3.6e8, got '1e20'"),
        (
            line(h="1e-9"),
            "line 4, h: must be a positive number in metres, from 1e-6 to 1e6, got '1e-9'",
        ),
        (f"{HEADER}\na,chair,0,0,0,1,1\n", "line 2: must have 8 cells, got 7"),
        (f"{HEADER}\na,chair,0,0,0,1,1,1,9\n", "line 2: must have 8 cells, got 9"),
        (line(id=""), "line 4, id: must not be empty, got ''"),
        (line(id="a"), "line 4, id: must not repeat an earlier id, got 'a'"),
        (line(x=""), "line 4, x: must be a finite number, got ''"),
        (line(x="one"), "line 4, x: must be a finite number, got 'one'"),
        (line(z="nan"), "line 4, z: must be a finite number, got 'nan'"),
        (line(yaw_deg="-inf"), "line 4, yaw_deg: must be a finite number, got '-inf'"),
        (line(z="1e999"), "line 4, z: must be a finite number, got '1e999'"),
        (line(w="0"), "line 4, w: must be a positive number in metres, got '0'"),
        (line(h="-1"), "line 4, h: must be a positive number in metres, got '-1'"),
        (line(d="NaN"), "line 4, d: must be a positive number in metres, got 'NaN'"),
        (line(d="wide"), "line 4, d: must be a positive number in metres, got 'wide'"),
        (f"{HEADER},y\na,chair,0,0,0,1,1,1,\n", "line 2, y: must be a finite number, got ''"),
    ],
)
def test_a_broken_table_gives_one_line_with_the_file_the_line_the_column_and_the_value(
    table, load, error, text, message
):
    with pytest.raises(error) as problem:
        load(table(text))
    said = re.sub(r"\(all but id, x and z may be left out; y, .* may be added\)", "(...)", str(problem.value))
    assert said == f"table.csv: {message}"


def test_an_object_of_a_layout_may_have_no_category_that_is_known(table):
    layout = load_layout_csv(table(line(category=" ")))
    assert NO_CATEGORY in layout.category
    assert layout.partly_named


@pytest.mark.parametrize(("load", "error"), LOADERS)
def test_a_table_in_another_encoding_is_refused(table, load, error):
    with pytest.raises(error, match=r"table\.csv: file: must be a CSV table in UTF-8, got 'UTF-16'"):
        load(table(TABLE, "utf-16"))


@pytest.mark.parametrize(("load", "error"), LOADERS)
def test_a_cell_too_long_for_a_table_is_refused(table, load, error):
    with pytest.raises(error, match=r"table\.csv: file: must be a CSV table, got 'field larger"):
        load(table(f"{HEADER}\n{'a' * 200_000}"))


@pytest.mark.parametrize(("load", "error"), LOADERS)
def test_a_table_that_is_not_there_is_refused_by_its_whole_path(tmp_path, load, error):
    with pytest.raises(error) as problem:
        load(tmp_path / "nothing.csv")
    assert str(problem.value) == (
        f"{tmp_path / 'nothing.csv'}: file: must be a readable file, got 'No such file or directory'"
    )


def test_what_a_table_leaves_out_is_not_known(table):
    layout = load_layout_csv(table("id,x,z\na,1,2\nb,-3,4\n"))
    assert layout.position.tolist() == [[1, 2], [-3, 4]]
    assert layout.category == (NO_CATEGORY, NO_CATEGORY)
    assert np.isnan(layout.yaw).all()
    assert np.isnan(layout.size).all()
    assert load_scene_csv(table("id,x,z\na,1,2\n")).bounds is None
    seen = load_snapshot_csv(table("id,x,z,yaw_deg,w,h,d\na,1,2,,,,\nb,1,2,90,1,2,3\n"), CAMERA).detections
    assert np.isnan(seen.yaw).tolist() == [True, False]
    assert np.isnan(seen.size).all(axis=1).tolist() == [True, False]


def test_a_table_may_say_its_frame_units_turns_tracks_and_what_is_fixed(table):
    s = np.sqrt(0.5)
    text = f"id,x,y,z,qx,qy,qz,qw,fixed,frame,units\na,100,50,-200,0,{s},0,{s},yes,openxr,cm\n"
    layout = load_layout_csv(table(text + "b,0,0,0,0,0,0,1,,openxr,cm\n"))
    assert layout.position.tolist() == [[1, 2], [0, 0]]
    assert layout.elevation.tolist() == [0.5, 0]
    assert layout.yaw == pytest.approx([-np.pi / 2, 0])
    assert layout.fixed.tolist() == [True, False]
    ros = table("id,x,y,yaw_rad,track_id,confidence,frame\na,3,-4,0.5,t7,0.25,ros\n")
    seen = load_snapshot_csv(ros, CAMERA).detections
    assert seen.position.tolist() == [[4, 3]]
    assert seen.yaw.tolist() == [-0.5]
    assert (seen.track_id, seen.confidence.tolist()) == (("t7",), [0.25])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("id,x,z,w,h,d\na,1,2,1,,1\n", "line 2, h: must be a positive number in metres, got ''"),
        ("id,x,z,qx,qy,qz,qw\na,1,2,1,1,1,1\n", "line 2, qx,qy,qz,qw: must be a unit quaternion"),
        ("id,x,z,frame\na,1,2,opencv\n", "frame: must be a world's frame (unity, openxr or ros): opencv is"),
        ("id,x,z,units\na,1,2,m\nb,1,2,cm\n", "line 3, units: must be m, as in the rows before, got 'cm'"),
        ("id,x,z,fixed\na,1,2,maybe\n", "line 2, fixed: must be true or false, got 'maybe'"),
        ("id,x,z,frame\na,1,2,ros\n", "line 2, y: must be a number from -1e6 to 1e6, got nothing"),
        ("id,x,z,confidence\na,1,2,1\n", "header: must be id,category,"),
        ("id,x,yaw_deg\na,1,2\n", "header: must be id,category,"),
    ],
)
def test_a_broken_column_is_named_with_its_line(table, text, message):
    with pytest.raises(SceneError) as problem:
        load_layout_csv(table(text))
    assert str(problem.value).startswith(f"table.csv: {message}")
