"""What each error names: its kind, the field and the value, of bad inputs to constructors and readers."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium as gym
import numpy as np

from farm_ar.agents.stress import StressOptions
from farm_ar.envs import FarmToTableEnv, load_trace
from farm_ar.errors import InputError
from farm_ar.reid import (
    LikelihoodOptions,
    Motion,
    Rates,
    RelationalOptions,
    SpatialOptions,
    SpatialReid,
    track,
)
from farm_ar.scenes import (
    Camera,
    Detections,
    Detector,
    FieldOfView,
    Gaussian,
    Layout,
    LayoutNoise,
    Snapshot,
    Weights,
    builtin_scene,
    load_scene,
    load_scene_csv,
    load_snapshot,
    observe,
    scene_to_dict,
    snapshot_to_dict,
)
from farm_ar.showcases import load_script
from farm_ar.sweeps import ProcessExecutor, Store, Sweep, grid, make_executor, run_sweep

UNIT = "farm_ar.agents.stress.study:known_case"
ONE = {"scene": ["farm"], "case": [0], "jitter": ["none"]}
SCRIPT = 'title = "x"\nscene = "nowhere"\ngaze = "S1"\nseed = 1\n[[visits]]\nplay_s = 1.0\n'
ROW = "id,category,x,z,yaw_deg,w,h,d\na,chair,1,one,0,1,1,1\n"
VIEW = FieldOfView(0.5, 0.5, 3.0)
SCENE_EDITS: dict[str, Any] = {
    "no size": lambda s: s.pop("size_m"),
    "size": lambda s: s.update(size_m=[0, 1]),
    "size text": lambda s: s.update(size_m="big"),
    "unknown field": lambda s: s.update(colour="red"),
    "label twice": lambda s: s["objects"][1].update(label=s["objects"][0]["label"]),
    "category": lambda s: s["objects"][0].update(category=3),
    "size_whd": lambda s: s["objects"][2].update(size_whd=[0.1, 0, 0.1]),
    "x": lambda s: s["objects"][0].update(x="left"),
    "x infinite": lambda s: s["objects"][0].update(x=float("inf")),
    "yaw": lambda s: s["objects"][0].update(yaw_deg=None),
    "objects": lambda s: s.update(objects={}),
    "object": lambda s: s["objects"].append(7),
    "no label": lambda s: s["objects"][0].pop("label"),
    "format": lambda s: s.update(format="other"),
    "name": lambda s: s.update(name=""),
}
SNAPSHOT_EDITS: dict[str, Any] = {
    "no camera": lambda s: s.pop("camera"),
    "fov": lambda s: s["camera"].update(fov_left_deg=400),
    "range": lambda s: s["camera"].update(range_m=0),
    "id twice": lambda s: s["detections"][1].update(id=s["detections"][0]["id"]),
    "category": lambda s: s["detections"][0].update(category=["chair"]),
    "z": lambda s: s["detections"][0].update(z=True),
    "detections": lambda s: s.update(detections=None),
    "unknown field": lambda s: s["detections"][0].update(colour=1),
}


def _file(name: str, text: str | bytes, read: Callable[[Path], Any]) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        read(path)


def _edited(values: dict[str, Any], edit: Callable[[Any], Any], read: Callable[[Path], Any]) -> None:
    values = json.loads(json.dumps(values))
    edit(values)
    _file("edited.json", json.dumps(values), read)


def _seen() -> Snapshot:
    return observe(builtin_scene("L1").layout, Camera(np.array([2.0, 2.0]), 0.3, FieldOfView(3, 3, 9.0)))[0]


def _with(**changes: Any) -> None:
    given = {"labels": ("a", "b"), "category": ("chair",) * 2, "position": np.zeros((2, 2))}
    Layout(**{**given, "yaw": np.zeros(2), "size": np.ones((2, 3)), **changes})


def _step(action: Any, **arguments: Any) -> None:
    env = FarmToTableEnv(play_seconds=0.0, **arguments)
    env.reset(seed=0)
    env.step(action)


def _masks(**arguments: Any) -> None:
    env = FarmToTableEnv(**arguments)
    env.reset(seed=0)
    env.action_masks()


def _calls() -> dict[str, Callable[[], Any]]:
    farm = builtin_scene("farm")
    calls: dict[str, Callable[[], Any]] = {
        **{f"layout {k}": partial(_with, **{k: v}) for k, v in {
            "labels": ("a", "a"), "category": ("chair",), "position": np.full((2, 2), np.nan),
            "yaw": np.zeros(3), "size": np.zeros((2, 3)), "fixed": np.zeros(3, bool),
        }.items()},
        "camera position": lambda: Camera(np.zeros(3), 0.0, VIEW),
        "camera yaw": lambda: Camera(np.zeros(2), np.nan, VIEW),
        "field of view": lambda: FieldOfView(-1.0, 0.5, 3.0),
        "field of view range": lambda: FieldOfView(0.5, 0.5, 0.0),
        "detections size": lambda: Detections(
            ids=("d",), category=(None,), position=np.zeros((1, 2)), yaw=np.zeros(1), size=-np.ones((1, 3))
        ),
        "gaussian": lambda: Gaussian(0.0, -1.0),
        "noise": lambda: LayoutNoise.of(-1.0, 0.0),
        "weights": lambda: SpatialReid(builtin_scene("L1"), SpatialOptions(weights=Weights(-1.0, 1.0))),
        "detector": lambda: Detector(miss_rate=1.5),
        "detector sd": lambda: Detector(position_sd=float("nan")),
        "builtin": lambda: builtin_scene("L9"),
        **{f"spatial {k}": partial(SpatialOptions, **{k: v}) for k, v in {
            "threshold": 1.5, "solver": "best", "box": "none", "terms": (), "weights": "none",
        }.items()},
        **{f"likelihood {k}": partial(LikelihoodOptions, **{k: v}) for k, v in {
            "rates": (), "size_sd": 0.0, "gone_rate": 1.0, "confusion": -0.1, "min_confidence": 2.0,
            "noise": [Motion(0.5, 0.1, 0.1)],
        }.items()},
        "rates": lambda: Rates(-1.0, 0.0),
        **{f"relational {k}": partial(RelationalOptions, **{k: v}) for k, v in {
            "drift": 1.0, "group_deg": 0.0, "tried": -1,
        }.items()},
        "category of a snapshot": lambda: SpatialReid(farm).identify(_seen()),
        "no snapshots": lambda: track(SpatialReid(farm), []),
        **{f"stress {k}": partial(StressOptions, **{k: v}) for k, v in {
            "scene": "none", "reids": (), "attacks": ("none",), "queries": 0, "cases": True, "budget": 0.0,
            "jitter": "none at all", "seed": -1,
        }.items()},
        "step choice": partial(_step, np.array([99, 0, 0, 0])),
        "step shape": partial(_step, np.array([0, 0])),
        "step nan": partial(_step, np.full(5, np.nan), action="continuous"),
        "step before reset": lambda: FarmToTableEnv().step(np.zeros(4, int)),
        "step masks": partial(_masks, control="hand"),
        "make": lambda: gym.make("FarmToTable-v0", nonsense=1),
        "sweep name": lambda: Sweep("", "json:loads", []),
        "sweep function": lambda: Sweep("s", "nowhere:none", [{}]),
        "sweep seeds": lambda: Sweep("s", "json:loads", [{}], [-1]),
        "sweep parameters": lambda: Sweep("s", UNIT, [{"x": 1}]),
        "sweep twice": lambda: Sweep("s", UNIT, grid(**ONE | {"case": [0, 0]}), version="1"),
        "sweep nan": lambda: Sweep("s", UNIT, grid(**ONE | {"case": [np.nan]}), version="1"),
        "sweep result": lambda: run_sweep(Sweep("s", UNIT, grid(**ONE))).rows(),
        "executor": lambda: make_executor("threads"),
        "workers": lambda: ProcessExecutor(0),
        "time limit": lambda: make_executor("serial", time_limit=1.0),
        "no store": lambda: Store("/nowhere/at/all.sqlite", create=False),
        "store of text": lambda: _file("s.sqlite", "no database" * 99, lambda p: Store(p, create=False)),
        "scene missing": lambda: load_scene("/nowhere/at/all.json"),
        "scene no json": lambda: _file("s.json", "{", load_scene),
        "scene list": lambda: _file("s.json", "[]", load_scene),
        "scene utf16": lambda: _file("s.json", b"\xff\xfe{\x00", load_scene),
        "scene repeated": lambda: _file("s.json", '{"name": "a", "name": "b"}', load_scene),
        "snapshot list": lambda: _file("s.json", "[]", load_snapshot),
        "csv columns": lambda: _file("s.csv", "id,x\na,1\n", lambda p: load_scene_csv(p, (3.0, 3.0))),
        "csv number": lambda: _file("s.csv", ROW, lambda p: load_scene_csv(p, (3.0, 3.0))),
        "trace fields": lambda: _file("t.json", '{"version": "0"}', load_trace),
        "script": lambda: _file("s.toml", SCRIPT, load_script),
        "script toml": lambda: _file("s.toml", "title = ", load_script),
    }  # fmt: skip
    scene, snapshot = scene_to_dict(builtin_scene("L1")), snapshot_to_dict(_seen())
    calls |= {f"scene {n}": partial(_edited, scene, edit, load_scene) for n, edit in SCENE_EDITS.items()}
    return calls | {
        f"snap {n}": partial(_edited, snapshot, e, load_snapshot) for n, e in SNAPSHOT_EDITS.items()
    }


def named(call: Callable[[], Any]) -> dict[str, Any]:
    """What the error of a call names; nothing where it raises none."""
    try:
        call()
    except InputError as problem:
        return {"error": [type(problem).__name__, problem.field, repr(problem.got)[:200]]}
    except Exception as problem:
        return {"error": [type(problem).__name__]}
    return {"error": None}


def cases() -> dict[str, Callable[[], dict[str, Any]]]:
    """All cases by name."""
    return {f"mistake {name}": partial(named, call) for name, call in _calls().items()}
