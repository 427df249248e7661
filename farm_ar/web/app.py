"""The page and its games on HTTP: each game has a clock, one player and any number who watch."""

from __future__ import annotations

import asyncio
import json
import logging
import secrets
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from farm_ar import __version__
from farm_ar.envs.generator import JITTERS
from farm_ar.errors import InputError, OptionError, known_name
from farm_ar.service.access import Access
from farm_ar.service.refusals import missing_package
from farm_ar.web.gallery import Failures, cards_of, recorded_failure, shipped_gallery
from farm_ar.web.game import Game, scene_name
from farm_ar.web.messages import Json
from farm_ar.web.pages import add_files
from farm_ar.web.pointer import STEPS_PER_SECOND, Pointer
from farm_ar.web.recordings import demonstrations, recorded_script, recorded_trace
from farm_ar.web.rounds import FREE

try:
    from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
    from fastapi.requests import HTTPConnection
except ImportError:
    raise missing_package("fastapi") from None

_LOG = logging.getLogger(__name__)

FARM = "farm"
"""The scene on which every page may play."""

MOST_GAMES, KEPT_S, BEHIND = 32, 600.0, 8
"""Games at once; how long one without anybody is kept, seconds; messages that a slow viewer may lack."""

MOST_WAITING = 64
"""Messages that wait for a page at most: what is sent once, moments of the game but `BEHIND` of them."""

LONGEST_NAME, SOONEST_S = 32, 0.2
"""Letters of a game's name; seconds from one new game to the next."""

SEED_DIGITS = 10

ASKS_TRUTH, ASKS_ALL = '{"do":"truth"}', '{"do":"hello"}'
"""What every page may send, also one that watches: what is wrong; all anew, after showing something else."""

MOST_MESSAGE = 4096
"""Characters of what a page may send at once."""


@dataclass(eq=False)
class Table:
    """A game, its clock and who is there.

    Args:
        name: of the game, in links.
        game: the game.
        began: when the game began, seconds of the loop's clock.
        empty_since: since when nobody is there.
        failed: a game that cannot go on.
    """

    name: str
    game: Game
    player: WebSocket | None = None
    viewers: dict[WebSocket, asyncio.Queue[str]] = field(default_factory=dict)
    clock: asyncio.Task[None] | None = None
    began: float = 0.0
    empty_since: float = 0.0
    failed: Game | None = None

    def tell(self, message: str) -> None:
        """Have everybody get a moment of the game; one encoding for all. Who lags misses some."""
        for queue in self.viewers.values():
            _put(queue, message, BEHIND)

    async def run(self) -> None:
        """Let the game's time pass while somebody is there."""
        loop, step = asyncio.get_running_loop(), 1 / STEPS_PER_SECOND
        due = loop.time()
        while self.viewers:
            self.tick()
            due = max(due + step, loop.time() - step)  # what was missed is not caught up with
            await asyncio.sleep(max(0.0, due - loop.time()))
        self.empty_since = loop.time()

    def tick(self) -> None:
        """Let a step pass, and have everybody get what came of it."""
        self._step()
        while (news := self.game.news()) is not None:
            said = _encoded(news)
            for queue in self.viewers.values():
                _put(queue, said)
        self.tell(_encoded(self.game.state()))

    def _step(self) -> None:
        """Let the game go on; one that fails stands still, and a new one can be begun."""
        if self.game is self.failed:
            return
        try:
            self.game.step()
        except Exception:
            _LOG.exception("game %s cannot go on", self.name)
            self.failed = self.game
            reason = (
                "This game cannot go on, an error of farm-ar: see what the server printed. Begin a new one."
            )
            self.game.tell({"kind": "refused", "reason": reason})


def make_web_app(
    access: Access | None = None,
    seed: int = 0,
    reid: str = "spatial",
    gallery: Failures | None = None,
    scene: str = FARM,
) -> FastAPI:
    """The application of the page.

    Args:
        access: who may ask; on loopback anyone by default.
        seed: of the first game.
        reid: its re-identifier.
        gallery: failures to look at; those that come with farm-ar by default.
        scene: the first game's: "farm", or a scene file with a fixed object. Links may name it or the farm.
    """
    scenes, mine = {FARM: FARM, scene_name(scene): scene}, scene_name(scene)
    allowed, failures = access or Access(), shipped_gallery() if gallery is None else gallery
    cards = cards_of(failures)
    tables: dict[str, Table] = {}

    @asynccontextmanager
    async def life(app: FastAPI) -> AsyncIterator[None]:
        yield
        for table in tables.values():
            if table.clock is not None:
                table.clock.cancel()

    app = FastAPI(
        title="farm-ar: the game", version=__version__, docs_url=None, redoc_url=None, lifespan=life
    )
    app.state.tables = tables

    @app.get("/healthz")
    async def healthz() -> dict[str, str]:
        return {"status": "ok", "version": __version__}

    def let_in(asked: HTTPConnection) -> None:
        """See that who asks may; wrong tokens are counted by address."""
        address = asked.client.host if asked.client is not None else None
        allowed.check(asked.headers, asked.query_params, address)

    async def told(request: Request, begin: Callable[[], Callable[[], Json]], name: str = "") -> Response:
        """As JSON what a thread makes, of what is begun here, between two steps; with a name, as a file."""
        try:
            let_in(request)
            make = begin()
            text = await asyncio.to_thread(lambda: _encoded(make()))
        except InputError as problem:
            return Response(str(problem), getattr(problem, "status", 404))
        head = {"Content-Disposition": f'attachment; filename="{name}"'} if name else {}
        return Response(text, headers=head, media_type="application/json")

    def game_of(name: str) -> Game:
        if name not in tables:
            raise OptionError("game", "must be one that somebody plays", name)
        if tables[name].game.round.secret:
            raise OptionError("game", "must be one in which nothing is to be guessed now", name)
        return tables[name].game

    @app.get("/games/{name}/trace")
    async def trace(name: str, request: Request) -> Response:
        return await told(request, lambda: game_of(name).trace_so_far(), "farm-ar-game.json")

    @app.get("/games/{name}/recording")
    async def recording(name: str, request: Request) -> Response:
        def begin() -> Callable[[], Json]:
            make = game_of(name).trace_so_far()
            return lambda: recorded_trace(make())

        return await told(request, begin)

    @app.get("/recordings.json")
    async def recordings(request: Request) -> Response:
        return await told(request, lambda: lambda: {"recordings": demonstrations(), "gallery": cards})

    @app.get("/recordings/{name}.json")
    async def demonstration(name: str, request: Request) -> Response:
        if name in cards:
            failure = failures[list(cards).index(name)]
            return await told(request, lambda: lambda: recorded_failure(failure))
        return await told(request, lambda: lambda: _demonstration(name))

    @app.websocket("/games/{name}")
    async def play(socket: WebSocket, name: str) -> None:
        try:
            let_in(socket)
        except InputError as problem:
            await socket.close(1008, str(problem)[:120])
            return
        await socket.accept()  # before it a browser gets no reason
        try:
            first = {"seed": str(seed), "reid": reid, "scene": mine}
            table = _table(tables, name, {**first, **socket.query_params}, scenes)
        except InputError as problem:
            await socket.close(1008, str(problem)[:120])
            return
        await _attend(table, socket)

    add_files(app)
    return app


def _table(tables: dict[str, Table], name: str, asked: Mapping[str, str], scenes: Mapping[str, str]) -> Table:
    """The game of that name; "new" makes one, and so does a name of before the server restarted.

    Args:
        tables: the games by name.
        name: of a game.
        asked: how a new one begins, as the page's link says it.
        scenes: on which it may be, by name.
    """
    now = asyncio.get_running_loop().time()
    name = secrets.token_urlsafe(6) if name == "new" else name[:LONGEST_NAME]
    if name in tables:
        return tables[name]
    empty = sorted((table.empty_since, other) for other, table in tables.items() if not table.viewers)
    for since, other in empty:
        if now - since > KEPT_S or len(tables) >= MOST_GAMES:
            del tables[other]
    if len(tables) >= MOST_GAMES:
        raise OptionError("games", f"must be at most {MOST_GAMES} at once; try again later", len(tables) + 1)
    seed = asked.get("seed", "0")
    scene = scenes[known_name("scene", asked.get("scene", FARM), scenes)]
    number = int(seed) if seed.isdecimal() and len(seed) <= SEED_DIGITS else seed
    game = _new_game({**asked, "seed": number}, scene)
    tables[name] = table = Table(name, game, began=now, empty_since=now)
    return table


async def _attend(table: Table, socket: WebSocket) -> None:
    """Have a page play, or watch, until it goes."""
    queue: asyncio.Queue[str] = asyncio.Queue()
    if table.player is None:
        table.player = socket
    _greet(table, socket, queue)
    table.viewers[socket] = queue
    if table.clock is None or table.clock.done():
        table.clock = asyncio.create_task(table.run())
    sending = asyncio.create_task(_send(socket, queue))
    try:
        while True:
            text = await socket.receive_text()
            if text == ASKS_TRUTH:
                _put(queue, _encoded(table.game.truth()), BEHIND)
            elif text == ASKS_ALL:
                _greet(table, socket, queue)
            elif socket is table.player:
                _obey(table, text, queue)
            await asyncio.sleep(0)  # others have their turn, however many messages wait
    except (WebSocketDisconnect, RuntimeError, KeyError):
        pass
    finally:
        sending.cancel()
        table.viewers.pop(socket, None)
        table.empty_since = asyncio.get_running_loop().time()
        if table.player is socket:
            table.player, table.game.pointer = None, Pointer()
            for other, its in table.viewers.items():  # who has watched longest plays on
                table.player = other
                _greet(table, other, its)
                break


def _greet(table: Table, socket: WebSocket, queue: asyncio.Queue[str]) -> None:
    role = "player" if table.player is socket else "viewer"
    _put(queue, _encoded({**table.game.hello(), "game": table.name, "role": role}))


async def _send(socket: WebSocket, queue: asyncio.Queue[str]) -> None:
    with suppress(WebSocketDisconnect, RuntimeError):
        while True:
            await socket.send_text(await queue.get())


def _obey(table: Table, text: str, queue: asyncio.Queue[str]) -> None:
    """Do what the player's page says; what cannot be done is answered in a line."""
    try:
        message = json.loads(text) if len(text) <= MOST_MESSAGE else None
        if not isinstance(message, dict):
            raise OptionError(
                "message", f"must be a JSON object of at most {MOST_MESSAGE} characters", text[:40]
            )
        if message.get("do") == "new":
            now = asyncio.get_running_loop().time()
            if now - table.began < SOONEST_S:
                expected = f"must be a new game no sooner than {SOONEST_S:g} s after the last"
                raise OptionError("do", expected, f"{now - table.began:.2f} s")
            table.game, table.began = _new_game(message, table.game.scene), now
            for socket, its in table.viewers.items():
                _greet(table, socket, its)
        else:
            table.game.obey(message)
    except (InputError, ValueError, RecursionError) as problem:
        _put(queue, _encoded({"kind": "refused", "reason": str(problem)}), BEHIND)


@lru_cache(maxsize=8)
def _demonstration(name: str) -> Json:
    return recorded_script(known_name("recording", name, demonstrations()))


def _new_game(message: Mapping[str, Any], scene: str) -> Game:
    seed = message.get("seed", 0)
    if not isinstance(seed, int) or isinstance(seed, bool) or not 0 <= seed < 2**31:
        raise OptionError("seed", f"must be a whole number from 0 to {2**31 - 1}", seed)
    defaults = {"reid": "spatial", "jitter": "easy", "gaze": "all", "beside": "", "mode": FREE}
    names = (str(message.get(name) or default) for name, default in defaults.items())
    reid, jitter, gaze, beside, mode = names
    return Game(seed, reid, known_name("jitter", jitter, JITTERS), gaze, beside, mode, scene)


def _put(queue: asyncio.Queue[str], message: str, most: int = MOST_WAITING) -> None:
    """Have a page get a message, unless so many are waiting for it already."""
    if queue.qsize() < most:
        queue.put_nowait(message)


def _encoded(message: dict[str, Any]) -> str:
    return json.dumps(message, separators=(",", ":"))
