"""Writes environments.md: the docstring of the environment's class, and the spaces of what is registered.

Run it after a change of either: python docs/make_environments.py
"""

from inspect import getdoc
from pathlib import Path

import gymnasium as gym
from gymnasium import spaces

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.envs import DeliverToChairEnv, FarmToTableEnv
from farm_ar.envs.references import SAME_GAME, reference_returns

PAGE = Path(__file__).parent / "environments.md"
ENTRY_POINT = "farm_ar.envs:make_farm_to_table"

ABOUT_RETURNS = """
Mean returns and their standard errors over the first episodes of `farm_ar.envs.references.TEST_SEEDS`
(seeds from 10 million on; train on lower ones, `TRAINING_SEEDS`): 200 of each policy, 50 of
`exhaustive`, which tries every choice of an episode of one step and is a bound rather than a policy.
`steered` carries out the analytic policy's plan with a steered hand; `farm-displacement` comes with
farm-ar; `ppo` is what Stable-Baselines3's PPO learns with its defaults in a batch of 32
(`benchmarks/plain_ppo.py --seeds 1 --steps 200000`). `reward_threshold` is 80% of the
way from random to the best of a row. `python benchmarks/reference_returns.py` makes them,
`reference_returns(id)` gives them. A black-box id has those of the id without the word.
""".strip()


def page() -> str:
    """The whole page."""
    names = [name for name, spec in gym.registry.items() if spec.entry_point == ENTRY_POINT]
    summary, _, sections = (getdoc(FarmToTableEnv) or "").partition("\n\n")
    parts = [
        "# Environments",
        f"<!-- Made by docs/{Path(__file__).name}; do not edit. -->",
        summary,
        '```python\nimport gymnasium as gym\n\nenv = gym.make("farm_ar:FarmToTable-v0", jitter="easy")\n```',
        sections,
        "## Registered Environments",
        *(registered(name) for name in names if is_plain(name)),
        "### Variants",
        variants([name for name in names if not is_plain(name)]),
        "## Reference Returns",
        references(names),
        "# The delivery robot",
        getdoc(DeliverToChairEnv) or "",
        "## The Registered Environment",
        registered("DeliverToChair-v0"),
    ]
    return "\n\n".join(parts) + "\n"


def is_plain(name: str) -> bool:
    """Whether an id is no variant of another."""
    return not gym.spec(name).kwargs.keys() & {"action", "knowledge", "reward"}


def registered(name: str) -> str:
    """What is registered under a name: its arguments, its actions, its observations."""
    env = gym.make(name).unwrapped
    arguments = ", ".join(f"{key}={value!r}" for key, value in gym.spec(name).kwargs.items())
    lines = [
        f"### {name}",
        "",
        f"`{type(env).__name__}({arguments})`",
        "",
        "| | space |",
        "|---|---|",
        f"| action | `{env.action_space}` |",
    ]
    observed = env.observation_space
    assert isinstance(observed, spaces.Dict)
    lines += [f"| `{key}` | `{space}` |" for key, space in observed.spaces.items()]
    return "\n".join(lines)


def references(names: list[str]) -> str:
    """What known policies have on each id."""
    stored = {name: reference_returns(name) for name in names if not any(word in name for word in SAME_GAME)}
    policies = list(dict.fromkeys(policy for returns in stored.values() for policy in returns))
    lines = [
        ABOUT_RETURNS,
        "",
        f"| id | {' | '.join(policies)} | `reward_threshold` |",
        "|---" * (len(policies) + 2) + "|",
    ]
    for name, returns in stored.items():
        cells = [
            f"{returns[one].mean:.2f} ± {returns[one].standard_error:.2f}" if one in returns else ""
            for one in policies
        ]
        lines.append(f"| `{name}` | {' | '.join(cells)} | {gym.spec(name).reward_threshold} |")
    return "\n".join(lines)


def variants(names: list[str]) -> str:
    """A row for each id that is another one with further arguments."""
    lines = ["| id | arguments | action | length of the observation |", "|---|---|---|---|"]
    for name in names:
        env = gym.make(name)
        arguments = ", ".join(f"`{key}={value!r}`" for key, value in gym.spec(name).kwargs.items())
        length = spaces.flatdim(env.observation_space)
        lines.append(f"| `{name}` | {arguments} | `{env.action_space}` | {length} |")
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"Wrote {PAGE}")
