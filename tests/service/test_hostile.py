"""Attacks by who can reach the service, or hands somebody a recording or a stored file."""

from __future__ import annotations

import hmac
import itertools
import json
import os
import socket
import sqlite3
import struct
import time
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from farm_ar.cli.serve import certificate_for
from farm_ar.errors import OptionError, SessionError
from farm_ar.service.access import GUESSES_S, MOST_GUESSES, Access, Guesses, check_token
from farm_ar.service.limits import ServiceLimits
from farm_ar.service.network import self_signed
from farm_ar.service.recordings import Recorder, replay, safe
from farm_ar.service.refusals import RefusedError
from farm_ar.service.service import Service
from farm_ar.service.store import Store
from tests.service.conftest import Live, lab, layout_body, live, seen_in, snapshot_body

TOKEN = "open-sesame-please"


@pytest.fixture(scope="module")
def guarded() -> Iterator[Live]:
    forgetful = Guesses(itertools.count(0.0, GUESSES_S).__next__)
    yield from live(ServiceLimits(most_bytes=20_000, body_s=1.0), Access(TOKEN, guesses=forgetful))


def said(url: str, *parts: bytes, patience: float = 10.0) -> bytes:
    """What a service answers to bytes, until it closes the line or a whole answer is there."""
    place = urlsplit(url)
    with socket.create_connection((place.hostname, place.port), timeout=patience) as line:
        for part in parts:
            line.sendall(part)
        answer = b""
        while b"\r\n\r\n" not in answer and (more := line.recv(65536)):
            answer += more
        return answer


def asked_on(line: socket.socket, request: bytes) -> bytes:
    """What is answered, in JSON, on a line that stays open."""
    line.sendall(request)
    answer = b""
    while not answer.endswith(b"}"):
        more = line.recv(65536)
        assert more, "the line was closed"
        answer += more
    return answer


def head(path: str, *more: str, method: str = "POST", token: str | None = TOKEN) -> bytes:
    lines = [f"{method} {path} HTTP/1.1", "Host: 127.0.0.1", *more]
    lines += [] if token is None else [f"Authorization: Bearer {token}"]
    return "\r\n".join([*lines, "", ""]).encode("latin-1")


SNAPSHOTS = "/v1/sessions/room/snapshots"


@pytest.mark.parametrize(
    "given",
    ["", TOKEN[:-1], TOKEN + "x", TOKEN.upper(), f" {TOKEN}", f"{TOKEN}, {TOKEN}", "\xff\xfe", "x" * 10_000],
)
def test_another_token_opens_nothing(guarded: Live, given: str) -> None:
    for path, method in ((SNAPSHOTS, "POST"), ("/v1/sessions", "GET"), ("/v1/sessions/room", "DELETE")):
        answer = said(guarded.url, head(path, "Content-Length: 0", method=method, token=given))
        assert answer.startswith((b"HTTP/1.1 401", b"HTTP/1.1 400")), answer
        assert TOKEN.encode() not in answer


def test_a_token_is_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, usual = [], hmac.compare_digest

    def compare(one: bytes, other: bytes) -> bool:
        asked.append((one, other))
        return usual(one, other)

    monkeypatch.setattr("farm_ar.service.access.hmac.compare_digest", compare)
    with pytest.raises(RefusedError):
        Access(TOKEN).check({"authorization": "Bearer another"}, {})
    assert asked == [(b"another", TOKEN.encode())]


@pytest.mark.parametrize(
    "origin", ["null", "https://evil.example", "http://127.0.0.1", "file://", "http://[::1"]
)
def test_a_page_of_another_origin_cannot_ask_even_with_the_token(guarded: Live, origin: str) -> None:
    answer = said(guarded.url, head(SNAPSHOTS, f"Origin: {origin}x:1", "Content-Length: 0"))
    assert answer.startswith(b"HTTP/1.1 403")
    url = guarded.url.replace("http", "ws") + f"/v1/sessions/room/events?token={TOKEN}"
    with pytest.raises(InvalidStatus), connect(url, proxy=None, origin=f"{origin}x:1"):  # type: ignore[arg-type]
        pass


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "localhost@evil.example", "[", ""]
)
def test_a_name_that_points_here_is_not_served_on_loopback(server: Live, host: str) -> None:
    request = f"POST {SNAPSHOTS} HTTP/1.1\r\nHost: {host}\r\nContent-Length: 0\r\n\r\n".encode()
    assert said(server.url, request).startswith((b"HTTP/1.1 403", b"HTTP/1.1 400"))


def test_a_websocket_needs_the_token_and_reads_nothing(guarded: Live) -> None:
    url = guarded.url.replace("http", "ws") + "/v1/sessions/socket/events"
    for query in ("", "?token=", "?token=x", f"?token={TOKEN}x", f"?token=x&tokens={TOKEN}"):
        with pytest.raises(InvalidStatus), connect(url + query, proxy=None):
            pass
    with guarded.client() as client:
        begun = client.put("/v1/sessions/socket/layout", json=layout_body(lab(), method="spatial"))
        assert begun.status_code == 201
        with connect(f"{url}?token={TOKEN}", proxy=None) as line:
            line.recv(timeout=10)
            line.send("x" * 60_000)
            line.send(b"\x00" * 100)
            assert client.get("/v1/sessions/socket/state").status_code == 200


def test_chunks_are_counted_and_timed_like_any_body(guarded: Live) -> None:
    chunked = head(SNAPSHOTS, "Transfer-Encoding: chunked")
    chunk = b"1000\r\n" + b" " * 0x1000 + b"\r\n"
    assert said(guarded.url, chunked, *[chunk] * 6).startswith(b"HTTP/1.1 413")
    begun = time.monotonic()
    assert said(guarded.url, chunked, b"1\r\n{\r\n").startswith(b"HTTP/1.1 408")
    assert time.monotonic() - begun < 8
    both = head(SNAPSHOTS, "Transfer-Encoding: chunked", "Content-Length: 5")
    assert not said(guarded.url, both, b"0\r\n\r\n").startswith(b"HTTP/1.1 2")  # what smugglers send
    for length in ("-1", "1e3", "99999999999999999999999999", "0x10"):
        answer = said(guarded.url, head(SNAPSHOTS, f"Content-Length: {length}"))
        assert answer.startswith((b"HTTP/1.1 400", b"HTTP/1.1 413")), (length, answer)


@pytest.mark.parametrize(
    "name",
    [
        "..",
        "%2e%2e",
        "..%2f..%2fetc",
        "a%2fb",
        "a%00b",
        "%ff",
        "r%C3%B6om",
        ".hidden",
        "a" * 65,
        "a%0d%0ab",
        "%5c",
    ],
)
def test_a_name_that_is_a_path_is_no_session_and_no_file(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "deep" / "record"
    service = Service(Store(None), recorder=Recorder(folder))
    for one in live(service=service):
        body = json.dumps(layout_body(lab(), method="spatial")).encode()
        for path, method in (
            (f"/v1/sessions/{name}/layout", "PUT"),
            (f"/v1/sessions/{name}/snapshots", "POST"),
        ):
            request = head(path, f"Content-Length: {len(body)}", method=method, token=None)
            assert said(one.url, request + body)[9:12] in (b"400", b"404", b"422")
        with one.client() as client:
            assert client.get("/v1/sessions").json() == {"sessions": []}
    assert {path.name for path in tmp_path.rglob("*")} <= {"deep", "record", "refused.jsonl"}


def test_names_that_some_systems_take_for_the_same_have_files_of_their_own() -> None:
    names = ["room", "Room", "ROOM", "room.", "con", "CON", "nul.txt", "refused", "com1", "a" * 64]
    files = [safe(name).lower() for name in names]
    assert len(set(files)) == len(names)
    assert not {"con", "nul.txt", "refused", "com1"} & set(files)
    assert not any(one.endswith(".") for one in files)
    assert (safe("room"), safe("../room"), safe("x" * 10_000)) == ("room", "refused", "refused")


def test_a_token_that_is_quickly_guessed_or_no_header_can_carry_is_refused() -> None:
    check_token(TOKEN)
    for token in ("sesame", "open sesame please", "öffne-dich-bitte", "open\nsesame-please"):
        with pytest.raises(OptionError, match="must be at least"):
            check_token(token)


def test_a_key_that_is_not_the_certificates_is_refused(tmp_path: Path) -> None:
    one, other = self_signed(tmp_path / "a", "127.0.0.1"), self_signed(tmp_path / "b", "127.0.0.1")
    assert certificate_for(tmp_path, False, one.certificate, one.key)[0] is not None
    for key in (other.key, one.certificate, tmp_path / "none"):
        with pytest.raises(OptionError, match="must be the certificate's"):
            certificate_for(tmp_path, False, one.certificate, key)


def test_pages_and_answers_cannot_be_framed_or_sniffed(guarded: Live) -> None:
    with guarded.client() as client:
        page = client.get("/").headers
        assert "frame-ancestors 'none'" in page["content-security-policy"]
        assert page["referrer-policy"] == "no-referrer"
        for path in ("/", "/docs", "/v1/sessions", "/v1/sessions/none/state"):
            assert client.get(path).headers["x-content-type-options"] == "nosniff"
        assert client.post(SNAPSHOTS, content=b"{").headers["x-content-type-options"] == "nosniff"


def bomb(width: int, height: int) -> bytes:
    """A small PNG that says it is as large as that."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    size = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    pixels = chunk(b"IDAT", zlib.compress(b"\x00" * 100_000, 9))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", size) + pixels + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        ("multipart/form-data", b""),
        ("multipart/form-data; boundary=", b"--\r\n"),
        ("multipart/form-data; boundary=x", b"--y\r\n\r\n--y--"),
        ("multipart/form-data; boundary=x", b"--x\r\nContent-Disposition: form-data\r\n\r\n{}\r\n--x--"),
        ("multipart/form-data; boundary=x", b"--x\r\n" + b"A: b\r\n" * 5000 + b"\r\n\r\n--x--"),
        (
            "multipart/form-data; boundary=x",
            b'--x\r\nContent-Disposition: form-data; name="camera"\r\n\r\n{}',
        ),
        (
            "multipart/form-data; boundary=x",
            b'--x\r\nContent-Disposition: form-data; name="camera"\r\n\r\n{}\r\n' * 50 + b"--x--",
        ),
        ("multipart/form-data; boundary=" + "x" * 5000, b"--"),
        ("multipart/form-data; boundary=\xff", b"--\xff"),
    ],
)
def test_odd_parts_are_refused(guarded: Live, kind: str, body: bytes) -> None:
    request = head(SNAPSHOTS, f"Content-Type: {kind}", f"Content-Length: {len(body)}")
    assert said(guarded.url, request + body)[9:12] in (b"400", b"404", b"422")


def test_an_image_that_says_it_is_huge_is_not_unpacked(asked_image: Any) -> None:
    for width, height in ((60_000, 60_000), (1, 2**31 - 1), (2**24 + 1, 1)):
        begun = time.monotonic()
        status, reply = asked_image(bomb(width, height))
        assert status in (413, 422)
        assert "pixels" in reply["error"]["message"] or "image" in reply["error"]["field"]
        assert time.monotonic() - begun < 2


@pytest.fixture
def asked_image() -> Any:
    from farm_ar.vision.photos import decoded_image

    def ask(image: bytes) -> tuple[int, Any]:
        from farm_ar.errors import InputError
        from farm_ar.service.service import refused

        try:
            decoded_image(image, most_pixels=ServiceLimits().most_pixels)
        except InputError as problem:
            answer = refused(problem)
            return answer.status, json.loads(answer.body)
        raise AssertionError("it was unpacked")

    return ask


ROW: dict[str, Any] = {"session": "room", "began": None}
ASK: dict[str, Any] = {"action": "undo", "body": "{}", "status": 404, "answer": "{}"}

BAD_LINES = {
    "nothing": b"\n",
    "no JSON": b"{]",
    "no text": b"\xff\xfe",
    "very deep": b"[" * 100_000,
    "a number": b"3",
    "a list": json.dumps([ASK]).encode(),
    "another action": json.dumps({**ASK, "action": "__class__"}).encode(),
    "a body that is none": json.dumps({**ASK, "body": 3}).encode(),
    "an answer that is none": json.dumps({**ASK, "answer": None}).encode(),
    "an answer of half a pair": json.dumps({**ASK, "answer": "\ud800"}).encode(),
    "a status that is none": json.dumps({**ASK, "status": "200"}).encode(),
    "a name that is none": json.dumps({**ROW, "session": ["room"]}).encode(),
    "a session that is none": json.dumps({**ROW, "began": {"revision": 1}}).encode(),
    "a session without a revision": json.dumps({**ROW, "began": {"method": "spatial"}}).encode(),
    "a session that is a list": json.dumps({**ROW, "began": [1]}).encode(),
    "an end that is none": json.dumps({**ROW, "ended": "1"}).encode(),
    "a field more": json.dumps({**ROW, "run": "rm"}).encode(),
}


@pytest.mark.parametrize("name", BAD_LINES)
def test_a_recording_of_somebody_else_is_read_or_refused_in_a_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "room.jsonl").write_bytes(json.dumps(ROW).encode() + b"\n" + BAD_LINES[name] + b"\n")
    with pytest.raises(SessionError) as caught:
        list(replay(tmp_path))
    assert str(caught.value).startswith("room.jsonl: line 2")
    assert "\n" not in str(caught.value)


def test_answers_of_then_that_are_no_answers_differ(tmp_path: Path) -> None:
    for k, answer in enumerate(["", "{", "[]", "3", "[" * 100_000]):
        status = 404
        path = tmp_path / str(k) / "room.jsonl"
        path.parent.mkdir()
        path.write_text(
            json.dumps(ROW) + "\n" + json.dumps({**ASK, "answer": answer, "status": status}) + "\n"
        )
        (played,) = replay(path.parent)
        assert played.difference


def test_a_recording_is_a_plain_file(tmp_path: Path) -> None:
    (tmp_path / "a.jsonl").mkdir()
    with pytest.raises(SessionError, match="must be a plain file"):
        list(replay(tmp_path))
    (tmp_path / "a.jsonl").rmdir()
    os.mkfifo(tmp_path / "a.jsonl")
    with pytest.raises(SessionError, match="must be a plain file"):
        list(replay(tmp_path))


def stored(path: Path) -> Path:
    """A file of the service with the sessions `good` and `bad`."""
    service = Service(Store(path))
    for name in ("good", "bad"):
        assert (
            service.call(name, "layout", json.dumps(layout_body(lab(), method="spatial")).encode()).status
            == 201
        )
    service.store.close()
    return path


@pytest.mark.parametrize(
    "row",
    [
        "",
        "{",
        "[]",
        "3",
        "null",
        "{}",
        "[" * 100_000,
        b"\xff\xfe",
        None,
        '{"method": "spatial", "options": {}, "checks": true, "revision": "1", "history": [], "session": {}}',
        '{"method": "spatial", "options": {}, "checks": true, "revision": 1, "history": [3], "session": {}}',
        '{"method": "os:system", "options": {}, "checks": true, "revision": 1, "history": [], "session": {}}',
    ],
)
def test_a_row_that_cannot_be_read_is_refused_and_can_be_deleted(tmp_path: Path, row: Any) -> None:
    path = stored(tmp_path / "sessions.sqlite")
    with sqlite3.connect(path) as base:
        base.execute("update sessions set row = ? where name = 'bad'", (row,))
    base.close()
    service = Service(Store(path), recorder=Recorder(tmp_path / "record"))
    body = json.dumps(snapshot_body(seen_in(lab()))).encode()
    for action in ("snapshots", "undo", "layout"):
        answer = service.call("bad", action, body)
        assert answer.status in (404, 422), answer
    assert service.state("bad", "unity").status in (404, 422)
    assert service.call("good", "snapshots", body).status == 200
    assert service.call("bad", "delete", b"").status == 200
    layout = json.dumps(layout_body(lab(), method="spatial")).encode()
    again = service.call("bad", "layout", layout)
    assert (again.status, json.loads(again.body)["revision"]) == (201, 2)
    service.store.close()


HOSTILE = {
    "a view": "drop table sessions; create view sessions as select 'a' as name, 1 as revision, '{}' as row",
    "a trigger": "create trigger t after insert on sessions begin delete from sessions; end",
    "another table": "create table more (x)",
    "another column": "alter table sessions add column more text",
    "no session table": "drop table sessions; create table sessions (name text)",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_file_that_holds_other_things_is_not_used(tmp_path: Path, name: str) -> None:
    path = stored(tmp_path / "sessions.sqlite")
    base = sqlite3.connect(path)
    base.executescript(HOSTILE[name])
    base.close()
    for _ in range(2):  # and it is let go again
        with pytest.raises(OptionError, match="it holds other tables"):
            Store(path)


def test_a_file_that_is_no_database_is_not_used(tmp_path: Path) -> None:
    path = tmp_path / "sessions.sqlite"
    for data in (b"nothing" * 1000, stored(tmp_path / "other.sqlite").read_bytes()[:5000]):
        path.write_bytes(data)
        with pytest.raises(OptionError, match="must be writable"):
            Store(path)
        assert path.read_bytes() == data


def test_connections_that_say_nothing_do_not_keep_others_out(tmp_path: Path) -> None:
    """Also before TLS has begun, where there is no request whose head could be timed."""
    tls = self_signed(tmp_path, "127.0.0.1")
    for one in live(access=Access(TOKEN), tls=tls):
        place = urlsplit(one.url)
        silent = [socket.create_connection((place.hostname, place.port), timeout=20) for _ in range(100)]
        for line in silent[::2]:
            line.sendall(b"\x16\x03")
        with one.client(verify=False) as client:
            assert client.get("/v1/sessions").status_code == 200
        for line in silent:
            line.close()


def test_connections_that_are_too_many_are_told_to_come_again() -> None:
    whole = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    for one in live(ServiceLimits(most_connections=5)):
        place = urlsplit(one.url)
        first = [socket.create_connection((place.hostname, place.port), timeout=20) for _ in range(5)]
        for line in first:
            assert asked_on(line, whole).startswith(b"HTTP/1.1 200")
        answer = said(one.url, whole)
        assert answer.startswith(b"HTTP/1.1 429")
        assert b"Retry-After: 1" in answer or b"retry-after: 1" in answer.lower()
        with one.client() as client:  # each connection is one too many, so each is closed
            for _ in range(2):
                reply = client.post("/v1/sessions/a/snapshots", json={})
                assert (reply.status_code, reply.json()["error"]["field"]) == (429, "connections")
                assert reply.headers["connection"] == "close"
        url = one.url.replace("http", "ws") + "/v1/sessions/a/events"
        with pytest.raises(InvalidStatus) as caught, connect(url, proxy=None):
            pass
        assert caught.value.response.status_code == 429
        with socket.create_connection((place.hostname, place.port), timeout=20) as silent:
            begun = time.monotonic()
            assert silent.recv(65536) == b""
            assert time.monotonic() - begun < 5
        assert asked_on(first[0], whole).startswith(b"HTTP/1.1 200")  # those that came in time are served
        for line in first:
            line.close()
        with one.client() as client:
            end = time.monotonic() + 10
            while client.get("/healthz").status_code != 200:
                assert time.monotonic() < end


def test_who_guesses_tokens_is_answered_429_on_every_way_in() -> None:
    for one in live(access=Access(TOKEN)):
        for k in range(MOST_GUESSES):
            more = ["Content-Length: 0", f"X-Forwarded-For: 10.0.0.{k}"]  # which is not believed
            assert said(one.url, head(SNAPSHOTS, *more, token=f"try-{k}")).startswith(b"HTTP/1.1 401")
        for path, method in ((SNAPSHOTS, "POST"), ("/v1/sessions", "GET")):
            answer = said(one.url, head(path, "Content-Length: 0", method=method))
            assert answer.startswith(b"HTTP/1.1 429")
            seconds = int(answer.lower().partition(b"retry-after: ")[2].partition(b"\r\n")[0])
            assert 30 < seconds <= 60
        url = one.url.replace("http", "ws") + f"/v1/sessions/a/events?token={TOKEN}"
        with pytest.raises(InvalidStatus) as caught, connect(url, proxy=None):
            pass
        assert caught.value.response.status_code == 429
        with one.client() as client:
            assert client.get("/healthz").status_code == 200


@pytest.mark.parametrize(
    ("query", "status"), [("", 401), (f"?token={TOKEN}", 404), (f"?token={TOKEN}&frame=x", 422)]
)
def test_a_websocket_that_is_refused_is_told_why(guarded: Live, query: str, status: int) -> None:
    url = guarded.url.replace("http", "ws") + "/v1/sessions/nowhere/events" + query
    with pytest.raises(InvalidStatus) as caught, connect(url, proxy=None):
        pass
    assert caught.value.response.status_code == status
    assert json.loads(caught.value.response.body)["error"]["message"]
