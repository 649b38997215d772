"""The server of a page: one page, one socket, on this computer alone."""

import asyncio
import contextlib
import hmac
import logging
import secrets
import socket as sockets
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from aiohttp import WSMsgType, web
from aiohttp.http_exceptions import HttpProcessingError
from aiohttp.typedefs import Handler, Middleware

from scissorcal.errors import InputError
from scissorcal.prototype.rig_commands import (
    RefusedError,
    RigCommand,
    RigCommands,
    State,
)
from scissorcal.prototype.rig_feed import COLUMNS, Look, RigFeed
from scissorcal.prototype.watcher import Watcher, request_in

HOSTS = ("127.0.0.1", "localhost")
HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "Server": "scissorcal",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
"""Of every answer. There is none that would let another site read it (CORS)."""


@dataclass
class Guard:
    """Checks each request before anything else does: its host, its origin, and its token.

    The host keeps out names that another site made point here (DNS rebinding), the origin keeps out
    pages of other sites, which a browser lets open sockets to anywhere, and the token keeps out
    everybody else on this computer. Whatever is wrong, the answer is the same: 403, no more.
    """

    port: int = 0
    token: str = field(default_factory=lambda: secrets.token_urlsafe(32))
    policy: str = "default-src 'none'"

    def admits(self, request: web.Request) -> bool:
        """Whether a request comes from this page, or from who was given its address."""
        own = [f"{host}:{self.port}" for host in HOSTS]
        hosts = request.headers.getall("Host", [])
        origins = request.headers.getall("Origin", [])
        if len(hosts) != 1 or hosts[0].lower() not in own:
            return False
        if origins and origins != [f"http://{hosts[0].lower()}"]:
            return False
        return self._is_token(request.query.getall("token", []))

    def _is_token(self, given: list[str]) -> bool:
        """Compare in a time that does not depend on how much of it is right."""
        one = given[0] if len(given) == 1 else ""
        return hmac.compare_digest(one.encode("utf-8", "replace"), self.token.encode())

    def middleware(self) -> Middleware:
        """Refuses what is not admitted, whatever path it names."""

        @web.middleware
        async def guarded(request: web.Request, handler: Handler) -> web.StreamResponse:
            if not self.admits(request):
                return web.Response(status=403, text="Forbidden\n")
            return await handler(request)

        return guarded

    async def put_headers(self, request: web.Request, response: web.StreamResponse) -> None:
        """For ``on_response_prepare``: the headers of every answer, errors and sockets included."""
        response.headers.update(HEADERS)
        response.headers["Content-Security-Policy"] = f"{self.policy}; frame-ancestors 'none'"


ADDRESS = "127.0.0.1"
MOST_PAGES = 8
MOST_CONNECTIONS = 64
"""With those that have not shown the token; a process may often have no more than 256 files."""
IDLE_s = 5.0
"""A connection without a request is closed after it."""
MOST_MESSAGE_BYTES = 4096
TICK_s = 0.025
"""From one message of samples to the next: 40 a second."""
HEARTBEAT_s = 10.0
"""A page that does not answer a ping for half of it is gone."""
DIGITS = 6
_SOCKET_BUFFER = 65536

PageOf = Callable[[str], tuple[str, str]]
"""From the path of the socket to the page and its Content-Security-Policy."""


class PrototypeServer:
    """Serves a page, tells it what the rig does, and lets it start and stop ``commands``.

    ``page_of`` makes the page once the path of its socket is known, ``captures`` is the folder
    whose newest recording is followed, ``root`` where commands run. A context manager
    (asynchronous); :attr:`url` is the address to open, with the token in it.

    Any number of pages up to `MOST_PAGES` may watch at once, and each may start a command where
    none runs; the stop works from each.
    """

    def __init__(
        self,
        page_of: PageOf,
        captures: Path,
        root: Path,
        commands: Sequence[RigCommand] = (),
        *,
        port: int = 0,
        **how: Any,
    ) -> None:
        self._page_of = page_of
        self._port = port
        self._guard = Guard()
        self._feed = RigFeed(captures)
        self.commands = RigCommands(commands, root, self._tell, **how)
        self._following = ""
        self._watchers: set[Watcher] = set()
        self._somebody = asyncio.Event()
        self._closing = contextlib.AsyncExitStack()
        self._sockets: set[web.WebSocketResponse] = set()
        self._page = b""

    @property
    def url(self) -> str:
        """The address of the page; who has it may use the page."""
        return f"http://{ADDRESS}:{self._guard.port}/?token={self._guard.token}"

    @property
    def watching(self) -> int:
        """How many pages watch."""
        return len(self._watchers)

    async def __aenter__(self) -> "PrototypeServer":
        """Raises InputError where the port is taken."""
        app = web.Application(middlewares=[self._guard.middleware()])
        app.on_response_prepare.append(self._guard.put_headers)
        app.router.add_get("/", self._give_page, allow_head=False)
        app.router.add_get("/rig", self._give_rig, allow_head=False)
        runner = web.AppRunner(
            app,
            logger=_request_log(),
            access_log=None,
            handle_signals=False,
            shutdown_timeout=1.0,
            keepalive_timeout=IDLE_s,
        )
        await runner.setup()
        self._closing.push_async_callback(runner.cleanup)
        try:
            listening = await asyncio.get_running_loop().create_server(
                _bounded(runner.server), ADDRESS, self._port, reuse_address=True
            )
        except OSError as error:
            await self._closing.aclose()
            raise InputError(
                f"Port {self._port} of {ADDRESS} cannot be used ({error.strerror}): choose another "
                "with --port, or leave it out."
            ) from None
        self._closing.callback(listening.close)
        self._guard.port = listening.sockets[0].getsockname()[1]
        page, self._guard.policy = self._page_of(f"/rig?token={self._guard.token}")
        self._page = page.encode("utf-8")
        self._streaming = asyncio.create_task(self._stream())
        self._closing.push_async_callback(_cancelled, self._streaming)
        self._closing.push_async_callback(self._close_sockets)
        self._closing.push_async_callback(self.commands.close)
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._closing.aclose()
        self._feed.close()

    async def run(self, over: asyncio.Event) -> None:
        """Serve until ``over`` is set; raises what ends the following of recordings."""
        waiting = asyncio.create_task(over.wait())
        await asyncio.wait({waiting, self._streaming}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        if self._streaming.done():
            self._streaming.result()

    async def _give_page(self, request: web.Request) -> web.Response:
        return web.Response(body=self._page, content_type="text/html", charset="utf-8")

    async def _give_rig(self, request: web.Request) -> web.StreamResponse:
        if len(self._sockets) >= MOST_PAGES:
            return web.Response(status=503, text=f"{MOST_PAGES} pages are open already.\n")
        socket = web.WebSocketResponse(
            max_msg_size=MOST_MESSAGE_BYTES, compress=False, heartbeat=HEARTBEAT_s, timeout=1.0
        )
        self._sockets.add(socket)
        try:
            await socket.prepare(request)
            _bound_buffers(request.transport)
            await self._attend(socket)
        finally:
            self._sockets.discard(socket)
        return socket

    async def _attend(self, socket: web.WebSocketResponse) -> None:
        """Hear one page until it is gone."""
        watcher = Watcher(socket)
        watcher.tell(self._state())
        self._watchers.add(watcher)
        self._somebody.set()
        sending = asyncio.create_task(watcher.send_all())
        try:
            async for message in socket:
                if not watcher.may_speak():
                    await socket.close(code=1008, message=b"too many messages", drain=False)
                    break
                self._hear(watcher, message.data if message.type is WSMsgType.TEXT else "")
        finally:
            self._watchers.discard(watcher)
            self.commands.leave(watcher)
            if not self._watchers:
                self._somebody.clear()
            await _cancelled(sending)

    def _hear(self, watcher: Watcher, text: str) -> None:
        try:
            do, command, question = request_in(text)
            if do == "arm":
                self.commands.arm(command, watcher)
            elif do == "start":
                self.commands.start(command, watcher, question)
            else:
                self.commands.stop()
        except (InputError, RefusedError) as refused:
            watcher.refuse(str(refused))

    def _tell(self, state: State) -> None:
        for watcher in self._watchers:
            watcher.tell(self._state())

    def _state(self) -> dict[str, Any]:
        return {
            "kind": "state",
            **asdict(self.commands.state),
            "following": self._following,
            "commands": list(self.commands.commands),
        }

    async def _stream(self) -> None:
        """Look at the recording while somebody watches, and show all what is due."""
        while True:
            await self._somebody.wait()
            look = await asyncio.to_thread(self._feed.look)
            if look.sentence:
                self._following = look.sentence
                self._tell(self.commands.state)
            if len(look.rows) or look.pose is not None:
                message = samples_message(look)
                for watcher in self._watchers:
                    watcher.show(message)
            await asyncio.sleep(TICK_s)

    async def _close_sockets(self) -> None:
        """Close the pages once they know how what ran has ended."""
        await asyncio.gather(*(watcher.sent() for watcher in self._watchers))
        for socket in list(self._sockets):
            await socket.close(code=1001, message=b"the server ends", drain=False)


def samples_message(look: Look) -> dict[str, Any]:
    """A message of samples: a list for each of `COLUMNS`, how many were left out, and the pose."""
    columns = np.round(look.rows, DIGITS).T.tolist() if len(look.rows) else [[] for _ in COLUMNS]
    return {
        "kind": "samples",
        **dict(zip(COLUMNS, columns, strict=True)),
        "lost": look.lost,
        "pose": None if look.pose is None else [round(one, DIGITS) for one in look.pose],
        "recording": look.recording,
    }


def _bounded(server: web.Server | None) -> Callable[[], asyncio.BaseProtocol]:
    """A protocol for each new connection: closed at once where there are too many."""
    assert server is not None, "the runner is set up"
    return lambda: server() if len(server.connections) < MOST_CONNECTIONS else _Closed()


def _request_log() -> logging.Logger:
    """The log of one server's requests: what it refuses is a line, told once of each kind."""
    log = logging.Logger("scissorcal.prototype.requests", logging.WARNING)
    log.parent = logging.getLogger()
    log.addFilter(_RefusedOnce())
    return log


class _RefusedOnce(logging.Filter):
    """Turns refusals of what is no HTTP, which anyone on this computer may send, into one line.

    Nothing of the request is shown: it may hold the token, or what a terminal obeys. A fault of
    this program keeps its traceback.
    """

    def __init__(self) -> None:
        super().__init__()
        self._reported: set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        error = record.exc_info[1] if record.exc_info else None
        if not isinstance(error, HttpProcessingError):
            return True
        kind = type(error).__name__
        if kind in self._reported:
            return False
        self._reported.add(kind)
        record.msg = (
            "A request that the page's server cannot read was refused (%s); further ones are not "
            "shown."
        )
        record.args, record.exc_info, record.exc_text = (kind,), None, None
        return True


class _Closed(asyncio.Protocol):
    """A connection that is not taken."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        transport.abort()  # type: ignore[attr-defined]


def _bound_buffers(transport: asyncio.Transport | None) -> None:
    """Have what a page does not take wait in its queue, where it is counted, and not on the way."""
    if transport is not None:
        transport.set_write_buffer_limits(_SOCKET_BUFFER)
        line = transport.get_extra_info("socket")
        line.setsockopt(sockets.SOL_SOCKET, sockets.SO_SNDBUF, _SOCKET_BUFFER)


async def _cancelled(task: asyncio.Task[None]) -> None:
    task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await task
