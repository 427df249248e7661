"""Files of hyperparameters: what is in them is used, and what is not known is named."""

import sys

import gymnasium as gym
import pytest

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.agents.packages import need_training
from farm_ar.agents.training.recipes import (
    ALGORITHMS,
    IMITATE,
    Recipe,
    RecipeError,
    check_fit,
    load_recipe,
    settings_of,
)
from farm_ar.agents.training.run_folder import Run
from farm_ar.agents.training.training import train
from farm_ar.errors import InputError, MissingPackageError, OptionError

IDS = ("FarmToTable-v0", "FarmToTableHand-v0", "FarmToTableLayout-v0", "SceneLayout-v0")


@pytest.fixture
def written(tmp_path):
    """Writes a file of hyperparameters."""

    def write(text):
        path = tmp_path / "mine.yml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize("algo", ALGORITHMS)
@pytest.mark.parametrize("env_id", IDS)
def test_what_comes_with_farm_ar_suits_its_environment_or_says_why_not(algo, env_id):
    recipe = load_recipe(algo, env_id)
    env = gym.make(env_id, **recipe.env_kwargs)
    if algo == "maskable-ppo" and env_id != "FarmToTable-v0":
        with pytest.raises(OptionError, match="algo: must be ppo or sac for continuous actions"):
            check_fit(algo, recipe.policy, env)
    else:
        check_fit(algo, recipe.policy, env)
    assert recipe.n_timesteps >= 100_000


def test_discrete_actions_are_not_for_sac():
    with pytest.raises(OptionError, match="algo: must be ppo or maskable-ppo"):
        check_fit("sac", "MultiInputPolicy", gym.make("FarmToTable-v0"))


def test_the_object_policy_is_for_maskable_ppo_on_numbers():
    with pytest.raises(OptionError, match="policy"):
        check_fit("ppo", "ObjectPolicy", gym.make("FarmToTable-v0"))
    with pytest.raises(OptionError, match="policy"):
        check_fit("maskable-ppo", "ObjectPolicy", gym.make("FarmToTable-v0", observation="pixels"))


def test_a_section_of_its_own_goes_before_the_default(written):
    path = written("default: {n_epochs: 3}\nFarmToTable-v0: {n_epochs: 4, n_envs: 2}\n")
    assert load_recipe("ppo", "FarmToTable-v0", path).settings == {"n_epochs": 4}
    assert load_recipe("ppo", "FarmToTable-v0", path).n_envs == 2
    assert load_recipe("ppo", "SceneLayout-v0", path).settings == {"n_epochs": 3}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("FarmToTable-v0: {n_epoch: 3}", "mine.yml: FarmToTable-v0: n_epoch: must be one of"),
        (
            "FarmToTable-v0: {policy: Mlp}",
            "policy: must be one of CnnPolicy, MlpPolicy, MultiInputPolicy, ObjectPolicy",
        ),
        ("FarmToTable-v0: {seed: 3}", "seed: must be one of"),
        ("FarmToTable-v0: {n_envs: 0}", "n_envs: must be a whole number not below 1, got 0"),
        ("FarmToTable-v0: {n_timesteps: 1e5}", "n_timesteps: must be a whole number not below 1"),
        ("FarmToTable-v0: {env_kwargs: 3}", "env_kwargs: must hold values by name, got 3"),
        ("FarmToTable-v0: {normalize: true}", "normalize: must hold values for norm_obs,"),
        ("FarmToTable-v0: {normalize: {obs: true}}", "normalize.obs: must be one of norm_obs,"),
        ("FarmToTable-v0: {imitate: 3}", "imitate: must hold values for steps, beam, batches, learning_rate"),
        ("FarmToTable-v0: {imitate: {beams: 3}}", "imitate.beams: must be one of steps, beam,"),
        ("FarmToTable-v0: {imitate: {beam: 1.5}}", "imitate.beam: must be a positive whole number, got 1.5"),
        ("FarmToTable-v0: {imitate: {learning_rate: 0}}", "imitate.learning_rate: must be a positive number"),
        ("FarmToTable-v0: {learning_rate: lin_fast}", "learning_rate: must end in a number after lin_"),
        ("FarmToTable-v0: 3", "section: must hold values by name, got 3"),
        ("Other-v0: {}", "file: must have a section FarmToTable-v0 or default"),
        ("a: [", "file: must be YAML"),
    ],
)
def test_what_cannot_be_used_is_named(written, text, message):
    with pytest.raises((RecipeError, OptionError)) as problem:
        load_recipe("maskable-ppo", "FarmToTable-v0", written(text))
    assert message in str(problem.value)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(RecipeError, match="must be a readable file"):
        load_recipe("ppo", "FarmToTable-v0", tmp_path / "none.yml")


def test_a_key_of_another_learner_is_not_known():
    assert "buffer_size" in settings_of("sac")
    assert "buffer_size" not in settings_of("ppo")
    with pytest.raises(OptionError, match="algo: must be one of"):
        settings_of("dqn")


def test_a_falling_rate_falls_on_a_line_to_a_twentieth():
    rate = Recipe(settings={"learning_rate": "lin_0.001"}).of_learner()["learning_rate"]
    assert [rate(1.0), rate(0.5), rate(0.0)] == pytest.approx([1e-3, 5e-4, 5e-5])


def test_animals_are_not_left_out_where_they_are_what_counts():
    recipe = load_recipe("maskable-ppo", "FarmToTable-v0")
    assert recipe.with_arguments({"reward": "identity"}, None).env_kwargs["play_seconds"] == 0
    assert "play_seconds" not in recipe.with_arguments({"reward": "miscount"}, None).env_kwargs
    given = recipe.with_arguments({"reward": "miscount", "play_seconds": 2.0}, 5)
    assert (given.env_kwargs["play_seconds"], given.n_timesteps) == (2.0, 5)


def test_a_planner_is_asked_for_left_out_and_no_use_to_a_helper():
    recipe = load_recipe("maskable-ppo", "FarmToTable-v0")
    assert recipe.imitate is not None
    assert recipe.before == recipe.imitate["steps"] + recipe.lift
    assert recipe.with_arguments({}, imitate=0, lift=7).before == 7
    assert recipe.with_arguments({}, imitate=4096).imitate == {**recipe.imitate, "steps": 4096}
    assert recipe.with_arguments({"sign": -1}).imitate is None
    assert Recipe().with_arguments({}, imitate=64).imitate == {**IMITATE, "steps": 64}


@pytest.mark.parametrize("package", ["torch", "sb3_contrib", "tensorboard"])
def test_what_is_missing_is_named_with_what_to_install(monkeypatch, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingPackageError, match=f"training needs {package}: install the extra train"):
        need_training()


DAMAGED = [
    "", "7", "[]", "a: [1", "\x00", "default: 3", "default: {1: 2}", "default: {[1]: 2}", "default: &a [*a]",
    "default: 2001-99-99", "[" * 3000, "default: {n_envs: 1.5}", "default: {n_envs: 0}",
    "default: {n_timesteps: 1e30}", "default: {n_timesteps: true}", "default: {policy: [ObjectPolicy]}",
    "default: {policy: Nobody}", "default: {policy_kwargs: 3}", "default: {policy_kwargs: {1: 2}}",
    "default: {policy_kwargs: {nothing: 1}}", "default: {policy_kwargs: {net_arch: many}}",
    "default: {env_kwargs: [1]}", "default: {env_kwargs: {1: 2}}", "default: {env_kwargs: {nothing: 1}}",
    "default: {n_steps: many}", "default: {n_steps: 0}", "default: {batch_size: -1}",
    "default: {n_epochs: {}}", "default: {gamma: .nan}", "default: {gamma: 2}",
    "default: {learning_rate: fast}",
    "default: {learning_rate: lin_1_0}",
    "default: {learning_rate: lin_}", "default: {learning_rate: lin_nan}", "default: {n_steps: lin_8}",
    "default: {learning_rate: [1]}", "default: {ent_coef: {}}",
    "default: {normalize: 1}", "default: {normalize: {gamma: x}}", "default: {normalize: {norm_obs: 3}}",
    "default: {imitate: 3}", "default: {imitate: {steps: .inf}}", "default: {rehearse: -1}",
    "default: {lift: -1}", "default: {lift: 1, rehearse: 1}",
    "default: !!python/object/apply:os.system [ls]",
]  # fmt: skip


@pytest.mark.parametrize("text", DAMAGED)
def test_a_damaged_file_is_named_in_one_line_before_a_folder_is_made(written, tmp_path, text):
    path = written(text)
    with pytest.raises(InputError) as problem:
        train(Run("ppo", "FarmToTable-v0", 0, load_recipe("ppo", "FarmToTable-v0", path)), tmp_path / "run")
    assert "\n" not in str(problem.value)
    assert not (tmp_path / "run").exists()
