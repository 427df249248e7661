"""The page on the environments is made from the class, and tells of all that there is."""

import dataclasses
import inspect
import math
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.config import EnvConfig
from farm_ar.envs.rewards import REWARDS

DOCS = Path(__file__).parents[2] / "docs"

SECTIONS = [
    "Description",
    "Action Space",
    "Observation Space",
    "Rewards",
    "Starting State",
    "Episode End",
    "Physics",
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


def test_the_defaults_of_the_page_are_those_of_the_configuration():
    text = inspect.getdoc(FarmToTableEnv).partition("## Arguments")[2].partition("## ")[0]
    told = {}
    for names, defaults in re.findall(r"^\| (`[^|]*) \| ([^|]*) \|", text, re.MULTILINE):
        names, defaults = re.findall(r"`(\w+)`", names), defaults.replace("`", "").split(", ")
        told |= (
            dict.fromkeys(names, "by id")
            if defaults == ["by id"]
            else dict(zip(names, defaults, strict=True))
        )
    defaults = {field.name: field.default for field in dataclasses.fields(EnvConfig)}
    assert told.keys() == defaults.keys()
    for name, value in told.items():
        wanted = "by id" if name in ("control", "action") else defaults[name]
        assert (value if value == "by id" else eval(value, {"pi": math.pi})) == wanted, name


def test_every_field_of_the_configuration_is_described_where_it_is_declared():
    described = re.findall(
        r"^    (\w+): ", inspect.getdoc(EnvConfig).partition("Args:")[2].partition("Raises:")[0], re.MULTILINE
    )
    assert described == [field.name for field in dataclasses.fields(EnvConfig)]
