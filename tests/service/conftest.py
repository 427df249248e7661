"""A service in memory, and one on a port of this machine."""

import json
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
import uvicorn

from farm_ar.scenes import Camera, Detections, FieldOfView, Scene, Snapshot, builtin_scene
from farm_ar.scenes.json_files import scene_to_dict, snapshot_to_dict
from farm_ar.service.access import Access
from farm_ar.service.app import make_app
from farm_ar.service.limits import ServiceLimits
from farm_ar.service.network import Certificate, listening
from farm_ar.service.server import config_of
from farm_ar.service.service import Answer, Service
from farm_ar.service.store import Store

Values = dict[str, Any]


@dataclass
class Asked:
    """A service, asked by values instead of bytes."""

    service: Service
    revision: dict[str, int] = field(default_factory=dict)

    def __call__(self, action: str, body: Values | bytes = b"", name: str = "room") -> tuple[int, Values]:
        data = body if isinstance(body, bytes) else json.dumps(body).encode()
        answer: Answer = self.service.call(name, action, data)
        return answer.status, json.loads(answer.body)

    def good(self, action: str, body: Values | bytes = b"", name: str = "room") -> Values:
        status, reply = self(action, body, name)
        assert status in (200, 201), reply
        return reply

    def refused(self, action: str, body: Values | bytes, name: str = "room") -> tuple[int, Values]:
        status, reply = self(action, body, name)
        assert status >= 400, reply
        error: Values = reply["error"]
        return status, error

    def state(self, frame: str = "unity", name: str = "room") -> Values:
        answer = self.service.state(name, frame)
        assert answer.status == 200, answer.body
        values: Values = json.loads(answer.body)
        return values


def served_anew(path: Path | None = None, **limits: Any) -> Asked:
    return Asked(Service(Store(path), ServiceLimits(**limits)))


@pytest.fixture
def asked() -> Iterator[Asked]:
    one = served_anew()
    yield one
    one.service.store.close()


def layout_body(scene: Scene, **more: Any) -> Values:
    return {**scene_to_dict(scene), "frame": "unity", **more}


def snapshot_body(snapshot: Snapshot, **more: Any) -> Values:
    return {**snapshot_to_dict(snapshot), "frame": "unity", **more}


def lab() -> Scene:
    return builtin_scene("lab")


def seen_in(scene: Scene, shift: float = 0.0, kept: int | None = None) -> Snapshot:
    """All things of a scene, or the first few, shifted alike, from a camera that sees everything."""
    layout = scene.layout
    n = len(layout) if kept is None else kept
    seen = Detections(
        category=tuple(layout.category[:n]),
        position=layout.position[:n] + shift,
        yaw=layout.yaw[:n],
        size=layout.size[:n],
        ids=tuple(f"d{i}" for i in range(n)),
    )
    everything = FieldOfView(np.pi, np.pi, 1000.0)
    return Snapshot(Camera(layout.position.mean(axis=0) + 0.03, np.asarray(0.0), everything), seen)


@dataclass
class Live:
    """A service that listens on a port of this machine."""

    url: str
    service: Service
    token: str | None

    def client(self, **options: Any) -> httpx.Client:
        headers = {} if self.token is None else {"Authorization": f"Bearer {self.token}"}
        return httpx.Client(base_url=self.url, headers=headers, timeout=60, trust_env=False, **options)


def live(
    limits: ServiceLimits | None = None,
    access: Access | None = None,
    service: Service | None = None,
    tls: Certificate | None = None,
) -> Iterator[Live]:
    one = service or Service(Store(None), limits or ServiceLimits())
    allowed = access or Access()
    at = listening("127.0.0.1", 0)
    server = uvicorn.Server(config_of(make_app(one, allowed), tls, one.limits))
    thread = threading.Thread(target=server.run, args=([at],), daemon=True)
    thread.start()
    deadline = time.monotonic() + 60
    while not server.started and thread.is_alive() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert server.started
    scheme = "http" if tls is None else "https"
    yield Live(f"{scheme}://127.0.0.1:{at.getsockname()[1]}", one, allowed.token)
    server.should_exit = True
    thread.join(30)
    assert not thread.is_alive()


@pytest.fixture(scope="module")
def server() -> Iterator[Live]:
    yield from live()
