"""`farm-ar identify --snapshot -`: one process, many snapshots, an answer each."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from farm_ar.cli.program import app


@pytest.fixture
def ask(run, before):
    def ask(text: str | bytes, *arguments: str) -> Any:
        command = ["identify", "--scene", str(before), "--snapshot", "-", *arguments]
        return CliRunner().invoke(app, command, input=text, prog_name="farm-ar")

    return ask


def line(path: Path) -> str:
    return json.dumps(json.loads(path.read_text()))


def test_each_snapshot_is_answered_in_a_line_as_its_file_is(ask, run, before, seen):
    alone = json.loads(run("identify", "--scene", before, "--snapshot", seen, "--json").stdout)
    result = ask(f"{line(seen)}\n{seen.read_text()}\n{line(seen)}\n", "--json")
    assert result.exit_code == 0
    answers = [json.loads(one) for one in result.stdout.splitlines()]
    assert len(answers) == 3
    assert [answer.pop("line") for answer in answers] == [1, 2, len(seen.read_text().splitlines()) + 3]
    for answer in answers:
        assert {k: v for k, v in answer.items() if k != "solve_time_s"} == {
            k: v for k, v in alone.items() if k != "solve_time_s"
        }


def test_a_bad_line_is_one_error_in_its_place_and_the_rest_is_answered(ask, seen):
    good = line(seen)
    result = ask(f"{good}\n{{}}\n{good}\n", "--json")
    assert result.exit_code == 2
    first, error, last = (json.loads(one) for one in result.stdout.splitlines())
    assert first["labels"] == last["labels"]
    assert error == {
        "error": "SnapshotError: standard input: line 2: camera: must be a JSON object, got nothing"
    }


def test_without_json_a_table_each_and_errors_on_the_error_stream(ask, seen):
    result = ask(f"{line(seen)}\nnothing\n{line(seen)}\n")
    assert result.exit_code == 2
    assert result.stdout.count("Identified: ") == 2
    assert result.stderr.startswith("SnapshotError: standard input: line 2: file: must be JSON, got ")
    assert result.stderr.count("\n") == 1


def test_one_document_of_many_lines_is_one_snapshot(ask, seen):
    result = ask(seen.read_text())
    assert result.exit_code == 0
    assert result.stdout.count("Identified: ") == 1


def test_nothing_is_one_error(ask):
    result = ask("")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "must hold at least one snapshot" in result.stderr


@pytest.mark.parametrize("option", [("--camera", "1,1,0,90,3"), ("--plot", "a.svg")])
def test_what_belongs_to_a_file_is_refused(ask, option):
    assert f"{option[0]}: must not be given with --snapshot -" in ask("{}", *option).stderr


@pytest.mark.parametrize("method", ["spatial", "likelihood"])
def test_a_broken_pose_has_no_label_but_a_reason_and_the_others_are_as_without_it(ask, seen, method):
    whole = json.loads(seen.read_text())
    rest = whole | {"detections": whole["detections"][1:]}
    lost = json.loads(seen.read_text())
    lost["detections"][0] |= {"x": None}
    result = ask(f"{json.dumps(rest)}\n{json.dumps(lost)}\n", "--json", "--reid", method)
    assert result.exit_code == 0
    without, answer = (json.loads(one) for one in result.stdout.splitlines())
    assert answer["labels"] == [None, *without["labels"]]
    assert answer["confidence"][1:] == without["confidence"]
    assert answer["reasons"][0] == "its pose is broken: x: must be a number from -1e9 to 1e9, got None"


def test_a_warning_names_the_line_that_it_is_about(ask, seen):
    far = json.loads(seen.read_text())
    far["detections"][0] |= {"x": 90.0}
    result = ask(f"{line(seen)}\n\n{json.dumps(far)}\n")
    said = result.stderr.splitlines()
    assert said
    assert all(one.startswith("Warning: line 3: 1 detection of 6 outside the ") for one in said)
    assert "Method: adaptive, line 3" in result.stdout.splitlines()


def test_an_answer_comes_before_the_next_snapshot_is_sent(before, seen):
    command = [sys.executable, "-m", "farm_ar", "identify", "--scene", str(before), "--snapshot", "-"]
    command.append("--json")
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        for _ in range(2):
            process.stdin.write(f"{line(seen)}\n")
            process.stdin.flush()
            assert "labels" in json.loads(process.stdout.readline())
        process.stdin.close()
        assert process.wait() == 0
