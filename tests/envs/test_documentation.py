"""The page on the environments is made from the class, and tells of all that there is."""

import dataclasses
import inspect
import math
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv, generator
from farm_ar.envs.config import EnvConfig
from farm_ar.envs.rewards import REWARDS
from farm_ar.game_logic import farm_game, headset, visibility
from farm_ar.game_logic.animals import routes
from farm_ar.game_logic.physics import gripper, limits, space, trajectory

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


@pytest.mark.parametrize(
    "said",
    [
        f"friction {space.FRICTION} between surfaces",
        f"{1000 * space.SKIN:.0f} mm wider on every side",
        f"a disc of {100 * gripper.HAND_RADIUS:.0f} cm radius",
        f"moves at {gripper.MAX_HAND_SPEED} m/s and pi rad/s at most",
        f"may go {gripper.HAND_ROOM} m beyond the table",
        f"comes in above the buildings at z = {trajectory.ENTRY} m",
        f"at {trajectory.CARRY_SPEED} m/s and pi rad/s at most",
        f"starts at (width / 2, {farm_game.HAND_WAITS_AT_Z} m)",
        f"its footprint within {100 * gripper.REACH:.0f} cm",
        f"out of view and empty for {farm_game.HAND_AWAY_S:g} s",
        f"{200 * visibility.ARM_HALF_WIDTH_M:.0f} cm wide and {100 * visibility.ARM_HEIGHT_M:.0f} cm high",
        f"to z = {visibility.ELBOW_Z} m",
        f"Animals run at {farm_game.ANIMAL_SPEED_M_S} m/s",
        f"leaving the shed for {farm_game.WARM_UP_S:.0f} s",
        f"on lane j modulo {routes.ROUTES}",
        f"a normal random number of SD {100 * routes.PATH_SPREAD_M:.0f} cm",
        f"({limits.SLIDE:.3f} s x velocity, for what is held {limits.BRAKE:.2f} s²/m x velocity²)",
        f"centres {generator.HARD_SEPARATION_M} m apart (or {generator.ROOM_EACH} x the root",
        f"stay {1000 * generator.GAP_M:.0f} mm apart",
        f"the first of up to {generator.TRIES} poses",
        f"and after {generator.RESTARTS} the layout is the scene's own",
        f"{headset.EYE_HEIGHT_M} m above the table",
        f"at most {headset.RANGE_M:.0f} m away",
        f"one of {generator.PLACES_ON_PATH} equally spaced poses",
    ],
)
def test_constants_of_the_page_are_those_of_the_code(said):
    assert said in " ".join(inspect.getdoc(FarmToTableEnv).split())
