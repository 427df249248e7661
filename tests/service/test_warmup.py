"""After warming up no request waits for a kernel to be compiled, or to be loaded."""

import subprocess
import sys

PROGRAM = """
import json
import sys
from dataclasses import replace

import numpy as np

from farm_ar.inner_kernels import Kernel
from farm_ar.service.warmup import warm_up
from tests.service.conftest import lab, layout_body, seen_in, served_anew, snapshot_body


def loaded():
    modules = [module for name, module in sys.modules.items() if name.startswith("farm_ar.")]
    kernels = {id(one): one for module in modules for one in vars(module).values() if isinstance(one, Kernel)}
    return {(one.__module__, one.__name__): len(one.signatures) for one in kernels.values()}


warm_up()
before, asked = loaded(), served_anew()
usual = snapshot_body(seen_in(lab(), 0.05))
first, *rest = usual["detections"]
mirrored = [{**one, "x": -one["x"]} for one in usual["detections"]]
larger = [{**one, "x": 100 * one["x"], "z": 100 * one["z"]} for one in usual["detections"]]
bodies = [
    usual,
    {**usual, "detections": mirrored},
    {**usual, "detections": [first, {**first, "id": "again", "x": first["x"] + 0.01}, *rest]},
    {**usual, "detections": [{**first, "category": "a stranger"}, *rest]},
    {**usual, "detections": [{"id": "bare", "x": 1, "z": 1}, *rest]},
    {**usual, "detections": larger},
    {**usual, "detections": [{**one, "track_id": one["id"]} for one in usual["detections"]]},
    {**usual, "detections": []},
    {"snapshots": [usual, {**usual, "detections": rest}]},
]
for method in ("spatial", "likelihood", "adaptive"):
    asked.good("layout", layout_body(lab(), method=method), method)
    for body in bodies:
        seen = asked.good("snapshots", body, method)
    asked.good("confirm", {"revision": 1, "snapshot": seen["snapshot"]}, method)
    asked.good("align", {**usual, "revision": 2}, method)
    asked.good("undo", {"revision": asked.state(name=method)["revision"]}, method)
after = loaded()
print([name for name in after if after[name] != before.get(name, 0)])
"""


def test_nothing_is_loaded_or_compiled_after_warming_up() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "[]\n"
