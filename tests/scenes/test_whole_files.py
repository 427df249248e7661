"""Files appear whole, with the permissions that the umask leaves; text in CSV is no formula."""

import csv
import io
import os
import stat
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

from farm_ar.drawing.pictures import save_picture
from farm_ar.drawing.video import write_gif, write_mp4, write_png
from farm_ar.scenes import builtin_scene, save_scene
from farm_ar.scenes.files import csv_table, whole_file, write_text
from farm_ar.sweeps import Store

FRAMES = [np.full((32, 32, 3), 40 * k, dtype=np.uint8) for k in range(3)]
WRITERS = {
    "text.txt": lambda path: write_text(path, "text"),
    "scene.json": lambda path: save_scene(builtin_scene("L1"), path),
    "picture.svg": lambda path: save_picture(Figure(), path),
    "picture.png": lambda path: save_picture(Figure(), path),
    "frame.png": lambda path: write_png(path, FRAMES[1]),
    "film.gif": lambda path: write_gif(path, FRAMES, 4),
    "film.mp4": lambda path: write_mp4(path, FRAMES, 4),
    "store.sqlite": lambda path: Store(path).close(),
}


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no umask")
@pytest.mark.parametrize("umask", [0o022, 0o002, 0o077])
@pytest.mark.parametrize("name", WRITERS)
def test_the_umask_is_respected(name, umask, tmp_path):
    before = os.umask(umask)
    try:
        WRITERS[name](tmp_path / name)
    finally:
        os.umask(before)
    # SQLite makes its files readable for all and writable for their owner, as far as the umask allows.
    most = 0o644 if name.endswith("sqlite") else 0o666
    assert stat.S_IMODE((tmp_path / name).stat().st_mode) == most & ~umask


def test_what_fails_leaves_the_file_as_it_was_and_nothing_beside_it(tmp_path):
    write_text(tmp_path / "file", "before")

    def fail():
        with whole_file(tmp_path / "file") as temporary:
            temporary.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_text() == "before"


def test_a_full_disk_leaves_nothing_behind(tmp_path, monkeypatch):
    def full(self, *arguments, **named):
        raise OSError(28, os.strerror(28), str(self))

    monkeypatch.setattr("pathlib.Path.open", full)
    with pytest.raises(OSError, match="No space left"):
        write_text(tmp_path / "file", "text")
    assert list(tmp_path.iterdir()) == []


def test_text_that_a_spreadsheet_would_take_for_a_formula_gets_an_apostrophe_and_numbers_none():
    rows = [
        {"label": "=1+1", "@name": "+a", "number": -1.5},
        {"label": "-b", "@name": "@c", "number": -7},
        {"label": "\td", "@name": "plain = text", "number": None},
    ]
    read = list(csv.reader(io.StringIO(csv_table(("label", "@name", "number"), rows))))
    assert read == [
        ["label", "'@name", "number"],
        ["'=1+1", "'+a", "-1.5"],
        ["'-b", "'@c", "-7"],
        ["'\td", "plain = text", ""],
    ]
