"""RLlib: PPO on an environment with one Box to observe and one number to choose (a minute).

RLlib (`pip install 'ray[rllib]'`) asks for Gymnasium 1.2.2, which farm-ar supports; give it an environment
of its own.
"""

import os
import sys
import warnings

import gymnasium as gym

from farm_ar.envs.references import reference_returns

warnings.simplefilter("ignore")  # of what Ray itself will do without
os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
try:
    import ray
    from ray.rllib.algorithms.ppo import PPOConfig
    from ray.tune.registry import register_env
except ImportError as missing:
    print(f"This example learns with RLlib, and {missing.name} is not installed.")
    print("Install it, in an environment of its own: pip install 'ray[rllib]'")
    print("Nothing was trained.")
    sys.exit()

ENV = "FarmToTableLayoutDiscrete-v0"
ITERATIONS = int(sys.argv[1]) if len(sys.argv) > 1 else 3


def make(arguments: dict) -> gym.Env:
    """The environment, in whatever process; the module before the colon registers it there."""
    return gym.make(f"farm_ar:{ENV}", **arguments)


register_env(ENV, make)
ray.init(address="local", num_cpus=1, include_dashboard=False, log_to_driver=False, logging_level="error")
config = (
    PPOConfig()
    .environment(ENV, env_config={"carry": "lift", "play_seconds": 0.0, "animals_a_second": 0.0})
    .env_runners(num_env_runners=0, num_envs_per_env_runner=4)
    .training(train_batch_size_per_learner=1024, minibatch_size=128, num_epochs=6, lr=1e-3, gamma=0.98)
    .debugging(seed=0, log_level="ERROR")
)
learner = config.build_algo()
print(f"{ENV}: mean return of the last episodes in training")
for k in range(ITERATIONS):
    result = learner.train()
    print(f"{1024 * (k + 1):6} steps {result['env_runners']['episode_return_mean']:6.2f}", flush=True)
learner.stop()
ray.shutdown()
for name, reference in reference_returns(ENV).items():
    print(f"{name:12} {reference.mean:6.2f}")
