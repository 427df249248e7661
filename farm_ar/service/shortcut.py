"""The request that is asked oftenest, answered without the framework: it takes longer than the answer."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from typing import Any, NamedTuple

from farm_ar.service.refusals import TOO_LARGE, TOO_SLOW, RefusedError, missing_package
from farm_ar.service.service import Answer

try:
    from starlette.datastructures import QueryParams
    from starlette.requests import ClientDisconnect
except ImportError:
    raise missing_package("fastapi") from None

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]

Given = Mapping[str, str]
"""Headers, names in small letters, or the query of an address."""

_SNAPSHOTS = re.compile("/v1/sessions/([^/]+)/snapshots")


class Asking(NamedTuple):
    """The head of a request for a snapshot: of which session, headers, query, and from which address."""

    name: str
    headers: Given
    query: Given
    address: str | None


class Shortcut:
    """Hands snapshots in JSON to who answers them, and all else to the application.

    Args:
        app: the application.
        answer: of what is asked, and of what receives the body.
    """

    def __init__(self, app: App, answer: Callable[[Asking, Receive], Awaitable[Answer]]) -> None:
        self._app, self._answer = app, answer

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """See ASGI."""
        asked = None
        if scope["type"] == "http" and scope["method"] == "POST":
            asked = _SNAPSHOTS.fullmatch(scope["path"])
        # The first of several, as the application has it.
        given = reversed(scope["headers"]) if asked else ()
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in given}
        if asked is None or is_form(headers):
            await self._app(scope, receive, send)
            return
        query = QueryParams(scope["query_string"]) if scope["query_string"] else {}
        try:
            answer = await self._answer(Asking(asked[1], headers, query, address_of(scope)), receive)
        except ClientDisconnect:
            return
        await send_answer(answer, send)


async def send_answer(answer: Answer, send: Send, close: bool = False) -> None:
    """Send an answer, and with `close` that the connection ends with it."""
    said = {"content-length": str(len(answer.body)), "content-type": answer.kind, **answer.headers}
    said |= {"connection": "close"} if close else {}
    start = [(name.encode(), value.encode("latin-1")) for name, value in said.items()]
    await send({"type": "http.response.start", "status": answer.status, "headers": start})
    await send({"type": "http.response.body", "body": answer.body})


def address_of(scope: Message) -> str | None:
    """From where a request came; None where the server does not know."""
    client = scope.get("client")
    return client[0] if client else None


def is_form(headers: Given) -> bool:
    """Whether a body is in parts."""
    return headers.get("content-type", "").startswith("multipart/form-data")


async def body_of(headers: Given, receive: Receive, most: int, seconds: float) -> bytes:
    """The body of a request.

    Args:
        headers: of it.
        receive: gives its parts.
        most: bytes.
        seconds: in which it must arrive.

    Raises:
        RefusedError: it is too large, or does not arrive in time, or only half of it does.
    """
    length = headers.get("content-length", "")
    if length.isascii() and length.isdigit() and int(length[:20]) > most:
        raise RefusedError(TOO_LARGE, "body", f"must be at most {most} bytes", int(length[:20]))
    parts, size, more = [], 0, True
    try:
        async with asyncio.timeout(seconds):
            while more:
                message = await receive()
                if message["type"] == "http.disconnect":
                    raise ClientDisconnect
                part, more = message.get("body", b""), message.get("more_body", False)
                size += len(part)
                if size > most:
                    raise RefusedError(TOO_LARGE, "body", f"must be at most {most} bytes", "more")
                parts.append(part)
    except TimeoutError:
        raise RefusedError(TOO_SLOW, "body", f"must arrive within {seconds:g} s", f"{size} bytes") from None
    return b"".join(parts)
