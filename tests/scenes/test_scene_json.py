"""Scene files: read as they are, written back as they were, and refused in one line when they are broken."""

import copy
import json
from dataclasses import replace
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import SceneError
from farm_ar.scenes import (
    BUILTIN,
    PAPER_FIELD_OF_VIEW,
    CameraPath,
    FieldOfView,
    Layout,
    Scene,
    Site,
    Template,
    Weights,
    builtin_scene,
    load_scene,
    save_scene,
    scene_from_dict,
    scene_schema,
    scene_to_dict,
)

# Table 1 of the paper: sites, object types, objects, area.
TABLE_1 = {
    "L1": (2, 1, 16, 25),
    "L2": (4, 1, 8, 64),
    "M1": (5, 3, 35, 64),
    "M2": (6, 2, 30, 25),
    "H1": (10, 5, 52, 49),
    "H2": (14, 11, 48, 225),
}

EXAMPLE: dict[str, Any] = {
    "name": "example",
    "size_m": [5, 4],
    "sites": [{"name": "S1", "x": 1.0, "z": 1}, {"name": "S2", "x": 7, "z": -1}],
    "objects": [
        {"label": "1", "category": "chair", "x": 1, "z": 2, "yaw_deg": 30.1, "size_whd": [0.5, 1, 0.6]},
        {
            "label": "2",
            "category": "table",
            "x": 3,
            "z": 2.5,
            "yaw_deg": -400,
            "y": 0.1,
            "size_whd": [1.2, 0.7, 0.8],
            "fixed": True,
        },
    ],
    "templates": [{"category": "chair", "yaw_deg": 90, "size_whd": [0.5, 1, 0.6]}],
    "camera_path": {
        "closed": True,
        "bezier_points": [[1, 1], [2, 1], [3, 1], [4, 1]],
        "polyline": [[1, 1], [4, 1]],
    },
    "camera": {
        "fov_left_deg": 30,
        "fov_right_deg": 40,
        "fov_up_deg": 10,
        "fov_down_deg": 20,
        "range_m": 2.5,
        "speed_m_s": 0.5,
    },
    "weights": {"translation": 2, "rotation": 0},
    "symmetry_deg": {"table": 180},
}

MISSING = object()
HUGE = 10**400


def changed(path: tuple[str | int, ...], value: Any) -> dict[str, Any]:
    """The example with one value put in another's place, or taken out."""
    data = copy.deepcopy(EXAMPLE)
    place: Any = data
    for step in path[:-1]:
        place = place[step]
    if value is MISSING:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return data


def fits_schema(data: Any) -> bool:
    return jsonschema.Draft202012Validator(scene_schema()).is_valid(data)


def assert_same_scene(one: Scene, other: Scene) -> None:
    """Equal but for the last digit of an angle, which is not the same number in degrees."""
    assert (one.name, one.size, one.sites) == (other.name, other.size, other.sites)
    assert (one.weights, one.camera_speed) == (other.weights, other.camera_speed)
    layout, other_layout = one.layout, other.layout
    assert (layout.labels, layout.category) == (other_layout.labels, other_layout.category)
    for name in ("position", "size", "elevation", "fixed"):
        np.testing.assert_array_equal(getattr(layout, name), getattr(other_layout, name))
    np.testing.assert_allclose(layout.yaw, other_layout.yaw, rtol=1e-15, atol=1e-14)
    assert [t.category for t in one.templates] == [t.category for t in other.templates]
    assert [t.size for t in one.templates] == [t.size for t in other.templates]
    np.testing.assert_allclose([t.yaw for t in one.templates], [t.yaw for t in other.templates], atol=1e-13)
    assert one.symmetry == pytest.approx(dict(other.symmetry), abs=1e-13)
    for name in ("left", "right", "range_m", "up", "down"):
        assert getattr(one.fov, name) == pytest.approx(getattr(other.fov, name), abs=1e-13)
    assert (one.camera_path is None) == (other.camera_path is None)
    if one.camera_path is not None and other.camera_path is not None:
        assert one.camera_path.closed == other.camera_path.closed
        np.testing.assert_array_equal(one.camera_path.points, other.camera_path.points)


# --- The paper authors' layouts ---


@pytest.mark.parametrize("name", TABLE_1)
def test_the_authors_layouts_have_the_counts_of_table_1(paper_scenes, name):
    scene = load_scene(paper_scenes / f"{name}.json")
    counts = (len(scene.sites), len(scene.layout.categories), len(scene.layout), scene.area)
    assert counts == TABLE_1[name]
    assert scene.name == name


@pytest.mark.parametrize("name", TABLE_1)
def test_the_authors_layouts_are_read_as_they_are(paper_scenes, name):
    data = json.loads((paper_scenes / f"{name}.json").read_text())
    scene = load_scene(paper_scenes / f"{name}.json")
    layout = scene.layout
    assert list(scene.size) == data["size_m"]
    assert [{"name": s.name, "x": s.x, "z": s.z} for s in scene.sites] == data["sites"]
    for i, item in enumerate(data["objects"]):
        assert (layout.labels[i], layout.category[i]) == (item["label"], item["category"])
        assert layout.position[i].tolist() == [item["x"], item["z"]]
        assert layout.elevation[i] == item["y"]
        assert layout.size[i].tolist() == item["size_whd"]
        assert np.rad2deg(layout.yaw[i]) == pytest.approx(item["yaw_deg"])
    assert [t.category for t in scene.templates] == [t["category"] for t in data["templates"]]
    assert [list(t.size) for t in scene.templates] == [t["size_whd"] for t in data["templates"]]
    assert [np.rad2deg(t.yaw) for t in scene.templates] == pytest.approx(
        [t["yaw_deg"] for t in data["templates"]]
    )
    assert scene.camera_path.points.tolist() == data["camera_path"]["bezier_points"]
    assert scene.camera_path.closed == data["camera_path"]["closed"]
    assert scene.fov == PAPER_FIELD_OF_VIEW
    assert scene.camera_speed == data["camera"]["speed_m_s"]
    assert scene.weights == Weights(data["weights"]["translation"], data["weights"]["rotation"])
    assert not layout.fixed.any()
    assert not scene.symmetry


@pytest.mark.parametrize("name", TABLE_1)
def test_the_polyline_of_an_authors_path_lies_on_its_beziers(paper_scenes, name):
    data = json.loads((paper_scenes / f"{name}.json").read_text())
    sampled = load_scene(paper_scenes / f"{name}.json").camera_path.polyline
    given_points = np.array(data["camera_path"]["polyline"])
    away = np.linalg.norm(given_points[:, None] - sampled, axis=-1).min(axis=1)
    assert away.max() < 0.1


@pytest.mark.parametrize("name", TABLE_1)
def test_writing_an_authors_layout_changes_none_of_its_values(paper_scenes, name, tmp_path):
    data = json.loads((paper_scenes / f"{name}.json").read_text())
    save_scene(load_scene(paper_scenes / f"{name}.json"), tmp_path / "again.json")
    again = json.loads((tmp_path / "again.json").read_text())
    del data["camera_path"]["polyline"]
    assert again == data


# --- Reading and writing ---


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    metres = st.floats(-50, 50)
    sides = st.tuples(*[st.floats(1e-3, 20)] * 3)
    angles = st.floats(-10, 10)
    names = st.text(min_size=1, max_size=8)
    labels = draw(st.lists(names, max_size=6, unique=True))
    n = len(labels)
    category = draw(st.lists(st.sampled_from(["chair", "table", "été", "a.b"]), min_size=n, max_size=n))
    layout = Layout(
        tuple(labels),
        tuple(category),
        draw(st.lists(st.tuples(metres, metres), min_size=n, max_size=n)),
        draw(st.lists(angles, min_size=n, max_size=n)),
        draw(st.lists(sides, min_size=n, max_size=n)),
        draw(st.lists(metres, min_size=n, max_size=n)),
        draw(st.lists(st.booleans(), min_size=n, max_size=n)),
    )
    of_layout = st.lists(st.sampled_from(layout.categories), unique=True) if n else st.just([])
    places = draw(
        st.lists(st.tuples(metres, metres), max_size=4, unique_by=lambda p: (p[0] + 0.0, p[1] + 0.0))
    )
    half_turn, quarter = st.floats(0, np.pi), st.floats(0, np.pi / 2)
    vertical = draw(st.one_of(st.just((None, None)), st.tuples(quarter, quarter)))
    points = draw(st.none() | st.lists(st.tuples(metres, metres), min_size=7, max_size=7, unique=True))
    return Scene(
        name=draw(names),
        size=draw(st.tuples(st.floats(0.1, 100), st.floats(0.1, 100))),
        layout=layout,
        sites=tuple(Site(f"S{i}", x, z) for i, (x, z) in enumerate(places)),
        camera_path=None if points is None else CameraPath(points, draw(st.booleans())),
        fov=FieldOfView(draw(half_turn), draw(half_turn), draw(st.floats(0.1, 100)), *vertical),
        camera_speed=draw(st.floats(0.01, 10)),
        weights=draw(st.none() | st.builds(Weights, st.floats(0, 100), st.floats(0, 100))),
        templates=tuple(Template(c, draw(angles), draw(sides)) for c in draw(of_layout)),
        symmetry={c: draw(st.floats(0, 2 * np.pi)) for c in draw(of_layout)},
    )


@given(scenes())
def test_a_scene_that_is_written_and_read_is_the_same_scene(tmp_path_factory, scene):
    path = tmp_path_factory.getbasetemp() / "round trip.json"
    save_scene(scene, path)
    again = load_scene(path)
    assert_same_scene(scene, again)


@given(scenes())
def test_what_is_written_fits_the_schema_and_is_the_same_bytes_each_time(tmp_path_factory, scene):
    path = tmp_path_factory.getbasetemp() / "same bytes.json"
    save_scene(scene, path)
    first = path.read_bytes()
    assert fits_schema(json.loads(first))
    save_scene(load_scene(path), path)
    assert path.read_bytes() == first


def test_angles_of_up_to_eleven_decimals_are_written_as_they_were_read():
    for yaw_deg in (25.71, 0.1, -179.99, 359.12345678901, 400.7):
        data = changed(("objects", 0, "yaw_deg"), yaw_deg)
        assert scene_to_dict(scene_from_dict(data))["objects"][0]["yaw_deg"] == yaw_deg


def test_what_is_said_of_categories_that_no_object_has_is_not_written():
    scene = scene_from_dict(EXAMPLE)
    part = replace(scene, layout=scene.layout.subset([]))
    data = scene_to_dict(part)
    assert data["templates"] == []
    assert "symmetry_deg" not in data
    assert len(scene_from_dict(data).layout) == 0


def test_flags_and_numbers_of_numpy_can_be_written(tmp_path):
    path = CameraPath(np.zeros((4, 2)) + np.arange(4)[:, None], np.bool_(True))
    scene = Scene("room", np.array([5, 4]), scene_from_dict(EXAMPLE).layout, camera_path=path)
    save_scene(scene, tmp_path / "numpy.json")
    assert load_scene(tmp_path / "numpy.json").camera_path.closed is True


def test_every_value_of_a_file_is_read():
    scene = scene_from_dict(EXAMPLE)
    layout = scene.layout
    assert (scene.name, scene.size) == ("example", (5, 4))
    assert scene.sites == (Site("S1", 1, 1), Site("S2", 7, -1))
    assert (layout.labels, layout.category) == (("1", "2"), ("chair", "table"))
    assert layout.position.tolist() == [[1, 2], [3, 2.5]]
    np.testing.assert_allclose(layout.yaw, [30.1 * np.pi / 180, -400 * np.pi / 180])
    assert layout.elevation.tolist() == [0, 0.1]
    assert layout.size.tolist() == [[0.5, 1, 0.6], [1.2, 0.7, 0.8]]
    assert layout.fixed.tolist() == [False, True]
    assert scene.templates == (Template("chair", np.pi / 2, (0.5, 1, 0.6)),)
    assert scene.camera_path.closed
    assert scene.camera_path.points.tolist() == [[1, 1], [2, 1], [3, 1], [4, 1]]
    assert np.rad2deg([scene.fov.left, scene.fov.right, scene.fov.up, scene.fov.down]) == pytest.approx(
        [30, 40, 10, 20]
    )
    assert (scene.fov.range_m, scene.camera_speed) == (2.5, 0.5)
    assert scene.weights == Weights(2, 0)
    assert scene.symmetry == {"table": np.pi}


def test_a_file_needs_only_a_size_and_objects():
    scene = scene_from_dict({"size_m": [5, 4], "objects": EXAMPLE["objects"][:1]}, default_name="kitchen")
    assert scene.name == "kitchen"
    assert scene.sites == ()
    assert scene.templates == ()
    assert scene.camera_path is None
    assert scene.fov == PAPER_FIELD_OF_VIEW
    assert scene.camera_speed == 1
    assert scene.weights is None
    assert scene.symmetry == {}
    assert scene.layout.elevation.tolist() == [0]
    assert scene.layout.movable.all()


def test_an_entry_may_leave_out_what_has_a_default():
    data = {
        **EXAMPLE,
        "camera": {},
        "weights": {"translation": 3},
        "templates": [{"category": "chair", "size_whd": [1, 1, 1]}],
        "camera_path": {"bezier_points": [[1, 1], [2, 1], [3, 1], [4, 1]]},
    }
    scene = scene_from_dict(data)
    assert scene.fov == PAPER_FIELD_OF_VIEW
    assert scene.weights == Weights(3, 1)
    assert scene.templates[0].yaw == 0
    assert not scene.camera_path.closed
    assert fits_schema(data)


def test_a_file_may_have_no_objects():
    data = {"size_m": [5, 4], "objects": [], "sites": [{"name": "S1", "x": 1, "z": 1}]}
    scene = scene_from_dict(data)
    assert len(scene.layout) == 0
    assert scene.layout.position.shape == (0, 2)
    assert scene_to_dict(scene)["objects"] == []
    assert fits_schema(data)


def test_a_scene_without_a_name_has_that_of_its_file(tmp_path):
    path = tmp_path / "living room.json"
    path.write_text(json.dumps(changed(("name",), MISSING)))
    assert load_scene(path).name == "living room"


def test_a_file_may_say_which_schema_it_follows_and_what_it_is():
    data = {"$schema": "scene.schema.json", "description": "My kitchen.", **EXAMPLE}
    assert scene_from_dict(data).name == "example"
    assert fits_schema(data)


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path):
    path = tmp_path / "bom.json"
    path.write_text(json.dumps(EXAMPLE), encoding="utf-8-sig")
    assert load_scene(path).name == "example"


def test_names_are_not_bound_to_ascii(tmp_path):
    data = changed(("objects", 0, "label"), "椅子 “1”\n")
    path = tmp_path / "unicode.json"
    path.write_text(json.dumps(data, ensure_ascii=False), encoding="utf-8")
    save_scene(load_scene(path), path)
    assert load_scene(path).layout.labels[0] == "椅子 “1”\n"


def test_what_was_parsed_is_not_changed_by_reading_it():
    data = copy.deepcopy(EXAMPLE)
    scene_from_dict(data)
    assert data == EXAMPLE


# --- The schema ---


def test_the_schema_is_a_json_schema():
    jsonschema.Draft202012Validator.check_schema(scene_schema())


def test_the_schema_accepts_the_example_and_describes_every_field_that_is_read():
    assert fits_schema(EXAMPLE)
    others = {"frame", "units", "origin", "size", "bounds"}
    assert set(EXAMPLE) | others | {"$schema", "description"} == set(scene_schema()["properties"])


@pytest.mark.parametrize("name", TABLE_1)
def test_the_schema_accepts_the_authors_layouts(paper_scenes, name):
    assert fits_schema(json.loads((paper_scenes / f"{name}.json").read_text()))


@pytest.mark.parametrize("name", BUILTIN)
def test_the_schema_and_the_loader_accept_every_built_in_scene(name):
    data = scene_to_dict(builtin_scene(name))
    assert fits_schema(json.loads(json.dumps(data)))
    assert_same_scene(builtin_scene(name), scene_from_dict(data))


def test_changing_the_schema_that_was_given_out_does_not_change_the_next():
    scene_schema().clear()
    assert scene_schema()["required"] == ["objects"]


# --- Broken files ---

# What is wrong; the field that the error names; and the end of the error, the value.
BROKEN = [
    (("size_m",), None, "size_m", "got None"),
    (("size_m",), [5], "size_m", "got [5]"),
    (("size_m",), [5, 5, 5], "size_m", "got [5, 5, 5]"),
    (("size_m",), [5, 0], "size_m", "got [5, 0]"),
    (("size_m",), [True, 5], "size_m", "got [True, 5]"),
    (("size_m",), "5 x 5", "size_m", "got '5 x 5'"),
    (("name",), "", "name", "got ''"),
    (("name",), None, "name", "got None"),
    (("nmae",), "x", "nmae", "got 'x'"),
    (("objects",), MISSING, "objects", "got nothing"),
    (("objects",), {}, "objects", "got {}"),
    (("objects", 1), 5, "objects[1]", "got 5"),
    (("objects", 1, "label"), MISSING, "objects[1].label", "got nothing"),
    (("objects", 1, "label"), 2, "objects[1].label", "got 2"),
    (("objects", 1, "label"), "", "objects[1].label", "got ''"),
    (("objects", 0, "x"), "1.0", "objects[0].x", "got '1.0'"),
    (("objects", 0, "x"), True, "objects[0].x", "got True"),
    (("objects", 0, "z"), MISSING, "objects[0].z", "got nothing"),
    (("objects", 0, "yaw_deg"), None, "objects[0].yaw_deg", "got None"),
    (("objects", 0, "yaw"), 30, "objects[0].yaw", "got 30"),
    (("objects", 0, "y"), None, "objects[0].y", "got None"),
    (("objects", 1, "size_whd"), [0.1, 0, 0.12], "objects[1].size_whd", "got [0.1, 0, 0.12]"),
    (("objects", 1, "size_whd"), [0.1, -1, 0.12], "objects[1].size_whd", "got [0.1, -1, 0.12]"),
    (("objects", 1, "size_whd"), [0.1, 0.2], "objects[1].size_whd", "got [0.1, 0.2]"),
    (("objects", 1, "size_whd"), [0.1, 0.2, True], "objects[1].size_whd", "got [0.1, 0.2, True]"),
    (("objects", 1, "fixed"), 1, "objects[1].fixed", "got 1"),
    (("objects", 1, "fixed"), None, "objects[1].fixed", "got None"),
    (("sites",), None, "sites", "got None"),
    (("sites", 0, "name"), MISSING, "sites[0].name", "got nothing"),
    (("sites", 0, "z"), "1", "sites[0].z", "got '1'"),
    (("templates", 0, "size_whd"), MISSING, "templates[0].size_whd", "got nothing"),
    (("templates", 0, "yaw_deg"), "90", "templates[0].yaw_deg", "got '90'"),
    (("templates", 0, "label"), "1", "templates[0].label", "got '1'"),
    (("camera_path",), None, "camera_path", "got None"),
    (("camera_path", "bezier_points"), MISSING, "camera_path.bezier_points", "got nothing"),
    (("camera_path", "bezier_points"), [[0, 0]], "camera_path.bezier_points", "got [[0, 0]]"),
    (("camera_path", "bezier_points", 2), [1, 2, 3], "camera_path.bezier_points[2]", "got [1, 2, 3]"),
    (("camera_path", "closed"), "no", "camera_path.closed", "got 'no'"),
    (("camera_path", "polyline"), {}, "camera_path.polyline", "got {}"),
    (("camera_path", "polyline", 1), 7, "camera_path.polyline[1]", "got 7"),
    (("camera_path", "points"), [], "camera_path.points", "got []"),
    (("camera",), [], "camera", "got []"),
    (("camera", "fov_left_deg"), 181, "camera.fov_left_deg", "got 181"),
    (("camera", "fov_right_deg"), -1, "camera.fov_right_deg", "got -1"),
    (("camera", "fov_up_deg"), 91, "camera.fov_up_deg", "got 91"),
    (("camera", "fov_up_deg"), None, "camera.fov_up_deg", "got None"),
    (("camera", "fov_up_deg"), MISSING, "camera.fov_up_deg", "got nothing"),
    (("camera", "fov_down_deg"), MISSING, "camera.fov_down_deg", "got nothing"),
    (("camera", "range_m"), 0, "camera.range_m", "got 0"),
    (("camera", "speed_m_s"), -0.5, "camera.speed_m_s", "got -0.5"),
    (("camera", "fov_deg"), 60, "camera.fov_deg", "got 60"),
    (("weights",), None, "weights", "got None"),
    (("weights", "translation"), MISSING, "weights.translation", "got nothing"),
    (("weights", "translation"), -2, "weights.translation", "got -2"),
    (("weights", "dimension"), 1, "weights.dimension", "got 1"),
    (("symmetry_deg",), None, "symmetry_deg", "got None"),
    (("symmetry_deg", "table"), 361, "symmetry_deg.table", "got 361"),
    (("symmetry_deg", "table"), False, "symmetry_deg.table", "got False"),
    (("objects", 0, "z"), np.inf, "objects[0].z", "got inf"),
    (("objects", 0, "yaw_deg"), -np.inf, "objects[0].yaw_deg", "got -inf"),
    (("objects", 0, "x"), HUGE, "objects[0].x", " ..."),
]  # fmt: skip

# JSON Schema cannot say these: no number is NaN there, and it compares no values with each other.
BROKEN_BEYOND_SCHEMA = [
    (("objects", 0, "x"), np.nan, "objects[0].x", "got nan"),
    (("objects", 0, "size_whd", 1), np.nan, "objects[0].size_whd", "got [0.5, nan, 0.6]"),
    (("objects", 1, "label"), "1", "objects[1].label", "got '1'"),
    (("objects", 1, "category"), MISSING, "symmetry_deg.table", "got 'table'"),
    (("objects", 1, "category"), None, "symmetry_deg.table", "got 'table'"),
    (("sites", 0, "y"), 1, "sites[0].y", "got 1.0"),
    (("sites", 1, "name"), "S1", "sites[1].name", "got 'S1'"),
    (("sites", 1), {"name": "S2", "x": 1, "z": 1.0}, "sites[1]", "got (1.0, 1.0)"),
    (("templates",), EXAMPLE["templates"] * 2, "templates[1].category", "got 'chair'"),
    (("templates", 0, "category"), "chiar", "templates[0].category", "got 'chiar'"),
    (("symmetry_deg", "tabel"), 90, "symmetry_deg.tabel", "got 'tabel'"),
    (("camera_path", "bezier_points"), [[0, 0]] * 5, "camera_path.bezier_points", "got (5, 2)"),
    (("camera_path", "bezier_points"), [[0, 1]] * 4, "camera_path.bezier_points", "got [0.0, 1.0]"),
]  # fmt: skip


def case_name(value: Any) -> str:
    return ".".join(map(str, value)) if isinstance(value, tuple) else ""


@pytest.mark.parametrize(
    ("path", "value", "field", "end", "in_schema"),
    [(*case, True) for case in BROKEN] + [(*case, False) for case in BROKEN_BEYOND_SCHEMA],
    ids=case_name,
)
def test_a_broken_file_gives_one_line_with_the_file_the_field_and_the_value(
    tmp_path, path, value, field, end, in_schema
):
    data = changed(path, value)
    file = tmp_path / "broken.json"
    file.write_text(json.dumps(data))
    with pytest.raises(SceneError) as problem:
        load_scene(file)
    text = str(problem.value)
    assert text.startswith(f"broken.json: {field}: must ")
    assert text.endswith(end)
    assert "\n" not in text
    assert fits_schema(data) is not in_schema


def test_a_misspelt_field_is_refused_with_the_known_ones():
    with pytest.raises(SceneError) as problem:
        scene_from_dict(changed(("camera", "fov_deg"), 60))
    assert str(problem.value) == (
        "camera.fov_deg: must not be there (known fields: fov_down_deg, fov_left_deg, fov_right_deg, "
        "fov_up_deg, range, range_m, speed, speed_m_s), got 60"
    )


def test_a_number_out_of_its_limits_is_refused_with_the_limits():
    with pytest.raises(SceneError) as problem:
        scene_from_dict(changed(("symmetry_deg", "table"), 361))
    assert str(problem.value) == "symmetry_deg.table: must be a number from 0 to 360, got 361"


def test_fields_that_a_file_leaves_out_are_among_the_known_ones():
    data = {"size_m": [5, 4], "objects": [], "camra": {}}
    with pytest.raises(
        SceneError, match="known fields: bounds, camera, camera_path, frame, name, objects, origin, sites, "
    ):
        scene_from_dict(data)


def test_a_misspelt_field_with_a_line_break_still_gives_one_line():
    with pytest.raises(SceneError) as problem:
        scene_from_dict(changed(("objects", 0, "x\ny"), 1))
    assert str(problem.value).startswith(r"objects[0].'x\ny': must not be there")


def test_a_scene_that_is_no_object_is_refused():
    with pytest.raises(SceneError, match=r"kitchen: file: must be a JSON object, got \[1\]"):
        scene_from_dict([1], source="kitchen")


def test_notes_stand_at_the_top_only():
    with pytest.raises(SceneError, match=r"objects\[0\].description: must not be there"):
        scene_from_dict(changed(("objects", 0, "description"), "mine"))


def places(value: Any, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for key, item in inner for place in places(item, (*path, key)))]


def replaced(value: Any, path: tuple[str | int, ...], new: Any) -> Any:
    if not path:
        return new
    value = copy.copy(value)
    value[path[0]] = replaced(value[path[0]], path[1:], new)
    return value


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.just(HUGE) | st.floats() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from("xzy"), inner, max_size=3),
    max_leaves=5,
)


@given(st.sampled_from(places(EXAMPLE)), JSON)
def test_whatever_stands_anywhere_in_a_file_is_read_or_refused_and_what_is_read_fits_the_schema(place, value):
    data = replaced(EXAMPLE, place, value)
    try:
        scene_from_dict(data, "file.json")
        is_read = True
    except SceneError:
        is_read = False
    assert fits_schema(data) or not is_read
