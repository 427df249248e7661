"""The JavaScript client in Node: its own method, and a session of the service."""

import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from farm_ar.reid import identify
from farm_ar.service.vectors import vectors
from tests.service.conftest import Live, lab, layout_body, seen_in, snapshot_body

HERE, CLIENT = Path(__file__).parent, Path(__file__).parents[2] / "clients" / "js" / "farm-ar.js"

Node = Callable[..., str]


@pytest.fixture(scope="session")
def node() -> Node:
    """Runs a script of Node; where there is none the test is skipped, unless all clients must be tested."""
    program = shutil.which("node")
    if program is None:
        said = "node is not installed: the JavaScript client is not tested"
        (pytest.fail if os.environ.get("FARM_AR_CLIENTS") == "all" else pytest.skip)(said)

    def run(script: Path, *arguments: Path) -> str:
        command = [program, str(script), *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


def test_its_method_answers_the_vectors(node: Node, tmp_path: Path) -> None:
    every = list(vectors(np.random.default_rng(0), 500))
    path = tmp_path / "vectors.json"
    path.write_text(json.dumps({"version": 1, "vectors": every}))
    assert node(HERE / "check_vectors.mjs", CLIENT, path).strip() == "500 vectors, 0 wrong"
    every[3]["labels"][0] = "another"
    every[4]["costs"] = [1e3] * len(every[4]["costs"])
    path.write_text(json.dumps({"version": 1, "vectors": every}))
    assert node(HERE / "check_vectors.mjs", CLIENT, path).strip().endswith("500 vectors, 2 wrong")


def test_a_session_with_and_without_the_service(node: Node, server: Live, tmp_path: Path) -> None:
    scene = lab()
    labels = scene.layout.labels
    here, there = {"x": 0, "y": 0, "z": 0, "yaw_deg": 0}, {"x": 0.3, "y": 0, "z": -0.2, "yaw_deg": 10}
    given = {
        "url": server.url,
        "layout": layout_body(scene),
        "snapshot": snapshot_body(seen_in(scene, 0.05)),
        "swap": {"d0": labels[1], "d1": labels[0]},
        "anchor": {"here": here, "map": there},
    }
    (tmp_path / "given.json").write_text(json.dumps(given))
    said = json.loads(node(HERE / "client_flow.mjs", CLIENT, tmp_path / "given.json"))
    assert said["first"] == list(identify(scene, seen_in(scene, 0.05), "spatial").labels) == list(labels)
    swapped = [labels[1], labels[0], *labels[2:]]
    assert said["swapped"] == swapped
    assert said["offline"][:2] == [swapped, True]
    assert said["offline"][2] < 1e-9
    assert said["unseen"] == [409, "snapshot"]
    assert said["undone"] == "confirm"
    assert said["aligned"] is True
    assert said["turned"][0] == said["turned"][1]
    assert said["turned"][2] < 1e-9
    assert said["refused"] == [True, 409, "revision"]
    assert said["revision"] == 5
    xr = said["xr"]
    assert (xr["frame"], xr["timestamp"], len(xr["detections"])) == ("openxr", 2.5, 1)
    thing = {"x": 1, "y": 0, "z": -2, "quaternion": [0, 0, 0, 1]}
    assert xr["detections"][0] == {"category": "chair", "track_id": "7", "size_whd": [1, 2, 3], **thing}
    camera = xr["camera"]
    expected = np.rad2deg(np.arctan([0.5, 1.5, 1.0, 1.0]))
    sides = [camera[f"fov_{side}_deg"] for side in ("left", "right", "up", "down")]
    assert sides == pytest.approx(expected.tolist(), abs=1e-5)


def test_the_pages_of_the_example_and_of_the_service_are_javascript(node: Node, tmp_path: Path) -> None:
    from importlib.resources import files

    pages = [CLIENT.parent / "examples" / "webxr.html"]
    pages += [Path(str(files("farm_ar.service"))) / "pages" / name for name in ("debug.html", "api.html")]
    check = tmp_path / "check.mjs"
    check.write_text(
        'import { execFileSync } from "node:child_process";\n'
        'execFileSync(process.execPath, ["--check", process.argv[2]]);\nconsole.log("right");\n'
    )
    for page in pages:
        scripts = re.findall(r"<script[^>]*>(.*?)</script>", page.read_text(), re.DOTALL)
        assert scripts
        for number, text in enumerate(scripts):
            script = tmp_path / f"{page.stem}{number}.mjs"
            script.write_text(text)
            assert node(check, script) == "right\n"


LISTENING = """
import { pathToFileURL } from "node:url";
const { FarmAr } = await import(pathToFileURL(process.argv[2]));
delete globalThis.WebSocket;
let said = "";
const without = new FarmAr("http://a", { session: "room" });
try { without.listen(() => {}); } catch (problem) { said = problem.message; }
const waits = [], lines = [];
let again = null;
globalThis.setTimeout = (begin, wait) => { waits.push(wait); again = begin; };
class WebSocket { constructor() { lines.push(this); } close() {} }
const stop = new FarmAr("http://a", { session: "room", WebSocket }).listen(() => {});
for (let k = 0; k < 7; k++) { lines.at(-1).onclose(); again(); }
lines.at(-1).onopen();
lines.at(-1).onclose();
stop();
again();
console.log(JSON.stringify({ said, waits, lines: lines.length }));
"""


def test_who_is_not_let_in_asks_more_and_more_seldom(node: Node, tmp_path: Path) -> None:
    script = tmp_path / "listening.mjs"
    script.write_text(LISTENING)
    found = json.loads(node(script, CLIENT))
    assert found["said"].startswith("WebSocket: must be given")
    assert found["waits"] == [1000, 2000, 4000, 8000, 16000, 30000, 30000, 1000]
    assert found["lines"] == 8
