"""The inside of a worker process: takes units from a pipe, and puts what came of them back."""

from __future__ import annotations

import json
import os
import signal
import threading
import traceback
from multiprocessing import parent_process
from multiprocessing.connection import Connection, wait

from farm_ar.sweeps.attempts import Attempt, attempt, check_version
from farm_ar.sweeps.units import Unit

BEGUN = b""
"""Said when a worker is ready, and whenever it has loaded a function and begins to run it."""


def work(pipe: Connection) -> None:
    """Run the units that come through the pipe until it is closed or the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is interrupted too, and ends its workers
    threading.Thread(target=_end_with_the_parent, daemon=True).start()
    pipe.send_bytes(BEGUN)
    ready: set[tuple[str, str]] = set()
    while True:
        try:
            unit = unpack_unit(pipe.recv_bytes())
        except (EOFError, OSError):
            return
        done = None
        if (unit.function, unit.version) not in ready:
            done = _prepare(unit)
            if done is None:
                ready.add((unit.function, unit.version))
                pipe.send_bytes(BEGUN)
        try:
            pipe.send_bytes(pack_attempt(done or attempt(unit)))
        except OSError:
            return


def _prepare(unit: Unit) -> Attempt | None:
    """Load a unit's function; what went wrong, if anything did."""
    from farm_ar.sweeps.functions import load_function

    try:
        check_version(unit)
        load_function(unit.function)
    except Exception:
        return Attempt(unit, problem=traceback.format_exc())
    return None


def _end_with_the_parent() -> None:
    """A parent that was killed ends nobody: its workers see it themselves."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def pack_unit(unit: Unit) -> bytes:
    """A unit as bytes."""
    return json.dumps([unit.function, unit.text, unit.seed, unit.version]).encode()


def unpack_unit(data: bytes) -> Unit:
    """The unit of which `pack_unit` made these bytes."""
    return Unit(*json.loads(data))


def pack_attempt(done: Attempt) -> bytes:
    """All of an attempt but its unit as bytes."""
    return json.dumps([done.rows, done.measured, done.seconds, done.problem]).encode()


def unpack_attempt(unit: Unit, data: bytes) -> Attempt:
    """The attempt of which `pack_attempt` made these bytes."""
    return Attempt(unit, *json.loads(data))
