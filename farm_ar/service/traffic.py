"""Requests under way: one after another for each session, not too many, none too long; and who listens."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

from farm_ar.service.limits import ServiceLimits
from farm_ar.service.refusals import BUSY, TOO_MANY, RefusedError
from farm_ar.service.served import Served
from farm_ar.service.service import Answer, Service

WAITING_EVENTS = 32
"""Messages that wait for a listener; one that is slower is left, and has to come again."""


@dataclass(eq=False)
class Listener:
    """Someone on a WebSocket.

    Args:
        frame: in which poses are wanted.
        shown: labels that it knows to be there.
        events: that wait to be sent; None ends.
    """

    frame: str
    shown: set[str] = field(default_factory=set)
    events: asyncio.Queue[str | None] = field(default_factory=lambda: asyncio.Queue(WAITING_EVENTS))


class Traffic:
    """Lets requests to a service, in threads, and informs listeners.

    Args:
        service: that is asked.
        limits: of waiting and time.
    """

    def __init__(self, service: Service, limits: ServiceLimits, workers: int) -> None:
        self.service, self.limits = service, limits
        self._pool = ThreadPoolExecutor(workers, thread_name_prefix="farm-ar-service")
        self._locks: dict[str, tuple[asyncio.Lock, list[None]]] = {}
        self._listeners: dict[str, set[Listener]] = {}
        self._under_way = 0

    async def ask(self, name: str, action: str, body: bytes) -> Answer:
        """Do something to a session, and inform its listeners."""
        if action == "snapshots" and self._free(name) and self.service.is_brief(name, body):
            answer: Answer = self.service.call(name, action, body)
        else:
            answer = await self._in_turn(name, lambda: self.service.call(name, action, body))
        if answer.status < 300:
            self._tell(name, gone=action == "delete")
        return answer

    async def state(self, name: str, frame: str) -> Answer:
        """All that is known of a session."""
        answer: Answer = await self._in_turn(name, lambda: self.service.state(name, frame))
        return answer

    async def listen(self, name: str, frame: str) -> Listener:
        """A listener, which from here on receives what is there, what comes and what goes.

        Raises:
            RefusedError: there is no such session, or it has too many listeners.
        """
        served: Served = await self._in_turn(name, lambda: self.service.session(name))
        there = self._listeners.setdefault(name, set())
        if len(there) >= self.limits.most_listeners:
            raise RefusedError(
                TOO_MANY, "listeners", f"must be at most {self.limits.most_listeners}", len(there)
            )
        listener = Listener(frame)
        there.add(listener)
        listener.events.put_nowait(_message(served, listener, {}))
        return listener

    def leave(self, name: str, listener: Listener) -> None:
        """Inform someone no more."""
        there = self._listeners.get(name, set())
        there.discard(listener)
        if not there:
            self._listeners.pop(name, None)

    def close(self) -> None:
        """End: listeners receive it, and what is under way is waited for."""
        for there in self._listeners.values():
            for listener in there:
                _end(listener)
        self._pool.shutdown(wait=True, cancel_futures=True)

    async def _in_turn(self, name: str, do: Callable[[], Any]) -> Any:
        """What is done in a thread, after all that was asked of the session before."""
        limits = self.limits
        if self._under_way >= limits.most_requests or len(self._waiting(name)) >= limits.most_waiting:
            expected = "must be fewer at once: come again"
            raise RefusedError(TOO_MANY, "requests", expected, len(self._waiting(name)))
        lock, waiting = self._locks.setdefault(name, (asyncio.Lock(), []))
        self._under_way += 1
        waiting.append(None)
        try:
            async with asyncio.timeout(limits.answer_s):
                await lock.acquire()
        except BaseException as problem:
            self._done(name, waiting)
            if isinstance(problem, TimeoutError):
                raise RefusedError(
                    BUSY, "session", "must have answered what was asked before", name
                ) from None
            raise
        loop = asyncio.get_running_loop()
        try:
            task = loop.run_in_executor(self._pool, do)
        except BaseException:
            lock.release()
            self._done(name, waiting)
            raise

        def finished(done: asyncio.Future[Any]) -> None:
            done.cancelled() or done.exception()  # who asked has seen it, or has gone
            lock.release()
            self._done(name, waiting)

        task.add_done_callback(finished)
        try:
            async with asyncio.timeout(limits.answer_s):
                return await asyncio.shield(task)
        except TimeoutError:
            raise RefusedError(
                BUSY, "session", f"must be answered within {limits.answer_s:g} s", name
            ) from None

    def _free(self, name: str) -> bool:
        """Whether nothing that was asked of a session is under way, nor too much of others."""
        return name not in self._locks and self._under_way < self.limits.most_requests

    def _waiting(self, name: str) -> list[None]:
        """One for each request on a session that is under way."""
        return self._locks[name][1] if name in self._locks else []

    def _done(self, name: str, waiting: list[None]) -> None:
        self._under_way -= 1
        waiting.pop()
        if not waiting:
            self._locks.pop(name, None)

    def _tell(self, name: str, gone: bool) -> None:
        there = self._listeners.get(name)
        if not there:
            return
        try:
            served = None if gone else self.service.session(name)
        except RefusedError:  # deleted by who came next
            served = None
        made: dict[Any, str] = {}
        for listener in list(there):
            if served is None:
                _end(listener)
                continue
            try:
                listener.events.put_nowait(_message(served, listener, made))
            except asyncio.QueueFull:
                there.discard(listener)
                _end(listener)


def _end(listener: Listener) -> None:
    """Inform a listener that nothing more comes, in place of what waits."""
    while not listener.events.empty():
        listener.events.get_nowait()
    listener.events.put_nowait(None)


def _message(served: Served, listener: Listener, made: dict[Any, str]) -> str:
    """What has come, stayed and gone for a listener; made once for all that know the same."""
    key = (listener.frame, frozenset(listener.shown))
    if key not in made:
        there = served.tracked(listener.frame)
        stamp = None if served.seen is None else served.seen["header"]["stamp"]
        values = {
            "header": {"stamp": stamp, "frame_id": listener.frame},
            "session": served.name,
            "revision": served.revision,
            "snapshot": served.looked or None,
            "added": [one for label, one in there.items() if label not in listener.shown],
            "updated": [one for label, one in there.items() if label in listener.shown],
            "removed": sorted(listener.shown - set(there)),
        }
        made[key] = json.dumps(values, allow_nan=False, ensure_ascii=False)
    listener.shown = set(served.present)
    return made[key]
