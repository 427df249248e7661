"""Numbers on the command line: only digits and a point are numbers, and each has its limits."""

import inspect
import typing
from typing import Annotated, get_args, get_origin

import pytest
import typer

from farm_ar.cli import app
from farm_ar.cli.experiments import app as sweeps
from farm_ar.cli.scenes import app as scenes

COMMANDS = {
    command.name or command.callback.__name__: command.callback
    for group in (app, scenes, sweeps)
    for command in group.registered_commands
}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_number_of_a_command_is_read_strictly(name):
    hints = typing.get_type_hints(COMMANDS[name], include_extras=True)
    for option in inspect.signature(COMMANDS[name]).parameters:
        hint = hints[option]
        kind = get_args(hint)[0] if get_origin(hint) is Annotated else hint
        if not {int, float} & {kind, *get_args(kind)}:
            continue
        (info,) = (one for one in get_args(hint) if hasattr(one, "parser"))
        assert info.parser is not None, option
        for text in ("1_0", "\u0661", "nan", "inf", "1e400", "9" * 21, "-" + "9" * 21, "", "0x1"):
            with pytest.raises(typer.BadParameter, match="must be a"):
                info.parser(text)


@pytest.mark.parametrize("seed", ["-1", "\xb2", "1_0", "9" * 20, "1.0"])
def test_a_seed_out_of_its_limits_is_one_line(mistake, seed):
    assert mistake("design", "--seed", seed) == (
        f"Error: Invalid value for '--seed': must be a whole number from 0 to {2**63 - 1}, got {seed!r}. "
        "Try 'farm-ar design --help'."
    )


@pytest.mark.parametrize("objects", ["coop=\xb2", "coop=1_0", "coop=-1", "coop=1,coop=2", "coop"])
def test_how_many_objects_are_designed_is_digits(mistake, objects):
    line = mistake("design", "--objects", objects)
    assert line.startswith("OptionError: --objects: must be KIND=N,KIND=N,... with each kind once, got ")


def test_more_objects_than_a_design_can_compare_are_refused_at_once(mistake):
    line = mistake("design", "--objects", "coop=400,hutch=101")
    assert line == "OptionError: --objects: must be at most 500 in all, got 'coop=400,hutch=101'"


@pytest.mark.parametrize(
    ("option", "value"),
    [("--weights", "1_0,1"), ("--weights", "\u0661,1"), ("--threshold", "0_1"), ("--min-confidence", "0_5")],
)
def test_no_option_takes_an_underscore_for_a_digit(mistake, before, seen, option, value):
    line = mistake("identify", "--scene", before, "--snapshot", seen, option, value)
    assert line.split(", got ")[1].startswith(repr(value))


def test_rooms_and_cameras_take_no_underscores(mistake, before, seen):
    table = before.with_suffix(".csv")
    assert "--room: must be" in mistake("identify", "--scene", table, "--room", "5_0,4", "--snapshot", seen)
    camera = ("--snapshot", seen.with_suffix(".csv"), "--camera", "3_6,0.3,-45,90,4")
    assert "--camera: must be" in mistake("identify", "--scene", table, "--room", "5,4", *camera)
