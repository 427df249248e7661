"""The page that shows sessions, in a browser without a display."""

import os
import re
import shutil
import subprocess

import pytest

from tests.service.conftest import Live, lab, layout_body, seen_in, snapshot_body


@pytest.fixture(scope="module")
def browser() -> str:
    """Chromium; where there is none the test is skipped, unless all clients must be tested."""
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        said = "chromium is not installed: the service's pages are not tested"
        (pytest.fail if os.environ.get("FARM_AR_CLIENTS") == "all" else pytest.skip)(said)
    return program


def content(browser: str, url: str) -> str:
    """What a page shows once its script has run."""
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking"]
    command = [browser, *options, "--virtual-time-budget=5000", "--dump-dom", url]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    return done.stdout


def test_the_page_shows_layout_snapshot_confidences_and_history(browser: str, server: Live) -> None:
    labels = lab().layout.labels
    with server.client() as client:
        client.put("/v1/sessions/room/layout", json=layout_body(lab(), method="likelihood"))
        seen = client.post("/v1/sessions/room/snapshots", json=snapshot_body(seen_in(lab(), 0.05))).json()
        decided = {"revision": 1, "snapshot": seen["snapshot"], "labels": {"d0": "<b>new</b>"}}
        client.post("/v1/sessions/room/confirm", json=decided)
        client.post("/v1/sessions/room/snapshots", json=snapshot_body(seen_in(lab(), 0.1, kept=3)))
    page = content(browser, server.url)
    assert len(re.findall('class="known', page)) == len(labels) + 1
    assert len(re.findall('class="seen"', page)) == 3
    assert "revision 2" in page
    assert "confirm (revision 2): d0 is &lt;b&gt;new&lt;/b&gt;" in page
    assert re.search(r"\d+(\.\d)?%", page)
    assert not re.search(r'<button id="undo"[^>]*disabled', page)


def test_the_page_of_requests_lists_them(browser: str, server: Live) -> None:
    page = content(browser, f"{server.url}/docs")
    for request in ("PUT /v1/sessions/{name}/layout", "POST /v1/sessions/{name}/confirm", "GET /healthz"):
        assert request in page


def test_the_pages_load_nothing_from_elsewhere(server: Live) -> None:
    with server.client() as client:
        for path in ("/", "/docs"):
            text = client.get(path).text
            elsewhere = [link for link in re.findall(r"https?://[^\s\"'`<]+", text) if "w3.org" not in link]
            assert elsewhere == []
