"""Returns of known policies on each id, and which seeds are for training.

The numbers are those of `reference_returns.json`, which `python benchmarks/reference_returns.py` writes.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from farm_ar.errors import known_name

HELD_OUT = 10_000_000

TRAINING_SEEDS = range(HELD_OUT)
"""Seeds of episodes to train on, and to choose hyperparameters by."""

TEST_SEEDS = range(HELD_OUT, 2 * HELD_OUT)
"""Seeds of episodes to report; the reference returns are means over the first of them."""

SAME_GAME = ("BlackBox", "Shaped")
"""Variants in which an episode is that of the id without the word, and is scored as there."""


@dataclass(frozen=True)
class Reference:
    """What a policy had on an id.

    Args:
        policy: by name.
        mean: of the returns of the first `episodes` test seeds.
        standard_error: of that mean.
        episodes: how many.
    """

    policy: str
    mean: float
    standard_error: float
    episodes: int


def reference_returns(env_id: str) -> dict[str, Reference]:
    """The returns of known policies on a registered id, by the policies' names.

    A variant that only shows less, or pays otherwise in training, has those of the id that it varies.

    Raises:
        OptionError: there are none of such an id.
    """
    known = _stored()
    plain = re.sub("|".join(SAME_GAME), "", env_id.removeprefix("farm_ar:"))
    found = known[known_name("env_id", plain, known)]
    rows = found["returns"].items()
    return {
        name: Reference(name, row["mean"], row["standard_error"], int(row["episodes"])) for name, row in rows
    }


def best_known(env_id: str) -> Reference:
    """The best of them.

    Raises:
        OptionError: there are none of such an id.
    """
    return max(reference_returns(env_id).values(), key=lambda reference: reference.mean)


@cache
def _stored() -> dict[str, dict[str, dict[str, dict[str, float]]]]:
    text = files("farm_ar.envs").joinpath("reference_returns.json").read_text(encoding="utf-8")
    found: dict[str, dict[str, dict[str, dict[str, float]]]] = json.loads(text)["ids"]
    return found
