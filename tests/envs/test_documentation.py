"""The page on the environments is made from the class, and tells of all that there is."""

import inspect
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.rewards import REWARDS

DOCS = Path(__file__).parents[2] / "docs"

SECTIONS = [
    "Description",
    "Action Space",
    "Observation Space",
    "Rewards",
    "Starting State",
    "Episode End",
    "Arguments",
    "Info",
    "Version History",
]


def test_the_page_is_up_to_date():
    made = runpy.run_path(str(DOCS / "make_environments.py"))["page"]()
    written = (DOCS / "environments.md").read_text(encoding="utf-8")
    assert written == made, "run: python docs/make_environments.py"


def test_the_docstring_has_the_usual_sections_in_the_usual_order():
    assert re.findall(r"^## (.*)$", inspect.getdoc(FarmToTableEnv), re.MULTILINE) == SECTIONS


@pytest.mark.parametrize("name", inspect.signature(FarmToTableEnv).parameters)
def test_every_argument_is_described(name):
    arguments = inspect.getdoc(FarmToTableEnv).partition("## Arguments")[2]
    assert re.search(rf"^\|[^|]*`{name}`[^|]*\|", arguments, re.MULTILINE)


@pytest.mark.parametrize("control", ["move", "hand"])
def test_every_part_of_an_observation_is_described(control):
    text = inspect.getdoc(FarmToTableEnv).partition("## Observation Space")[2].partition("## Rewards")[0]
    for name in FarmToTableEnv(control=control).observation_space.spaces:
        assert f"`{name}`" in text


@pytest.mark.parametrize("reward", REWARDS)
def test_every_info_is_described_with_its_type(reward):
    text = inspect.getdoc(FarmToTableEnv).partition("## Info")[2].partition("## ")[0]
    described = dict(re.findall(r"^\| `([^`]+)`[^|]* \| ([^|]*) \|", text, re.MULTILINE))
    _, info = FarmToTableEnv(reward=reward).reset(seed=0)
    terms = {name for name in info if name.startswith("reward/")} - {"reward/effort"}
    assert {"reward/identity" if name in terms else name for name in info} == set(described)
    for name, value in info.items():
        wanted = described["reward/identity" if name in terms else name]
        assert wanted.endswith(value.dtype.name if isinstance(value, np.ndarray) else type(value).__name__)
