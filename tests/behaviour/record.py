"""Records what the package does, and compares it with a recording made earlier.

    python tests/behaviour/record.py record OUT.npz [PATTERN]
    python tests/behaviour/record.py compare OLD.npz [PATTERN]

With PATTERN, `record` records those cases of an existing file anew and keeps the others as they are.

A case (of `episodes`, `answers`, `commands`, `mistakes`) gives named values: arrays of numbers, held to a
tolerance, and JSON values, held exactly. PATTERN, a regular expression, chooses cases by name. Cases of the
authors' layouts need FARM_AR_PAPER_SCENES; without it they are left out of either.
"""

from __future__ import annotations

import json
import math
import os
import re
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

TOLERANCE, REWARD_TOLERANCE = 1e-6, 1e-12
"""Largest difference of a number, absolute up to 1 and relative beyond; and of a reward."""

NEW_CASE = "a case of its own now"
"""What is said of a case that the recording lacks."""

Values = Mapping[str, Any]
Case = Callable[[], Values]


def all_cases() -> dict[str, Case]:
    """Every case by name, in order."""
    import answers
    import commands
    import episodes
    import mistakes

    return {**episodes.CASES, **answers.cases(), **mistakes.cases(), **commands.CASES}


def record(pattern: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """The values of each case whose name matches; a line of progress every ten seconds."""
    chosen = {name: case for name, case in all_cases().items() if re.search(pattern, name)}
    began = said = time.monotonic()
    for number, (name, case) in enumerate(chosen.items()):
        if time.monotonic() - said > 10:
            said = time.monotonic()
            print(f"{number} of {len(chosen)} cases, {said - began:.0f} s: {name}", file=sys.stderr)
        try:
            values = dict(case())
        except Exception as problem:
            values = {"raised": f"{type(problem).__name__}: {problem}"[:300]}
        yield name, values


def save(recording: Mapping[str, Values], path: Path) -> None:
    """Write a recording as one file: arrays one after the other, by type, and the rest as JSON."""
    index: dict[str, Any] = {}
    blocks: dict[str, list[np.ndarray]] = {}
    for name, values in recording.items():
        index[name] = {}
        for key, value in values.items():
            if isinstance(value, np.ndarray):
                blocks.setdefault(str(value.dtype), []).append(value.reshape(-1))
                value = {"dtype": str(value.dtype), "shape": value.shape}
            index[name][key] = value
    text = np.frombuffer(json.dumps(index, indent=0).encode(), dtype=np.uint8)
    np.savez_compressed(path, index=text, **{d: np.concatenate(b) for d, b in blocks.items()})


def load(path: Path) -> dict[str, dict[str, Any]]:
    """A recording that `save` wrote, by case."""
    with np.load(path) as file:
        recording: dict[str, dict[str, Any]] = json.loads(file["index"].tobytes())
        blocks = {name: file[name] for name in file.files if name != "index"}
    begin = dict.fromkeys(blocks, 0)
    for values in recording.values():
        for key, value in values.items():
            if isinstance(value, dict) and value.keys() == {"dtype", "shape"}:
                dtype, end = value["dtype"], begin[value["dtype"]] + math.prod(value["shape"])
                values[key] = blocks[dtype][begin[dtype] : end].reshape(value["shape"])
                begin[dtype] = end
    return recording


def differences(name: str, old: Values, new: Values) -> Iterator[str]:
    """A line for each value of a case that is not what it was."""
    new = {key: value if isinstance(value, np.ndarray) else _as_json(value) for key, value in new.items()}
    for key in [*old, *(key for key in new if key not in old)]:
        if key not in new or key not in old:
            yield f"{name}|{key}: {'is gone' if key in old else 'is new'}: {_short({**new, **old}[key])}"
            continue
        was, now = old[key], new[key]
        if not (isinstance(was, np.ndarray) and isinstance(now, np.ndarray)):
            if isinstance(was, np.ndarray) or isinstance(now, np.ndarray) or was != now:
                yield f"{name}|{key}: old {_short(was, now)}, new {_short(now, was)}"
        elif was.shape != now.shape:
            yield f"{name}|{key}: old shape {was.shape}, new shape {now.shape}"
        else:
            limit = REWARD_TOLERANCE if key == "rewards" else TOLERANCE
            deviation, at = _deviation(was, now)
            if deviation > limit:
                pair = f"old {was.reshape(-1)[at]!s}, new {now.reshape(-1)[at]!s} at {at} of {was.size}"
                yield f"{name}|{key}: {pair}, largest deviation {deviation:.3g}"


def _deviation(was: np.ndarray, now: np.ndarray) -> tuple[float, int]:
    """The largest deviation, absolute up to 1 and relative beyond, and where it is."""
    if not was.size:
        return 0.0, 0
    a, b = was.reshape(-1).astype(np.float64), now.reshape(-1).astype(np.float64)
    same = (a == b) | (np.isnan(a) & np.isnan(b))
    with np.errstate(invalid="ignore"):
        apart = np.where(same, 0.0, np.abs(a - b) / np.maximum(1.0, np.abs(a)))
    apart = np.where(np.isfinite(apart), apart, np.inf)
    at = int(np.argmax(apart))
    return float(apart[at]), at


def _as_json(value: Any) -> Any:
    return json.loads(json.dumps(value))


def _short(value: Any, other: Any = None) -> str:
    """A value in a line; of two lists or objects only what differs."""
    if isinstance(value, list) and isinstance(other, list) and len(value) == len(other):
        value = [f"[{i}] {v}" for i, (v, o) in enumerate(zip(value, other, strict=True)) if v != o]
    elif isinstance(value, dict) and isinstance(other, dict):
        value = {k: v for k, v in value.items() if k not in other or other[k] != v}
    text = " ".join(str(value).split())
    return text if len(text) < 240 else f"{text[:240]} ..."


def compare(old: Mapping[str, Values], pattern: str = "") -> Iterator[str]:
    """Record anew, and give a line for each difference."""
    seen = set()
    for name, values in record(pattern):
        seen.add(name)
        if name in old:
            yield from differences(name, old[name], values)
        else:
            yield f"{name}: {NEW_CASE}"
    paper = bool(os.environ.get("FARM_AR_PAPER_SCENES"))
    for name in old:
        if name not in seen and re.search(pattern, name) and (paper or "paper-" not in name):
            yield f"{name}: no such case any more"


def main() -> None:
    """Run from the command line."""
    command, path, *pattern = sys.argv[1:]
    if command == "record":
        kept = load(Path(path)) if pattern and Path(path).exists() else {}
        save(
            {name: v for name, v in kept.items() if not re.search(*pattern, name)} | dict(record(*pattern)),
            Path(path),
        )
    elif command == "compare":
        count = 0
        for count, line in enumerate(compare(load(Path(path)), *pattern), 1):  # noqa: B007
            print(line, flush=True)
        print(f"{count} differences")
        sys.exit(count > 0)
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
