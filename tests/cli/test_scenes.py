import json
import re
import xml.etree.ElementTree as ET

import jsonschema
import numpy as np
import pytest

from farm_ar.scenes import BUILTIN, builtin_scene, load_scene, load_snapshot, scene_to_dict, visible


def test_list_has_a_row_with_the_counts_of_each_built_in_scene(run):
    lines = run("scenes", "list").stdout.splitlines()
    assert lines[0].split() == [
        "name",
        "what",
        "it",
        "is",
        "room",
        "area",
        "sites",
        "categories",
        "objects",
        "path",
    ]
    rows = {line.split()[0]: line for line in lines[2:]}
    assert list(rows) == list(BUILTIN)
    for name, line in rows.items():
        scene = builtin_scene(name)
        path = "none" if scene.camera_path is None else f"{scene.camera_path.length:.1f} m"
        counts = (len(scene.sites), len(scene.layout.categories), len(scene.layout))
        assert re.search(r"\s+".join(map(str, (*counts, path))) + r"\s*$", line)


def test_list_is_plain_text_that_keeps_every_word_however_narrow(run, monkeypatch):
    wide = run("scenes", "list").stdout
    monkeypatch.setenv("COLUMNS", "20")
    narrow = run("scenes", "list").stdout
    assert "\x1b" not in wide + narrow
    assert "…" not in wide + narrow
    assert all(len(line) <= 80 for line in narrow.splitlines())
    assert sorted(re.sub("─+", "", narrow).split()) == sorted(re.sub("─+", "", wide).split())


def test_show_draws_a_scene_under_its_name_in_this_folder(run, tmp_path):
    result = run("scenes", "show", "L1")
    assert result.stdout.endswith("Wrote L1.svg\n")
    assert ET.parse(tmp_path / "L1.svg").getroot().tag.endswith("svg")


def test_show_draws_a_file_under_the_name_it_is_given(run, before, tmp_path):
    out = tmp_path / "new" / "office.png"
    result = run("scenes", "show", before, "--out", out, "--camera", "-1,2.5,90")
    assert result.stdout.splitlines() == [
        "office: 5x4 m, 9 objects of 2 categories, 2 sites, no camera path",
        f"Wrote {out}",
    ]
    assert out.read_bytes().startswith(b"\x89PNG")


def test_a_camera_changes_the_picture(run, tmp_path):
    run("scenes", "show", "L2", "--out", "without.svg")
    run("scenes", "show", "L2", "--out", "with.svg", "--camera", "4,4,30")
    assert (tmp_path / "without.svg").read_bytes() != (tmp_path / "with.svg").read_bytes()


def test_show_json_prints_a_scene_file(run, before, tmp_path):
    copy = tmp_path / "copy.json"
    copy.write_text(run("scenes", "show", before, "--json").stdout)
    assert scene_to_dict(load_scene(copy)) == scene_to_dict(load_scene(before))


def test_show_snapshot_prints_what_the_camera_sees_as_a_snapshot_file(run, tmp_path):
    scene, file = builtin_scene("L2"), tmp_path / "seen.json"
    file.write_text(run("scenes", "show", "L2", "--camera", "4,4,-135", "--snapshot").stdout)
    snapshot = load_snapshot(file)
    seen = visible(scene.layout, snapshot.camera)
    assert np.rad2deg(snapshot.camera.yaw) == pytest.approx(-135)
    assert 0 < len(snapshot.detections) == seen.sum()
    np.testing.assert_allclose(snapshot.detections.position, scene.layout.position[seen])


def test_validate_says_what_is_in_a_file(run, before):
    result = run("scenes", "validate", before)
    assert result.exit_code == 0
    assert result.stdout == (
        f"{before}: a valid scene: 5x4 m, 9 objects of 2 categories, 2 sites, no camera path\n"
    )


def test_validate_reads_a_table_with_its_room(run, before):
    table = before.with_suffix(".csv")
    result = run("scenes", "validate", table, "--room", "5,4")
    assert result.stdout.startswith(f"{table}: a valid scene: 5x4 m, 9 objects of 2 categories, 0 sites")


def test_validate_says_in_one_line_what_is_wrong(mistake, before, tmp_path):
    data = json.loads(before.read_text())
    data["objects"][3]["size_whd"] = [0.1, 0, 0.12]
    (tmp_path / "farm.json").write_text(json.dumps(data))
    assert mistake("scenes", "validate", "farm.json") == (
        "SceneError: farm.json: objects[3].size_whd: must be 3 positive numbers in metres, from 1e-6 to 1e6, "
        "got [0.1, 0, 0.12]"
    )


def test_the_schema_accepts_what_show_prints(run):
    schema = json.loads(run("scenes", "schema").stdout)
    jsonschema.validate(json.loads(run("scenes", "show", "farm", "--json").stdout), schema)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["show", "nowhere"], "OptionError: scene: must be a .json or .csv file or one of L1, "),
        (["show", "none.json"], "SceneError: none.json: file: must be a readable file, got 'No such file"),
        (["show", "none.csv"], "SceneError: none.csv: file: must be a readable file, got 'No such file"),
        (
            ["show", "L1", "--room", "5,5"],
            "OptionError: --room: must not be given with a built-in scene, got '5,5'",
        ),
        (
            ["show", "L1", "--camera", "1,2"],
            "OptionError: --camera: must be x,z,yaw_deg, all of them numbers, got '1,2'",
        ),
        (["show", "L1", "--camera", "1,2,inf"], "OptionError: --camera: must be x,z,yaw_deg, all"),
        (["show", "L1", "--camera", "1,2,east"], "OptionError: --camera: must be x,z,yaw_deg, all"),
        (["show", "L1", "--json", "--snapshot"], "OptionError: --snapshot: must not be given with --json"),
        (["show", "L1", "--json", "--out", "a.svg"], "OptionError: --out: must not be given with --json"),
        (
            ["show", "L1", "--json", "--camera", "1,2,3"],
            "OptionError: --camera: must not be given with --json",
        ),
        (
            ["show", "L1", "--snapshot"],
            "OptionError: --camera: must be given with --snapshot, as x,z,yaw_deg",
        ),
        (
            ["show", "L1", "--snapshot", "--camera", "1,2,3", "--out", "a.svg"],
            "OptionError: --out: must not be given",
        ),
        (["show", "L1", "--out", "L1.pdf"], "OptionError: --out: must end in .svg or .png"),
        (
            ["show", "L1", "--out", "taken/L1.svg"],
            "OptionError: --out: must be a place that can be written (",
        ),
        (["validate", "L1"], "OptionError: scene: must be a .json or .csv file, got 'L1'"),
        (
            ["validate", "none.csv", "--room", "5,-5"],
            "OptionError: --room: must be width,depth, positive numbers",
        ),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(mistake, tmp_path, arguments, line):
    (tmp_path / "taken").touch()
    assert mistake("scenes", *arguments).startswith(line)
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_validate_notes_what_stands_outside_the_room(run, tmp_path):
    import json

    from farm_ar.scenes import builtin_scene, scene_to_dict

    data = scene_to_dict(builtin_scene("L2"))
    data["objects"][2]["x"] = 9.5
    (tmp_path / "far.json").write_text(json.dumps(data))
    result = run("scenes", "validate", "far.json")
    assert result.exit_code == 0
    assert result.stdout.splitlines()[1] == "Note: outside the room [0, w] x [0, d] stand 3"
