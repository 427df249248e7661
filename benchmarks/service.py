"""The service's time beside an endpoint that reads the same body and returns the same bytes; load and memory.

`python benchmarks/service.py` takes about two minutes; `--minutes 10` watches the memory for longer.
"""

from __future__ import annotations

import argparse
import asyncio
import http.client
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.scenes import Detections, Layout, Scene, Snapshot, builtin_scene
from farm_ar.scenes.camera import Camera, FieldOfView
from farm_ar.scenes.json_files import scene_to_dict, snapshot_to_dict

CHILD = """
from fastapi import Request, Response
from farm_ar.service.app import make_app
from farm_ar.service.limits import ServiceLimits
from farm_ar.service.network import listening
from farm_ar.service.server import run
from farm_ar.service.service import Service
from farm_ar.service.store import Store
from farm_ar.service.warmup import warm_up

warm_up()
app = make_app(Service(Store(None), ServiceLimits()))
kept = {}

@app.put("/same")
async def keep(request: Request) -> Response:
    kept["bytes"] = await request.body()
    return Response()

@app.post("/same")
async def same(request: Request) -> Response:
    await request.body()
    return Response(kept["bytes"], media_type="application/json")

at = listening("127.0.0.1", 0)
run(app, at, lambda: print(at.getsockname()[1], flush=True))
"""


def place(labels: int) -> Scene:
    """The classroom, of which `labels` objects are kept."""
    scene = builtin_scene("classroom")
    layout = scene.layout
    kept = np.arange(labels)
    values = {
        name: tuple(value[i] for i in kept) if isinstance(value, tuple) else value[kept]
        for name in ("labels", "category", "position", "yaw", "size")
        for value in [getattr(layout, name)]
    }
    return Scene(name="classroom", layout=Layout(**values), size=scene.room)


def seen(scene: Scene, detections: int, rng: np.random.Generator) -> Snapshot:
    """Some of the objects, moved by 30 cm, in view of a camera that sees them all."""
    layout = scene.layout
    some = rng.choice(len(layout), detections, replace=False)
    found = Detections(
        category=tuple(layout.category[i] for i in some),
        position=layout.position[some] + rng.normal(0, 0.3, (detections, 2)),
        yaw=layout.yaw[some] + rng.normal(0, 0.3, detections),
        size=layout.size[some],
    )
    return Snapshot(Camera(np.zeros(2), np.asarray(0.5), FieldOfView(np.pi, np.pi, 50.0)), found)


class Line:
    """A connection that stays open."""

    def __init__(self, port: int) -> None:
        self._line = http.client.HTTPConnection("127.0.0.1", port)

    def ask(self, method: str, path: str, body: bytes = b"") -> bytes:
        """The body of the answer to a request."""
        self._line.request(method, path, body, {"Content-Type": "application/json"})
        reply = self._line.getresponse()
        answer = reply.read()
        assert reply.status < 300, answer
        return answer


def timed(ask: Callable[[int], object], times: int) -> np.ndarray[Any, Any]:
    """Milliseconds of each of so many requests."""
    found = np.empty(times)
    for k in range(times):
        begun = time.perf_counter()
        ask(k)
        found[k] = (time.perf_counter() - begun) * 1e3
    return found


def beside_the_same_bytes(port: int, method: str, more: dict[str, Any], times: int, runs: int) -> None:
    """Print p50 and p99, and their ratio to those of the other endpoint: medians of alternating runs."""
    scene, rng, line = place(29), np.random.default_rng(0), Line(port)
    bodies = [
        json.dumps({**snapshot_to_dict(seen(scene, 8, rng)), "frame": "unity"}).encode() for _ in range(20)
    ]
    layout = {**scene_to_dict(scene), "frame": "unity", "method": method, **more}
    name = f"{method}-{len(more)}"
    line.ask("PUT", f"/v1/sessions/{name}/layout", json.dumps(layout).encode())
    path = f"/v1/sessions/{name}/snapshots"
    line.ask("PUT", "/same", line.ask("POST", path, bodies[0]))
    rows = []
    for _ in range(runs):
        ours = timed(lambda k: line.ask("POST", path, bodies[k % 20]), times)
        theirs = timed(lambda k: line.ask("POST", "/same", bodies[k % 20]), times)
        rows.append([np.percentile(one, q) for q in (50, 99) for one in (ours, theirs)])
    p50, same50, p99, same99 = np.median(rows, axis=0)
    ratios = [np.median([row[i] / row[i + 1] for row in rows]) for i in (0, 2)]
    what = method + "".join(f", {key} {json.dumps(value)}" for key, value in more.items())
    print(
        f"{what:32} 8 x 29: p50 {p50:6.2f} ms ({ratios[0]:4.1f} times {same50:.2f}), "
        f"p99 {p99:6.2f} ms ({ratios[1]:4.1f} times {same99:.2f})",
        flush=True,
    )


def at_once(port: int, sessions: int, each: int) -> None:
    """Print how long requests take when so many sessions ask at once."""
    import httpx

    scene, rng = place(29), np.random.default_rng(1)
    body = json.dumps({**snapshot_to_dict(seen(scene, 8, rng)), "frame": "unity"}).encode()
    layout = json.dumps({**scene_to_dict(scene), "frame": "unity", "method": "spatial"}).encode()
    found: list[float] = []

    async def one(client: httpx.AsyncClient, k: int) -> None:
        (await client.put(f"/v1/sessions/many-{k}/layout", content=layout)).raise_for_status()
        for _ in range(each):
            begun = time.perf_counter()
            (await client.post(f"/v1/sessions/many-{k}/snapshots", content=body)).raise_for_status()
            found.append((time.perf_counter() - begun) * 1e3)

    async def every() -> float:
        limits = httpx.Limits(max_connections=sessions)
        options: Any = {"base_url": f"http://127.0.0.1:{port}", "timeout": 60, "trust_env": False}
        async with httpx.AsyncClient(limits=limits, **options) as client:
            begun = time.perf_counter()
            await asyncio.gather(*(one(client, k) for k in range(sessions)))
            return time.perf_counter() - begun

    seconds = asyncio.run(every())
    p50, p99 = np.percentile(found, [50, 99])
    rate = len(found) / seconds
    print(f"{sessions} sessions at once: {rate:.0f} snapshots/s, p50 {p50:.0f} ms, p99 {p99:.0f} ms")


def memory(port: int, process: int, minutes: float) -> None:
    """Print how the memory grows while a session is asked, confirmed, undone, and begun anew."""
    scene, rng, line = place(29), np.random.default_rng(2), Line(port)
    layout = json.dumps({**scene_to_dict(scene), "frame": "unity", "method": "spatial"}).encode()
    line.ask("PUT", "/v1/sessions/long/layout", layout)
    status, revision, asked = Path(f"/proc/{process}/status"), 1, 0
    sizes: list[float] = []
    end, next_look = time.monotonic() + 60 * minutes, 0.0
    while time.monotonic() < end:
        body = json.dumps({**snapshot_to_dict(seen(scene, 8, rng)), "frame": "unity"}).encode()
        reply = json.loads(line.ask("POST", "/v1/sessions/long/snapshots", body))
        asked += 1
        if asked % 5 == 0:
            decided = json.dumps({"revision": revision, "snapshot": reply["snapshot"]}).encode()
            line.ask("POST", "/v1/sessions/long/confirm", decided)
            revision += 1
        if asked % 50 == 0:
            line.ask("POST", "/v1/sessions/long/undo", json.dumps({"revision": revision}).encode())
            revision += 1
        if asked % 1000 == 0:
            line.ask("DELETE", "/v1/sessions/long")
            revision = json.loads(line.ask("PUT", "/v1/sessions/long/layout", layout))["revision"]
        if time.monotonic() > next_look:
            next_look = time.monotonic() + 1
            resident = next(row for row in status.read_text().splitlines() if row.startswith("VmRSS"))
            sizes.append(int(resident.split()[1]) / 1024)
    third = max(len(sizes) // 3, 1)
    parts = [statistics.median(sizes[k * third : (k + 1) * third]) for k in range(3)]
    shown = ", ".join(f"{one:.1f}" for one in parts)
    print(f"{minutes:g} minutes, {asked} snapshots, revision {revision}: {shown} MiB in each third")


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=300, help="requests a run")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--minutes", type=float, default=0.5)
    given = parser.parse_args()
    process = subprocess.Popen([sys.executable, "-c", CHILD], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    with process:
        port = int(process.stdout.readline())
        for method, more in (
            ("spatial", {}),
            ("spatial", {"checks": False}),
            ("likelihood", {}),
            ("adaptive", {}),
        ):
            beside_the_same_bytes(port, method, more, given.times, given.runs)
        at_once(port, 64, 20)
        memory(port, process.pid, given.minutes)
        process.terminate()


if __name__ == "__main__":
    main()
