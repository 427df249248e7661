"""A pair at one table, with PettingZoo: an adversary and a helper learn in turn, each from the other.

With more steps, `python examples/trainers/pettingzoo_pair.py 160000`, both learn something (minutes).
"""

import sys
from collections.abc import Callable

import gymnasium as gym
import numpy as np

from farm_ar.agents.policies import AnalyticPolicy
from farm_ar.envs.references import TEST_SEEDS

try:
    import torch
    from sb3_contrib import MaskablePPO
    from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

    from farm_ar.envs.two_players import ADVERSARY, HELPER, AdversaryAndHelperEnv
except ImportError as missing:
    print(f"This example needs PettingZoo and sb3-contrib, and {missing.name} is not installed.")
    print("Install both extras, in the project's folder: pip install '.[train,pettingzoo]'")
    print("Nothing was trained.")
    sys.exit()

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 8192
ARGUMENTS = {"carry": "lift", "play_seconds": 0.0, "animals_a_second": 0.0}
ROUNDS, SEATS, EPISODES = 2, 8, min(60, STEPS // 200)
Choose = Callable[[AdversaryAndHelperEnv, str], int]
"""What one does whose turn it is."""


class Seat(gym.Env):
    """The environment as one of the two has it; the other plays as `other` says, which may be set."""

    def __init__(self, agent: str, other: Choose) -> None:
        self.pair, self.agent, self.other = AdversaryAndHelperEnv(**ARGUMENTS), agent, other
        self.observation_space = self.pair.observation_space(agent)
        self.action_space = self.pair.action_space(agent)

    def action_masks(self) -> np.ndarray:
        """What makes sense now."""
        return self.pair.infos[self.agent]["action_mask"].astype(bool)

    def reset(self, seed: int | None = None, options: dict | None = None) -> tuple:
        """Begin, and have the other play first if it is its turn."""
        super().reset(seed=seed)
        self.pair.reset(seed=seed, options=options)
        self._wait()
        return self.pair.observe(self.agent), {}

    def step(self, action: int) -> tuple:
        """Do it, and have the other play until it is this one's turn again."""
        self.pair.step(int(action))
        reward = self.pair.rewards[self.agent] + self._wait()
        return self.pair.observe(self.agent), reward, self.pair.terminations[self.agent], False, {}

    def _wait(self) -> float:
        """Have the other play until it is this one's turn again; what that brings."""
        brought = 0.0
        while self.pair.agent_selection != self.agent and not self.pair.terminations[self.agent]:
            self.pair.step(self.other(self.pair, self.pair.agent_selection))
            brought += self.pair.rewards[self.agent]
        return brought


def ends(pair: AdversaryAndHelperEnv, agent: str) -> int:
    """End the turn at once."""
    return int(pair.action_space(agent).n) - 1


def random(pair: AdversaryAndHelperEnv, agent: str) -> int:
    """Anything that makes sense."""
    return int(pair.action_space(agent).sample(pair.infos[agent]["action_mask"]))


def analytic(pair: AdversaryAndHelperEnv, agent: str) -> int:
    """The adversary that plans."""
    return int(AnalyticPolicy().act(pair.table))


def learnt(model: MaskablePPO) -> Choose:
    """What a learner finds likeliest."""

    def choose(pair: AdversaryAndHelperEnv, agent: str) -> int:
        mask = pair.infos[agent]["action_mask"].astype(bool)
        return int(model.predict(pair.observe(agent), action_masks=mask, deterministic=True)[0])

    return choose


def mean_return(adversary: Choose, helper: Choose) -> str:
    """The adversary's mean return over test episodes, with its standard error."""
    seat, returns = Seat(ADVERSARY, helper), []
    seat.pair.action_space(ADVERSARY).seed(0)
    seat.pair.action_space(HELPER).seed(0)
    for seed in TEST_SEEDS[:EPISODES]:
        seat.reset(seed=seed)
        total, over = 0.0, False
        while not over:
            _, reward, over, *_ = seat.step(adversary(seat.pair, ADVERSARY))
            total += reward
        returns.append(total)
    return f"{np.mean(returns):5.2f} ± {np.std(returns, ddof=1) / np.sqrt(EPISODES):.2f}"


torch.set_num_threads(1)
seats, models = {}, {}
for agent in (ADVERSARY, HELPER):
    made = [Seat(agent, ends) for _ in range(SEATS)]
    seats[agent] = made
    envs = VecMonitor(DummyVecEnv([lambda seat=seat: seat for seat in made]))
    models[agent] = MaskablePPO("MlpPolicy", envs, n_steps=64, batch_size=128, seed=0, device="cpu")
each = STEPS // (2 * ROUNDS)
for turn in range(ROUNDS):
    for agent, other in ((ADVERSARY, HELPER), (HELPER, ADVERSARY)):
        for seat in seats[agent]:
            seat.other = learnt(models[other]) if turn or agent == HELPER else ends
        models[agent].learn(each, reset_num_timesteps=False)
        gained = np.mean([one["r"] for one in models[agent].ep_info_buffer])
        print(f"{agent:12} {models[agent].num_timesteps:6} steps {gained:6.2f} in training", flush=True)

helpers = {"ends its turn": ends, "random": random, "learnt": learnt(models[HELPER])}
print(f"mean return of the adversary (rows) beside a helper that\n{'':12} {'   '.join(helpers)}")
for name, adversary in {"random": random, "analytic": analytic, "learnt": learnt(models[ADVERSARY])}.items():
    print(f"{name:12} {'   '.join(mean_return(adversary, helper) for helper in helpers.values())}")
