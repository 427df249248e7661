"""Every request on docs/headset.md is answered as the page says."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.service.conftest import Live

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "headset.md").read_text(encoding="utf-8")
HOME = "http://127.0.0.1:8765"


def blocks(kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def test_every_curl_is_answered(server: Live) -> None:
    if shutil.which("curl") is None or shutil.which("bash") is None:
        pytest.skip("curl is not installed: the requests of docs/headset.md are not tried")
    answers = []
    for block in blocks("sh")[1:]:  # the first installs and starts it
        script = "set -e\n" + block.replace(HOME, server.url).replace("curl ", "curl -sS --fail-with-body ")
        done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=False, timeout=60)
        assert done.returncode == 0, (block, done.stdout, done.stderr)
        answers += [json.loads(line) for line in re.findall(r"\{.*?\}(?=\{\"|$)", done.stdout)]
    (said,) = map(json.loads, blocks("json"))
    assert answers[0] == said
    named = answers[1]
    assert [one["id"] for one in named["detections"]] == ["ada", "ben"]
    for field in re.findall(r"^\| `(\w+)", PAGE.split("field of the reply")[1].split("`confirm`")[0], re.M):
        assert field in named
    assert answers[-1]["status"] == "ok"


def test_the_python_on_the_page_runs(server: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (code,) = blocks("python")
    exec(compile(code.replace(HOME, server.url), "headset.md", "exec"), {})
