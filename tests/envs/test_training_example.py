"""The example that trains says what to install where its learner is missing."""

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "train_adversary.py"


@pytest.mark.parametrize("missing", ["torch", "sb3_contrib", "stable_baselines3"])
def test_without_its_learner_the_example_says_what_to_install(missing):
    code = f"import runpy, sys; sys.modules[{missing!r}] = None; runpy.run_path({str(EXAMPLE)!r})"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    assert missing in result.stdout
    assert "pip install 'farm-ar[train]'" in result.stdout
