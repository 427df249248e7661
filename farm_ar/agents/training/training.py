"""Training a policy, and going on with a training that was interrupted."""

from __future__ import annotations

import warnings
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, CallbackList
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv, VecNormalize

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.agents.training.callbacks import (
    Checkpoints,
    EndLifting,
    Evaluations,
    KeepBest,
    MaskableEvaluations,
    NoteEvaluation,
    Progress,
)
from farm_ar.agents.training.checkpoints import DEMONSTRATIONS, as_written, normalized, read_state, restore
from farm_ar.agents.training.demonstrated_env import lifted
from farm_ar.agents.training.imitation import ImitatingPPO
from farm_ar.agents.training.recipes import ALGORITHMS, RecipeError, check_fit, policy_class
from farm_ar.agents.training.run_folder import CHECKPOINTS, Run, RunFolder
from farm_ar.envs.batched.entry_point import can_be_batched
from farm_ar.envs.batched.sb3 import BatchedVecEnv
from farm_ar.envs.registration import make_env
from farm_ar.errors import OptionError

EVALUATION_SEED = 1_000_003
"""Added to a run's seed for the environments in which it is evaluated."""

WINDOW = 200
"""Episodes whose mean return the learning curve shows."""


def train(
    run: Run,
    path: Path,
    resume: bool = False,
    progress: bool = False,
    steps: int | None = None,
    trust: bool = False,
) -> BaseAlgorithm:
    """Train a policy, and leave everything in a folder.

    Same arguments, same bytes; but a training that was interrupted goes on with other random numbers than it
    would have had.

    Args:
        run: its description; of a run that goes on, its own counts.
        path: the folder.
        resume: whether to go on from the newest checkpoint in the folder, if there is one.
        progress: whether to show a bar, or lines where no terminal can show it.
        steps: in all, of a run that goes on, in place of those it was to have.
        trust: whether a folder that exists may run code of whoever wrote it: the module of its environment,
            pickles of an older version.

    Returns:
        The learner, trained.

    Raises:
        OptionError: the folder holds a run already, another process trains in it, or learner and environment
            do not fit.
        RunError: the run's files are damaged, or would run code that is not trusted.
    """
    folder = RunFolder(path)
    if not folder.exists:
        check(run)  # before a folder is made
    with folder.locked():
        return _train(run, folder, resume, progress, steps, trust)


def _train(
    run: Run, folder: RunFolder, resume: bool, progress: bool, steps: int | None, trust: bool
) -> BaseAlgorithm:
    if folder.exists and not resume:
        raise OptionError("run", "must be a new folder, or go on with --resume", str(folder.path))
    if folder.exists:
        run = folder.read_to_make(trust)
        if steps is not None:
            run = replace(run, recipe=replace(run.recipe, n_timesteps=steps))
            folder.describe(run)
    check(run)
    if not folder.exists:
        folder.describe(run)
    torch.set_num_threads(run.threads)
    started = folder.kept(CHECKPOINTS)
    newest = started[-1] if started else None
    done, seconds = (0, 0.0) if newest is None else read_state(newest)
    folder.go_back(done)
    seed = run.seed + done
    envs = _environments(run, seed, run.recipe.n_envs, newest, trust=trust)
    judge = _environments(run, run.seed + EVALUATION_SEED, 1, None, judging=True)
    first = envs
    try:
        if done < run.recipe.before:
            first = lifted(run.env, run.recipe.env_kwargs, run.recipe.n_envs, seed, run.threads)
        model = _new_model(run, first) if newest is None else _old_model(run, first, newest, trust)
        if done < run.recipe.n_timesteps:
            _learn(model, run, folder, envs, judge, seconds, progress)
    finally:
        if first is not envs:
            first.close()
        envs.close()
        judge.close()
    return model


def check(run: Run) -> None:
    """Make the environment once, so that a mistake in its arguments is seen before any work begins.

    Raises:
        OptionError: learner, recipe and environment do not fit.
    """
    env = make_env(run.env, run.recipe.env_kwargs)
    check_fit(run.algo, run.recipe.policy, env)
    if run.recipe.imitate is not None:
        shown = run.recipe.imitate["steps"]
        if run.algo != "maskable-ppo" or run.recipe.policy != "ObjectPolicy":
            raise OptionError("imitate", "must be 0 but for maskable-ppo with ObjectPolicy", shown)
        if run.recipe.env_kwargs.get("sign", 1) != 1:
            raise OptionError("imitate", "must be 0 for a helper, as the planner is an adversary", shown)
    if run.recipe.before:
        if run.recipe.normalize is not None:
            raise OptionError("imitate, lift", "must both be 0 with normalization", run.recipe.before)
        lifted(run.env, run.recipe.env_kwargs, 1, 0, 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of batches that one environment cannot fill
            _new_model(run, DummyVecEnv([lambda: env]))
    except Exception as problem:  # what a learner says to its settings has no one class
        got = " ".join(f"{type(problem).__name__}: {problem}".split())
        raise RecipeError("recipe", "must hold settings that the learner takes", got) from None
    env.close()


def _environments(
    run: Run, seed: int, count: int, saved: Path | None, judging: bool = False, trust: bool = False
) -> VecEnv:
    envs = _monitored(run, seed, count, judging)
    if run.recipe.normalize is None:
        return envs
    if saved is not None:
        return normalized(envs, run.recipe.normalize, saved, trust)
    kept = VecNormalize(envs, training=not judging, **run.recipe.normalize)
    if judging:
        kept.norm_reward = False
    return kept


def _monitored(run: Run, seed: int, count: int, judging: bool) -> VecEnv:
    """Environments whose episodes are reported: in a batch where they can be, to the same bits."""
    arguments = dict(run.recipe.env_kwargs)
    if not (judging or run.processes) and can_be_batched(run.env, arguments):
        batch = BatchedVecEnv.of(run.env, count, run.threads, monitor=True, **arguments)
        batch.seed(seed)
        return batch
    many = SubprocVecEnv if run.processes and not judging else DummyVecEnv
    # A process of its own learns of the environments by the module before the colon.
    env_id = run.env if ":" in run.env else f"farm_ar:{run.env}"
    return make_vec_env(env_id, count, seed=seed, env_kwargs=arguments, vec_env_cls=many)


def _new_model(run: Run, envs: VecEnv) -> BaseAlgorithm:
    recipe = run.recipe
    learner: Any = (
        ALGORITHMS[run.algo] if recipe.imitate is None else partial(ImitatingPPO, imitate=recipe.imitate)
    )
    return learner(  # type: ignore[no-any-return]
        policy_class(recipe.policy, envs.observation_space),
        envs,
        seed=run.seed,
        device="cpu",
        policy_kwargs=dict(recipe.policy_kwargs),
        stats_window_size=WINDOW,
        **recipe.of_learner(),
    )


def _old_model(run: Run, envs: VecEnv, saved: Path, trust: bool) -> BaseAlgorithm:
    model = _new_model(run, envs)
    restore(model, saved, trust)
    if isinstance(model, ImitatingPPO) and model.num_timesteps < model.imitate["steps"]:
        with as_written(saved):
            model.demonstrations.load(saved / DEMONSTRATIONS)
    model.set_random_seed(run.seed + model.num_timesteps)  # of the environments too, to see new tables
    return model


def _learn(
    model: BaseAlgorithm,
    run: Run,
    folder: RunFolder,
    envs: VecEnv,
    judge: VecEnv,
    seconds: float,
    progress: bool,
) -> None:
    recipe, steps = run.recipe, model.num_timesteps
    model.set_logger(configure(str(folder.path / "tensorboard"), ["tensorboard"]))
    evaluating = MaskableEvaluations if run.algo == "maskable-ppo" else Evaluations
    calls: list[BaseCallback] = [
        Checkpoints(folder, recipe.checkpoint_every, seconds),
        evaluating(
            judge,
            callback_on_new_best=KeepBest(folder),
            callback_after_eval=NoteEvaluation(folder),
            n_eval_episodes=run.eval_episodes,
            eval_freq=max(run.eval_every // recipe.n_envs, 1),
            verbose=0,
            warn=False,
        ),
    ]
    if steps < recipe.before:
        calls.append(EndLifting(recipe.before, envs))
    shown = Progress(recipe.n_timesteps, recipe.before)
    if progress:
        calls.append(shown)
    try:
        model.learn(
            recipe.n_timesteps - steps, CallbackList(calls), log_interval=1, reset_num_timesteps=steps == 0
        )
    finally:
        if progress:
            shown.stop()
