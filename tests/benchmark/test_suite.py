"""Suites: the frozen one, folders of files, and what is wrong with them."""

import json
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

import farm_ar.benchmark.frozen as frozen
from farm_ar.benchmark.frozen import NAME, SEED, WORLD_SNAPSHOTS, frozen_suite, paper_rows
from farm_ar.benchmark.suite import (
    ANSWERS,
    TRUTH,
    Suite,
    made_examples,
    pack,
    read_folder,
    row_of,
    unpack,
    write_folder,
)
from farm_ar.benchmark.worlds import ROWS
from farm_ar.errors import InputError, OptionError, SnapshotError
from farm_ar.experiments.setting import load_scenes


def small(*names: str, count: int = 3) -> Suite:
    rows = (ROWS[name] for name in names or ("board", "corridor-1.2s", "players-points-1s"))
    return Suite(
        "small-1",
        tuple(row_of(row.name, row.about, row.all_in_view, made_examples(row, 5, count)) for row in rows),
    )


def test_the_frozen_suite_has_its_hash_and_all_rows():
    suite = frozen_suite()
    assert suite.digest == frozen.DIGEST
    assert [row.name for row in suite.rows] == [*(f"paper-{name}" for name in frozen.SCENES), *ROWS]
    assert sum(len(example.truth) for row in suite.rows for example in row.examples) > 20_000


def test_a_changed_archive_is_refused(monkeypatch):
    monkeypatch.setattr(frozen, "DIGEST", "0" * 32)
    frozen_suite.cache_clear()
    try:
        with pytest.raises(SnapshotError, match=r"^benchmark-1.*: digest: must be 0{32}"):
            frozen_suite()
    finally:
        frozen_suite.cache_clear()


def test_the_generators_still_make_what_was_frozen():
    """Not to the last bit, and not what is chaotic: a simulation of many steps differs between machines."""
    made = {
        name: made_examples(ROWS[name], SEED, WORLD_SNAPSHOTS) for name in ("board", "sizes-10", "flat-twins")
    }
    made |= {row.name: row.examples for row in paper_rows("paper", load_scenes(None), 2)}
    for name, examples in made.items():
        for a, b in zip(examples, frozen_suite().by_name[name].examples, strict=False):
            assert a.truth == b.truth
            seen = a.snapshot.detections.position
            np.testing.assert_allclose(b.snapshot.detections.position, seen, atol=1e-3)


def test_an_archive_gives_the_suite_back(tmp_path: Path):
    suite = small()
    pack(suite, tmp_path / "archive")
    again = unpack("small-1", (tmp_path / "archive").read_bytes())
    assert again.digest == suite.digest
    assert list(again.lines()) == list(suite.lines())


def test_a_folder_gives_the_suite_back_and_an_export_holds_no_truth(tmp_path: Path):
    suite = small()
    assert write_folder(suite, tmp_path / "with", truth=True) == 9
    assert read_folder(tmp_path / "with").digest == suite.digest
    write_folder(suite, tmp_path / "without", truth=False)
    with pytest.raises(OptionError, match=r"^--data: must be a folder with suite.json and truth.json"):
        read_folder(tmp_path / "without")
    assert not list((tmp_path / "without").rglob("truth*"))
    for file in (tmp_path / "without").rglob("*.snapshot.json"):
        assert "truth" not in file.read_text()


def test_what_is_not_known_is_left_out_of_the_files(tmp_path: Path):
    write_folder(small("players-points-1s", count=1), tmp_path, truth=True)
    scene = json.loads((tmp_path / "players-points-1s" / "0000.scene.json").read_text())
    assert not {"yaw_deg", "size_whd"} & scene["objects"][0].keys()
    example = read_folder(tmp_path).rows[0].examples[0]
    assert np.isnan(example.scene.layout.yaw).all()
    assert np.isnan(example.snapshot.detections.size).all()


def test_what_stays_exactly_stays_exactly_in_files():
    far = []
    for scene, snapshot, truth in small("flat", count=10).rows[0].examples:
        known = scene.layout.position[[scene.layout.index(label) for label in truth]]
        far.append(np.linalg.norm(snapshot.detections.position - known, axis=1))
    assert 0.5 < np.mean(np.concatenate(far) == 0) < 0.9


def labels_of(truth: dict) -> list:
    return truth["answers"]["board/0001"]["labels"]


@pytest.mark.parametrize(
    ("file", "change", "message"),
    [
        ("suite.json", lambda d: d["rows"].clear(), "suite.json: rows: must be a list of at least one row"),
        ("suite.json", lambda d: d["rows"][0]["snapshots"].append("../../secret"), "must be names as in"),
        ("suite.json", lambda d: d["rows"][0].update(more=1), "must not be there"),
        (TRUTH, lambda d: d["answers"].pop("board/0001"), "truth.json: answers.board/0001: must be there"),
        (TRUTH, lambda d: labels_of(d).pop(), "board/0001: truth: must be a list"),
        (TRUTH, lambda d: labels_of(d).__setitem__(0, "nobody"), "must be labels of the scene"),
        ("board/0002.scene.json", lambda d: d.pop("objects"), "board/0002: objects"),
    ],
)
def test_files_that_are_wrong_are_named(tmp_path: Path, file: str, change, message: str):
    write_folder(small("board"), tmp_path, truth=True)
    content = json.loads((tmp_path / file).read_text())
    change(content)
    (tmp_path / file).write_text(json.dumps(content))
    with pytest.raises(InputError, match=message):
        _ = [row.examples for row in read_folder(tmp_path).rows]


def test_the_archive_comes_with_the_package():
    assert (resources.files("farm_ar.benchmark") / f"{NAME}.jsonl.xz").is_file()


def test_the_form_of_answers_in_the_docs_is_the_one_that_is_read():
    page = (Path(__file__).parents[2] / "docs" / "benchmark.md").read_text(encoding="utf-8")
    shown = json.loads(page.split("```json\n")[1].split("```")[0])
    assert ANSWERS.read(shown)["method"] == "mine"
    assert all(key in page for key in ("answers", "--export", "--score", "--data"))
    suite = frozen_suite()
    detections = sum(len(document["truth"]) for row in suite.rows for document in row.documents)
    assert f"{len(suite.rows)} rows, {round(detections / 1000)} thousand detections" in page
