"""What docs/session.md prints is true."""

import re
import runpy
import shutil
from pathlib import Path

ROOT = Path(__file__).parents[3]
BLOCKS = re.findall(
    r"^```(\w+)\n(.*?)^```$",
    (ROOT / "docs" / "session.md").read_text(encoding="utf-8"),
    re.MULTILINE | re.DOTALL,
)


def test_the_example_prints_what_stands_below_it(tmp_path, monkeypatch, capsys):
    (kind, code), (below, output), *_ = BLOCKS
    assert (kind, below) == ("python", "text")
    shutil.copytree(ROOT / "examples" / "data", tmp_path / "examples" / "data")
    monkeypatch.chdir(tmp_path)
    Path("page.py").write_text(code, encoding="utf-8")
    runpy.run_path("page.py")
    assert capsys.readouterr().out == output
