"""`farm-ar train`, `watch` and `evaluate`: from nothing to a film and a score."""

import json
import pickle
import re
from pathlib import Path

import pytest

from farm_ar.agents.training.evaluation import compare
from farm_ar.cli.training import arguments
from farm_ar.errors import OptionError

pytest.importorskip("stable_baselines3", reason="pip install '.[train]'")
pytest.importorskip("sb3_contrib", reason="pip install '.[train]'")

RECIPE = """
FarmToTable-v0:
  n_envs: 2
  policy: ObjectPolicy
  policy_kwargs: {width: 16, pair_width: 8, rounds: 1}
  env_kwargs: {play_seconds: 0.0, animals_a_second: 0.0, action: slot, moves: 2}
  n_steps: 16
  batch_size: 32
  n_epochs: 1
"""


@pytest.fixture
def tiny(tmp_path):
    """What makes a training short."""
    (tmp_path / "tiny.yml").write_text(RECIPE)
    return "--recipe", "tiny.yml", "--steps", 32, "--no-progress"


@pytest.fixture
def train(run, tiny):
    """Trains for a moment, and evaluates once."""

    def train(folder, *more):
        return run("train", folder, *tiny, "--eval-every", 32, "--eval-episodes", 1, *more)

    return train


def test_a_run_is_trained_scored_and_filmed(run, train, tmp_path):
    result = train("runs/first")
    assert result.exit_code == 0
    assert result.stdout.startswith("32 steps are done.")
    scored = ["evaluate", "runs/first", "--episodes", 3, "--beside", "analytic", "--json"]
    found = json.loads(run(*scored).stdout)
    assert [row["policy"] for row in found["policies"]] == ["trained", "analytic", "random"]
    assert found["policies"][2]["score"] == [0.0, 0.0, 0.0]
    assert all(row["return"] <= found["best"] + 1e-9 for row in found["policies"])
    assert json.loads(run(*scored).stdout) == found
    table = run(*scored[:-1])
    assert "wrong labels" in table.stdout
    assert "3 held-out episodes; the best found: " in table.stdout
    film = run(
        "watch",
        "runs/first",
        "--episodes",
        1,
        "--arg",
        "play_seconds=0.1",
        "--arg",
        "moves=1",
        "--out",
        "film.gif",
    )
    told = r"Episode 1: return -?\d+\.\d\d, wrong labels \d+\nWrote film.gif\n"
    assert re.fullmatch(told, film.stdout)
    assert (tmp_path / "film.gif").stat().st_size > 10_000


def test_a_run_is_not_trained_twice_but_goes_on(run, train, mistake, tmp_path):
    train("one", "--arg", "jitter=easy", "--seed", 7)
    assert json.loads((tmp_path / "one" / "run.json").read_text())["seed"] == 7
    assert "jitter: easy" in (tmp_path / "one" / "hyperparameters.yml").read_text()
    assert mistake("train", "one").startswith(
        "OptionError: run: must be a new folder, or go on with --resume"
    )
    assert run("train", "one", "--resume").stdout.startswith("32 steps are done.")


@pytest.fixture
def harmful(train, tmp_path):
    """A run whose newest checkpoint is of an older version, with a pickle that runs somebody's code."""
    recipe = RECIPE.replace("policy: ObjectPolicy", "policy: MultiInputPolicy\n  normalize: {norm_obs: true}")
    recipe = recipe.replace("policy_kwargs: {width: 16, pair_width: 8, rounds: 1}", "policy_kwargs: {}")
    (tmp_path / "tiny.yml").write_text(recipe)
    train("one", "--algo", "ppo")
    for saved in (tmp_path / "one").glob("*/0*"):
        (saved / "normalization.npz").unlink()
        (saved / "vecnormalize.pkl").write_bytes(pickle.dumps(Touches()))


class Touches:
    def __reduce__(self):
        return Path.touch, (Path("touched"),)


@pytest.mark.parametrize(
    "command",
    [
        ("watch", "one", "--episodes", 1, "--out", "film.gif"),
        ("evaluate", "one", "--episodes", 2),
        ("train", "one", "--resume", "--steps", 64),
        ("stress", "--attack", "learned", "--player", "one", "--cases", 1),
    ],
)
def test_a_folder_that_runs_code_has_to_be_trusted(mistake, run, harmful, tmp_path, command):
    told = mistake(*command)
    assert told.startswith("OptionError: --trust: must be given to load one")
    assert "the pickle vecnormalize.pkl" in told
    assert not (tmp_path / "touched").exists()
    trusted = run(*command, "--trust")
    expected = "Loading one runs the pickle vecnormalize.pkl, code of whoever wrote it."
    assert trusted.stderr.startswith(expected)
    assert (tmp_path / "touched").exists()


def test_a_run_that_names_a_module_has_to_be_trusted(mistake, train, tmp_path):
    train("one")
    for name in ("run.json", "hyperparameters.yml"):
        path = tmp_path / "one" / name
        path.write_text(path.read_text().replace("FarmToTable-v0", "somebodys_module:FarmToTable-v0"))
    assert "the module somebodys_module" in mistake("watch", "one")
    assert "the module somebodys_module" in mistake("train", "one", "--resume")


def test_a_run_that_was_not_evaluated_is_watched_as_it_was_last(run, mistake, tiny):
    assert run("train", "one", *tiny).stdout.endswith("farm-ar watch one --which last\n")
    expected = "OptionError: --which: must be last for a run that has not been evaluated yet, got 'best'"
    assert mistake("evaluate", "one").startswith(expected)
    beside = ("--beside", "farm-slot", "--arg", "moves=6", "--episodes", 2, "--json")
    rows = json.loads(run("evaluate", "one", "--which", "last", *beside).stdout)["policies"]
    assert [row["policy"] for row in rows] == ["trained", "farm-slot", "random"]


@pytest.mark.parametrize("given", [("--arg", "jitter=hard"), ("--eval-every", 10)])
def test_what_a_run_that_goes_on_would_not_heed_is_refused(train, mistake, given):
    train("one")
    expected = f"OptionError: {given[0]}: must be left out with --resume, as the run's own counts"
    assert mistake("train", "one", "--resume", *given).startswith(expected)


def test_where_no_terminal_shows_a_bar_lines_tell_of_a_run(run, train, monkeypatch):
    monkeypatch.setattr("farm_ar.agents.training.callbacks.LINE_EVERY_S", 0.02)
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    train("one")
    told = run("train", "one", "--resume", "--steps", 96).stderr
    assert told.startswith("Going on from step 32\n")
    steps = [
        int(n) for n in re.findall(r"^(\d+) of 96 steps, return (?:-|-?\d+\.\d\d), 0:00:\d\d$", told, re.M)
    ]
    assert len(steps) > 2
    assert steps == sorted(steps)
    assert steps[-1] == 96


def test_ctrl_c_tells_how_to_go_on(run, train, monkeypatch):
    def stop(self):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("farm_ar.agents.training.callbacks.Checkpoints._on_rollout_start", stop)
        stopped = train("my run")
    assert stopped.exit_code == 130
    assert stopped.stderr.splitlines()[-1] == "Interrupted. Go on with: farm-ar train 'my run' --resume"
    assert run("train", "my run", "--resume", "--no-progress").stdout.startswith("32 steps are done.")


def test_mistakes_are_one_line(mistake, train, tmp_path):
    assert mistake("train", "x", "--algo", "dqn").startswith(
        "OptionError: --algo: must be one of maskable-ppo"
    )
    assert mistake("train", "x", "--env", "Farm-v9").startswith(
        "OptionError: --env: must be one that can be made"
    )
    assert mistake("train", "x", "--arg", "jiter=easy").startswith(
        "OptionError: --arg: must be one of action, animals_a_second, "
    )
    assert mistake("train", "x", "--arg", "easy").startswith("OptionError: --arg: must be NAME=VALUE")
    assert mistake("train", "x", "--resume").startswith(
        "OptionError: --resume: must have a run to go on with"
    )
    expected = "OptionError: run: must be the folder of a run, or one of farm-displacement, farm-slot, got"
    assert mistake("watch", "nowhere").startswith(expected)
    assert mistake("watch", "x", "--out", "film.avi").startswith(
        "OptionError: --out: must end in .mp4 or .gif"
    )
    assert not (tmp_path / "x").exists()
    (tmp_path / "empty").mkdir()
    assert mistake("evaluate", "empty").startswith(expected)
    unbatched = mistake("train", "x", "--arg", "reid=likelihood")
    assert "--arg reid: must be spatial or distance in a batch (which --imitate 0 --lift 0" in unbatched
    train("one", "--lift", 0)
    assert mistake("evaluate", "one", "--beside", "clever").startswith(
        "OptionError: --beside: must be one of"
    )
    wrong = mistake("evaluate", "one", "--arg", "action=displacement")
    assert wrong.startswith("OptionError: env: must have the actions")
    assert mistake("evaluate", "one", "--arg", "jitter=wild").startswith(
        "OptionError: --arg jitter: must be one of"
    )


def test_arguments_are_json_where_they_can_be():
    given = ["moves=3", "jitter=easy", "game=false", "budget_m=0.3", 'scene="farm"']
    expected = {"moves": 3, "jitter": "easy", "game": False, "budget_m": 0.3, "scene": "farm"}
    with arguments(given) as found:
        assert found == expected
    with pytest.raises(OptionError):
        arguments(["x"]).__enter__()


def test_what_evaluate_cannot_do_is_found_before_the_learners_are_loaded(mistake, monkeypatch):
    def load():
        raise AssertionError("the learners are loaded")

    monkeypatch.setattr("farm_ar.agents.packages.need_training", load)
    assert mistake("evaluate", "nowhere").startswith("OptionError: run: must be the folder of a run")
    assert mistake("evaluate", "farm-slot", "--beside", "clever").startswith("OptionError: --beside: must be")
    assert mistake("evaluate", "farm-slot", "--which", "third").startswith("OptionError: --which: must be")
    assert mistake("evaluate", "farm-slot", "--arg", "easy").startswith("OptionError: --arg: must be NAME")


def test_a_comparison_tells_of_every_episode():
    told: list[tuple[str, float]] = []
    compare(["farm-slot"], ["constant"], 2, arguments={"moves": 1}, watch=lambda *now: told.append(now))
    assert [share for _, share in told] == pytest.approx([k / 6 for k in range(1, 7)])
    names = ("constant", "random", "trained")
    assert {what for what, _ in told} == {f"{name}: episode {k} of 2" for name in names for k in (1, 2)}


@pytest.mark.parametrize("command", ["evaluate", "watch"])
def test_what_is_wrong_is_found_before_the_learners_are_loaded(command, mistake, monkeypatch):
    monkeypatch.setattr("farm_ar.agents.packages.need_training", lambda: pytest.fail("loaded"))
    assert mistake(command, "farm-slot", "--arg", "jiter=easy").startswith("OptionError: --arg: must be one")
    assert mistake(command, "farm-slot", "--which", "newest").startswith("OptionError: --which: must be one")
    assert mistake(command, "nowhere").startswith("OptionError: run: must be the folder of a run, or")


@pytest.mark.parametrize("command", [("evaluate", "farm-slot"), ("watch", "farm-slot"), ("train", "one")])
def test_a_wrong_argument_of_the_environment_is_named_as_it_was_typed(command, mistake):
    expected = "OptionError: --arg jitter: must be one of default, easy, hard, none, got 'wild'"
    assert mistake(*command, "--arg", "jitter=wild") == expected


def test_episodes_are_counted_while_policies_play(run, monkeypatch):
    monkeypatch.setattr("farm_ar.cli.output.EVERY_S", 0.0)
    told = run("evaluate", "farm-slot", "--episodes", 2, "--beside", "", "--arg", "moves=6").stderr
    assert "random: episode 1 of 2 (25%)\nrandom: episode 2 of 2 (50%)\ntrained: episode 1 of 2" in told
