"""Environments in a batch beside single ones, in one run: steps a second, ratios, memory of 4096.

    python benchmarks/batched.py [--count 1024] [--seconds 2]

Actions are random. Kernels are compiled and environments played before time is taken. Single ones are
played as they come (`carry="drag"`, the default) and with the options of the batch. Rates are by the clock
and by processor time, which other programs disturb less: of several threads, that of each.
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
    """Steps a second of one environment, resets included: by the clock, by processor time."""
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
    begin, used = time.perf_counter(), time.process_time()
    steps = play(begin + seconds)
    return steps / (time.perf_counter() - begin), steps / (time.process_time() - used)


def batch_rate(env_id, seconds, options, count, threads):
    """The same of a batch on some threads; episodes begin anew within the step."""
    kwargs = gym.spec(env_id).kwargs | options
    envs = BatchedVectorEnv(count, "SameStep", threads, **kwargs)
    envs.reset(seed=0)
    envs.action_space.seed(0)
    actions = [envs.action_space.sample() for _ in range(8)]
    for k in range(8):
        envs.step(actions[k])
    steps, begin, used = 0, time.perf_counter(), time.process_time()
    while time.perf_counter() < begin + seconds:
        envs.step(actions[steps % 8])
        steps += 1
    steps, passed, used = steps * count, time.perf_counter() - begin, time.process_time() - used
    envs.close()
    return steps / passed, threads * steps / used


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
    print(f"4096 FarmToTable-v0: {memory('FarmToTable-v0', {'carry': 'lift'}):.0f} MB")
    print(f"{chosen.count} environments, {cores} cores, load {np.round(os.getloadavg(), 1).tolist()}")
    print(
        f"{'steps/s by the clock (by processor time)':42}{'single':>16}{'lifting':>16}{'1 thread':>18}",
        end="",
    )
    print(f"{f'{cores} threads':>18}{'ratio':>13}")
    for case, (env_id, options, more) in CASES.items():
        rates = [
            single_rate(env_id, chosen.seconds, options),
            single_rate(env_id, chosen.seconds, options | more),
            batch_rate(env_id, chosen.seconds, options | more, chosen.count, 1),
            batch_rate(env_id, chosen.seconds, options | more, chosen.count, cores),
        ]
        print(f"{case:42}", end="")
        for (clock, processor), width in zip(rates, (16, 16, 18, 18), strict=True):
            print(f"{f'{clock:.0f} ({processor:.0f})':>{width}}", end="")
        clock, processor = (rates[3][k] / rates[0][k] for k in range(2))
        print(f"{f'{clock:.0f} ({processor:.0f})':>13}", flush=True)
    print(f"load {np.round(os.getloadavg(), 1).tolist()}")
