"""The C# client under Mono: its own method, a session of the service, and the sample with stubs of Unity."""

import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from farm_ar.service.access import Access
from farm_ar.service.network import self_signed
from farm_ar.service.vectors import vectors
from tests.service.conftest import Live, live

HERE = Path(__file__).parent
PACKAGE = HERE.parents[1] / "clients" / "unity"
CORE = PACKAGE / "Runtime" / "FarmAr.cs"

Mono = Callable[..., str]


def compiler() -> str:
    """Mono's compiler; where there is none the test is skipped, unless all clients must be tested."""
    program = shutil.which("mcs")
    if program is None or shutil.which("mono") is None:
        said = "mono is not installed: the C# client is not tested"
        (pytest.fail if os.environ.get("FARM_AR_CLIENTS") == "all" else pytest.skip)(said)
    return program


def compiled(out: Path, *options: str | Path) -> None:
    command = [compiler(), "-langversion:7", "-warnaserror", f"-out:{out}", *map(str, options)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def mono(tmp_path_factory: pytest.TempPathFactory) -> Mono:
    """Runs the client."""
    program = tmp_path_factory.mktemp("mono") / "check.exe"
    compiled(program, CORE, HERE / "CheckClient.cs")

    def run(*arguments: str | Path) -> str:
        command = ["mono", str(program), *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def test_its_method_answers_the_vectors(mono: Mono, tmp_path: Path) -> None:
    every = list(vectors(np.random.default_rng(0), 500))
    path = tmp_path / "vectors.json"
    path.write_text(json.dumps({"version": 1, "vectors": every}))
    assert mono("vectors", path).strip() == "500 vectors, 0 wrong"
    every[3]["labels"][0] = "another"
    path.write_text(json.dumps({"version": 1, "vectors": every}))
    assert mono("vectors", path).strip() == "500 vectors, 1 wrong"


SAID = [
    "b,c,a",
    "c,b,a",
    "c,b,a offline",
    "409 snapshot",
    "b,c,a",
    "True",
    "b,c,a",
    "b,c,a offline",
    "409 revision",
]


def test_a_session_with_and_without_the_service(mono: Mono, server: Live) -> None:
    assert mono("flow", server.url).splitlines() == SAID


def test_over_tls_the_certificate_is_pinned(mono: Mono, tmp_path: Path) -> None:
    made = self_signed(tmp_path, "192.0.2.7")
    for one in live(access=Access("sesame"), tls=made):
        assert mono("flow", one.url, made.pin).splitlines() == [*SAID, "another certificate"]


def test_the_sample_compiles_against_stubs_of_unity_and_the_package_names_what_is_there(
    tmp_path: Path,
) -> None:
    package = json.loads((PACKAGE / "package.json").read_text())
    assert re.fullmatch(r"\d+\.\d+\.\d+", package["version"])
    (sample,) = package["samples"]
    scripts = sorted((PACKAGE / sample["path"]).glob("*.cs"))
    assert scripts
    assert "UnityEngine" not in CORE.read_text()
    assert json.loads((PACKAGE / "Runtime" / "FarmAr.asmdef").read_text())["noEngineReferences"] is True
    compiled(tmp_path / "sample.dll", "-target:library", CORE, *scripts, HERE / "UnityStubs.cs")
