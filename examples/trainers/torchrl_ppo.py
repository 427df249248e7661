"""TorchRL: PPO on an environment with one Box to observe and one number to choose (half a minute)."""

import sys
import warnings

import gymnasium as gym

from farm_ar.envs.references import reference_returns

warnings.simplefilter("ignore")  # of what TorchRL itself will do without
try:
    import torch
    from tensordict.nn import TensorDictModule
    from torch import nn
    from torchrl.collectors import Collector
    from torchrl.envs import GymWrapper, RewardSum, TransformedEnv
    from torchrl.modules import OneHotCategorical, ProbabilisticActor, ValueOperator
    from torchrl.objectives import ClipPPOLoss
    from torchrl.objectives.value import GAE
except ImportError as missing:
    print(f"This example learns with TorchRL, and {missing.name} is not installed.")
    print("Install it: pip install torchrl")
    print("Nothing was trained.")
    sys.exit()

ENV = "FarmToTableLayoutDiscrete-v0"
ROLLOUT, EPOCHS, BATCH = 512, 6, 128
STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 4096

torch.manual_seed(0)
torch.set_num_threads(1)
made = gym.make(f"farm_ar:{ENV}", carry="lift", play_seconds=0.0, animals_a_second=0.0)
env = TransformedEnv(GymWrapper(made), RewardSum())
env.set_seed(0)
observations, actions = made.observation_space.shape[0], int(made.action_space.n)


def layers(out: int) -> nn.Module:
    """A network with one hidden layer."""
    return nn.Sequential(nn.Linear(observations, 128), nn.Tanh(), nn.Linear(128, out))


actor = ProbabilisticActor(
    TensorDictModule(layers(actions), in_keys=["observation"], out_keys=["logits"]),
    in_keys=["logits"],
    distribution_class=OneHotCategorical,
    return_log_prob=True,
)
critic = ValueOperator(layers(1), in_keys=["observation"])
advantage = GAE(gamma=0.98, lmbda=0.95, value_network=critic, average_gae=True)
loss_of = ClipPPOLoss(actor, critic, clip_epsilon=0.2, entropy_coeff=0.01)
optimizer = torch.optim.Adam(loss_of.parameters(), lr=1e-3)
collector = Collector(env, actor, frames_per_batch=ROLLOUT, total_frames=STEPS)

print(f"{ENV}: mean return of the episodes of a rollout")
for count, data in enumerate(collector, 1):
    ended = data["next", "done"]
    print(f"{count * ROLLOUT:6} steps {data['next', 'episode_reward'][ended].mean():6.2f}", flush=True)
    for _ in range(EPOCHS):
        advantage(data)
        for rows in torch.randperm(ROLLOUT).split(BATCH):
            losses = loss_of(data.reshape(-1)[rows])
            loss = losses["loss_objective"] + losses["loss_critic"] + losses["loss_entropy"]
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(loss_of.parameters(), 0.5)
            optimizer.step()
collector.shutdown()
for name, reference in reference_returns(ENV).items():
    print(f"{name:12} {reference.mean:6.2f}")
