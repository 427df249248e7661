import json
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from typer.testing import CliRunner

from farm_ar.cli import app
from farm_ar.reid import (
    REIDENTIFIERS,
    AdaptiveReid,
    DistanceReid,
    LastKnownReid,
    LikelihoodReid,
    NearestReid,
    RigidMotion,
    SpatialOptions,
    SpatialReid,
)
from farm_ar.reid.alignment import moved
from farm_ar.scenes import (
    Camera,
    Detections,
    FieldOfView,
    Snapshot,
    Weights,
    load_scene,
    load_snapshot,
    observe,
    save_snapshot,
)

NAMES = ", ".join(sorted(REIDENTIFIERS))
CSV_CAMERA = ("--camera", "3.6,0.3,-45,90,4")


@pytest.fixture
def run(run):
    """Types commands, `identify` with the paper's method where no method is named."""

    def run_it(*arguments):
        named = arguments[:1] != ("identify",) or "--reid" in arguments
        return run(*arguments, *(() if named else ("--reid", "spatial")))

    return run_it


@pytest.fixture
def identify(run, before, seen):
    """Types `farm-ar identify` about the example files, asking for JSON, and gives the parsed answer."""

    def identify(*options):
        return json.loads(run("identify", "--scene", before, "--snapshot", seen, "--json", *options).stdout)

    return identify


def expected(found, seen):
    return {
        "ids": list(seen.detections.ids),
        "labels": list(found.labels),
        "reasons": [None if label else "no label fits it" for label in found.labels],
        "costs": [None if cost != cost else cost for cost in found.cost.tolist()],
        "confidence": [None if value != value else value for value in found.confidence.tolist()],
        "margins": [None if value != value else value for value in found.margin.tolist()],
        "runners_up": list(found.runner_up),
        "certified": found.certified
        and {
            "radius": found.certified.radius,
            "metres": found.certified.metres,
            "degrees": found.certified.degrees,
        },
        "warnings": list(found.warnings),
        "total": found.total,
        "candidates": list(found.candidates),
        "sites": list(found.sites),
        "widened": found.widened,
        "world": {"frame": "unity", "units": "m"},
    }


def test_the_default_is_named_first_and_is_the_method_that_wins_the_benchmark(before, seen):
    files = ["identify", "--scene", str(before), "--snapshot", str(seen)]
    typed = CliRunner().invoke(app, files)
    assert typed.stdout.startswith("Method: adaptive\n")
    answer = json.loads(CliRunner().invoke(app, [*files, "--json"]).stdout)
    snapshot = load_snapshot(seen)
    assert answer["method"] == "adaptive"
    assert answer["labels"] == list(AdaptiveReid(load_scene(before)).identify(snapshot).labels)
    assert (
        json.loads(CliRunner().invoke(app, [*files, "--json", "--threshold", "0"]).stdout)["method"]
        == "spatial"
    )
    careful = CliRunner().invoke(app, [*files, "--json", "--min-confidence", "0.999"])
    assert json.loads(careful.stdout)["labels"].count(None) > answer["labels"].count(None)


def test_the_table_gives_each_detection_its_label_and_cost(run, before, seen):
    lines = run("identify", "--scene", before, "--snapshot", seen).stdout.splitlines()[1:]
    columns = ["detection", "category", "x", "z", "yaw_deg", "label"]
    assert lines[0].split() == [*columns, "cost", "confidence", "margin", "runner_up"]
    rows = [line.split() for line in lines[2:8]]
    assert rows[0][:6] == ["d1", "chair", "2.70", "1.90", "110.0", "dan"]
    assert [row[0] for row in rows] == ["d1", "d2", "d3", "d4", "d5", "d6"]
    found = SpatialReid(load_scene(before)).identify(load_snapshot(seen))
    known = [line for line in map(str.split, lines[2:8]) if line[1] == "chair"]
    margins = {f"{cost:.4f}": f"{margin:.4f}" for cost, margin in zip(found.cost, found.margin, strict=True)}
    assert all(margins[row[6]] == row[8] and row[7] == "-" for row in known)
    assert lines[8:] == [
        f"Identified: 6 of 6 detections, total cost {found.total:.4f}",
        "Candidates: 9 of 9 labels, nothing pruned",
    ]


def test_an_unidentified_detection_has_neither_label_nor_cost(run, before, seen):
    lines = run(
        "identify", "--scene", before, "--snapshot", seen, "--reid", "last-known"
    ).stdout.splitlines()[1:]
    assert lines[2].split()[-5:] == ["none", "none", "-", "-", "none"]
    assert lines[4].split()[-6:] == ["long", "table", "0.0000", "-", "-", "none"]
    assert lines[8] == "Identified: 1 of 6 detections, total cost 0.0000"


def test_the_likelihood_says_how_sure_it_is(run, identify, before, seen):
    answer = identify("--reid", "likelihood")
    found = LikelihoodReid(load_scene(before)).identify(load_snapshot(seen))
    del answer["solve_time_s"], answer["method"]
    assert answer == expected(found, load_snapshot(seen))
    lines = run(
        "identify", "--scene", before, "--snapshot", seen, "--reid", "likelihood"
    ).stdout.splitlines()[1:]
    numbers = [line.split() for line in lines[2:8] if line.split()[1] == "chair"]
    shown = {f"{sure:.3f} {margin:.4f}" for sure, margin in zip(found.confidence, found.margin, strict=True)}
    assert all(f"{row[7]} {row[8]}" in shown for row in numbers)


def test_a_label_that_is_not_sure_enough_is_withheld(identify):
    sure = identify("--reid", "likelihood", "--min-confidence", ".9999")
    assert None in sure["labels"]
    assert identify("--reid", "likelihood")["labels"] != sure["labels"]


def test_a_known_category_is_kept_unless_it_is_said_how_often_it_is_wrong(run, tmp_path):
    things = [
        {"label": "a", "category": "chair", "x": 1, "z": 1, "yaw_deg": 0, "size_whd": [0.4, 0.9, 0.4]},
        {"label": "b", "category": "table", "x": 2, "z": 1, "yaw_deg": 0, "size_whd": [1.2, 0.7, 0.8]},
    ]
    seen = things[1] | {"category": "chair", "id": "d"}  # in the table's place, as large as it
    del seen["label"]
    camera = {"x": 1, "z": -1, "yaw_deg": 0, "fov_left_deg": 45, "fov_right_deg": 45, "range_m": 5}
    (tmp_path / "scene.json").write_text(json.dumps({"size_m": [3, 3], "objects": things}))
    (tmp_path / "seen.json").write_text(json.dumps({"camera": camera, "detections": [seen]}))
    command = (
        "identify",
        "--scene",
        "scene.json",
        "--snapshot",
        "seen.json",
        "--reid",
        "likelihood",
        "--json",
    )
    assert json.loads(run(*command).stdout)["labels"] != ["b"]
    assert json.loads(run(*command, "--confusion", "0.05").stdout)["labels"] == ["b"]


@pytest.mark.parametrize("rule", ["spatial", "likelihood"])
def test_a_detection_is_explained_on_request(run, identify, before, seen, rule):
    output = run("identify", "--scene", before, "--snapshot", seen, "--reid", rule, "--explain", "d1").stdout
    assert "\nd1 is dan, moved " in output
    assert identify("--reid", rule, "--explain", "d1")["explanation"] in output


def test_what_is_certified_is_told(run, before, tmp_path):
    scene = load_scene(before)
    snapshot, _ = observe(scene.layout, Camera(np.array([3.6, 0.3]), np.array(-0.8)))
    save_snapshot(snapshot, tmp_path / "still.json")
    output = run("identify", "--scene", before, "--snapshot", tmp_path / "still.json").stdout
    found = SpatialReid(scene).identify(snapshot)
    assert found.certified is not None
    assert f"Certified: right if every object moved less than {found.certified.metres:.2f} m, or " in output


def test_pruning_and_widening_are_told(run, before, seen):
    output = run("identify", "--scene", before, "--snapshot", seen, "--threshold", 0).stdout
    assert "Candidates: 9 of 9 labels, from 2 of 2 sites (long table, round table)\n" in output
    assert output.endswith(
        "Widened: the threshold left fewer labels than detections, so further sites were added\n"
    )


@pytest.mark.parametrize(
    ("name", "printed"),
    [
        ("[red]ada :cat:", "[red]ada :cat:"),
        ("Ådå", "Ådå"),
        ("\x1b[31mada\n", "\N{REPLACEMENT CHARACTER}[31mada\N{REPLACEMENT CHARACTER}"),
    ],
)
def test_names_are_printed_as_they_stand_in_the_file_but_steer_no_terminal(
    run, before, seen, tmp_path, name, printed
):
    (tmp_path / "odd.json").write_text(before.read_text().replace('"ada"', json.dumps(name)))
    rows = run("identify", "--scene", "odd.json", "--snapshot", seen).stdout.splitlines()
    assert f" {printed} " in rows[8]


def test_json_is_the_whole_answer(run, before, seen):
    result = run("identify", "--scene", before, "--snapshot", seen, "--json")
    answer = json.loads(result.stdout)
    assert result.stderr == ""
    assert answer.pop("solve_time_s") > 0
    assert answer.pop("method") == "spatial"
    snapshot = load_snapshot(seen)
    assert answer == expected(SpatialReid(load_scene(before)).identify(snapshot), snapshot)


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        (["--reid", "nearest"], NearestReid),
        (["--reid", "distance"], DistanceReid),
        (["--reid", "last-known"], LastKnownReid),
        (["--weights", "0,1"], lambda scene: SpatialReid(scene, SpatialOptions(weights=Weights(0, 1)))),
        (
            ["--gate", "--weights", "0,0"],
            lambda scene: SpatialReid(scene, SpatialOptions(weights=Weights(0, 0))),
        ),
        (["--no-gate"], lambda scene: SpatialReid(scene, SpatialOptions(gate_categories=False))),
        (
            ["--reid", "spatial-ungated"],
            lambda scene: SpatialReid(scene, SpatialOptions(gate_categories=False)),
        ),
        (
            ["--reid", "spatial-ungated", "--threshold", "0"],
            lambda scene: SpatialReid(scene, SpatialOptions(threshold=0, gate_categories=False)),
        ),
        (["--reid", "nearest", "--no-gate"], lambda scene: NearestReid(scene, gate_categories=False)),
        (["--reid", "distance", "--no-gate"], lambda scene: DistanceReid(scene, gate_categories=False)),
        (["--reid", "farm_ar.reid:LastKnownReid"], LastKnownReid),
        (["--threshold", "0"], lambda scene: SpatialReid(scene, SpatialOptions(threshold=0))),
        (
            ["--solver", "mip", "--weights", "3,1"],
            lambda scene: SpatialReid(scene, SpatialOptions(weights=Weights(3, 1), solver="mip")),
        ),
    ],
)
def test_options_choose_the_rule(identify, before, seen, options, rule):
    answer = identify(*options)
    del answer["solve_time_s"], answer["method"]
    snapshot = load_snapshot(seen)
    assert answer == expected(rule(load_scene(before)).identify(snapshot), snapshot)


def seen_in_the_place_of_the_other(scene, tmp_path):
    """A file with a chair where a table stood and a table where a chair did, of the chair's size both."""
    layout = scene.layout
    code = list(layout.category)
    chair, table = (code.index(name) for name in ("chair", "table"))
    seen = Detections(
        ("chair", "table"),
        layout.position[[table, chair]],
        layout.yaw[[table, chair]],
        layout.size[[chair, chair]],
    )
    file = tmp_path / "crossed.json"
    save_snapshot(Snapshot(Camera(np.array([2.5, 0.5]), np.array(0.0)), seen), file)
    return file, layout.labels[chair], layout.labels[table]


@pytest.mark.parametrize("rule", ["spatial", "distance", "nearest"])
def test_it_is_told_when_categories_decided_a_label(run, before, seen, tmp_path, rule):
    scene = load_scene(before)
    crossed, chair, table = seen_in_the_place_of_the_other(scene, tmp_path)
    ours = ("identify", "--scene", before, "--snapshot", crossed, "--reid", rule)
    output = run(*ours).stdout
    line = "Categories decided the labels of 2 of 2 detections (0, 1): with --no-gate they would be others\n"
    assert line in output
    given = json.loads(run(*ours, "--json").stdout)["labels"]
    assert [scene.layout.category[scene.layout.index(label)] for label in given] == ["chair", "table"]
    assert json.loads(run(*ours, "--no-gate", "--json").stdout)["labels"] == [table, chair]
    assert "Categories" not in run(*ours, "--no-gate").stdout
    assert "Categories" not in run("identify", "--scene", before, "--snapshot", seen, "--reid", rule).stdout


def test_the_example_fools_the_nearest_label_but_not_the_assignment(identify):
    assert identify()["labels"] == ["dan", "cleo", "long table", "ben", "gus", "ada"]
    assert identify("--reid", "nearest")["labels"] == ["dan", "cleo", "long table", "ada", "gus", "ada"]


def test_tables_give_what_the_json_files_give(run, identify, before, seen):
    files = ("--scene", before.with_suffix(".csv"), "--snapshot", seen.with_suffix(".csv"))
    result = run("identify", *files, "--room", "5,4", *CSV_CAMERA, "--json")
    from_tables, from_json = json.loads(result.stdout), identify()
    assert from_tables["costs"] == pytest.approx(from_json["costs"])
    for name in ("ids", "labels", "candidates"):
        assert from_tables[name] == from_json[name]


def test_a_built_in_scene_can_be_named(run, tmp_path):
    (tmp_path / "seen.json").write_text(
        run("scenes", "show", "farm", "--camera", ".6,-.3,0", "--snapshot").stdout
    )
    answer = json.loads(run("identify", "--scene", "farm", "--snapshot", "seen.json", "--json").stdout)
    assert answer["total"] == pytest.approx(0)
    assert "shed" in answer["labels"]


def test_an_empty_snapshot_is_an_empty_answer(run, before, tmp_path):
    (tmp_path / "empty.json").write_text('{"camera": {"x": 1, "z": 1, "yaw_deg": 0}, "detections": []}')
    result = run("identify", "--scene", before, "--snapshot", "empty.json")
    assert "Identified: 0 of 0 detections, total cost 0.0000" in result.stdout


def test_plot_draws_the_answer_and_says_so(run, before, seen, tmp_path):
    result = run("identify", "--scene", before, "--snapshot", seen, "--plot", "answer.svg")
    assert result.stdout.endswith("Wrote answer.svg\n")
    assert ET.parse(tmp_path / "answer.svg").getroot().tag.endswith("svg")


def test_plot_leaves_json_alone(identify, tmp_path):
    assert identify("--plot", "answer.png")["ids"]
    assert (tmp_path / "answer.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (
            ["--reid", "guess"],
            f"OptionError: --reid: must be one of {NAMES}, or module:Class of your own, got 'guess'",
        ),
        (
            ["--min-confidence", ".5"],
            "OptionError: --min-confidence: must not be given with --reid spatial",
        ),
        (
            ["--explain", "d9"],
            "SnapshotError: detection: must be one of d1, d2, d3, d4, d5, d6, or an index below 6, got 'd9'",
        ),
        (
            ["--reid", "nearest", "--threshold", ".5"],
            "OptionError: --threshold: must not be given with --reid nearest",
        ),
        (
            ["--reid", "distance", "--weights", "1,1"],
            "OptionError: --weights: must not be given with --reid distance",
        ),
        (
            ["--reid", "last-known", "--no-gate"],
            "OptionError: --gate: must not be given with --reid last-known",
        ),
        (
            ["--confusion", ".1"],
            "OptionError: --confusion: must not be given with --reid spatial",
        ),
        (
            ["--reid", "spatial-ungated", "--gate"],
            "OptionError: --gate: must not be given with --reid spatial-ungated",
        ),
        (
            ["--reid", "farm_ar.reid:Nobody"],
            "OptionError: --reid: must name a class at the top of farm_ar.reid, which defines none, got",
        ),
        (
            ["--reid", "nearest", "--solver", "mip"],
            "OptionError: --solver: must not be given with --reid nearest",
        ),
        (["--threshold", "1.5"], "OptionError: --threshold: must be from 0 to 1, got 1.5"),
        (["--weights", "1"], "OptionError: --weights: must be wt,wr, all of them numbers, got '1'"),
        (
            ["--weights", "-1,1"],
            "SceneError: weights.translation: must be a number not below 0, at most 1e6, got -1.0",
        ),
        (["--solver", "magic"], "OptionError: --solver: must be one of lsap, mip, got 'magic'"),
        (
            ["--room", "5,4"],
            "OptionError: --room: must not be given with a scene in JSON, which has its own size_m",
        ),
        (
            CSV_CAMERA,
            "OptionError: --camera: must not be given with a snapshot in JSON, which has its own camera",
        ),
        (["--plot", "answer.gif"], "OptionError: --plot: must end in .svg or .png, got 'answer.gif'"),
        (["--plot", "taken/answer.svg"], "OptionError: --plot: must be a place that can be written ("),
    ],
)
def test_options_that_are_wrong_or_do_not_apply_are_refused(mistake, before, seen, tmp_path, options, line):
    (tmp_path / "taken").touch()
    assert mistake("identify", "--scene", before, "--snapshot", seen, *options).startswith(line)
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


@pytest.mark.parametrize(
    ("camera", "line"),
    [
        ([], "OptionError: --camera: must be given with a snapshot in CSV, as x,z,yaw_deg,fov_deg,range_m"),
        (
            ["--camera", "1,1,0"],
            "OptionError: --camera: must be x,z,yaw_deg,fov_deg,range_m, all of them numbers",
        ),
        (
            ["--camera", "1,1,0,361,3"],
            "OptionError: --camera: must be x,z,yaw_deg,fov_deg,range_m with 0 < fov_deg",
        ),
        (
            ["--camera", "1,1,0,90,0"],
            "OptionError: --camera: must be x,z,yaw_deg,fov_deg,range_m with 0 < fov_deg",
        ),
    ],
)
def test_a_table_of_detections_needs_a_camera(mistake, before, seen, camera, line):
    table = seen.with_suffix(".csv")
    assert mistake("identify", "--scene", before, "--snapshot", table, *camera).startswith(line)


def test_what_is_not_known_is_a_dash_in_the_table(run, before, tmp_path):
    (tmp_path / "bare.csv").write_text("id,x,z\nada,1.2,0.6\nben,2,0.6\n")
    view = {"x": 1.5, "z": -1, "yaw_deg": 0, "range_m": 9}
    (tmp_path / "bare.json").write_text(
        json.dumps({"camera": view, "detections": [{"x": 1.25, "z": 0.6}, {"x": 2.1, "z": 0.6}]})
    )
    result = run("identify", "--scene", "bare.csv", "--snapshot", "bare.json")
    row = result.stdout.splitlines()[3].split()
    assert row[:7] == ["0", "not", "known", "1.25", "0.60", "-", "ada"]
    assert "nan" not in result.stdout
    assert "2 objects without categories" in run("scenes", "validate", "bare.csv").stdout


def test_a_table_of_objects_may_have_no_room(run, before, seen):
    files = ("--scene", before.with_suffix(".csv"), "--snapshot", seen)
    with_room = json.loads(run("identify", *files, "--room", "5,4", "--json").stdout)
    without = json.loads(run("identify", *files, "--json").stdout)
    assert without["labels"] == with_room["labels"]


def test_a_wrong_value_in_a_file_is_named(mistake, before, seen, tmp_path):
    (tmp_path / "odd.json").write_text(seen.read_text().replace('"chair"', '""', 1))
    assert mistake("identify", "--scene", before, "--snapshot", "odd.json") == (
        "SnapshotError: odd.json: detections[0].category: must be a category or null, got ''"
    )
    assert mistake("identify", "--scene", before, "--snapshot", "odd.txt") == (
        "OptionError: --snapshot: must be a .json or .csv file, got 'odd.txt'"
    )


def test_a_category_that_the_scene_lacks_gets_no_label_but_a_reason(run, before, seen, tmp_path):
    (tmp_path / "odd.json").write_text(seen.read_text().replace('"chair"', '"sofa"', 1))
    asked = ("identify", "--scene", before, "--snapshot", "odd.json", "--reid", "likelihood")
    reason = "the scene has no 'sofa', only chair, table"
    shown = run(*asked, "--explain", "d1").stdout.splitlines()
    assert f"No label for d1: {reason}" in shown
    assert shown[-1] == f"d1 has no label: {reason}"
    answer = json.loads(run(*asked, "--json").stdout)
    assert answer["labels"][0] is None
    assert answer["reasons"] == [reason, None, None, None, None, None]
    assert [answer[name][0] for name in ("costs", "confidence", "margins", "runners_up")] == [None] * 4
    assert None not in answer["labels"][1:]
    assert run(*asked, "--explain", "d2").exit_code == 0


def test_warnings_go_to_the_error_stream_and_into_the_json(run, before, seen, tmp_path):
    turned = json.loads(seen.read_text())
    turned["camera"]["yaw_deg"] += 180
    (tmp_path / "turned.json").write_text(json.dumps(turned))
    said = "6 detections of 6 outside the camera's view, which would hold them if it were turned around"
    for options in ([], ["--json"]):
        result = run("identify", "--scene", before, "--snapshot", "turned.json", *options)
        assert result.stderr.startswith(f"Warning: {said}")
        assert "Warning" not in result.stdout
        assert result.exit_code == 0
    assert [one.startswith(said) for one in json.loads(result.stdout)["warnings"]] == [True]


def test_a_snapshot_in_an_unknown_frame_is_answered_with_poses_in_the_maps(run, tmp_path, before):
    scene = load_scene(before)
    camera = Camera(scene.layout.position.mean(axis=0) - [0, 5], 0.0, FieldOfView(1.5, 1.5, 50.0))
    motion = RigidMotion(np.zeros(2), np.array([3.0, -40.0]), np.array(2.0))
    snapshot, truth = observe(scene.layout, camera)
    save_snapshot(moved(snapshot, motion.inverse()), tmp_path / "seen.json")
    command = ("identify", "--scene", before, "--snapshot", tmp_path / "seen.json", "--reid", "likelihood")
    answer = json.loads(run(*command, "--frame", "unknown", "--json").stdout)
    assert answer["labels"] == list(truth)
    assert (answer["frame"]["x"], answer["frame"]["z"]) == pytest.approx((3.0, -40.0), abs=1e-6)
    assert answer["frame"]["yaw_deg"] == pytest.approx(np.rad2deg(2.0), abs=1e-6)
    assert answer["frame"]["confidence"] > 0.95
    x, z = snapshot.detections.position[0]
    text = run(*command, "--frame", "unknown").stdout
    assert "Frame: its origin at (3.00, -40.00), turned by 114.6°" in text
    assert f"{x:z.2f}" in text
    assert f"{z:z.2f}" in text
    assert run(*command, "--frame", "nowhere").exit_code == 2
