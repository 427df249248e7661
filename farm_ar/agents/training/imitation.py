"""The imitation warm start (DAgger): a learner imitates a planner before it learns from its own rewards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from sb3_contrib import MaskablePPO
from torch import Tensor

from farm_ar.agents.training.demonstrated_env import DemonstratedEnv
from farm_ar.agents.training.demonstrations import Demonstration, Demonstrations
from farm_ar.agents.training.object_policy import ObjectPolicy
from farm_ar.envs.actions import MoveAction
from farm_ar.envs.observations import mirror

VALUE_SHARE = 0.1
"""What the error of the values counts beside that of the choices."""

LEAST = 1e-12
"""The least value of a choice."""

LOWEST_RATE = 0.02
"""The share of itself below which the rate does not fall."""

LEAST_LED = 0.5
"""In what share of the steps the planner would act at the end, had the last rollout no length."""


class ImitatingPPO(MaskablePPO):
    """MaskablePPO that first learns the choices of a planner at its side, in a `DemonstratedEnv`.

    At first the planner acts, later the learner itself in up to half of the steps, so that it gets
    demonstrations in states that its own choices lead to; all demonstrations are kept (Ross, Gordon and
    Bagnell 2011, "A reduction of imitation learning and structured prediction to no-regret online learning").
    One step of the best plan is as good as another, if it can come first. The policy must be an
    `ObjectPolicy`.

    Args:
        imitate: "steps" of imitation, the "beam" of the planner, how many "batches" it learns
            after every rollout, and the "learning_rate", which falls in proportion to the steps left.
        arguments: of `MaskablePPO`.
    """

    def __init__(self, *arguments: Any, imitate: Mapping[str, Any] | None = None, **named: Any) -> None:
        self.imitate = dict(imitate or {})
        self.demonstrations = Demonstrations()
        super().__init__(*arguments, **named)

    def collect_rollouts(self, *arguments: Any, **named: Any) -> bool:
        """A rollout, with the planner at the side of a learner that still imitates it."""
        envs = self.env
        if isinstance(envs, DemonstratedEnv):
            left = 1.0 - self.num_timesteps / self.imitate["steps"] if self.imitate else 0.0
            led = LEAST_LED + (1.0 - LEAST_LED) * left
            envs.beam, envs.led = (self.imitate["beam"], led) if left > 0.0 else (0, 0.0)
        goes_on = bool(super().collect_rollouts(*arguments, **named))
        if isinstance(envs, DemonstratedEnv) and envs.shown:
            self._remember(envs.shown)
            envs.shown = []
        return goes_on

    def train(self) -> None:
        """Learn from what the planner would have done; left to itself, from what came of the last rollout."""
        if not len(self.demonstrations):
            super().train()
            return
        self._learn_choices()
        if self.num_timesteps >= self.imitate["steps"]:
            policy: Any = self.policy
            policy.renew_optimizer(self.lr_schedule(self._current_progress_remaining))
            self.demonstrations = Demonstrations()

    def _remember(self, shown: Sequence[Demonstration]) -> None:
        buffer: Any = self.rollout_buffer
        moments = {
            **buffer.observations,
            "masks": buffer.action_masks,
            "returns": buffer.returns,
            "actions": np.stack([one.actions for one in shown]),
            "worth": np.stack([one.worth for one in shown]).astype(np.float32),
        }
        self.demonstrations.add({name: v.reshape(-1, *v.shape[2:]).copy() for name, v in moments.items()})

    def _learn_choices(self) -> None:
        policy: Any = self.policy
        policy.set_training_mode(True)
        rng = np.random.default_rng([int(self.seed or 0), self.num_timesteps])
        left = 1.0 - (self.num_timesteps - self.n_steps * self.n_envs) / self.imitate["steps"]
        for group in policy.optimizer.param_groups:
            group["lr"] = self.imitate["learning_rate"] * max(left, LOWEST_RATE)
        losses = []
        for _ in range(self.imitate["batches"]):
            drawn = mirrored(self.demonstrations.draw(int(self.batch_size or 1), rng), rng, policy.encoding)
            choice, value = _errors(policy, drawn)
            policy.optimizer.zero_grad()
            (choice + VALUE_SHARE * value).backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(policy.parameters(), self.max_grad_norm)
            policy.optimizer.step()
            losses.append((choice.item(), value.item()))
        choice_loss, value_loss = np.mean(losses, axis=0)
        self.logger.record("imitation/choice_loss", choice_loss)
        self.logger.record("imitation/value_loss", value_loss)

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), "demonstrations"]


def mirrored(
    moments: dict[str, npt.NDArray[Any]], rng: np.random.Generator, encoding: MoveAction
) -> dict[str, npt.NDArray[Any]]:
    """About half of the moments with left and right exchanged, so that twice as many are learnt.

    Args:
        moments: as `Demonstrations` has them.
        rng: says which.
        encoding: of their actions.
    """
    chosen = rng.random(len(moments["returns"])) < 0.5
    turned = mirror(moments) | {"actions": encoding.mirror(moments["actions"])}
    return {
        name: np.where(chosen.reshape(-1, *[1] * (values.ndim - 1)), turned[name], values)
        for name, values in moments.items()
    }


def _errors(policy: ObjectPolicy, moments: dict[str, npt.NDArray[Any]]) -> tuple[Tensor, Tensor]:
    """Negative logarithm of the planner's value of the policy's choices; how wrong its values are."""
    names = policy.observation_space.spaces  # type: ignore[attr-defined]
    seen = {name: torch.as_tensor(moments[name]) for name in names}
    distribution, values = policy.outlook(seen, moments["masks"], apart=True)
    actions, worth = torch.as_tensor(moments["actions"]), torch.as_tensor(moments["worth"])
    choice = -torch.logsumexp(distribution.log_probs(actions) + worth.clamp(min=LEAST).log(), dim=1).mean()
    return choice, (values.squeeze(-1) - torch.as_tensor(moments["returns"])).square().mean()
