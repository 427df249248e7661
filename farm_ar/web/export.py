"""The page as files that any host serves: it shows recordings, plays by itself, and needs no server."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.errors import OptionError
from farm_ar.rendering.models import MODELS
from farm_ar.scenes.files import whole_file
from farm_ar.web.adversary import exchange_plan
from farm_ar.web.gallery import Failures, cards_of, recorded_failure, shipped_gallery
from farm_ar.web.game import Game
from farm_ar.web.messages import Json
from farm_ar.web.recordings import demonstrations, recorded_script, recorded_trace

STARTS = 12
"""How many tables the page can begin with."""


def start_of(seed: int) -> Json:
    """What a page needs to play by itself from the start that a seed gives, as `web/src/engine.js` says."""
    game = Game(seed)
    scene, camera = game.world.scene.knowing(game.world.truth), game.world.camera
    plan, weights = exchange_plan(scene, camera), scene.cost_weights
    return {
        "hello": game.hello(),
        "state": {
            **game.state(),
            "believed": np.column_stack([scene.layout.position, scene.layout.yaw]).tolist(),
            "animals": [],
            "arrived": 0,
            "astray": 0,
        },
        "eye": {
            "x": float(camera.position[0]),
            "z": float(camera.position[1]),
            "yaw": float(camera.yaw),
            "left": camera.fov.left,
            "right": camera.fov.right,
            "range": camera.fov.range_m,
        },
        "weights": {"translation": weights.translation, "rotation": weights.rotation},
        "rest": game.rest.tolist(),
        "plan": [list(one) for one in plan.carries],
        "pair": sorted({scene.layout.labels[one.thing] for one in plan.carries}),
    }


def export(
    folder: Path,
    traces: Mapping[str, Mapping[str, Any]],
    report: Callable[[float], None] = lambda share: None,
    gallery: Failures | None = None,
) -> list[Path]:
    """Write the page, its models, the demonstrations and episodes into a folder.

    Args:
        folder: where; made if it is not there.
        traces: of the episodes, by the names that they get.
        report: called with the share that is done.
        gallery: failures to look at; those that come with farm-ar by default.

    Returns:
        What was written.

    Raises:
        OptionError: an episode is of an environment without the game, or has the name of a failure or a
            demonstration.
    """
    written = []

    def write(name: str, data: bytes) -> None:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as file:
            file.write_bytes(data)
        written.append(path)

    def write_json(name: str, value: Json) -> None:
        write(name, json.dumps(value, separators=(",", ":")).encode())

    failures = shipped_gallery() if gallery is None else gallery
    titles, cards = demonstrations(), cards_of(failures)
    works = len(titles) + len(traces) + len(cards)
    for done, name in enumerate(titles, start=1):
        write_json(f"recordings/{name}.json", recorded_script(name))
        report(done / works)
    for done, (name, trace) in enumerate(traces.items(), start=len(titles) + 1):
        if name in cards or name in titles:
            expected = "must have another name than the demonstrations and the failures of the gallery"
            raise OptionError("trace", expected, name)
        recording = recorded_trace(trace)
        titles[name] = f"{name}: {recording['title']}"
        write_json(f"recordings/{name}.json", recording)
        report(done / works)
    for done, (name, failure) in enumerate(zip(cards, failures, strict=True), start=len(titles) + 1):
        write_json(f"recordings/{name}.json", recorded_failure(failure))
        report(done / works)
    write_json("play.json", {"starts": [start_of(seed) for seed in range(STARTS)]})
    write_json("recordings.json", {"recordings": titles, "gallery": cards})
    static = files("farm_ar.web") / "static"
    page = (static / "index.html").read_text(encoding="utf-8")
    write("index.html", page.replace('<html lang="en">', '<html lang="en" data-alone>').encode())
    for name in ("play.js", "style.css", "three-LICENSE.txt"):
        write(name, (static / name).read_bytes())
    for name in MODELS:
        write(f"models/{name}.glb", (files("farm_ar.rendering") / "models" / f"{name}.glb").read_bytes())
    return written
