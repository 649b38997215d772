"""A small page, its server, the socket of a browser, and recordings that grow meanwhile."""

import asyncio
import json
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
from numpy.typing import NDArray

from scissorcal.prototype.rig_commands import RigCommand
from scissorcal.prototype.server import PrototypeServer
from scissorcal.recording import RecordingFacts, RecordingWriter, layout
from tests.guard import GUARD_S

POLICY = "default-src 'none'"


def small_page(socket: str) -> tuple[str, str]:
    return f"<!doctype html><title>Rig</title><p>{socket}</p>", POLICY


def a_server(folder: Path, *commands: RigCommand, **how: Any) -> PrototypeServer:
    return PrototypeServer(small_page, folder / "captures", folder, commands, **how)


@asynccontextmanager
async def a_browser(
    server: PrototypeServer, **how: Any
) -> AsyncIterator[aiohttp.ClientWebSocketResponse]:
    """The socket of a page, as a browser opens it."""
    url = server.url.replace("/?", "/rig?")
    headers = {"Origin": server.url.split("/?")[0]}
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(url, headers=headers, **how) as socket,
    ):
        yield socket


@contextmanager
def running(server: PrototypeServer) -> Iterator[PrototypeServer]:
    """A server in a thread, for a browser that is driven from this one."""
    ready, over = threading.Event(), asyncio.Event()
    loops: list[asyncio.AbstractEventLoop] = []

    async def run() -> None:
        async with server:
            loops.append(asyncio.get_running_loop())
            ready.set()
            await server.run(over)

    thread = threading.Thread(target=lambda: asyncio.run(run()))
    thread.start()
    try:
        assert ready.wait(GUARD_S)
        yield server
    finally:
        loops[0].call_soon_threadsafe(over.set)
        thread.join(GUARD_S)


async def heard(
    socket: aiohttp.ClientWebSocketResponse, is_it: Callable[[dict[str, Any]], bool]
) -> dict[str, Any]:
    """The first message that ``is_it``."""
    async with asyncio.timeout(GUARD_S):
        while True:
            message: dict[str, Any] = json.loads(await socket.receive_str())
            if is_it(message):
                return message


async def ask(socket: aiohttp.ClientWebSocketResponse, do: str, command: str = "") -> None:
    await socket.send_str(json.dumps({"do": do, "command": command}))


def samples_of(first: int, count: int, rate_Hz: float = 1000.0) -> NDArray[np.void]:
    """Samples ``first`` to ``first + count`` of a motion."""
    samples = layout.empty_samples(count)
    number = np.arange(first, first + count)
    samples["sequence"] = number
    samples["device_time_us"] = number * round(1e6 / rate_Hz)
    samples["host_time_ns"] = number * round(1e9 / rate_Hz)
    samples["opening"] = 0.5 + 0.1 * np.sin(number / 500.0)
    samples["advance"] = 1e-6 * number
    samples["motor_torque"] = 0.001 * number
    samples["handle_force"] = 2.0
    samples["force_command"] = 0.25
    return samples


def a_writer(folder: Path, kind: Any = "render", name: str = "render-1.mcap") -> RecordingWriter:
    (folder / "captures").mkdir(exist_ok=True)
    return RecordingWriter(
        folder / "captures" / name, kind, facts=RecordingFacts(handle_radius_m=0.07)
    )
