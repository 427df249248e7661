"""What comes in from anywhere does no harm: any body, kills at any moment, a full disk."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from schemathesis import GenerationMode

from farm_ar.service.limits import ServiceLimits
from farm_ar.service.refusals import RefusedError
from farm_ar.service.service import Service
from farm_ar.service.store import Store
from farm_ar.service.warmup import warm_up
from tests.service.conftest import Live, lab, layout_body, live, seen_in, served_anew, snapshot_body

Values = dict[str, Any]


def test_no_request_that_the_schema_allows_or_not_breaks_it() -> None:
    warm_up()  # as the command does: a request is waited for 10 s, and compiling may take longer
    for one in live(ServiceLimits(most_sessions=20)):
        _ask_anything(one)


def _ask_anything(one: Live) -> None:
    schema = schemathesis.openapi.from_url(f"{one.url}/openapi.json")
    operations = [found.ok() for found in schema.get_all_operations()]
    asked = st.one_of(
        [
            operation.as_strategy(generation_mode=mode)
            for operation in operations
            for mode in (GenerationMode.POSITIVE, GenerationMode.NEGATIVE)
            if mode is GenerationMode.POSITIVE or operation.body
        ]
    )
    client = one.client()
    client.put("/v1/sessions/room/layout", json=layout_body(lab(), method="spatial"))
    statuses: dict[int, int] = {}

    @given(case=asked, known=st.booleans())
    @settings(
        max_examples=10 * settings().max_examples,
        suppress_health_check=list(HealthCheck),
        phases=(Phase.generate,),
        database=None,
    )
    def ask(case: Any, known: bool) -> None:
        if known and case.path_parameters and case.method != "DELETE":
            case.path_parameters = {"name": "room"}
        reply = case.call(base_url=one.url)
        statuses[reply.status_code] = statuses.get(reply.status_code, 0) + 1
        assert reply.status_code < 500, (case, reply.text)
        if reply.status_code >= 400 and reply.headers.get("content-type") == "application/json":
            assert "message" in reply.json().get("error", reply.json()) or "detail" in reply.json()

    ask()
    assert statuses[200] > 10
    assert statuses[422] > 10
    assert client.get("/healthz").status_code == 200
    assert client.get("/v1/sessions/room/state").status_code == 200
    client.close()


def malformed(rng: np.random.Generator) -> list[tuple[str, bytes]]:
    """A hundred bodies that are wrong somewhere, and what was done to each."""
    whole = [("layout", layout_body(lab())), ("snapshots", snapshot_body(seen_in(lab())))]
    values: list[Any] = [None, True, -1, 1e308, "", "x" * 5000, [], {}, [[]], "\ud800", 10**400, -0.0, "NaN"]
    found = []
    for k in range(100):
        action, body = whole[k % 2]
        text = json.dumps(body)
        if k < 60:  # another value in some place
            body = json.loads(text)
            place: Any = body
            while True:
                key = rng.choice(list(place)) if isinstance(place, dict) else int(rng.integers(len(place)))
                if not isinstance(place[key], dict | list) or not place[key] or rng.random() < 0.2:
                    break
                place = place[key]
            place[key] = values[k % len(values)]
            data = json.dumps(body).encode()
        elif k < 80:  # half a body
            data = text[: int(rng.integers(len(text)))].encode()
        else:  # other bytes
            raw = bytearray(text.encode())
            for at in rng.integers(0, len(raw), 5):
                raw[at] = rng.integers(256)
            data = bytes(raw)
        found.append((action, data))
    return [
        *found,
        ("snapshots", b"[" * 200_000),
        ("snapshots", b'{"a":' * 100_000),
        ("layout", b'{"frame": "unity", "frame": "ros", "objects": []}'),
        ("confirm", b"null"),
        ("undo", b'{"revision": 1e400}'),
        ("align", b'{"frame": "unity", "revision": 1, "anchor": {"here": {}, "map": 3}}'),
        ("snapshots", b'{"snapshots": [{"frame": "unity"}, 3]}'),
        ("snapshots", b"\x00\xff" * 1000),
    ]


def test_malformed_bodies_are_refused_and_the_session_stays(rng: np.random.Generator) -> None:
    asked = served_anew()
    asked.good("layout", layout_body(lab(), method="spatial"))
    before = asked.state()["objects"]
    refused = 0
    for action, body in malformed(rng):
        name = "room" if action != "layout" else "other"
        status, reply = asked(action, body, name)
        assert status in (200, 201, 400, 409, 413, 422), (status, reply, body[:200])
        if status >= 400:
            refused += 1
            assert set(reply["error"]) == {"field", "expected", "got", "message"}
            assert len(reply["error"]["message"]) < 1500
        if status == 201:
            asked.good("delete", b"", "other")
    assert refused > 60
    assert asked.state()["objects"] == before
    asked.good("snapshots", snapshot_body(seen_in(lab())))


def test_a_million_objects_are_refused_quickly() -> None:
    one = '{"label":"a","x":1,"z":2},'
    body = ('{"frame":"unity","objects":[' + one * 1_000_000).rstrip(",").encode() + b"]}"
    for server in live():
        with server.client() as client:
            assert client.put("/v1/sessions/a/layout", content=body).status_code == 413
            assert client.get("/healthz").status_code == 200
    asked = served_anew(most_bytes=10**9)
    status, error = asked.refused("layout", body)
    assert (status, error["field"]) == (413, "objects")


class FullDisk(Store):
    """A store whose disk may be full."""

    full = False

    def write(self, name: str, row: Values) -> None:
        if self.full:  # so few pages that nothing more fits: SQLite's own error
            self._base.execute("pragma max_page_count = 1")
        else:
            self._base.execute("pragma max_page_count = 1000000")
        super().write(name, row)


def test_on_a_full_disk_nothing_is_changed_and_it_is_said(tmp_path: Path) -> None:
    store = FullDisk(tmp_path / "sessions.sqlite")
    asked = served_anew()
    asked.service = Service(store)
    asked.good("layout", layout_body(lab(), method="spatial"))
    store.full = True
    for number in range(100):
        seen = asked.good("snapshots", snapshot_body(seen_in(lab(), 0.01 * number)))
        before = asked.state()
        status, reply = asked("confirm", {"revision": number + 1, "snapshot": seen["snapshot"]})
        if status != 200:
            break
    assert status == 507
    assert "full" in reply["error"]["got"]
    assert asked.state() == before
    store.full = False
    asked.good("confirm", {"revision": before["revision"], "snapshot": seen["snapshot"]})
    store.close()
    again = served_anew(tmp_path / "sessions.sqlite")
    assert again.state()["revision"] == before["revision"] + 1


def test_what_is_outdated_does_not_fill_a_small_disk(tmp_path: Path) -> None:
    """A limit of the system on any file stands for the disk: the log of changes must not grow over it."""
    before, usual = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    store = Store(tmp_path / "sessions.sqlite")
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, before[1]))
        for revision in range(1, 101):
            store.write("room", {"revision": revision, "more": "x" * 20_000})
        with pytest.raises(RefusedError, match="must have room to be written"):
            store.write("room", {"revision": 101, "more": "x" * 200_000})
        store.write("room", {"revision": 102, "more": ""})
        store.delete("room", 102)
        store.write("room", {"revision": 103, "more": "x" * 20_000})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, usual)
    store.close()
    again = Store(tmp_path / "sessions.sqlite")
    assert again.read("room") == {"revision": 103, "more": "x" * 20_000}
    assert again.ended("room") == 102
    again.close()


KILLED = """
import sys
from farm_ar.service.app import make_app
from farm_ar.service.network import listening
from farm_ar.service.server import run
from farm_ar.service.service import Service
from farm_ar.service.store import Store

at = listening("127.0.0.1", 0)
app = make_app(Service(Store(sys.argv[1])))
run(app, at, lambda: print(at.getsockname()[1], flush=True))
"""


def killed_at(path: Path, rng: np.random.Generator, known: int) -> int:
    """Serve, decide again and again, and kill it at some moment; the last revision that was answered."""
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    with process, process.stdout:
        port = int(process.stdout.readline())
        end = time.monotonic() + rng.uniform(0.05, 0.6)
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False, timeout=60) as client:
            revision: int = client.get("/v1/sessions/room/state").json()["revision"]
            assert revision in (known, known + 1)  # one may have been written and not been answered
            while time.monotonic() < end:
                body = snapshot_body(seen_in(lab(), float(rng.uniform(0, 0.02))))
                seen = client.post("/v1/sessions/room/snapshots", json=body).json()
                decided = {"revision": revision, "snapshot": seen["snapshot"]}
                if rng.random() < 0.1:  # what comes after it goes on from its revision
                    assert client.delete("/v1/sessions/room").status_code == 200
                    reply = client.put("/v1/sessions/room/layout", json=layout_body(lab(), method="spatial"))
                elif rng.random() < 0.3 and client.get("/v1/sessions/room/state").json()["history"]:
                    reply = client.post("/v1/sessions/room/undo", json={"revision": revision})
                else:
                    reply = client.post("/v1/sessions/room/confirm", json=decided)
                if reply.status_code in (200, 201):
                    assert reply.json()["revision"] == revision + 1
                    revision += 1
            # And one that is under way while it is killed.
            body = snapshot_body(seen_in(lab(), 0.01))
            seen = client.post("/v1/sessions/room/snapshots", json=body).json()
            line = httpx.Client(base_url=client.base_url, trust_env=False, timeout=60)
            request = line.build_request(
                "POST",
                "/v1/sessions/room/confirm",
                json={"revision": revision, "snapshot": seen["snapshot"]},
                timeout=float(rng.uniform(0.001, 0.02)),
            )
            os.kill(process.pid, signal.SIGSTOP) if rng.random() < 0.2 else None
            try:
                line.send(request)
                revision += 1
            except httpx.HTTPError:
                pass
            finally:
                process.kill()
                line.close()
    return revision


def check_kills(path: Path, moments: int) -> None:
    asked = served_anew(path)
    asked.good("layout", layout_body(lab(), method="spatial"))
    asked.good(
        "snapshots", snapshot_body(seen_in(lab()))
    )  # compiles what those that are killed would have to
    asked.service.store.close()
    rng, revision = np.random.default_rng(0), 1
    for _ in range(moments):
        after = killed_at(path, rng, revision)
        assert after >= revision
        revision = after
    last = served_anew(path)
    state = last.state()
    assert state["revision"] in (revision, revision + 1)
    assert len(state["objects"]) == len(lab().layout)
    last.service.store.close()


def test_kills_between_writes_lose_nothing_and_the_revision_never_goes_back(tmp_path: Path) -> None:
    check_kills(tmp_path / "sessions.sqlite", 5)


@pytest.mark.long
def test_fifty_kills_lose_nothing(tmp_path: Path) -> None:
    check_kills(tmp_path / "sessions.sqlite", 50)
