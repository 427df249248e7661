"""Held-out episodes, and what several trainings of one kind score there beside other policies."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from scipy.stats import trim_mean

from farm_ar.agents.policies import (
    CONSTANT,
    POLICIES,
    Policy,
    best_constant,
    check_request,
    play_episode,
    shipped,
)
from farm_ar.agents.policies.trained import load_shipped, policy_and_env
from farm_ar.arrays import FloatArray
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.config import EnvConfig
from farm_ar.envs.references import TEST_SEEDS
from farm_ar.errors import OptionError

RESAMPLES = 2000


@dataclass(frozen=True)
class Score:
    """A score with its interval.

    Args:
        value: interquartile mean over the seeds.
        low: lower end of the 95% interval.
        high: its upper end.
    """

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.value:.2f} [{self.low:.2f}, {self.high:.2f}]"


def interquartile_mean(values: FloatArray) -> FloatArray:
    """Mean of the middle half of the values along the first axis (Agarwal et al. 2021, as in rliable).

    Args:
        values: (R, ...); a quarter of R, rounded down, is left out at either end.
    """
    return np.asarray(trim_mean(values, 0.25, axis=0), dtype=np.float64)


def normalized(returns: FloatArray, random: FloatArray, best: FloatArray) -> FloatArray:
    """(mean return - random's) / (best's - random's) over the same episodes.

    Args:
        returns: (..., E) of the policy in E episodes.
        random: (E,) of a random policy.
        best: (E,) the best that is known of each episode.

    Returns:
        (...) scores.

    Raises:
        OptionError: the best is no better than random.
    """
    low, high = random.mean(-1), best.mean(-1)
    if not np.all(high > low):
        raise OptionError("best", f"must be better than random's {np.min(low):.3f}", float(np.min(high)))
    scores: FloatArray = (returns.mean(-1) - low) / (high - low)
    return scores


def score(returns: FloatArray, random: FloatArray, best: FloatArray, rng: np.random.Generator) -> Score:
    """The interquartile mean of the seeds' scores, with a bootstrap interval over seeds and episodes.

    Args:
        returns: (R, E) of R trainings in E episodes.
        random: (E,) of a random policy in the same episodes.
        best: (E,) the best that is known of each of them.
        rng: draws the resamples.
    """
    value = float(interquartile_mean(normalized(returns, random, best)))
    runs, episodes = returns.shape
    counts = rng.multinomial(episodes, np.full(episodes, 1 / episodes), size=RESAMPLES) / episodes
    low, high = counts @ random, counts @ best
    drawn_run = rng.integers(runs, size=(runs, RESAMPLES))
    some = high > low  # in a resample where random is the best, there is no score
    of_run = (returns @ counts[some].T - low[some]) / (high - low)[some]
    drawn = np.take_along_axis(of_run, drawn_run[:, some], axis=0)
    ends = np.quantile(interquartile_mean(drawn), [0.025, 0.975])
    return Score(value, float(ends[0]), float(ends[1]))


USUAL = ("analytic", "greedy")
"""The policies that are compared with by default."""

TRIES, EPISODES_OF_A_TRY = 40, 10
"""How many constant policies are tried, and in how many episodes each."""


@dataclass(frozen=True, eq=False)
class Played:
    """What a policy did in E episodes.

    Args:
        returns: (E,) the sums of rewards.
        wrong_labels: (E,) at the end.
        effort: (E,) of all moves.
    """

    returns: FloatArray
    wrong_labels: FloatArray
    effort: FloatArray

    def as_row(self) -> dict[str, float]:
        """Means, and the standard error of the return."""
        error = self.returns.std(ddof=1) / np.sqrt(len(self.returns)) if len(self.returns) > 1 else 0.0
        return {
            "return": float(self.returns.mean()),
            "standard_error": float(error),
            "wrong_labels": float(self.wrong_labels.mean()),
            "effort": float(self.effort.mean()),
        }


def held_out(episodes: int, first: int = 0) -> range:
    """The seeds of held-out episodes: of `TEST_SEEDS`; trainings and their evaluations use lower ones."""
    return TEST_SEEDS[first : first + episodes]


def play(
    env: FarmToTableEnv, policy: Policy, seeds: Sequence[int], done: Callable[[], None] = lambda: None
) -> Played:
    """Play an episode for each seed; `done` is called after each."""
    episodes = []
    for seed in seeds:
        episodes.append(play_episode(env, policy, seed))
        done()
    return Played(
        np.array([e.total for e in episodes]),
        np.array([e.wrong_labels for e in episodes], dtype=np.float64),
        np.array([e.effort for e in episodes]),
    )


def best_found(played: Sequence[Played]) -> FloatArray:
    """(E,) the best return that any of the policies had in each episode."""
    best: FloatArray = np.max([one.returns for one in played], axis=0)
    return best


@dataclass(frozen=True, eq=False)
class Comparison:
    """Several policies in the same E episodes.

    Args:
        played: what each did, by name; the trainings that differ in the seed under one name.
        best: (E,) the best return that is known of each episode.
        seed: of the resampling.
    """

    played: Mapping[str, Sequence[Played]]
    best: FloatArray
    seed: int = 0

    def scores(self) -> dict[str, Score]:
        """The score of each."""
        (random,) = self.played["random"]
        return {
            name: score(
                np.array([one.returns for one in played]),
                random.returns,
                self.best,
                np.random.default_rng(self.seed),
            )
            for name, played in self.played.items()
        }

    def rows(self) -> list[dict[str, Any]]:
        """A row for each."""
        values = self.scores()
        return [
            {"policy": name, **_together(played).as_row(), "runs": len(played), "score": values[name]}
            for name, played in self.played.items()
        ]


def compare(
    runs: Sequence[str],
    beside: Sequence[str] | None,
    episodes: int,
    which: str = "best",
    arguments: Mapping[str, Any] | None = None,
    seed: int = 0,
    trust: bool = False,
    watch: Callable[[str, float], None] = lambda what, share: None,
) -> Comparison:
    """Play the same held-out episodes with trained policies and with others.

    Args:
        runs: folders of trainings that differ in the seed, or the name of a policy that comes with farm-ar.
        beside: names of other policies, "constant" and those that come with farm-ar among them; a random one
            is always there. None for the usual ones, as far as they can act here.
        episodes: how many.
        which: "best" or "last" of each run.
        arguments: of the environment, in place of the training's.
        seed: of the policies that need one.
        trust: whether the runs may load code of whoever wrote them, as in `load_policy`.
        watch: is called after each episode with what plays, its progress, and the share of all that is done.

    Raises:
        RunError: a folder is no run's.
        OptionError: a policy is not known, or cannot act here; or the runs are of several environments.
    """
    check_request(runs, beside, which, arguments or {})
    seeds, pairs = held_out(episodes), [policy_and_env(run, which, arguments, trust) for run in runs]
    env = pairs[0][1]
    for run, (_, other) in zip(runs, pairs, strict=True):
        every = [field.name for field in fields(EnvConfig)]
        differing = [n for n in every if getattr(other.config, n) != getattr(env.config, n)]
        if differing:
            expected = f"must be of the same environment with the same arguments as {runs[0]}"
            raise OptionError("run", f"{expected}, not another {' and '.join(differing)}", run)
    others: dict[str, Sequence[Played]] = {}
    names = list(dict.fromkeys([*(USUAL if beside is None else beside), "random"]))
    total, count = (len(names) + len(runs)) * episodes, itertools.count(1)

    def counted(name: str) -> Callable[[], None]:
        own = itertools.count(1)
        return lambda: watch(f"{name}: episode {next(own)} of {episodes}", next(count) / total)

    for name in names:
        try:
            rival = _other(name, env, np.random.default_rng(seed))
            others[name] = [play(env, rival, seeds, counted(name))]
        except OptionError as problem:
            if beside is None:
                continue
            raise OptionError("beside", f"must be policies that can act here ({problem})", name) from None
    played = {"trained": [play(env, one, seeds, counted("trained")) for one, _ in pairs], **others}
    best = best_found([one for several in played.values() for one in several])
    return Comparison(played, best, seed)


def _other(name: str, env: FarmToTableEnv, rng: np.random.Generator) -> Policy:
    """A policy to stand beside; the best constant one is looked for in episodes of the training."""
    if name == CONSTANT:
        return best_constant(env, rng, TRIES, range(EPISODES_OF_A_TRY), env.config.moves)
    return load_shipped(name) if name in shipped() else POLICIES[name](rng)


def _together(played: Sequence[Played]) -> Played:
    """The means over several trainings, episode by episode."""
    return Played(
        np.mean([one.returns for one in played], axis=0),
        np.mean([one.wrong_labels for one in played], axis=0),
        np.mean([one.effort for one in played], axis=0),
    )
