"""How much of a core the page's server takes while several pages watch one game.

    python benchmarks/page_viewers.py --viewers 8 --seconds 10

The server is a process of its own; its processor time is divided by the time on the clock. The player's
hand moves all the while. Viewers read each message, as browsers do, and offer to take them compressed.
"""

import argparse
import asyncio
import json
import multiprocessing
import threading
import time
from multiprocessing.connection import Connection

import uvicorn
from websockets.asyncio.client import connect

from farm_ar.service.network import listening
from farm_ar.service.server import config_of
from farm_ar.web.app import make_web_app
from farm_ar.web.game import Game
from farm_ar.web.pointer import STEPS_PER_SECOND

SETTLE_S = 1.0


def serve(pipe: Connection) -> None:
    """Serve the page; say the port, then the processor time whenever it is asked for."""
    Game().step()
    at = listening("127.0.0.1", 0)
    server = uvicorn.Server(config_of(make_web_app()))
    threading.Thread(target=server.run, args=([at],), daemon=True).start()
    while not server.started:
        time.sleep(0.02)
    pipe.send(at.getsockname()[1])
    while pipe.recv():
        pipe.send(time.process_time())


async def watch(port: int, viewers: int, seconds: float, pipe: Connection) -> tuple[float, float, float]:
    """The share of a core, messages a second and bytes of one, each of a viewer."""
    address = f"ws://127.0.0.1:{port}/games/watched"
    sockets = [await connect(address, proxy=None) for _ in range(viewers)]
    counts, size, going = [0] * viewers, 0, True

    async def read(k: int) -> None:
        nonlocal size
        async for text in sockets[k]:
            counts[k] += 1
            size = max(size, len(text)) if '"kind":"state"' in text else size

    async def play() -> None:
        while going:
            share = time.monotonic() % 4 / 4
            pointer = {"x": 0.2 + 0.8 * share, "z": 0.3, "grip": share > 0.2, "turn": share}
            await sockets[0].send(json.dumps(pointer))
            await asyncio.sleep(1 / STEPS_PER_SECOND)

    tasks = [asyncio.create_task(one) for one in (*map(read, range(viewers)), play())]
    await asyncio.sleep(SETTLE_S)
    pipe.send(True)
    before, began, read_before = pipe.recv(), time.monotonic(), sum(counts)
    await asyncio.sleep(seconds)
    pipe.send(True)
    spent, passed = pipe.recv() - before, time.monotonic() - began
    heard = (sum(counts) - read_before) / viewers / passed
    going = False
    for task in tasks:
        task.cancel()
    for socket in sockets:
        await socket.close()
    return spent / passed, heard, size


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--viewers", type=int, nargs="+", default=[1, 8])
    parser.add_argument("--seconds", type=float, default=10.0)
    given = parser.parse_args()
    spawn = multiprocessing.get_context("spawn")
    mine, its = spawn.Pipe()
    server = spawn.Process(target=serve, args=(its,), daemon=True)
    server.start()
    port = mine.recv()
    for viewers in given.viewers:
        share, heard, size = asyncio.run(watch(port, viewers, given.seconds, mine))
        print(f"{viewers} viewers: {share:.1%} of a core, {heard:.1f} messages/s each, {size} bytes at most")
    mine.send(False)
    server.join(timeout=5)


if __name__ == "__main__":
    main()
