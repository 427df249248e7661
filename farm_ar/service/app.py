"""The service on HTTP: a FastAPI application of the sessions, their listeners, and a page to look at them."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator, AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from importlib.resources import files

from farm_ar import __version__
from farm_ar.errors import InputError, OptionError
from farm_ar.scenes import WORLD_FRAMES
from farm_ar.service.access import Access
from farm_ar.service.refusals import NO_JSON, WRONG, RefusedError, missing_package
from farm_ar.service.schemas import REFUSED, bodies, path_of, replies
from farm_ar.service.service import SEPARATOR, Answer, Service, refused
from farm_ar.service.shortcut import Asking, Receive, Shortcut, address_of, body_of, is_form
from farm_ar.service.traffic import Traffic

try:
    from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
    from fastapi.middleware.cors import CORSMiddleware
    from starlette.datastructures import UploadFile
    from starlette.formparsers import MultiPartException, MultiPartParser
    from starlette.requests import ClientDisconnect
except ImportError:
    raise missing_package("fastapi") from None

TITLE = "farm-ar: which of these identical objects is which"

POLICY = (
    "default-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; connect-src 'self' ws: wss:; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
"""What the pages may load: nothing from elsewhere; and no page may show them inside itself."""

GUARDS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",  # a token may be in an address
}

WORKERS = 4
"""Threads that identify."""

SLOW_LISTENER = 1013
"""Why a WebSocket is closed whose messages are not fetched: come again."""

Handler = Callable[[Request], Awaitable[Answer]]


def make_app(service: Service, access: Access | None = None, workers: int = WORKERS) -> FastAPI:
    """The application of a service.

    Args:
        service: whose sessions are served.
        access: who may ask; on loopback anyone by default.
        workers: threads that identify.
    """
    allowed = access or Access()
    traffic = Traffic(service, service.limits, workers)

    @asynccontextmanager
    async def life(app: FastAPI) -> AsyncIterator[None]:
        yield
        traffic.close()
        service.store.close()

    app = FastAPI(
        title=TITLE,
        version=__version__,
        docs_url=None,
        redoc_url=None,
        lifespan=life,
        separate_input_output_schemas=False,
    )
    app.state.traffic, app.state.access = traffic, allowed
    _add_pages(app)
    _add_sessions(app, traffic, allowed)
    _add_listening(app, traffic, allowed)
    if allowed.origins:  # the last one added comes first
        app.add_middleware(
            CORSMiddleware,
            allow_origins=list(allowed.origins),
            allow_methods=["GET", "PUT", "POST", "DELETE"],
            allow_headers=["Authorization", "Content-Type"],
        )
    return app


def _add_pages(app: FastAPI) -> None:
    pages = files("farm_ar.service") / "pages"

    @app.get("/healthz", summary="Whether the service is there", tags=["service"])
    async def healthz() -> dict[str, str]:
        return {"status": "ok", "version": __version__}

    def shown(name: str, title: str) -> Callable[[], Awaitable[Response]]:
        async def page() -> Response:
            return Response(
                (pages / name).read_bytes(),
                media_type="text/html",
                headers=GUARDS,
            )

        page.__doc__ = title
        return page

    app.get("/", include_in_schema=False)(shown("debug.html", "The page to look at sessions."))
    app.get("/docs", include_in_schema=False)(shown("api.html", "The requests, from the OpenAPI schema."))


def _add_sessions(app: FastAPI, traffic: Traffic, access: Access) -> None:
    limits = traffic.limits

    def guarded(handler: Handler) -> Callable[[Request], Awaitable[Response]]:
        """A route that checks who asks, and answers refusals."""

        async def route(request: Request) -> Response:
            try:
                access.check(request.headers, request.query_params, address_of(request.scope))
                answer = await handler(request)
            except InputError as problem:
                answer = refused(problem)
            except ClientDisconnect:  # nobody hears it
                return Response(status_code=NO_JSON)
            return Response(answer.body, answer.status, answer.headers, answer.kind)

        return route

    async def snapshots(asked: Asking, receive: Receive) -> Answer:
        try:
            access.check(asked.headers, asked.query, asked.address)
            body = await body_of(asked.headers, receive, limits.most_bytes, limits.body_s)
            return await traffic.ask(asked.name, "snapshots", body)
        except InputError as problem:
            return refused(problem)

    async def look(request: Request) -> Answer:
        if not is_form(request.headers):
            return await asking("snapshots")(request)
        body = await body_of(request.headers, request.receive, limits.most_image_bytes, limits.body_s)
        camera, image = await _parts(request, body)
        return await traffic.ask(request.path_params["name"], "image", camera + SEPARATOR + image)

    def asking(action: str) -> Handler:
        async def ask(request: Request) -> Answer:
            body = b""
            if action != "delete":
                body = await body_of(request.headers, request.receive, limits.most_bytes, limits.body_s)
            return await traffic.ask(request.path_params["name"], action, body)

        return ask

    async def state(request: Request) -> Answer:
        return await traffic.state(
            request.path_params["name"], _frame(request.query_params.get("frame", "unity"))
        )

    async def image(request: Request) -> Answer:
        found = traffic.service.image(request.path_params["name"])
        return Answer(200, found, "image/png" if found.startswith(b"\x89PNG") else "image/jpeg")

    async def sessions(request: Request) -> Answer:
        return Answer(200, json.dumps({"sessions": traffic.service.names}).encode())

    def add(method: str, path: str, handler: Handler, name: str) -> None:
        app.add_api_route(
            path,
            guarded(handler),
            methods=[method],
            name=name,
            operation_id=name,
            summary=path_of(name)["summary"],
            description=path_of(name)["description"],
            tags=["sessions"],
            response_class=Response,
            status_code=201 if name == "layout" else 200,
            responses={**replies(name), **REFUSED},
            openapi_extra=bodies(name, limits.most_text),
        )

    app.add_middleware(Shortcut, answer=snapshots)
    one = "/v1/sessions/{name}"
    add("GET", "/v1/sessions", sessions, "sessions")
    add("PUT", f"{one}/layout", asking("layout"), "layout")
    add("POST", f"{one}/snapshots", look, "snapshots")
    for action in ("align", "confirm", "undo"):
        add("POST", f"{one}/{action}", asking(action), action)
    add("GET", f"{one}/state", state, "state")
    add("GET", f"{one}/image", image, "image")
    add("DELETE", one, asking("delete"), "delete")


def _add_listening(app: FastAPI, traffic: Traffic, access: Access) -> None:
    @app.websocket("/v1/sessions/{name}/events")
    async def events(socket: WebSocket, name: str) -> None:
        try:
            access.check(socket.headers, socket.query_params, address_of(socket.scope))
            listener = await traffic.listen(name, _frame(socket.query_params.get("frame", "unity")))
        except InputError as problem:
            answer = refused(problem)
            await socket.send_denial_response(
                Response(answer.body, answer.status, answer.headers, answer.kind)
            )
            return
        await socket.accept()
        gone = asyncio.ensure_future(_until_gone(socket))
        try:
            while True:
                waiting = asyncio.ensure_future(listener.events.get())
                await asyncio.wait({waiting, gone}, return_when=asyncio.FIRST_COMPLETED)
                if gone.done():
                    waiting.cancel()
                    return
                message = waiting.result()
                if message is None:
                    await socket.close(SLOW_LISTENER)
                    return
                await socket.send_text(message)
        except (WebSocketDisconnect, RuntimeError):
            return
        finally:
            gone.cancel()
            traffic.leave(name, listener)


async def _until_gone(socket: WebSocket) -> None:
    """Returns when the other side has gone; what it sends is not read."""
    while (await socket.receive())["type"] != "websocket.disconnect":
        pass


async def _parts(request: Request, body: bytes) -> tuple[bytes, bytes]:
    """The camera and the image of a body in parts.

    Raises:
        RefusedError: it has others, or is no such body.
    """

    async def stream() -> AsyncGenerator[bytes, None]:
        yield body

    parts = []
    try:
        parser = MultiPartParser(
            request.headers, stream(), max_files=2, max_fields=2, max_part_size=len(body)
        )
        form = await parser.parse()
        for name in ("camera", "image"):
            part = form.get(name)
            parts.append(await part.read() if isinstance(part, UploadFile) else (part or "").encode())
        await form.close()
    except (MultiPartException, ValueError, KeyError) as problem:
        raise RefusedError(NO_JSON, "body", "must be multipart/form-data", str(problem)) from None
    if not all(parts) or SEPARATOR in parts[0]:
        expected = "must have the parts camera, JSON, and image, PNG or JPEG"
        raise RefusedError(WRONG, "body", expected, [len(part) for part in parts])
    return parts[0], parts[1]


def _frame(name: str) -> str:
    if name not in WORLD_FRAMES:
        raise OptionError("frame", f"must be one of {', '.join(WORLD_FRAMES)}", name)
    return name
