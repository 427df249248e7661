"""The service on a port: who may ask, what is too large or too slow, and who is told what happens."""

import asyncio
import json
import resource
import signal
import socket
import ssl
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest
from jsonschema import Draft202012Validator
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from farm_ar.errors import OptionError
from farm_ar.service.access import Access
from farm_ar.service.client import ServiceSession
from farm_ar.service.limits import ServiceLimits
from farm_ar.service.network import lan_address, listening, pin_of, qr_code, self_signed
from farm_ar.service.recordings import Recorder, replay
from farm_ar.service.refusals import RefusedError
from farm_ar.service.service import Service
from farm_ar.service.store import Store
from farm_ar.service.traffic import Traffic
from tests.service.conftest import Live, lab, layout_body, live, seen_in, snapshot_body


@pytest.fixture(scope="module")
def guarded() -> Iterator[Live]:
    yield from live(ServiceLimits(most_bytes=20_000, body_s=2.0), Access("sesame", ("https://app.example",)))


def begin(client: httpx.Client, name: str, **more: Any) -> None:
    body = layout_body(lab(), **{"method": "spatial"} | more)
    reply = client.put(f"/v1/sessions/{name}/layout", json=body)
    assert reply.status_code == 201, reply.text


def test_a_session_by_http_from_the_layout_to_undo(server: Live) -> None:
    with server.client() as client:
        begin(client, "flow")
        seen = client.post("/v1/sessions/flow/snapshots", json=snapshot_body(seen_in(lab(), 0.1))).json()
        assert [one["id"] for one in seen["detections"]] == list(lab().layout.labels)
        body = {"revision": seen["revision"], "snapshot": seen["snapshot"]}
        assert client.post("/v1/sessions/flow/confirm", json=body).json()["revision"] == 2
        assert client.post("/v1/sessions/flow/confirm", json=body).status_code == 409
        assert client.post("/v1/sessions/flow/undo", json={"revision": 2}).json()["revision"] == 3
        state = client.get("/v1/sessions/flow/state", params={"frame": "ros"}).json()
        assert (state["revision"], state["header"]["frame_id"]) == (3, "ros")
        assert "flow" in client.get("/v1/sessions").json()["sessions"]
        assert client.delete("/v1/sessions/flow").status_code == 200
        assert client.get("/v1/sessions/flow/state").status_code == 404
        assert client.get("/v1/sessions/flow/state", params={"frame": "opencv"}).status_code == 422
        assert client.get("/healthz").json()["status"] == "ok"


def test_answers_are_what_the_openapi_description_says(server: Live) -> None:
    with server.client() as client:
        paths = client.get("/openapi.json").json()["paths"]
        begin(client, "schema")
        one = "/v1/sessions/{name}"
        seen = client.post("/v1/sessions/schema/snapshots", json=snapshot_body(seen_in(lab())))
        decided = {"revision": 1, "snapshot": seen.json()["snapshot"]}
        here = {"x": 0, "z": 0, "yaw_deg": 0}
        anchored = {"frame": "unity", "revision": 3, "anchor": {"here": here, "map": here}}
        replies = {
            ("post", f"{one}/snapshots"): seen,
            ("post", f"{one}/confirm"): client.post("/v1/sessions/schema/confirm", json=decided),
            ("post", f"{one}/undo"): client.post("/v1/sessions/schema/undo", json={"revision": 2}),
            ("post", f"{one}/align"): client.post("/v1/sessions/schema/align", json=anchored),
            ("get", f"{one}/state"): client.get("/v1/sessions/schema/state"),
            ("get", "/v1/sessions"): client.get("/v1/sessions"),
            ("put", f"{one}/layout"): client.put("/v1/sessions/schema/layout", json={}),
            ("delete", one): client.delete("/v1/sessions/schema"),
        }
        for (method, path), reply in replies.items():
            described = paths[path][method]["responses"][str(reply.status_code)]
            Draft202012Validator(described["content"]["application/json"]["schema"]).validate(reply.json())
        for method, path, good, bad in (
            ("put", f"{one}/layout", layout_body(lab(), method="adaptive"), {"frame": "unity"}),
            ("post", f"{one}/snapshots", snapshot_body(seen_in(lab())), {"frame": "opencv"}),
            ("post", f"{one}/align", anchored, {**anchored, "revision": -1}),
        ):
            taken = paths[path][method]["requestBody"]["content"]["application/json"]["schema"]
            assert Draft202012Validator(taken).is_valid(good)
            assert not Draft202012Validator(taken).is_valid(bad)


def test_without_the_token_nothing_is_said(guarded: Live) -> None:
    with httpx.Client(base_url=guarded.url, trust_env=False) as client:
        for headers in ({}, {"Authorization": "Bearer open"}, {"Authorization": "Basic sesame"}):
            reply = client.get("/v1/sessions", headers=headers)
            assert reply.status_code == 401
            assert "sesame" not in reply.text
        assert client.get("/v1/sessions", params={"token": "sesame"}).status_code == 200
        assert client.get("/healthz").status_code == 200
        page = client.get("/")
        assert "default-src 'self'" in page.headers["content-security-policy"]
    with guarded.client() as client:
        assert client.get("/v1/sessions").status_code == 200
    url = guarded.url.replace("http", "ws") + "/v1/sessions/none/events"
    with pytest.raises(InvalidStatus), connect(url, proxy=None):
        pass


def test_pages_of_other_origins_may_ask_only_if_they_were_named(guarded: Live, server: Live) -> None:
    with guarded.client() as client:
        assert client.get("/v1/sessions", headers={"Origin": "https://evil.example"}).status_code == 403
        named = client.get("/v1/sessions", headers={"Origin": "https://app.example"})
        assert named.status_code == 200
        assert named.headers["access-control-allow-origin"] == "https://app.example"
    with server.client() as client:
        own = client.get("/v1/sessions", headers={"Origin": server.url})
        assert own.status_code == 200
        assert "access-control-allow-origin" not in own.headers
        assert client.get("/v1/sessions", headers={"Origin": "https://app.example"}).status_code == 403
        # A page whose name was made to point at this machine asks under its own name.
        assert client.get("/v1/sessions", headers={"Host": "evil.example"}).status_code == 403


def test_large_bodies_are_refused_before_they_are_read(guarded: Live) -> None:
    with guarded.client() as client:
        for content in (b"[" * 30_000, iter([b"[" * 10_000] * 3)):
            reply = client.post("/v1/sessions/a/snapshots", content=content)
            assert reply.status_code == 413


def raw(url: str, *parts: bytes, pause_s: float = 0.0, close: bool = False) -> bytes:
    """What is answered to bytes that are sent one after another."""
    place = urlsplit(url)
    with socket.create_connection((place.hostname, place.port), timeout=20) as line:
        for part in parts:
            line.sendall(part)
            time.sleep(pause_s)
        if close:
            return b""
        answer = b""
        while more := line.recv(65536):
            answer += more
            if b"\r\n\r\n" in answer:
                break
        return answer


def test_half_a_body_and_a_slow_one_hold_nobody_up(guarded: Live) -> None:
    head = (
        b"POST /v1/sessions/a/snapshots HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer sesame\r\n"
        b"Content-Length: 1000\r\n\r\n"
    )
    raw(guarded.url, head, b"{" * 500, close=True)
    slow = threading.Thread(target=lambda: results.append(raw(guarded.url, head, b"{")))
    results: list[bytes] = []
    slow.start()
    with guarded.client() as client:
        assert client.get("/healthz").status_code == 200
        assert client.get("/v1/sessions").status_code == 200
    slow.join(20)
    assert results[0].startswith(b"HTTP/1.1 408")


def test_a_head_that_does_not_come_ends_the_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else whoever opens connections and says nothing takes all that the system has."""
    monkeypatch.setattr("farm_ar.service.server.HEAD_S", 0.5)
    whole = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    for one in live():
        place = urlsplit(one.url)
        silent = [socket.create_connection((place.hostname, place.port), timeout=20) for _ in range(20)]
        for line in silent[10:]:
            line.sendall(whole)
            answer = b""
            while not answer.endswith(b"}"):
                answer += line.recv(65536)
            assert answer.startswith(b"HTTP/1.1 200")
        for part in (whole[:-2], b"X-More: 1\r\n", b"X-More: 2\r\n"):
            for line in silent[5:]:
                line.sendall(part)
            time.sleep(0.1)
        begun = time.monotonic()
        for line in silent:
            assert line.recv(65536) == b""
            line.close()
        assert time.monotonic() - begun < 5
        with one.client() as client:  # and one who takes his time between two requests is not hurried
            assert client.get("/healthz").status_code == 200
            time.sleep(1.0)
            assert client.get("/healthz").status_code == 200


def test_who_asks_too_much_at_once_is_told_to_come_again() -> None:
    limits = ServiceLimits(most_waiting=2)
    for one in live(limits):
        with one.client() as client:
            begin(client, "busy", method="adaptive")

            def ask(_: int) -> int:
                return client.post(
                    "/v1/sessions/busy/snapshots", json=snapshot_body(seen_in(lab()))
                ).status_code

            with ThreadPoolExecutor(16) as many:
                found = list(many.map(ask, range(64)))
            assert set(found) == {200, 429}
            assert client.post("/v1/sessions/busy/snapshots", json=snapshot_body(seen_in(lab()))).is_success


def test_nothing_is_kept_of_names_whose_requests_were_too_many() -> None:
    traffic = Traffic(Service(Store(None)), ServiceLimits(most_requests=1), 1)
    traffic._under_way = 1

    async def ask() -> None:
        for number in range(5):
            with pytest.raises(RefusedError, match="fewer at once"):
                await traffic.state(f"room-{number}", "unity")

    asyncio.run(ask())
    assert traffic._locks == {}


def test_what_takes_too_long_is_told_to_come_again_and_the_session_stays_whole(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    service = Service(Store(None), ServiceLimits(answer_s=1.0))
    usual, go_on = Service.state, threading.Event()

    def slowly(self: Service, name: str, frame: str) -> Any:
        go_on.wait(60)
        return usual(self, name, frame)

    service.call("slow", "layout", json.dumps(layout_body(lab(), method="spatial")).encode())
    monkeypatch.setattr(Service, "state", slowly)
    for one in live(service=service):
        with one.client() as client:
            reply = client.get("/v1/sessions/slow/state")
            assert reply.status_code == 503
            assert reply.headers["retry-after"] == "1"
            assert client.get("/healthz").status_code == 200
            # While it is at work, others of this session wait in vain, and those of other sessions do not.
            assert client.get("/v1/sessions/slow/state").status_code == 503
            go_on.set()
            end = time.monotonic() + 60
            while (last := client.get("/v1/sessions/slow/state")).status_code == 503:
                assert time.monotonic() < end
            assert last.json()["revision"] == 1


def test_listeners_are_told_what_comes_stays_and_goes(server: Live) -> None:
    labels = lab().layout.labels
    with server.client() as client:
        begin(client, "told")
        url = server.url.replace("http", "ws") + "/v1/sessions/told/events?frame=openxr"
        with connect(url, proxy=None) as line:
            first = json.loads(line.recv(60))
            assert (first["added"], first["updated"], first["removed"]) == ([], [], [])
            everything, some = seen_in(lab(), 0.02), seen_in(lab(), 0.02, kept=3)
            client.post("/v1/sessions/told/snapshots", json=snapshot_body(everything, timestamp=3.0))
            second = json.loads(line.recv(60))
            assert [one["id"] for one in second["added"]] == list(labels)
            assert second["header"] == {"stamp": 3.0, "frame_id": "openxr"}
            place = second["added"][0]["pose"]["position"]
            x, z = (lab().layout.position[0] + 0.02).tolist()
            assert (place["x"], place["z"]) == pytest.approx((x, -z))
            client.post("/v1/sessions/told/snapshots", json=snapshot_body(some))
            third = json.loads(line.recv(60))
            assert [one["id"] for one in third["updated"]] == list(labels[:3])
            assert third["added"] == []
            assert third["removed"] == sorted(labels[3:])
            with connect(url, proxy=None) as late:
                assert [one["id"] for one in json.loads(late.recv(60))["added"]] == list(labels[:3])
            client.delete("/v1/sessions/told")
            with pytest.raises(ConnectionClosed):
                line.recv(60)


def test_two_clients_at_once_lose_no_decision(server: Live) -> None:
    """Each of two clients confirms what it saw ten times; what is refused it looks at again."""
    counts = []
    with server.client() as client:
        begin(client, "shared")

    def work(shift: float) -> None:
        done = 0
        with server.client() as client:
            while done < 10:
                seen = client.post(
                    "/v1/sessions/shared/snapshots", json=snapshot_body(seen_in(lab(), shift))
                ).json()
                body = {"revision": seen["revision"], "snapshot": seen["snapshot"]}
                reply = client.post("/v1/sessions/shared/confirm", json=body)
                assert reply.status_code in (200, 409), reply.text
                done += reply.status_code == 200
        counts.append(done)

    both = [threading.Thread(target=work, args=(shift,)) for shift in (0.01, 0.02)]
    for one in both:
        one.start()
    for one in both:
        one.join(60)
    assert counts == [10, 10]
    with server.client() as client:
        state = client.get("/v1/sessions/shared/state").json()
    assert state["revision"] == 21
    assert [one["revision"] for one in state["history"]] == list(range(2, 22))


def test_a_recording_is_played_again_bit_for_bit_and_a_change_is_noticed(tmp_path: Path) -> None:
    folder = tmp_path / "recorded"
    store = Store(tmp_path / "sessions.sqlite")
    scene, rng = lab(), np.random.default_rng(3)
    for part in range(2):  # the second part begins with a session that is there already
        service = Service(store, recorder=Recorder(folder))
        if part == 0:
            service.call("room", "layout", json.dumps(layout_body(scene)).encode())
            service.call("room", "snapshots", b"{")
            service.call("../room", "snapshots", b"\xff\xfe")
        for _ in range(3):
            body = snapshot_body(seen_in(scene, float(rng.normal(0, 0.1))))
            seen = json.loads(service.call("room", "snapshots", json.dumps(body).encode()).body)
            decided = {"revision": seen["revision"], "snapshot": seen["snapshot"]}
            service.call("room", "confirm", json.dumps(decided).encode())
    played = list(replay(folder))
    assert [one.difference for one in played] == [None] * 15
    assert {one.action for one in played} == {"layout", "snapshots", "confirm"}
    path = folder / "room.jsonl"
    path.write_text(path.read_text().replace('\\"revision\\":3', '\\"revision\\":4', 1))
    assert [bool(one.difference) for one in replay(folder)].count(True) == 1
    service.call("room", "delete", b"")
    third = Service(store, recorder=Recorder(tmp_path / "third"))  # of a session whose name is used again
    third.call("room", "layout", json.dumps(layout_body(scene)).encode())
    (again,) = replay(tmp_path / "third")
    assert (again.action, again.difference) == ("layout", None)
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "x.jsonl").write_text('{"session": 3}\n')
    with pytest.raises(ValueError, match="must be one of a recording"):
        list(replay(tmp_path / "bad"))
    with pytest.raises(ValueError, match="serve --record"):
        list(replay(tmp_path / "none"))


def test_a_recording_that_finds_no_room_ends_and_the_service_goes_on(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    service = Service(Store(None), recorder=Recorder(tmp_path))
    layout = json.dumps(layout_body(lab(), method="spatial")).encode()
    body = json.dumps(snapshot_body(seen_in(lab()))).encode()
    size = 0
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    usual = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        assert service.call("room", "layout", layout).status == 201
        assert service.call("room", "snapshots", body).status == 200
        size = (tmp_path / "room.jsonl").stat().st_size
        resource.setrlimit(resource.RLIMIT_FSIZE, (size + 100, before[1]))
        assert [service.call("room", "snapshots", body).status for _ in range(3)] == [200] * 3
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, usual)
    assert service.call("room", "snapshots", body).status == 200
    assert (tmp_path / "room.jsonl").stat().st_size == size
    assert [one.message for one in caplog.records if "recorded" in one.message] == [
        "nothing more is recorded of session room: no room left"
    ]
    assert [one.difference for one in replay(tmp_path)] == [None, None]


def test_the_certificate_is_kept_for_pinning_and_is_for_the_address(tmp_path: Path) -> None:
    made = self_signed(tmp_path, "192.0.2.7")
    assert self_signed(tmp_path, "192.0.2.7").pin == made.pin == pin_of(made.certificate)
    assert made.key.stat().st_mode & 0o077 == 0
    context = ssl.create_default_context(cafile=str(made.certificate))
    own = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    own.load_cert_chain(made.certificate, made.key)
    sides = socket.socketpair()
    with sides[0], sides[1]:
        there = threading.Thread(target=lambda: own.wrap_socket(sides[1], server_side=True).close())
        there.start()
        with context.wrap_socket(sides[0], server_hostname="192.0.2.7") as line:
            der = line.getpeercert(binary_form=True)
        there.join(10)
    assert der is not None
    (tmp_path / "certificate.pem").write_text(ssl.DER_cert_to_PEM_cert(der))
    assert pin_of(tmp_path / "certificate.pem") == made.pin
    (tmp_path / "certificate.pem").write_text("nothing")
    assert self_signed(tmp_path, "192.0.2.7").pin != made.pin


def test_answers_are_sent_at_once() -> None:
    """Without TCP_NODELAY each answer waits 40 ms for the other side's acknowledgement."""
    at = listening("127.0.0.1", 0)
    options = []

    async def one() -> None:
        def met(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            line = writer.get_extra_info("socket")
            options.append(line.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
            writer.close()

        async with await asyncio.start_server(met, sock=at):
            reader, writer = await asyncio.open_connection("127.0.0.1", at.getsockname()[1])
            await reader.read()
            writer.close()
            await writer.wait_closed()

    asyncio.run(one())
    assert options == [1]


def test_a_qr_code_is_a_square_of_blocks() -> None:
    lines = qr_code("https://192.0.2.7:8765/#token=abc").rstrip("\n").split("\n")
    assert len(lines) > 10
    assert lan_address().count(".") == 3


def begun(tmp_path: Path, *options: str) -> tuple["subprocess.Popen[str]", str]:
    """`farm-ar serve` in a process of its own, and its address once it has said it."""
    command = [sys.executable, "-m", "farm_ar", "serve", "--port", "0", "--state", str(tmp_path), *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert process.stdout is not None
    while line := process.stdout.readline():
        if line.startswith("Serving on "):
            return process, line.split()[2]
    raise AssertionError(process.wait())


def test_the_command_says_where_it_serves_and_ends_clean(tmp_path: Path) -> None:
    process, url = begun(
        tmp_path / "state", "--lan", "--token", "open-sesame-please", "--record", str(tmp_path / "record")
    )
    assert url.startswith("https://")
    context = ssl.create_default_context(cafile=str(tmp_path / "state" / "certificate.pem"))
    port = urlsplit(url).port
    with httpx.Client(base_url=f"https://127.0.0.1:{port}", verify=context, trust_env=False) as client:
        assert client.get("/v1/sessions").status_code == 401
        client.headers["Authorization"] = "Bearer open-sesame-please"
        begin(client, "room")
        pin = pin_of(tmp_path / "state" / "certificate.pem")
        pinned = ServiceSession(f"https://127.0.0.1:{port}", "room", "open-sesame-please", pin)
        assert pinned.state()["revision"] == 1
        pinned.close()
        with pytest.raises(OptionError, match="must be the SHA-256"):
            ServiceSession(f"https://127.0.0.1:{port}", "room", "open-sesame-please", pin[:-1] + "x")
        again = subprocess.run(
            [sys.executable, "-m", "farm_ar", "serve", "--port", "0", "--state", str(tmp_path / "state")],
            capture_output=True,
            text=True,
            check=False,
        )
        assert again.returncode == 2
        assert "must be used by one service only" in again.stderr
    process.send_signal(2)
    assert process.stdout is not None
    with process:
        said = process.stdout.read()
    assert process.returncode == 0
    assert "Token: open-sesame-please" in said
    assert said.rstrip().endswith("Stopped; what was confirmed is kept")
    assert "Traceback" not in said
    replayed = subprocess.run(
        [sys.executable, "-m", "farm_ar", "serve-replay", str(tmp_path / "record")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (replayed.returncode, replayed.stdout) == (0, "1 requests, bit-exact\n")


@pytest.mark.parametrize("package", ["fastapi", "uvicorn"])
def test_without_the_extra_a_line_says_what_to_install(tmp_path: Path, package: str) -> None:
    program = f"import sys; sys.modules[{package!r}] = None; from farm_ar.cli import main; main()"
    command = [sys.executable, "-c", program, "serve", "--state", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert f"the service needs {package}: pip install 'farm-ar[service]'" in done.stderr
    assert "Traceback" not in done.stderr


def test_who_was_answered_before_a_deletion_keeps_the_answer() -> None:
    """The session may be gone by the time that its listeners are to be told."""
    service = Service(Store(None))
    traffic = Traffic(service, ServiceLimits(), 1)
    call, scene = service.call, lab()
    body = json.dumps(snapshot_body(seen_in(scene))).encode()

    def and_gone(name: str, action: str, body: bytes) -> Any:
        answer = call(name, action, body)
        call(name, "delete", b"")
        return answer

    async def play() -> None:
        await traffic.ask("room", "layout", json.dumps(layout_body(scene)).encode())
        listener = await traffic.listen("room", "unity")
        service.call = and_gone  # type: ignore[method-assign]
        assert (await traffic.ask("room", "snapshots", body)).status == 200
        assert listener.events.get_nowait() is None

    asyncio.run(play())
    traffic.close()


@pytest.mark.parametrize("value", [0, -1, 2.5, 0.5, True, "5", None, float("nan")])
def test_a_limit_that_counts_is_a_whole_number(value: Any) -> None:
    with pytest.raises(OptionError, match="most_history: must be positive and a whole number"):
        ServiceLimits(most_history=value)
    with pytest.raises(OptionError, match="answer_s: must be positive"):
        ServiceLimits(answer_s="5")  # type: ignore[arg-type]
