"""The page's server: names of games, what a page may send, and games that go on meanwhile."""

import asyncio
import json
import time
import warnings
from contextlib import ExitStack
from pathlib import Path

import pytest
from fastapi import WebSocketDisconnect

from farm_ar.envs import first_difference
from farm_ar.errors import OptionError
from farm_ar.service.access import MOST_GUESSES, Access
from farm_ar.web import app as pages
from farm_ar.web.app import MOST_GAMES, Table, make_web_app
from farm_ar.web.game import Game
from farm_ar.web.pointer import STEPS_PER_SECOND

OFFICE = str(Path(__file__).parents[2] / "examples" / "data" / "before.json")

SCENES = {"farm": "farm"}

LOOPBACK, SOCKETS = "http://127.0.0.1", "ws://127.0.0.1"


def served(**options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it would rather have a package that is not there
        from starlette.testclient import TestClient
    return TestClient(make_web_app(**options), base_url=LOOPBACK)


@pytest.fixture
def client():
    with served() as one:
        yield one


def hello(socket):
    while True:
        message = json.loads(socket.receive_text())
        if message["kind"] == "hello":
            return message


def said(socket, kind):
    for _ in range(200):
        message = json.loads(socket.receive_text())
        if message["kind"] == kind:
            return message
    raise AssertionError(kind)


def test_a_long_name_is_one_game(client):
    with client.websocket_connect(f"{SOCKETS}/games/" + "x" * 50) as first:
        assert hello(first)["role"] == "player"
        with client.websocket_connect(f"{SOCKETS}/games/" + "x" * 50) as second:
            assert hello(second)["role"] == "viewer"
        assert len(client.app.state.tables) == 1


@pytest.mark.parametrize("host", ["[", "evil.example", "127.0.0.1.evil.example"])
def test_a_strange_host_is_refused(client, host):
    assert client.get("/recordings.json", headers={"Host": host}).status_code == 403
    assert client.get("/recordings.json", headers={"Origin": f"http://{host}"}).status_code == 403


@pytest.mark.parametrize(
    "text",
    [
        *("", "{", "[]", '{"x": "a"}', '{"x": NaN, "z": 0, "turn": 0}', "9" * 5000, "[" * 3000),
        *('{"do": "new", "seed": -1}', '{"do": "new", "reid": "magic"}'),
    ],
)
def test_what_cannot_be_done_is_said_and_the_game_goes_on(client, text):
    with client.websocket_connect(f"{SOCKETS}/games/new") as page:
        hello(page)
        asyncio.run(asyncio.sleep(pages.SOONEST_S))
        page.send_text(text)
        assert said(page, "refused")["reason"]
        step = said(page, "state")["step"]
        assert said(page, "state")["step"] > step


def test_new_games_do_not_follow_one_another_too_soon(client, monkeypatch):
    with client.websocket_connect(f"{SOCKETS}/games/new") as page:
        hello(page)
        asyncio.run(asyncio.sleep(pages.SOONEST_S))
        page.send_text(json.dumps({"do": "new", "seed": 1}))
        assert hello(page)["seed"] == 1
        monkeypatch.setattr(pages, "SOONEST_S", 3600.0)  # a busy machine takes longer than it is
        page.send_text(json.dumps({"do": "new", "seed": 2}))
        assert "no sooner" in said(page, "refused")["reason"]


def test_a_trace_saved_while_the_game_is_played_plays_again(client):
    with client.websocket_connect(f"{SOCKETS}/games/mine") as page:
        hello(page)
        page.send_text(json.dumps({"x": 0.6, "z": 0.3, "turn": 0}))
        for _ in range(3):
            trace = client.get("/games/mine/trace").json()
            assert len(trace["hashes"]) == len(trace["actions"]) + 1
            assert first_difference(trace) is None
    assert client.get("/games/other/trace").status_code == 404


def test_a_trace_does_not_give_away_what_is_to_be_guessed(client):
    with client.websocket_connect(f"{SOCKETS}/games/mine?mode=guess") as page:
        hello(page)
        page.send_text(json.dumps({"do": "rearrange"}))
        assert said(page, "round")["stage"] == "moving"
        for what in ("trace", "recording"):
            reply = client.get(f"/games/mine/{what}")
            assert (reply.status_code, "guessed" in reply.text) == (404, True)


def test_who_watches_may_ask_what_is_true_but_not_play(client):
    with client.websocket_connect(f"{SOCKETS}/games/mine") as page:
        hello(page)
        with client.websocket_connect(f"{SOCKETS}/games/mine") as other:
            assert hello(other)["role"] == "viewer"
            other.send_text(json.dumps({"x": 0.6, "z": 0.3}))
            other.send_text('{"do":"truth"}')
            assert said(other, "truth")["number"] == 0
        assert client.app.state.tables["mine"].game.pointer.away


def test_who_plays_on_begins_without_the_hand_of_who_has_gone(client):
    with ExitStack() as gone:
        page = gone.enter_context(client.websocket_connect(f"{SOCKETS}/games/mine"))
        hello(page)
        with client.websocket_connect(f"{SOCKETS}/games/mine") as other:
            hello(other)
            page.send_text(json.dumps({"x": 0.6, "z": 0.3, "grip": True}))
            page.send_text('{"do":"truth"}')
            said(page, "truth")
            game = client.app.state.tables["mine"].game
            assert not game.pointer.away
            gone.close()
            assert hello(other)["role"] == "player"
            assert game.pointer.away


def test_who_has_shown_something_else_gets_all_anew_and_stays_who_it_was(client):
    with client.websocket_connect(f"{SOCKETS}/games/mine") as page:
        hello(page)
        with client.websocket_connect(f"{SOCKETS}/games/mine") as other:
            hello(other)
            for one, role in ((page, "player"), (other, "viewer")):
                one.send_text('{"do":"hello"}')
                assert hello(one)["role"] == role


def test_a_link_names_the_farm_or_the_scene_that_is_served():
    with served(scene=OFFICE) as client:
        for query, width in (("", 5.0), ("?scene=before", 5.0), ("?scene=farm", 1.2)):
            with client.websocket_connect(f"{SOCKETS}/games/new{query}") as page:
                assert hello(page)["width"] == width
                asyncio.run(asyncio.sleep(pages.SOONEST_S))
                page.send_text(json.dumps({"do": "new", "seed": 1, "scene": "/etc/passwd"}))
                assert hello(page)["width"] == width  # a new game is played where the last one was
        with client.websocket_connect(f"{SOCKETS}/games/new?scene=../{Path(OFFICE).name}") as page:
            with pytest.raises(WebSocketDisconnect) as refused:
                page.receive_text()
            assert (refused.value.code, refused.value.reason.split(":")[0]) == (1008, "scene")


def test_a_game_that_fails_stands_still_and_a_new_one_can_be_begun(client, monkeypatch):
    def fails(game):
        raise ValueError("broken")

    with client.websocket_connect(f"{SOCKETS}/games/mine") as page:
        hello(page)
        step = said(page, "state")["step"]
        monkeypatch.setattr(client.app.state.tables["mine"].game, "step", fails.__get__(None, object))
        assert "cannot go on" in said(page, "refused")["reason"]
        asyncio.run(asyncio.sleep(pages.SOONEST_S))
        page.send_text(json.dumps({"do": "new", "seed": 1}))
        assert hello(page)["seed"] == 1
        assert said(page, "state")["step"] <= step + 10
        assert said(page, "state")["step"] >= 1


def test_a_trace_is_that_of_when_it_was_asked_for():
    game = Game()
    game.step()
    make = game.trace_so_far()
    game.step()
    assert len(make()["actions"]) == 1


def test_games_that_nobody_is_in_make_room_for_new_ones():
    async def names():
        tables: dict[str, Table] = {}
        for k in range(MOST_GAMES + 3):
            pages._table(tables, f"game {k}", {}, SCENES)
        first = pages._table(tables, "game 34", {}, SCENES)
        assert pages._table(tables, "game 34", {}, SCENES) is first
        assert len(tables) <= MOST_GAMES
        for table in tables.values():
            table.viewers[object()] = asyncio.Queue()
        with pytest.raises(OptionError, match="at once"):
            pages._table(tables, "one more", {}, SCENES)

    asyncio.run(names())


def test_a_page_that_does_not_read_misses_moments_but_nothing_that_is_said_once():
    async def queue():
        table = Table("slow", Game())
        table.viewers[object()] = waiting = asyncio.Queue()
        table.viewers[object()] = asyncio.Queue()
        clock = asyncio.create_task(table.run())
        end = time.monotonic() + 20
        while waiting.qsize() < pages.BEHIND and time.monotonic() < end:
            await asyncio.sleep(0.01)
        await asyncio.sleep(10 / STEPS_PER_SECOND)
        clock.cancel()
        return waiting.qsize()

    assert asyncio.run(queue()) == pages.BEHIND


def test_wrong_tokens_are_counted_by_address():
    with served(access=Access("open-sesame-please")) as client:
        wrong = [client.get("/recordings.json?token=another").status_code for _ in range(MOST_GUESSES + 1)]
        right = client.get("/recordings.json?token=open-sesame-please").status_code
    assert wrong == [401] * MOST_GUESSES + [429]
    assert right == 429
