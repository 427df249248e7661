"""PPO in one file, in the form of CleanRL's: no class but the agent, all in the order in which it happens.

`FarmToTableLayoutDiscrete-v0` has one Box to observe and one number to choose, which is all that such a
script needs; an episode is one step. The mask in `info` leaves out what would do nothing.
"""

import sys

import gymnasium as gym
import numpy as np

from farm_ar.envs.references import reference_returns

try:
    import torch
    from torch import nn
    from torch.distributions import Categorical
except ImportError as missing:
    print(f"This example learns with PyTorch, and {missing.name} is not installed.")
    print("Install the extra `train`, in the project's folder: pip install '.[train]'")
    print("Nothing was trained.")
    sys.exit()

ENV = "FarmToTableLayoutDiscrete-v0"
SEED, ENVS, ROLLOUT = 1, 8, 128
STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 8192
RATE, DISCOUNT, TRACE, CLIP, ENTROPY, VALUE, EPOCHS, BATCHES = 1e-3, 0.98, 0.95, 0.2, 0.01, 0.5, 6, 4


class Agent(nn.Module):
    """An actor and a critic with two layers each."""

    def __init__(self, observations: int, actions: int) -> None:
        super().__init__()
        self.actor = nn.Sequential(nn.Linear(observations, 128), nn.Tanh(), nn.Linear(128, actions))
        self.critic = nn.Sequential(nn.Linear(observations, 128), nn.Tanh(), nn.Linear(128, 1))

    def choices(self, seen: torch.Tensor, mask: torch.Tensor) -> Categorical:
        """What to do, among what makes sense."""
        return Categorical(logits=self.actor(seen).masked_fill(~mask, -1e8), validate_args=False)


def masks_of(infos: dict) -> torch.Tensor:
    """The masks of all environments."""
    return torch.as_tensor(np.stack(infos["action_mask"]).astype(bool))


torch.manual_seed(SEED)
torch.set_num_threads(1)
envs = gym.make_vec(
    f"farm_ar:{ENV}",
    num_envs=ENVS,
    vectorization_mode="sync",
    vector_kwargs={"autoreset_mode": gym.vector.AutoresetMode.SAME_STEP},
    play_seconds=0.0,
    animals_a_second=0.0,
    carry="lift",
)
agent = Agent(envs.single_observation_space.shape[0], int(envs.single_action_space.n))
optimizer = torch.optim.Adam(agent.parameters(), lr=RATE, eps=1e-5)

shape = (ROLLOUT, ENVS)
seen = torch.zeros((*shape, *envs.single_observation_space.shape))
mask = torch.zeros((*shape, int(envs.single_action_space.n)), dtype=torch.bool)
action, logprob, reward, over, value = (torch.zeros(shape) for _ in range(5))

observation, infos = envs.reset(seed=SEED)
totals, returns = np.zeros(ENVS), []
print(f"{ENV}: mean return of episodes so far in training")
UPDATES = max(1, STEPS // (ROLLOUT * ENVS))
for update in range(1, UPDATES + 1):
    for t in range(ROLLOUT):
        seen[t], mask[t] = torch.as_tensor(observation), masks_of(infos)
        with torch.no_grad():
            choices = agent.choices(seen[t], mask[t])
            action[t], value[t] = choices.sample(), agent.critic(seen[t]).squeeze(-1)
            logprob[t] = choices.log_prob(action[t])
        observation, paid, ended, cut, infos = envs.step(action[t].long().numpy())
        reward[t], over[t] = torch.as_tensor(paid), torch.as_tensor(ended | cut).float()
        totals += paid
        returns += totals[ended | cut].tolist()
        totals[ended | cut] = 0.0

    with torch.no_grad():
        advantage, later = torch.zeros(shape), torch.zeros(ENVS)
        next_value = agent.critic(torch.as_tensor(observation)).squeeze(-1)
        for t in reversed(range(ROLLOUT)):
            goes_on = 1 - over[t]
            error = reward[t] + DISCOUNT * next_value * goes_on - value[t]
            later = advantage[t] = error + DISCOUNT * TRACE * goes_on * later
            next_value = value[t]
        target = (advantage + value).flatten()

    rows = [part.flatten(0, 1) for part in (seen, mask, action, logprob, advantage)]
    for _ in range(EPOCHS):
        for batch in torch.randperm(ROLLOUT * ENVS).chunk(BATCHES):
            some_seen, some_mask, some_action, before, gain = (part[batch] for part in rows)
            choices = agent.choices(some_seen, some_mask)
            ratio = (choices.log_prob(some_action) - before).exp()
            gain = (gain - gain.mean()) / (gain.std() + 1e-8)
            policy_loss = -torch.min(gain * ratio, gain * ratio.clamp(1 - CLIP, 1 + CLIP)).mean()
            value_loss = (agent.critic(some_seen).squeeze(-1) - target[batch]).pow(2).mean()
            loss = policy_loss + VALUE * value_loss - ENTROPY * choices.entropy().mean()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimizer.step()

    if update % 4 == 0 or update == UPDATES:
        print(f"{update * ROLLOUT * ENVS:6} steps {np.mean(returns[-200:]):6.2f}", flush=True)
envs.close()
for name, reference in reference_returns(ENV).items():
    print(f"{name:12} {reference.mean:6.2f}")
