"""What each command writes and prints for programs, its exit code, and the mistakes that it names."""

from __future__ import annotations

import contextlib
import csv
import hashlib
import json
import os
import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from typer.testing import CliRunner

from farm_ar.cli import app
from farm_ar.errors import InputError

DATA = Path(__file__).parents[2] / "examples" / "data"
SCENE, SEEN = f"{DATA}/before.json", f"{DATA}/seen.json"
SCENE_CSV, SEEN_CSV = f"{DATA}/before.csv", f"{DATA}/seen.csv"
ROOM, CAMERA = "--room=5,4", "--camera=3.6,0.3,-45,90,4"

MEASURED = re.compile(r"second|time|machine|commands|versions|python|version|pace|note|title|what|how")
"""Names of values that a clock, a machine or prose is behind."""

MOVES = """cyan-hutch to 0.42 0.34
blue-coop by -0.1 0.05 turn 30
look
nonsense
yellow-coop turn 40
where
look
end
"""
IDENTIFY = ("identify", "--scene", SCENE, "--snapshot", SEEN, "--json")
STRESS = ("stress", "--jitter", "easy", "--cases", "2", "--queries", "60", "--out", "s")

COMMANDS: dict[str, list[tuple[str, ...]]] = {
    "scenes": [
        ("scenes", "list"),
        *(("scenes", "show", name, "--json") for name in ("L1", "H2", "farm", "lab")),
        ("scenes", "show", "L1", "--snapshot", "--camera", "2,2,30"),
        ("scenes", "show", "M1", "--out", "m1.svg", "--camera", "2,2,30"),
        ("scenes", "show", SCENE_CSV, ROOM, "--json"),
        ("scenes", "validate", SCENE),
        ("scenes", "schema"),
    ],
    "identify": [
        *((*IDENTIFY, "--reid", name) for name in
          ("spatial", "likelihood", "relational", "nearest", "distance", "last-known")),
        *((*IDENTIFY, *options.split()) for options in
          ("--threshold .5", "--threshold 0", "--weights 3,1", "--gate", "--no-gate", "--solver mip",
           "--reid likelihood --min-confidence .9")),
        ("identify", "--scene", SCENE_CSV, ROOM, "--snapshot", SEEN_CSV, CAMERA, "--json"),
        (*IDENTIFY[:-1], "--plot", "a.svg"),
        (*IDENTIFY, "--explain", "d1"),
    ],
    "design": [
        ("design", "--seed", "0", "--save", "d.json", "--plot", "d.svg"),
        ("design", "--scene", "L1", "--objects", "chair=6", "--save", "d1.json", "--plot", "d1.svg"),
    ],
    "play": [("play", "--seed", "3", "--out", "p", "--save", "p.toml"),
             ("play-script", "p.toml", "--json"),
             ("play-script", "demonstration-1", "--json", "--reid", "likelihood")],
    "demo": [("demo", "demonstration-2", "--no-gif", "--out", "f")],
    "reproduce": [
        ("reproduce", "all", "--quick", "--layouts", "1", "--workers", "1", "--out", "r"),
        ("reproduce", "fig5", "--quick", "--layouts", "1", "--workers", "1", "--out", "r"),
        ("sweeps", "status", "r/sweeps.sqlite", "--json"),
        ("sweeps", "export", "r/sweeps.sqlite", "--sweep", "fig5", "--out", "fig5-rows.csv"),
        ("sweeps", "export", "r/sweeps.sqlite"),
    ],
    "relations": [("reproduce", "relations", "--quick", "--layouts", "1", "--workers", "1", "--out", "r")],
    "stress farm": [(*STRESS, "--attack", "all"), ("stress-replay", "s/stress.json", "1"),
                    ("stress-replay", "s/stress.json", "9999")],
    "stress compare": [(*STRESS, "--scene", "L1", "--compare", "spatial,likelihood,distance"),
                       (*STRESS, "--scene", "L1", "--compare", "spatial,likelihood,distance",
                        "--fail-under", "9")],
    "stress own": [(*STRESS, "--reid", "farm_ar.reid:NearestReid", "--attack", "random,greedy")],
    "train": [
        ("train", "t", "--steps", "32", "--eval-every", "32", "--eval-episodes", "1", "--recipe", "tiny.yml",
         "--no-progress"),
        ("train", "t", "--resume", "--steps", "96", "--no-progress"),
        ("evaluate", "t", "--which", "last", "--episodes", "2", "--beside", "greedy", "--json"),
        ("evaluate", "farm-slot", "--episodes", "2", "--beside", "analytic,greedy,constant", "--json"),
    ],
}  # fmt: skip
TINY = """FarmToTable-v0:
  n_envs: 2
  policy: ObjectPolicy
  policy_kwargs: {width: 16, pair_width: 8, rounds: 1}
  env_kwargs: {play_seconds: 0.5, action: slot}
  n_steps: 16
  batch_size: 32
  n_epochs: 1
"""
FILES = {"SCENE": SCENE, "SEEN": SEEN, "SCENE_CSV": SCENE_CSV, "SEEN_CSV": SEEN_CSV}
WRONG = Path(__file__).with_name("wrong.txt").read_text().splitlines()


def commands(lines: list[tuple[str, ...]]) -> dict[str, Any]:
    """What a series of commands in one empty folder gives."""
    values: dict[str, Any] = {}
    with _folder() as folder:
        (folder / "tiny.yml").write_text(TINY)
        known = {"tiny.yml": 0}
        for number, line in enumerate(lines):
            for key, value in _run(line, folder).items():
                values[f"{number} {key}"] = value
        for path in sorted(folder.rglob("*")):
            name = path.relative_to(folder).as_posix()
            if path.is_file() and name not in known and not re.search(r"tensorboard|\d{9}/|sqlite-", name):
                values |= {f"{name} {key}".strip(): value for key, value in _content(path).items()}
    return values


def mistake(line: str) -> dict[str, Any]:
    """The exit code of a wrong command, and what the error names."""
    with _folder() as folder:
        (folder / "tiny.yml").write_text(TINY)
        return {name: v for name, v in _run(tuple(line.split()), folder).items() if name != "output"}


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    here = Path.cwd()
    with TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            yield Path(folder)
        finally:
            os.chdir(here)


def _run(line: tuple[str, ...], folder: Path) -> dict[str, Any]:
    shown: list[InputError] = []
    plain = InputError.__str__

    def noted(self: InputError) -> str:
        shown.append(self)
        return plain(self)

    InputError.__str__ = noted  # type: ignore[method-assign]
    try:
        result = CliRunner().invoke(app, list(line), prog_name="farm-ar", input=MOVES, env={"COLUMNS": "160"})
    finally:
        InputError.__str__ = plain  # type: ignore[method-assign]
    values: dict[str, Any] = {"exit": result.exit_code}
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        values["raised"] = type(result.exception).__name__
    if result.exit_code == 2 and shown:
        last = shown[-1]
        named = [type(last).__name__, str(last.source), last.field, repr(last.got)[:160]]
        values["error"] = [re.sub(r"/[\w/.-]*/", "", text.replace(str(folder), "")) for text in named]
    elif result.exit_code == 2:
        values["error"] = re.findall(r"'(-*[\w-]+)'", result.stderr)[:1]
    elif result.stdout[:1] in "[{" and result.stdout and "schema" not in line:
        values |= {f"output {key}": value for key, value in _flat(json.loads(result.stdout)).items()}
    elif result.stdout.count(",") > 3 and "export" in line:
        values |= {f"output {key}": value for key, value in _table(result.stdout).items()}
    return values


def _content(path: Path) -> dict[str, Any]:
    """What a file says to programs."""
    if "times" in path.name:
        return {}
    if path.suffix == ".csv":
        return _table(path.read_text())
    if path.suffix in (".json", ".jsonl") and path.name != "run.json":
        return _flat(json.loads(path.read_text()))
    if path.suffix in (".png", ".toml"):
        return {"digest": hashlib.sha256(path.read_bytes()).hexdigest()[:16]}
    if path.suffix == ".svg":
        return {"elements": np.array([path.read_text().count(f"<{tag} ") for tag in ("path", "use", "g")])}
    return {"": "is there"}


def _table(text: str) -> dict[str, Any]:
    rows = list(csv.reader(text.splitlines()))
    return {
        "columns": rows[0],
        **_flat([dict(zip(rows[0], map(_value, row), strict=True)) for row in rows[1:]]),
    }


def _value(cell: str) -> Any:
    try:
        return json.loads(cell)
    except ValueError:
        return cell


def _flat(value: Any) -> dict[str, Any]:
    """The numbers of JSON values by name, as arrays, and the texts by name, or a digest of many."""
    numbers: dict[str, list[float]] = {}
    texts: dict[str, list[str]] = {}

    def visit(item: Any, name: str) -> None:
        if isinstance(item, dict):
            for key, inner in item.items():
                if not MEASURED.search(key):
                    visit(inner, key)
        elif isinstance(item, list):
            for inner in item:
                visit(inner, name)
        elif isinstance(item, int | float):
            numbers.setdefault(name, []).append(float(item))
        else:
            texts.setdefault(f"{name} texts", []).append(str(item))

    visit(value, "")
    found: dict[str, Any] = {name: np.array(row) for name, row in numbers.items()}
    for name, row in texts.items():
        digest = hashlib.sha256("\n".join(row).encode()).hexdigest()[:16]
        found[name] = row if len(row) < 40 else [f"{len(row)} of them", *row[:10], digest]
    return found


CASES: dict[str, Callable[[], dict[str, Any]]] = {
    **{f"command {name}": partial(commands, lines) for name, lines in COMMANDS.items()},
    **{f"wrong {line}": partial(mistake, line.format(**FILES)) for line in WRONG},
}
