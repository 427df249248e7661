"""Runs of the benchmark: methods that fail, resuming, files of answers."""

import json
from pathlib import Path

import numpy as np
import pytest

from farm_ar.benchmark.answers import read_answers
from farm_ar.benchmark.evaluation import Source
from farm_ar.benchmark.report import page_of
from farm_ar.benchmark.run import Request, run_benchmark
from farm_ar.benchmark.suite import Suite, write_folder
from farm_ar.errors import OptionError, SnapshotError
from farm_ar.reid import SquaredDistanceReid
from farm_ar.sweeps import ProcessExecutor, SerialExecutor
from tests.benchmark.test_suite import small

METHODS = "tests.benchmark.methods"


@pytest.fixture
def data(tmp_path: Path) -> Path:
    write_folder(small("board", "lounge-new"), tmp_path / "data", truth=True)
    return tmp_path / "data"


def run(data: Path, *methods: str, store: object = None, executor=None, seen=None, **more):
    watch = (lambda standing: seen.append(standing)) if seen is not None else (lambda standing: None)
    place = data.parent / "store.sqlite" if store is None else store
    return run_benchmark(Request(methods, data=data, **more), place, executor or SerialExecutor(), watch)


@pytest.mark.parametrize(
    ("method", "problem"),
    [
        ("Raises", "ZeroDivisionError: by nothing"),
        ("Garbage", "must return an Identification"),
        ("Strange", "must return labels of the scene"),
        ("Short", "must return a label, or None"),
        ("TooSure", "confidence: must be from 0 to 1, got 1.5"),
    ],
)
def test_a_method_that_fails_gets_nothing_right_and_the_page_says_why(data: Path, method: str, problem: str):
    results = run(data, f"{METHODS}:{method}")
    score = results.scores[f"{METHODS}:{method}", "all"]
    assert (score.accuracy, score.failed) == (0, 1)
    assert len(results.notes) == 1
    assert "failed on 6 of 6 snapshots" in results.notes[0]
    assert problem in results.notes[0]


def test_a_method_that_hangs_is_ended_and_the_others_are_scored(data: Path):
    run(data, "squared-distance", rows=("board",))  # without a limit, for kernels may have to be compiled
    with ProcessExecutor(1, time_limit=1) as executor:
        results = run(data, f"{METHODS}:Hangs", "squared-distance", executor=executor, rows=("board",))
    assert results.scores[f"{METHODS}:Hangs", "board"].failed == 1
    assert results.scores["squared-distance", "board"].failed == 0
    assert "time" in results.notes[0]


def test_scores_are_those_of_the_answers(data: Path):
    results = run(data, f"{METHODS}:Honest", "squared-distance")
    rows = small("board", "lounge-new").rows
    for row in rows:
        right = total = 0
        for scene, snapshot, truth in row.examples:
            labels = SquaredDistanceReid(scene).identify(snapshot).labels
            right, total = right + sum(a == b for a, b in zip(labels, truth, strict=True)), total + len(truth)
        assert results.scores["squared-distance", row.name].accuracy == right / total
        honest = results.scores[f"{METHODS}:Honest", row.name]
        assert honest.accuracy == results.scores["distance", row.name].accuracy
        assert (honest.coverage, honest.coverage_right) == (1, honest.accuracy)
    mean = np.mean([results.scores["squared-distance", row.name].accuracy for row in rows])
    assert results.scores["squared-distance", "all"].accuracy == mean


def test_two_methods_are_compared_on_the_same_snapshots(data: Path):
    results = run(data, "spatial", f"{METHODS}:Honest")
    assert set(results.paired) == {(f"{METHODS}:Honest", row) for row in ("board", "lounge-new", "all")}
    for row in ("board", "lounge-new"):
        ours, theirs = (results.scores[method, row].accuracy for method in results.methods[:2])
        found = results.paired[f"{METHODS}:Honest", row]
        assert found.value == pytest.approx(ours - theirs)
        assert found.low <= found.value <= found.high
    counts = [sum(len(one.truth) for one in row.examples) for row in small("board", "lounge-new").rows]
    together = np.average(
        [results.paired[f"{METHODS}:Honest", row].value for row in results.rows], weights=counts
    )
    assert results.paired[f"{METHODS}:Honest", "all"].value == pytest.approx(together)
    assert {one["row"] for one in results.values()["paired"]} == {"board", "lounge-new", "all"}
    assert "Paired differences by row" in page_of(results)
    assert "Paired" not in page_of(run(data, "spatial"))


def test_rows_that_begin_alike_are_chosen_together():
    suite = small("board", "lounge-new", "lounge")
    assert [row.name for row in suite.only(["lounge*"]).rows] == ["lounge-new", "lounge"]
    assert [row.name for row in suite.only(["board", "lounge-new"]).rows] == ["board", "lounge-new"]
    for wrong in ("*", "chess*", "loung"):
        with pytest.raises(OptionError, match="--rows: must be one or several of board, "):
            suite.only([wrong])


def test_a_run_begun_again_asks_nothing_twice_and_gives_the_same(data: Path):
    first, again = run(data, "spatial").values(), []
    second = run(data, "spatial", seen=again)
    assert again[0].before == again[0].total
    for values in (first, second := second.values()):
        for score in values["scores"]:
            score.pop("milliseconds")
    assert first == second


def test_a_folder_that_changes_while_it_is_used_is_refused(data: Path):
    with pytest.raises(SnapshotError, match="folder: must stay as it is while methods are asked"):
        Source("data", str(data), "0" * 32).examples("board")


def answers_of(suite: Suite, **more) -> dict:
    return {
        "suite": suite.name,
        "method": "theirs",
        "answers": {
            row.key(i): {"labels": list(example.truth)}
            for row in suite.rows
            for i, example in enumerate(row.examples)
        },
        **more,
    }


def test_a_file_of_the_true_labels_scores_one(data: Path, tmp_path: Path):
    (tmp_path / "theirs.json").write_text(json.dumps(answers_of(small("board", "lounge-new"))))
    results = run(data, scored=(tmp_path / "theirs.json",))
    assert results.methods[0] == "theirs"
    assert results.scores["theirs", "all"].accuracy == 1
    assert results.notes == ()


def test_what_a_file_leaves_out_counts_as_wrong(data: Path, tmp_path: Path):
    content = answers_of(small("board", "lounge-new"))
    for key in list(content["answers"]):
        if key.startswith("board"):
            del content["answers"][key]
    (tmp_path / "theirs.json").write_text(json.dumps(content))
    results = run(data, scored=(tmp_path / "theirs.json",))
    assert results.scores["theirs", "board"].accuracy == 0
    assert results.scores["theirs", "all"].accuracy == 0.5
    assert results.notes[0] == "theirs.json leaves out 3 snapshots, which count as wrong."


def test_stated_confidence_in_a_file_is_calibrated_and_selected(tmp_path: Path):
    suite = small("board")
    content = answers_of(suite)
    for one in content["answers"].values():
        one["confidence"] = [0.95] * len(one["labels"])
    (tmp_path / "theirs.json").write_text(json.dumps(content))
    found = read_answers(tmp_path / "theirs.json", suite).answers["theirs", "board"].scored
    assert set(found.confidence) == {0.95}


def changed(key: str, name: str, value: object):
    def change(content: dict) -> None:
        content["answers"][key][name] = value

    return change


def first_label(value: object):
    return lambda content: content["answers"]["board/0001"]["labels"].__setitem__(0, value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.update(suite="other"), "suite: must be small-1, got 'other'"),
        (
            lambda c: c["answers"].update({"board/9999": {"labels": []}}),
            "answers: must be the name of a snapshot of small-1, got 'board/9999'",
        ),
        (
            changed("board/0000", "labels", []),
            r"answers.board/0000.labels: must have an entry for each of \d+",
        ),
        (changed("board/0000", "confidence", [0.5]), "answers.board/0000.confidence: must have an entry"),
        (changed("board/0001", "labels", ["me"] * 99), "answers.board/0001.labels"),
        (
            first_label("me"),
            r"answers.board/0001.labels\[0\]: must be a label of the scene, or null, got 'me'",
        ),
        (first_label(7), r"answers.board/0001.labels\[0\]: must be a label or null, got 7"),
        (lambda c: c.pop("answers"), "answers: must be a JSON object, got nothing"),
    ],
)
def test_wrong_files_of_answers_are_refused_in_one_line(tmp_path: Path, change, message: str):
    suite = small("board")
    content = answers_of(suite)
    change(content)
    (tmp_path / "theirs.json").write_text(json.dumps(content))
    with pytest.raises(OptionError, match=f"^theirs.json: {message}"):
        read_answers(tmp_path / "theirs.json", suite)
