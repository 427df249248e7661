"""What a player is worth: between a random player, 0, and the best that is known, 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import trim_mean

from farm_ar.arrays import FloatArray
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
        returns: (..., E) of the player in E episodes.
        random: (E,) of a random player.
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
        random: (E,) of a random player in the same episodes.
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
