"""Files that are no JSON, and files that are written whole or not at all."""

import codecs
import json
import os
from pathlib import Path

import numpy as np
import pytest

from farm_ar.errors import SceneError, SnapshotError
from farm_ar.scenes import (
    Camera,
    Detections,
    Layout,
    Scene,
    Snapshot,
    load_scene,
    load_snapshot,
    save_scene,
    save_snapshot,
)
from farm_ar.scenes.files import MOST_BYTES, csv_table, write_text

SCENE = Scene("room", (5, 4), Layout(("a",), ("chair",), [(1, 2)], [0.5], [(1, 1, 1)]))
SNAPSHOT = Snapshot(Camera([1, 2], 0.5), Detections(("chair",), [(1, 2)], [0.5], [(1, 1, 1)]))

LOADERS = [(load_scene, SceneError), (load_snapshot, SnapshotError)]
SAVERS = [(save_scene, SCENE), (save_snapshot, SNAPSHOT)]


@pytest.mark.parametrize(("load", "error"), LOADERS)
@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "Expecting value"),
        (b'{"size_m": [5,', "Expecting value"),
        (b"{'size_m': 5}", "Expecting property name"),
        (b'{"name": "a", "name": "b"}', "the field name twice in one object"),
        (b'{"objects": [{"x": 1, "x": 2}]}', "the field x twice in one object"),
        (b'{"name": ' + b"1" * 5000 + b"}", "integer string conversion"),
        (b"[" * 100_000, "recursion"),
    ],
)
def test_a_file_that_is_no_json_is_refused_in_one_line_with_the_reason(
    tmp_path, load, error, content, reason
):
    path = tmp_path / "broken.json"
    path.write_bytes(content)
    with pytest.raises(error) as problem:
        load(path)
    assert str(problem.value).startswith("broken.json: file: must be JSON, got ")
    assert reason in str(problem.value)
    assert "\n" not in str(problem.value)


@pytest.mark.parametrize(("load", "error"), LOADERS)
def test_a_file_that_is_not_there_is_refused_by_its_whole_path(tmp_path, load, error):
    with pytest.raises(error) as problem:
        load(tmp_path / "nothing.json")
    assert str(problem.value) == (
        f"{tmp_path / 'nothing.json'}: file: must be a readable file, got 'No such file or directory'"
    )


@pytest.mark.parametrize(("load", "error"), LOADERS)
@pytest.mark.parametrize(
    ("content", "encoding"),
    [
        ('{"name": "a"}'.encode("utf-16"), "'UTF-16'"),
        ('{"name": "a"}'.encode("utf-32"), "'UTF-32'"),
        (codecs.BOM_UTF16_BE + '{"name": "a"}'.encode("utf-16-be"), "'UTF-16'"),
        ('{"name": "\xe9"}'.encode("latin-1"), "Latin-1 or Windows-1252"),
    ],
)
def test_a_file_in_another_encoding_is_refused_by_its_name(tmp_path, load, error, content, encoding):
    path = tmp_path / "broken.json"
    path.write_bytes(content)
    with pytest.raises(error) as problem:
        load(path)
    assert str(problem.value).startswith("broken.json: file: must be JSON in UTF-8, got ")
    assert encoding in str(problem.value)


@pytest.mark.parametrize(("load", "error"), LOADERS)
def test_what_may_never_end_is_refused_at_once(tmp_path, load, error):
    os.mkfifo(tmp_path / "pipe.json")
    (tmp_path / "endless.json").symlink_to("/dev/zero")
    for name in ("pipe.json", "endless.json"):
        with pytest.raises(error, match="must be a plain file, got 'a pipe or a device'"):
            load(tmp_path / name)


@pytest.mark.parametrize(("load", "error"), LOADERS)
def test_a_file_larger_than_any_is_refused_before_it_is_read_whole(tmp_path, load, error):
    with (tmp_path / "large.json").open("wb") as file:
        file.truncate(MOST_BYTES + 1)  # a sparse file takes no room
    with pytest.raises(error, match="must be at most 64 MiB"):
        load(tmp_path / "large.json")


@pytest.mark.parametrize(("load", "error"), LOADERS)
def test_a_name_that_no_file_can_have_is_refused(load, error):
    with pytest.raises(error, match="must be a readable file"):
        load("a\0b.json")


@pytest.mark.parametrize(("load", "error"), LOADERS)
def test_a_folder_is_no_file(tmp_path, load, error):
    with pytest.raises(error, match="must be a readable file, got 'Is a directory'"):
        load(str(tmp_path))


@pytest.mark.parametrize(("load", "error"), LOADERS)
def test_a_file_with_something_else_than_an_object_is_refused(tmp_path, load, error):
    path = tmp_path / "list.json"
    path.write_text("[]")
    with pytest.raises(error, match=r"^list.json: file: must be a JSON object, got \[\]$"):
        load(path)


@pytest.mark.parametrize(("save", "value"), SAVERS)
def test_what_is_saved_twice_is_the_same_bytes(tmp_path, save, value):
    save(value, tmp_path / "one.json")
    save(value, str(tmp_path / "two.json"))
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()
    assert (tmp_path / "one.json").read_bytes().endswith(b"}\n")
    json.loads((tmp_path / "one.json").read_text())


@pytest.mark.parametrize(("save", "value"), SAVERS)
def test_a_folder_that_is_not_there_is_made(tmp_path, save, value):
    save(value, tmp_path / "new" / "folder" / "one.json")
    assert [path.name for path in (tmp_path / "new" / "folder").iterdir()] == ["one.json"]


@pytest.mark.parametrize(("save", "value"), SAVERS)
@pytest.mark.parametrize("interruption", [OSError("no space left"), KeyboardInterrupt()])
def test_a_save_that_fails_before_the_end_leaves_the_old_file_and_nothing_else(
    tmp_path, monkeypatch, save, value, interruption
):
    path = tmp_path / "one.json"
    path.write_text("old")

    def fail(self: Path, target: Path) -> None:
        assert len(self.read_text()) > 100  # all of it is written, under another name
        raise interruption

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(type(interruption)):
        save(value, path)
    assert [(entry.name, entry.read_text()) for entry in tmp_path.iterdir()] == [("one.json", "old")]


def test_a_write_that_fails_midway_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "one.txt"
    path.write_text("old")
    cannot_be_written = "x" * 100_000 + "\ud800"
    with pytest.raises(UnicodeEncodeError):
        write_text(path, cannot_be_written)
    assert [(entry.name, entry.read_text()) for entry in tmp_path.iterdir()] == [("one.txt", "old")]


def test_a_folder_that_cannot_be_written_to_is_the_error_that_is_raised(tmp_path, monkeypatch):
    def refuse(self: Path, *args: object, **options: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(PermissionError):
        write_text(tmp_path / "one.txt", "a")
    assert list(tmp_path.iterdir()) == []


def test_a_value_that_cannot_be_saved_leaves_no_file(tmp_path):
    with pytest.raises(AttributeError):
        save_scene(None, tmp_path / "one.json")  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_written_with_the_rights_and_line_ends_that_any_new_file_has(tmp_path):
    write_text(tmp_path / "one.txt", "a\nb\n")
    (tmp_path / "two.txt").touch()
    assert (tmp_path / "one.txt").stat().st_mode == (tmp_path / "two.txt").stat().st_mode
    assert (tmp_path / "one.txt").read_bytes() == b"a\nb\n"


def test_numbers_are_written_so_that_they_are_read_back_exactly(tmp_path):
    position = np.array([[0.1 + 0.2, 1 / 3]])
    layout = SCENE.layout.with_poses(position, [0.0])
    save_scene(Scene("room", (5, 4), layout), tmp_path / "one.json")
    np.testing.assert_array_equal(load_scene(tmp_path / "one.json").layout.position, position)


def test_no_text_of_a_table_is_a_formula_in_a_spreadsheet():
    rows = [
        {"label": "=1+1", "x": -0.5},
        {"label": "-2", "x": None},
        {"label": "@a,b"},
        {"label": "a=1", "x": 1},
    ]
    table = "label,x\n'=1+1,-0.5\n-2,\n\"'@a,b\",\na=1,1\n"
    assert csv_table(("label", "x"), rows) == table
