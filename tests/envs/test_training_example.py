"""The example that trains ends above random play, and says what to install where its learner is missing."""

import resource
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "train_adversary.py"


@pytest.mark.parametrize("missing", ["torch", "sb3_contrib", "stable_baselines3"])
def test_without_its_learner_the_example_says_what_to_install(missing):
    code = f"import runpy, sys; sys.modules[{missing!r}] = None; runpy.run_path({str(EXAMPLE)!r})"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    assert missing in result.stdout
    assert "pip install '.[train]'" in result.stdout


def returns_of(choose):
    """Returns of 100 episodes that the example has not seen."""
    env, returns = gym.make("farm_ar:FarmToTable-v0", jitter="easy", play_seconds=0.0), []
    for seed in range(3_000_000, 3_000_100):
        observation, _ = env.reset(seed=seed)
        returns.append(0.0)
        over = False
        while not over:
            observation, reward, over, _, _ = env.step(choose(observation, env.unwrapped.action_masks()))
            returns[-1] += reward
    return np.array(returns)


def test_the_example_ends_above_random_play_by_more_than_three_standard_errors(tmp_path):
    sb3_contrib = pytest.importorskip("sb3_contrib", reason="pip install '.[train]'")
    path = tmp_path / "adversary.zip"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    result = subprocess.run(
        [sys.executable, "-W", "error", str(EXAMPLE), str(path)],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert (result.returncode, result.stderr) == (0, "")
    assert len(result.stdout.splitlines()) == 5
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 60

    rng, ends = np.random.default_rng(0), np.cumsum([11, 7, 7])
    model = sb3_contrib.MaskablePPO.load(path, device="cpu")
    chance = returns_of(lambda _, mask: [rng.choice(np.flatnonzero(part)) for part in np.split(mask, ends)])
    learnt = returns_of(lambda seen, mask: model.predict(seen, action_masks=mask, deterministic=True)[0])
    error = np.sqrt((chance.var(ddof=1) + learnt.var(ddof=1)) / 100)
    assert learnt.mean() - chance.mean() > 3 * error
