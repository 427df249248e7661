"""Each example of a trainer runs and prints what it learnt; where its library is not installed it says so."""

import subprocess
import sys
from pathlib import Path

import pytest

TRAINERS = Path(__file__).parents[1] / "examples" / "trainers"

QUICK = {
    "sb3_ppo": "2048",
    "cleanrl_ppo": "1100",
    "torchrl_ppo": "512",
    "rllib_ppo": "1",
    "pettingzoo_pair": "2048",
}
"""How much each of them learns here, in the first argument."""


def test_every_example_of_a_trainer_is_run():
    assert {path.stem for path in TRAINERS.glob("*.py")} == set(QUICK)


@pytest.mark.parametrize("name", QUICK)
def test_a_trainer_learns(name, tmp_path):
    command = [sys.executable, str(TRAINERS / f"{name}.py"), QUICK[name]]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    told = result.stdout.splitlines()
    if told[-1] == "Nothing was trained.":
        pytest.skip(f"{name}: {told[0]}")
    assert any(" steps " in line for line in told)
    assert {"random", "analytic"} <= {line.split()[0] for line in told}
