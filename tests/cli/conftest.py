"""A way to type commands, the example files to type them about, and documents with anything wrong in them."""

import copy
import json
import random
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from farm_ar.cli import app

DATA = Path(__file__).parents[2] / "examples" / "data"

Run = Callable[..., Result]
Mutate = Callable[[Any, random.Random], Any]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Types `farm-ar` with arguments in an empty folder; an error that is ours comes out as it is."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(
        "COLUMNS", "160"
    )  # as where there is no terminal; parallel runs of the tests set another

    def run(*arguments: object) -> Result:
        result = CliRunner().invoke(app, [str(argument) for argument in arguments], prog_name="farm-ar")
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return run


@pytest.fixture
def mistake(run: Run) -> Callable[..., str]:
    """Types a command that has to be refused in one line, and gives that line."""

    def mistake(*arguments: object) -> str:
        result = run(*arguments)
        assert result.exit_code == 2
        assert result.stdout == ""
        assert result.stderr.count("\n") == 1
        return result.stderr.rstrip("\n")

    return mistake


@pytest.fixture
def before() -> Path:
    return DATA / "before.json"


@pytest.fixture
def seen() -> Path:
    return DATA / "seen.json"


@pytest.fixture(scope="session")
def documents() -> dict[str, Any]:
    """A document of each kind that is valid and has every field that there is."""
    from farm_ar.envs import FarmToTableEnv
    from farm_ar.scenes import builtin_scene, scene_to_dict
    from farm_ar.showcases import builtin_scripts

    farm = builtin_scene("farm")
    scene = json.loads((DATA / "before.json").read_text())
    category = scene["objects"][0]["category"]
    scene |= {
        "weights": {"translation": 1.0, "rotation": 2.0},
        "symmetry_deg": {category: 90},
        "templates": [{"category": category, "yaw_deg": 1, "size_whd": [1, 1, 1]}],
        "camera": {"fov_left_deg": 30, "fov_right_deg": 40, "range_m": 3, "speed_m_s": 2},
        "camera_path": scene_to_dict(builtin_scene("L1"))["camera_path"] | {"polyline": [[0, 0], [1, 1]]},
    }
    scene["camera"] |= {"fov_up_deg": 20, "fov_down_deg": 30}
    scene["camera_path"]["bezier_points"] = scene["camera_path"]["bezier_points"][:7]
    snapshot = json.loads((DATA / "seen.json").read_text())
    snapshot["camera"] |= {"y": 1.6, "pitch_deg": -10, "fov_up_deg": 20, "fov_down_deg": 30}
    snapshot["detections"] = [one | {"y": 0, "confidence": 0.5} for one in snapshot["detections"]]
    env = FarmToTableEnv(play_seconds=0.2)
    env.action_space.seed(0)
    camera = {"position": [0.6, -0.3], "yaw": 0.1, "height": 0.45, "pitch": -0.2}
    view = {"left": 0.5, "right": 0.5, "range_m": 3.0, "up": None, "down": None}
    layout = {"position": farm.layout.position.tolist(), "yaw": farm.layout.yaw.tolist()}
    env.reset(seed=0, options={"camera": camera | {"fov": view}, "layout": layout})
    env.step(env.action_space.sample())
    failure = {"scene": "farm", "jitter": "easy", "seed": 0, "case": 1, "reid": "spatial", "attack": "ladder"}
    script = tomllib.loads(next(iter(builtin_scripts().values())).read_text(encoding="utf-8"))
    return {
        "scene": scene,
        "snapshot": snapshot,
        "camera": {
            "camera": snapshot["camera"],
            "intrinsics": {"fx": 500, "fy": 510.5, "cx": 319.5, "cy": 179.5, "width": 640, "height": 360}
            | {"distortion": [0.1, -0.2, 0, 0, 0.01]},
        },
        "trace": json.loads(json.dumps(env.trace())),
        "script": script,
        "failures": {"version": "0", "failures": [failure | layout | {"effort": 0.1, "wrong": 1}]},
        "suite": {
            "suite": "own-1",
            "digest": "0",
            "rows": [{"name": "a", "about": "b", "all_in_view": True, "snapshots": ["a/0", "a/1"]}],
        },
        "answers": {
            "suite": "own-1",
            "method": "mine",
            "answers": {"a/0": {"labels": ["chair 1", None], "confidence": [0.5, 1], "seconds": 0.1}},
        },
    }


VALUES: list[Any] = [
    *(None, True, False, 0, 1, -1, 2.0, 0.5, 1e-7, 1e6, -1e6, 1.0001e6, 3.6e8, 4e8, 1e20, 1e300, -1e308),
    *(2**31, 2**63, 2**128, 10**400, 3.4028234663852886e38, float("nan"), float("inf")),
    *("", "a", "1_0", "farm", "sweep", "\x1b[31m", "\ud83d", "PCG64", "none", "hard", "no.json", "a:B"),
    *([], {}, [0, 0], [1, 2, 3], [0.1, 0, 1], [[0, 0]], ["a"], {"x": 1}, [None], [True, 1], [[[1]]]),
]
"""What may stand where something else should."""


def places(value: Any, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Where in a document values stand."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for name, item in inner for place in places(item, (*path, name)))]


@pytest.fixture(scope="session")
def mutate() -> Mutate:
    """Gives a copy of a document in which one, two or three values are others, gone, new or twice."""

    def mutate(document: Any, rng: random.Random) -> Any:
        changed = copy.deepcopy(document)
        for _ in range(rng.choice((1, 1, 1, 2, 3))):
            path = rng.choice(places(changed))
            if not path:
                if rng.random() < 0.1:
                    return rng.choice(VALUES)
                continue
            holder = changed
            for step in path[:-1]:
                holder = holder[step]
            last, way = path[-1], rng.random()
            if way < 0.6:
                holder[last] = copy.deepcopy(rng.choice(VALUES))
            elif way < 0.75:
                del holder[last]
            elif way < 0.85 and isinstance(holder, dict):
                holder[rng.choice(("x", "scene", "\x1b[2J", "y\n", "fov_up_deg"))] = rng.choice(VALUES)
            elif isinstance(holder, list):
                holder.insert(rng.randrange(len(holder) + 1), copy.deepcopy(holder[last]))
            else:
                value = holder[last]
                holder[last] = value * rng.choice((-1, 1e3, 1e9)) if isinstance(value, float) else [value]
        return changed

    return mutate
