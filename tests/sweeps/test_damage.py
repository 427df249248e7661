"""Damaged stores, and what is none: one line that names the file, whatever was to be done with it."""

import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from typer.testing import CliRunner

from farm_ar.cli import app
from farm_ar.sweeps import Store, StoreError, Sweep, grid, run_sweep

STORE = Path(__file__).parents[1] / "behaviour" / "earlier" / "stress.sqlite"
SIZE = STORE.stat().st_size


def truncated(length):
    return lambda path: path.write_bytes(STORE.read_bytes()[:length])


def executed(*statements):
    def change(path):
        shutil.copy(STORE, path)
        with closing(sqlite3.connect(path)) as connection:
            for statement in statements:
                connection.execute(statement)
            connection.commit()

    return change


def overwritten(begin, end):
    def change(path):
        content = bytearray(STORE.read_bytes())
        content[begin:end] = os.urandom(1) * (end - begin)
        path.write_bytes(content)

    return change


DAMAGES = {
    "one byte": truncated(1),
    "half a header": truncated(50),
    "a header": truncated(100),
    "a page": truncated(4096),
    "half": truncated(SIZE // 2),
    "all but a page": truncated(SIZE - 4096),
    "all but a byte": truncated(SIZE - 1),
    "no database": lambda path: path.write_text("no database at all\n" * 500),
    "zeros": lambda path: path.write_bytes(bytes(SIZE)),
    "overwritten in the middle": overwritten(4096, SIZE - 4096),
    "no schema": overwritten(100, 4096),
    "another form": executed("PRAGMA user_version = 7"),
    "another program's": executed("DROP TABLE results", "PRAGMA user_version = 0"),
    "a table gone": executed("DROP TABLE results"),
    "no times": executed("DROP TABLE times"),
    "a column gone": executed("ALTER TABLE units DROP COLUMN version"),
    "a column renamed": executed("ALTER TABLE claims RENAME COLUMN owner TO who"),
    "results no JSON": executed("UPDATE results SET rows = 'rows'"),
    "results a number": executed("UPDATE results SET rows = '7'"),
    "results a blob": executed("UPDATE results SET rows = x'00ff'"),
    "results no UTF-8": executed("UPDATE results SET rows = CAST(x'fffe' AS TEXT)"),
    "times no number": executed("UPDATE times SET seconds = 'long'"),
    "parameters no JSON": executed("UPDATE units SET parameters = '{'"),
    "parameters a list": executed("UPDATE units SET parameters = '[]'"),
    "a seed of text": executed("UPDATE units SET seed = 'one'"),
    "a function of nothing": executed("UPDATE units SET function = NULL"),
    "a failure of nothing": executed("INSERT INTO failures SELECT key, NULL, 'x', 0 FROM units"),
    "a folder": lambda path: path.mkdir(),
    "a pipe": os.mkfifo,
}


@pytest.mark.parametrize("command", ["status", "export"])
@pytest.mark.parametrize("damage", [*DAMAGES, "empty"])
def test_a_command_that_reads_it_says_so_in_a_line(damage, command, tmp_path):
    path = tmp_path / "store.sqlite"
    {**DAMAGES, "empty": truncated(0)}[damage](path)
    chosen = ["--sweep", "stress-attacks-farm"] if command == "export" else []
    result = CliRunner().invoke(app, ["sweeps", command, str(path), *chosen], prog_name="farm-ar")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith(f"StoreError: {path}: store: must be ")
    assert result.stderr.count("\n") == 1


def sums(path):
    return run_sweep(Sweep("sums", "sweep_functions:double", grid(x=[0, 1]), seeds=[0, 1], version="1"), path)


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_run_on_it_ends_with_an_error_of_the_store_or_does_not_need_what_is_damaged(damage, tmp_path):
    path = tmp_path / "store.sqlite"
    DAMAGES[damage](path)
    said, results = "", None
    try:
        results = sums(path)
    except StoreError as problem:
        said = str(problem)
    if results is None:
        assert said.startswith(f"{path}: store: must be ")
    else:
        assert [row["double"] for row in results.rows()] == [0, 0, 2, 2]


def test_an_empty_file_becomes_a_store(tmp_path):
    path = tmp_path / "store.sqlite"
    path.touch()
    assert len(sums(path)) == 4


def test_a_file_of_which_another_is_a_folder_is_no_place(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="store: must be in a folder that can be written"):
        Store(tmp_path / "file" / "store.sqlite")


@pytest.mark.parametrize("damage", ["half", "a table gone", "no database", "a folder", "a pipe"])
@pytest.mark.parametrize(
    ("command", "name"),
    [
        (
            ("stress", "--cases", "1", "--queries", "1", "--attack", "random", "--jitter", "none"),
            "stress.sqlite",
        ),
        (("reproduce", "table1", "--quick", "--layouts", "1", "--workers", "1"), "sweeps.sqlite"),
    ],
)
def test_a_command_that_goes_on_with_it_says_so_in_a_line(command, name, damage, tmp_path):
    DAMAGES[damage](tmp_path / name)
    result = CliRunner().invoke(app, [*command, "--out", str(tmp_path)], prog_name="farm-ar")
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith(f"StoreError: {tmp_path / name}: store: must be ")
    assert result.stderr.count("\n") == 1
