"""`farm-ar play --lan`: the page for a phone, with TLS and a token."""

import os
import ssl
import subprocess
import sys
from urllib.parse import parse_qs, urlsplit

import httpx
import pytest
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect


def test_the_page_is_served_to_the_network_with_tls_and_a_token(tmp_path) -> None:
    command = [sys.executable, "-m", "farm_ar", "play", "--lan", "--port", "0"]
    environment = {**os.environ, "XDG_STATE_HOME": str(tmp_path)}
    environment.pop("FARM_AR_TOKEN", None)
    process = subprocess.Popen(
        command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    with process:
        link = urlsplit(process.stdout.readline().split()[2])
        assert link.scheme == "https"
        (token,) = parse_qs(link.fragment)["token"]
        tls = ssl.create_default_context(cafile=str(tmp_path / "farm-ar" / "certificate.pem"))
        with httpx.Client(base_url=f"https://127.0.0.1:{link.port}", verify=tls, trust_env=False) as client:
            assert client.get("/").status_code == 200
            assert client.get("/recordings.json").status_code == 401
            assert client.get("/recordings.json", params={"token": "guess"}).status_code == 401
            assert "gallery" in client.get("/recordings.json", params={"token": token}).json()
        games = f"wss://127.0.0.1:{link.port}/games/new"
        with pytest.raises(WebSocketException), connect(games, ssl=tls, proxy=None) as page:
            page.recv(5)
        with connect(f"{games}?token={token}&mode=tidy", ssl=tls, proxy=None) as page:
            assert '"mode":"tidy"' in page.recv(5)
        process.send_signal(2)
        said = process.stdout.read()
    assert process.returncode == 0
    assert "█" in said or "▀" in said  # the code for a phone's camera
    assert "SHA-256" in said
