"""Environments in a batch beside single ones, in one run: steps a second, ratios, memory of 4096.

    python benchmarks/batched.py [--count 1024] [--seconds 2]

Actions are random. Kernels are compiled and environments played before time is taken. Single ones are
played as they come (`carry="drag"`, today's default) and with the options of the batch.
"""

import argparse
import os
import resource
import time

import gymnasium as gym
import numpy as np

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.envs.batched import BatchedVectorEnv

CASES = {
    "FarmToTable-v0, play_seconds=0": ("FarmToTable-v0", {"play_seconds": 0.0}, {"carry": "lift"}),
    "FarmToTable-v0": ("FarmToTable-v0", {}, {"carry": "lift"}),
    "FarmToTableLayout-v0": ("FarmToTableLayout-v0", {}, {"carry": "lift"}),
    "SceneLayout-v0": ("SceneLayout-v0", {}, {}),
}
"""Names of cases: the id, options, and options that a batch takes beside."""


def single_rate(env_id, seconds, options):
    """Steps a second of one environment, resets included."""
    env = gym.make(env_id, **options).unwrapped
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(500)]

    def play(until):
        steps = 0
        while time.perf_counter() < until:
            for action in actions[:50]:
                if env.step(action)[2]:
                    env.reset()
            steps += 50
        return steps

    play(time.perf_counter() + 1.0)
    begin = time.perf_counter()
    return play(begin + seconds) / (time.perf_counter() - begin)


def batch_rate(env_id, seconds, options, count, threads):
    """Steps a second of a batch, which begin anew within the step."""
    kwargs = gym.spec(env_id).kwargs | options
    envs = BatchedVectorEnv(count, "SameStep", threads, **kwargs)
    envs.reset(seed=0)
    envs.action_space.seed(0)
    actions = [envs.action_space.sample() for _ in range(8)]
    for k in range(8):
        envs.step(actions[k])
    steps, begin = 0, time.perf_counter()
    while time.perf_counter() < begin + seconds:
        envs.step(actions[steps % 8])
        steps += 1
    rate = steps * count / (time.perf_counter() - begin)
    envs.close()
    return rate


def memory(env_id, options):
    """Megabytes that 4096 environments take beyond what the process has."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    envs = BatchedVectorEnv(4096, "SameStep", **(gym.spec(env_id).kwargs | options))
    envs.reset(seed=0)
    envs.action_space.seed(0)
    for _ in range(8):
        envs.step(envs.action_space.sample())
    return (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=1024)
    parser.add_argument("--seconds", type=float, default=2.0)
    chosen = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    print(f"{chosen.count} environments, {cores} cores, load {np.round(os.getloadavg(), 1).tolist()}")
    print(f"{'':32}{'single':>9}{'lifting':>9}{'1 thread':>10}{f'{cores} threads':>11}{'ratio':>7}")
    for case, (env_id, options, more) in CASES.items():
        today = single_rate(env_id, chosen.seconds, options)
        lifting = single_rate(env_id, chosen.seconds, options | more)
        one, all_cores = (
            batch_rate(env_id, chosen.seconds, options | more, chosen.count, threads)
            for threads in (1, cores)
        )
        print(f"{case:32}{today:9.0f}{lifting:9.0f}{one:10.0f}{all_cores:11.0f}{all_cores / today:7.1f}")
    print(f"4096 FarmToTable-v0: {memory('FarmToTable-v0', {'carry': 'lift'}):.0f} MB")
    print(f"load {np.round(os.getloadavg(), 1).tolist()}")
