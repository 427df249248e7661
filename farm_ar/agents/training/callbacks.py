"""What happens while a learner learns: checkpoints, evaluations, the learning curve, the progress bar."""

from __future__ import annotations

import math
import threading
import time
from datetime import timedelta
from typing import Any

import numpy as np
from sb3_contrib.common.maskable.callbacks import MaskableEvalCallback
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, EvalCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from farm_ar.agents.training.checkpoints import write_model
from farm_ar.agents.training.run_folder import BEST, CHECKPOINTS, RunFolder, Table

LINE_EVERY_S = 10.0
"""How often a line reports a run where no terminal shows a bar."""

TRAINING = ("steps", "seconds", "mean_return", "mean_length")
EVALUATIONS = ("steps", "mean_return", "best_mean_return")


class Checkpoints(BaseCallback):
    """Keeps the model before every rollout, so that a kill loses one rollout at the most, and the curve.

    Args:
        folder: of the run.
        every: steps between checkpoints at the least.
        seconds: how long the run has learnt before.
    """

    def __init__(self, folder: RunFolder, every: int, seconds: float = 0.0) -> None:
        super().__init__()
        self._folder, self._every, self._before = folder, every, seconds

    def _on_training_start(self) -> None:
        self._begin = time.perf_counter()
        self._saved = self._noted = self.num_timesteps
        self._table = Table(self._folder.path / "training.csv", TRAINING, self.num_timesteps)

    def _on_rollout_start(self) -> None:
        """After the update that the last rollout led to."""
        if self.num_timesteps - self._saved >= max(self._every, 1):
            self._keep()

    def _on_step(self) -> bool:
        return True

    def _on_training_end(self) -> None:
        if self.num_timesteps > self._saved:
            self._keep()

    def _keep(self) -> None:
        self._saved = self.num_timesteps
        seconds = self._before + time.perf_counter() - self._begin
        episodes: Any = self.model.ep_info_buffer
        if episodes:
            self._table.add(
                steps=self.num_timesteps,
                seconds=round(seconds, 2),
                mean_return=round(float(np.mean([e["r"] for e in episodes])), 5),
                mean_length=round(float(np.mean([e["l"] for e in episodes])), 3),
            )
        self._folder.keep(CHECKPOINTS, self._saved, lambda at: write_model(self.model, at, seconds))


class KeepBest(BaseCallback):
    """Keeps the model that an evaluation found to be the best so far.

    Args:
        folder: of the run.
    """

    def __init__(self, folder: RunFolder) -> None:
        super().__init__()
        self._folder = folder

    def _on_step(self) -> bool:
        self._folder.keep(BEST, self.model.num_timesteps, lambda at: write_model(self.model, at))
        return True


class Evaluations(EvalCallback):
    """Evaluates in environments of another kind than those of the training, too."""

    def _init_callback(self) -> None:
        if self.callback_on_new_best is not None:
            self.callback_on_new_best.init_callback(self.model)


class MaskableEvaluations(Evaluations, MaskableEvalCallback):
    """The same for a learner that masks actions."""


class EndLifting(BaseCallback):
    """Lets a learner go on in the environment itself when the steps in the batch are over.

    Args:
        after: steps in the batch, in which the hand lifts.
        envs: where to go on.
    """

    def __init__(self, after: int, envs: VecEnv) -> None:
        super().__init__()
        self._after, self._envs, self._over = after, envs, False

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        learner: Any = self.model
        if learner.env is self._envs and not self._over:
            self._over = True
            learner.ep_info_buffer.clear()  # the curve is not to show a mean over both

    def _on_rollout_end(self) -> None:
        learner: Any = self.model
        if self.num_timesteps >= self._after and learner.env is not self._envs:
            learner.set_env(self._envs)
            learner._last_obs = self._envs.reset()
            learner._last_episode_starts = np.ones(self._envs.num_envs, dtype=np.bool_)


class NoteEvaluation(BaseCallback):
    """Notes every evaluation in a table; one that goes on with a run knows the best so far.

    Args:
        folder: of the run.
    """

    parent: EvalCallback

    def __init__(self, folder: RunFolder) -> None:
        super().__init__()
        self._folder = folder

    def _init_callback(self) -> None:
        self._table = Table(self._folder.path / "evaluations.csv", EVALUATIONS, self.model.num_timesteps)
        if self._table.rows and self._folder.kept(BEST):
            self.parent.best_mean_reward = self._table.rows[-1]["best_mean_return"]
        # Evaluations go by calls, of which there has been one for every step of all environments.
        self.parent.n_calls = self.model.num_timesteps // self.model.n_envs

    def _on_step(self) -> bool:
        self._table.add(
            steps=self.model.num_timesteps,
            mean_return=round(self.parent.last_mean_reward, 5),
            best_mean_return=round(self.parent.best_mean_reward, 5),
        )
        return True


def whole_rollouts(model: BaseAlgorithm, steps: int) -> int:
    """How many steps a learner takes in all that is to take so many: PPO ends after a whole rollout."""
    if not isinstance(model, OnPolicyAlgorithm):
        return steps
    rollout, done = model.n_steps * model.n_envs, model.num_timesteps
    return done + rollout * math.ceil(max(steps - done, 0) / rollout)


class Progress(BaseCallback):
    """A bar on the error stream, or a line every `LINE_EVERY_S` where no terminal shows it.

    Args:
        total: steps that were asked for.
        lifted: the first of them, in a batch in which the hand lifts.
    """

    def __init__(self, total: int, lifted: int = 0) -> None:
        super().__init__()
        self._total, self._lifted, self._mean = total, lifted, "-"
        self._begun, self._over = False, threading.Event()

    def _on_training_start(self) -> None:
        from rich import progress
        from rich.console import Console

        columns = (
            progress.BarColumn(),
            progress.MofNCompleteColumn(),
            progress.TextColumn("return {task.fields[mean]}"),
            progress.TimeElapsedColumn(),
            progress.TimeRemainingColumn(),
        )
        asked, self._total = self._total, whole_rollouts(self.model, self._total)
        self._console, self._began = Console(stderr=True, highlight=False), time.monotonic()
        self._bar = progress.Progress(*columns, console=self._console)
        self._row = self._bar.add_task("", total=self._total, completed=self.num_timesteps, mean="-")
        self._begun = True
        going_on = f"Going on from step {self.num_timesteps}"
        self._console.print(going_on if self.num_timesteps else f"Training for {self._total} steps")
        if self._total != asked:
            self._console.print(f"{asked} steps are rounded up to {self._total}, which are whole rollouts")
        if self._console.is_interactive:
            self._bar.start()
        else:
            threading.Thread(target=self._tell, daemon=True).start()

    def _on_step(self) -> bool:
        self._bar.update(self._row, completed=self.num_timesteps)
        return True

    def _on_rollout_end(self) -> None:
        episodes: Any = self.model.ep_info_buffer
        self._mean = f"{np.mean([e['r'] for e in episodes]):.2f}" if episodes else "-"
        if self.num_timesteps <= self._lifted:
            self._mean += " with a hand that lifts"
        self._bar.update(self._row, mean=self._mean)

    def stop(self) -> None:
        """Take the bar away, or write the last line; also where the training did not come to its end."""
        if not self._begun:
            return
        self._over.set()
        if self._console.is_interactive:
            self._bar.stop()
        else:
            self._line()

    def _tell(self) -> None:
        """From a thread of its own, as there is no step while the network is fitted or evaluated."""
        while not self._over.wait(LINE_EVERY_S):
            self._line()

    def _line(self) -> None:
        seconds = timedelta(seconds=round(time.monotonic() - self._began))
        self._console.print(f"{self.num_timesteps} of {self._total} steps, return {self._mean}, {seconds}")
