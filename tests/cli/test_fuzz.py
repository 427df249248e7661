"""Whatever stands in a file, an option or a typed line: the program ends well, or in one line that says why.

500 inputs by default, 10 000 with `FARM_AR_TESTS=all`; `FARM_AR_FUZZED` says another number.
"""

import csv
import faulthandler
import io
import json
import os
import random
import re
import time
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import settings
from typer.testing import CliRunner

from farm_ar.cli import app
from farm_ar.errors import InputError

TRIED = int(os.environ.get("FARM_AR_FUZZED", 10 * settings().max_examples))
LIMIT_S = 20.0
ONE_LINE = re.compile(r"(\w*Error: .*)|(Interrupted\.)")
PROGRESS = re.compile(r"(?!\w*Error: ).* \.\.\.")
HEADER = "id,category,x,z,yaw_deg,w,h,d"

TEXTS = [
    *("", "0", "-1", "1", "0.5", "1e6", "1e7", "1e308", "1e999", "nan", "inf", "1_0", "\u0661", "\xb2"),
    *("a", "farm", "L1", "no.json", "scene.json", "snapshot.json", "table.csv", ".", "/dev/zero"),
    *("5,4", "5,4,3", "1,2,3,4,5", "0,0,0", "1_0,2", "1;2", "0,0", "1e7,1", "-1,1", "nan,1", "1,2,1e300"),
    *("spatial", "likelihood", "relational", "nearest", "no:where", ":", "\x1b[31m", "\udcff"),
    *("lsap", "mip", "d1", "coop=2", "coop=\xb2", "coop=-1", "x=1", "out.svg", "out.png", "out.txt"),
    *("9" * 20, "pipe.json", "blue-coop", "cyan-hutch"),
]
"""What options are given."""

OPTIONS = {
    "identify": (
        *("--scene", "--snapshot", "--room", "--camera", "--reid", "--threshold", "--weights", "--solver"),
        *("--min-confidence", "--confusion", "--explain", "--plot", "--json", "--gate"),
    ),
    "scenes show": ("", "--out", "--camera", "--room", "--json", "--snapshot"),
    "scenes validate": ("", "--room"),
    "stress-replay": ("", ""),
    "replay": ("",),
    "schema": ("",),
    "play-script": ("", "--reid", "--json"),
}
KINDS = ("scene", "scene", "snapshot", "snapshot", "trace", "script", "failures", "csv", "csv", "options")
FLAGS = ("--json", "--gate", "--snapshot")


def test_whatever_is_put_in_ends_in_one_line_or_well(documents, mutate, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe.json")
    rng = random.Random(int(os.environ.get("FARM_AR_FUZZ_SEED", "0")))
    for kind, document in documents.items():
        Path(f"{kind}.json").write_text(json.dumps(document))
    Path("table.csv").write_text(table(documents["scene"]))
    for reid in ("spatial", "likelihood", "relational", "nearest", "distance"):  # compiled before time counts
        command = ["identify", "--scene", "scene.json", "--snapshot", "snapshot.json", "--reid", reid]
        assert CliRunner().invoke(app, command).exit_code == 0
    found = []
    for number in range(TRIED):
        arguments, typed = an_input(documents, mutate, rng)
        begin = time.process_time()
        faulthandler.dump_traceback_later(10 * LIMIT_S, exit=True)
        result = CliRunner().invoke(app, arguments, input=typed, prog_name="farm-ar")
        faulthandler.cancel_dump_traceback_later()
        seconds = time.process_time() - begin
        wrong = what_is_wrong(arguments, result)
        if wrong or seconds > LIMIT_S:
            kept = [Path(name).read_bytes()[:3000] for name in arguments if name.startswith("fuzzed")]
            found.append(f"input {number}, {seconds:.1f} s, {arguments}, {typed!r}: {wrong}\n{kept}")
    assert not found, "\n".join(found[:10])


def test_whatever_a_recipe_says_is_read_or_refused(mutate, tmp_path):
    recipes = pytest.importorskip("farm_ar.agents.training.recipes")
    rng = random.Random(0)
    given = Path(recipes.__file__).parent / "recipes" / "ppo.yml"
    document = yaml.safe_load(given.read_text(encoding="utf-8"))
    file = tmp_path / "fuzzed.yml"
    for _ in range(max(TRIED // 10, 50)):
        file.write_bytes(broken(yaml.safe_dump(mutate(document, rng)).encode("utf-8", "surrogatepass"), rng))
        said = ""
        try:
            recipes.load_recipe("ppo", "FarmToTable-v0", file)
        except InputError as problem:
            said = str(problem)
        assert said.isprintable()


def an_input(documents: dict[str, Any], mutate: Any, rng: random.Random) -> tuple[list[str], str | None]:
    """A command whose file, options or typed lines may have anything in them."""
    if rng.random() < 0.02:
        return ["play", "--out", "out"], some_moves(rng)
    kind = rng.choice(KINDS)
    if kind == "options":
        return some_options(rng), None
    if kind == "csv":
        text = some_table(documents["scene"], rng)
        Path("fuzzed.csv").write_bytes(broken(text.encode("utf-8", "replace"), rng))
        scene = ["identify", "--scene", "fuzzed.csv", "--room", "5,4", "--snapshot", "snapshot.json"]
        seen = ["identify", "--scene", "scene.json", "--snapshot", "fuzzed.csv", "--camera", "1,1,1,90,3"]
        return rng.choice((["scenes", "validate", "fuzzed.csv", "--room", "5,4"], scene, seen)), None
    document = mutate(documents[kind], rng)
    text = as_toml(document) if kind == "script" else json.dumps(document)
    name = "fuzzed.toml" if kind == "script" else "fuzzed.json"
    Path(name).write_bytes(broken(text.encode("utf-8", "surrogatepass"), rng))
    reid = rng.choice(("spatial",) * 6 + ("likelihood", "relational", "nearest", "distance"))
    if kind == "scene":
        ways = [["scenes", "validate", name], ["scenes", "show", name, "--json"]] * 2
        ways += [["identify", "--scene", name, "--snapshot", "snapshot.json", "--reid", reid]] * 4
        ways += [["scenes", "show", name, "--out", "out.png"]]
        return rng.choice(ways), None
    if kind == "snapshot":
        command = ["identify", "--scene", "scene.json", "--snapshot", name, "--reid", reid]
        return command + rng.choice(([], [], ["--json"], ["--explain", "d1"], ["--plot", "out.png"])), None
    if kind == "trace":
        return ["replay", name], None
    if kind == "failures":
        return ["stress-replay", name, "0"], None
    return ["play-script", name], None


def some_options(rng: random.Random) -> list[str]:
    """A command with some of its options, each with any value."""
    command = rng.choice(list(OPTIONS))
    given = ["--scene", "scene.json", "--snapshot", "snapshot.json"] if command == "identify" else []
    for option in rng.sample(OPTIONS[command], rng.randint(1, min(3, len(OPTIONS[command])))):
        given += [option] if option else []
        given += [] if option in FLAGS else [rng.choice(TEXTS)]
    return [*command.split(), *given]


def some_moves(rng: random.Random) -> str:
    """Lines that a player types."""
    words = ["to", "by", "turn", "look", "where", "end", "0.3", "-0.1", *TEXTS]
    lines = [["blue-coop", "by", "-0.1", "0.05"], ["look"]]
    lines += [[rng.choice(words) for _ in range(rng.randint(1, 5))] for _ in range(3)]
    return "".join(" ".join(line).replace("\udcff", "") + "\n" for line in lines)


def some_table(scene: dict[str, Any], rng: random.Random) -> str:
    """A table in which cells, lines or separators are others."""
    rows = [line.split(",") for line in table(scene).splitlines()]
    for _ in range(rng.randint(1, 3)):
        row = rng.choice(rows)
        row[rng.randrange(len(row))] = rng.choice(TEXTS)
    return "\n".join(rng.choice((",", ",", ",", ";", "\t")).join(row) for row in rows)


def table(scene: dict[str, Any]) -> str:
    """The objects of a scene as a CSV table."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER.split(","))
    for one in scene["objects"]:
        writer.writerow([one[name] for name in ("label", "category", "x", "z", "yaw_deg")] + one["size_whd"])
    return text.getvalue()


def broken(data: bytes, rng: random.Random) -> bytes:
    """The bytes of a file, now and then cut off, with a byte changed, doubled, or in another encoding."""
    way, place = rng.random(), rng.randrange(len(data) + 1)
    if way < 0.04:
        return data[:place]
    if way < 0.08:
        return data[:place] + bytes([rng.randrange(256)]) + data[place + 1 :]
    if way < 0.09:
        return data + data
    return data.decode("utf-8", "replace").encode("utf-16") if way < 0.1 else data


def as_toml(value: Any, top: bool = True) -> str:
    """A document as TOML, tables inline."""
    if isinstance(value, dict) and top:
        return "".join(f"{json.dumps(name)} = {as_toml(item, False)}\n" for name, item in value.items())
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {as_toml(v, False)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(as_toml(item, False) for item in value) + "]"
    if isinstance(value, float) and value != value:
        return "nan"
    return "inf" if value == float("inf") else "null" if value is None else json.dumps(value)


NO_PAGE = "The moves come from the input, which is no terminal, so there is no page"
"""What `farm-ar play` says where it is given moves, beside what comes of them."""


def what_is_wrong(arguments: list[str], result: Any) -> str:
    """What an end of the program breaks of what it promises; nothing if all is well."""
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        return f"{result.exception!r}, {result.exc_info}"
    allowed = (0, 1, 2) if arguments[0] in ("replay", "stress-replay") else (0, 2)
    if result.exit_code not in allowed:
        return f"exit code {result.exit_code}"
    if not all(line.isprintable() for line in (result.stdout + result.stderr).split("\n")):
        return f"it steers the terminal: {result.output!r}"
    said = [line for line in result.stderr.splitlines() if not PROGRESS.fullmatch(line)]
    lines = [line for line in said if not line.startswith("Warning: ") and line != NO_PAGE]
    if result.exit_code == 2 and not (len(lines) == 1 and ONE_LINE.fullmatch(lines[0])):
        return f"not one line: {result.stderr!r}"
    return "" if result.exit_code == 2 or not lines else f"an error beside success: {result.stderr!r}"
