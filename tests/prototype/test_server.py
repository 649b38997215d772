"""Pages that talk nonsense, too much or too slowly, that reload, and that watch together."""

import asyncio
import contextlib
import json
import logging
import sys
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import aiohttp
import numpy as np
import pytest
from aiohttp import WSMsgType

from scissorcal.prototype.rig_commands import RigCommand
from scissorcal.prototype.rig_feed import Look
from scissorcal.prototype.server import (
    MOST_CONNECTIONS,
    MOST_MESSAGE_BYTES,
    MOST_PAGES,
    PrototypeServer,
    samples_message,
)
from scissorcal.prototype.watcher import ALLOWED_AT_ONCE, MOST_WAITING, Watcher
from tests.guard import GUARD_S

from .made import a_browser, a_server, a_writer, ask, heard, samples_of

REQUEST = "Take everything out."
RENDER = RigCommand("render", ("render",), REQUEST)
WAITS = (
    "import sys, time\n"
    "try:\n    print('ready', file=sys.stderr, flush=True)\n"
    "    while True:\n        time.sleep(0.02)\n"
    "except KeyboardInterrupt:\n    sys.exit(130)\n"
)
"""It sleeps for moments: a signal that comes just before a sleep begins does not end it."""
HOW: dict[str, Any] = {"program": (sys.executable, "-c", WAITS)}


def served(folder: Path, act: Callable[[PrototypeServer], Coroutine[Any, Any, None]]) -> None:
    """Act with a server, within a bounded time."""

    async def trial() -> None:
        async with asyncio.timeout(4 * GUARD_S), a_server(folder, RENDER, **HOW) as server:
            await act(server)

    asyncio.run(trial())


def is_state(**facts: Any) -> Callable[[dict[str, Any]], bool]:
    """Whether a message is a state with these facts."""
    return lambda message: (
        message["kind"] == "state" and all(message[key] == facts[key] for key in facts)
    )


def is_samples(message: dict[str, Any]) -> bool:
    return message["kind"] == "samples"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "\0",
        "{",
        "null",
        "[]",
        '"stop"',
        "1e999",
        "{}",
        '{"do": 1}',
        '{"do": "quit"}',
        '{"do": ["stop"]}',
        '{"do": "arm", "command": 7}',
        '{"do": "arm", "command": "demo"}',
        '{"do": "arm", "command": "render; rm -rf /"}',
        '{"do": "start", "command": "render"}',
        "[" * 4000,
        '{"do":' * 600,
        '{"do": "stop", "command": ' + "9" * 3000 + "}",
    ],
)
def test_nonsense_is_refused_in_a_sentence_and_the_page_goes_on(text: str, tmp_path: Path) -> None:
    async def act(server: PrototypeServer) -> None:
        async with a_browser(server) as page:
            await page.send_str(text)
            said = await heard(page, lambda message: message["kind"] == "refused")
            assert said["sentence"].endswith(".")
            await page.send_bytes(b'{"do": "stop"}')
            await heard(page, lambda message: message["kind"] == "refused")
            await ask(page, "arm", "render")
            assert await heard(page, is_state(request=REQUEST))

    served(tmp_path, act)


def test_a_message_that_is_too_long_ends_its_page_alone(tmp_path: Path) -> None:
    async def act(server: PrototypeServer) -> None:
        async with a_browser(server) as bad, a_browser(server) as good:
            await heard(bad, is_state())
            await bad.send_str("x" * (MOST_MESSAGE_BYTES + 1))
            ended = await bad.receive(GUARD_S)
            assert ended.type in (WSMsgType.CLOSE, WSMsgType.CLOSED)
            assert bad.close_code == aiohttp.WSCloseCode.MESSAGE_TOO_BIG
            await ask(good, "arm", "render")
            assert await heard(good, is_state(request=REQUEST))

    served(tmp_path, act)


def test_a_page_that_sends_too_often_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it may send grows by the clock; here it does not, however slowly the page sends."""
    monkeypatch.setattr("scissorcal.prototype.watcher.ALLOWED_A_s", 0.0)

    async def act(server: PrototypeServer) -> None:
        async with a_browser(server) as page:
            for _ in range(int(3 * ALLOWED_AT_ONCE)):
                await ask(page, "nothing")
            while (await page.receive(GUARD_S)).type is WSMsgType.TEXT:
                pass
            assert page.close_code == aiohttp.WSCloseCode.POLICY_VIOLATION
        async with a_browser(server) as again:
            assert await heard(again, is_state())

    served(tmp_path, act)


def test_so_many_pages_and_no_more(tmp_path: Path) -> None:
    async def act(server: PrototypeServer) -> None:
        headers = {"Origin": server.url.split("/?")[0]}
        async with aiohttp.ClientSession() as session:
            url = server.url.replace("/?", "/rig?")
            pages = [await session.ws_connect(url, headers=headers) for _ in range(MOST_PAGES)]
            with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
                await session.ws_connect(url, headers=headers)
            assert refused.value.status == 503
            await pages[0].close()
            async with asyncio.timeout(GUARD_S):
                while server.watching == MOST_PAGES:
                    await asyncio.sleep(0.01)
            pages[0] = await session.ws_connect(url, headers=headers)
            assert await heard(pages[0], is_state(state="idle"))
            for page in pages:
                await page.close()

    served(tmp_path, act)


def test_so_many_connections_and_no_more_and_idle_ones_are_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scissorcal.prototype.server.IDLE_s", 0.5)

    async def act(server: PrototypeServer) -> None:
        async with a_browser(server) as page:
            port = urlsplit(server.url).port
            lines = [
                await asyncio.open_connection("127.0.0.1", port)
                for _ in range(MOST_CONNECTIONS + 40)
            ]
            await asyncio.gather(*(ended(*one) for one in lines[-40:]))
            await ask(page, "arm", "render")
            assert await heard(page, is_state(request=REQUEST))
            await asyncio.gather(*(ended(*one) for one in lines[:-40]))
            async with a_browser(server) as late:
                assert await heard(late, is_state(request=REQUEST))

    served(tmp_path, act)


async def ended(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """The other side closes, without a word."""
    with contextlib.suppress(ConnectionResetError):
        assert await reader.read() == b""
    writer.close()
    with contextlib.suppress(ConnectionResetError):
        await writer.wait_closed()


def test_two_pages_see_the_same_and_either_stops_what_the_other_started(tmp_path: Path) -> None:
    async def act(server: PrototypeServer) -> None:
        async with a_browser(server) as first, a_browser(server) as second:
            await ask(first, "arm", "render")
            assert await heard(second, is_state(request=REQUEST))
            await ask(second, "start", "render")
            await heard(second, lambda message: message["kind"] == "refused")
            await ask(first, "start", "render")
            for page in (first, second):
                assert await heard(page, is_state(state="running", sentence="ready"))
            await ask(second, "stop")
            for page in (first, second):
                assert await heard(page, is_state(state="idle", code=130, sentence="Stopped."))

    served(tmp_path, act)


def test_a_page_that_reloads_finds_the_command_still_running(tmp_path: Path) -> None:
    async def act(server: PrototypeServer) -> None:
        with a_writer(tmp_path) as writer:
            async with a_browser(server) as page:
                await ask(page, "arm", "render")
                await ask(page, "start", "render")
                await heard(page, is_state(state="running", sentence="ready"))
                writer.append(samples_of(0, 1000))
                await heard(page, is_samples)
            async with a_browser(server) as page:
                now = await heard(page, is_state())
                assert (now["state"], now["sentence"]) == ("running", "ready")
                assert now["following"] == "Following render-1.mcap."
                writer.append(samples_of(1000, 1000))
                assert (await heard(page, is_samples))["time_s"]
                await ask(page, "stop")
                assert await heard(page, is_state(code=130))

    served(tmp_path, act)


def test_a_page_that_leaves_after_arming_lets_nobody_else_start(tmp_path: Path) -> None:
    async def act(server: PrototypeServer) -> None:
        async with a_browser(server) as other:
            async with a_browser(server) as page:
                await ask(page, "arm", "render")
                await heard(other, is_state(request=REQUEST))
            await heard(other, is_state(request=None))
            await ask(other, "start", "render")
            said = await heard(other, lambda message: message["kind"] == "refused")
            assert "not armed" in said["sentence"]

    served(tmp_path, act)


def test_the_end_of_the_server_ends_the_command_and_tells_the_pages(tmp_path: Path) -> None:
    async def trial() -> None:
        async with aiohttp.ClientSession() as session, asyncio.timeout(GUARD_S):
            async with a_server(tmp_path, RENDER, **HOW) as server:
                page = await session.ws_connect(server.url.replace("/?", "/rig?"))
                await ask(page, "arm", "render")
                await ask(page, "start", "render")
                await heard(page, is_state(state="running", sentence="ready"))
                commands = server.commands
            assert commands.state.code == 130
            assert await heard(page, is_state(code=130))
            ended = await page.receive()
            assert (ended.type, ended.data) == (WSMsgType.CLOSE, aiohttp.WSCloseCode.GOING_AWAY)
            await page.close()

    asyncio.run(trial())


def test_samples_arrive_in_small_messages_forty_times_a_second(tmp_path: Path) -> None:
    async def act(server: PrototypeServer) -> None:
        async with a_browser(server) as page:
            await heard(page, is_state())
            with a_writer(tmp_path) as writer:
                times: list[float] = []
                for number in range(20):
                    writer.append(samples_of(50 * number, 50))
                    await asyncio.sleep(0.05)
                while not times or times[-1] < 0.75:
                    message = await heard(page, is_samples)
                    assert len(json.dumps(message)) < 20000
                    assert message["lost"] == 0
                    assert message["recording"] == "render-1.mcap"
                    columns = [message[key] for key in ("opening_rad", "advance_m", "torque_Nm")]
                    assert {len(column) for column in columns} == {len(message["time_s"])}
                    times += message["time_s"]
            assert np.all(np.diff(times) > 0.0)
            assert np.median(np.diff(times)) == pytest.approx(0.004)

    served(tmp_path, act)


def test_a_page_that_reads_nothing_delays_no_other(tmp_path: Path) -> None:
    async def act(server: PrototypeServer) -> None:
        async with a_browser(server) as slow, a_browser(server) as fast:
            transport = slow._response.connection.transport  # type: ignore[union-attr]
            assert transport is not None
            transport.pause_reading()
            number = full = 0  # messages so far, and those that found all places taken
            while full < 20:
                message = samples_message(Look(np.full((250, 5), number / 7.0)))
                for watcher in server._watchers:
                    watcher.show(message)
                now = await heard(fast, is_samples)
                assert now["time_s"][0] == round(number / 7.0, 6)
                assert now["lost"] == 0
                waiting = sorted(len(watcher._samples) for watcher in server._watchers)
                full += waiting == [0, MOST_WAITING]  # once what the system buffers is full, too
                number += 1
            transport.resume_reading()
            seen = lost = 0
            while seen + lost < number * 250:
                now = await heard(slow, is_samples)
                seen, lost = seen + len(now["time_s"]), lost + now["lost"]
            assert now["time_s"][0] == round((number - 1) / 7.0, 6)
            assert lost > 0
            assert seen + lost == number * 250

    served(tmp_path, act)


def test_what_waits_for_a_page_is_bounded_and_counted() -> None:
    async def trial() -> None:
        watcher = Watcher(None)  # type: ignore[arg-type]
        rows = np.zeros((7, 5))
        for number in range(100):
            watcher.show(samples_message(Look(rows, lost=1)))
            watcher.tell({"kind": "state", "number": number})
            watcher.refuse(f"{number}")
        sent = []
        while (text := watcher._next()) is not None:
            sent.append(json.loads(text))
        kinds = [message["kind"] for message in sent]
        assert kinds == ["refused"] * 5 + ["state"] + ["samples"] * MOST_WAITING
        assert sent[5]["number"] == 99
        assert sent[4]["sentence"] == "99"
        samples = sent[6:]
        assert sum(len(m["time_s"]) + m["lost"] for m in samples) == 100 * 8

    asyncio.run(trial())


UNREADABLE = {
    "a long address": b"GET /" + b"a" * 20_000 + b" HTTP/1.1\r\nHost: x\r\n\r\n",
    "a long header": b"GET / HTTP/1.1\r\nHost: " + b"a" * 20_000 + b"\r\n\r\n",
    "no HTTP": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n",
    "a bad method": b"G\x1b[31mT / HTTP/1.1\r\nHost: x\r\n\r\n",
    "a bad header": b"GET / HTTP/1.1\r\nHo st: x\r\n\r\n",
    "two lengths": b"GET / HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
    "an escape in the address": b"GET /\x1b]0;x\x07 HTTP/1.1\r\nHost: x\r\n\r\n",
    "a bad version": b"GET / HTTP/9999999999999\r\n\r\n",
    "a bad chunk": b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nxyz\r\n\r\n",
}


def test_what_is_no_request_is_a_line_on_the_terminal(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def act(server: PrototypeServer) -> None:
        port = urlsplit(server.url).port
        for _ in range(3):
            for request in UNREADABLE.values():
                reader, writer = await asyncio.open_connection("127.0.0.1", port)
                writer.write(request)
                writer.write_eof()
                with contextlib.suppress(ConnectionError):
                    await reader.read()
                writer.close()
                with contextlib.suppress(ConnectionError):
                    await writer.wait_closed()

    served(tmp_path, act)
    told = [logging.Formatter().format(record) for record in caplog.records]
    assert 1 <= len(told) <= len(UNREADABLE)
    assert len(set(told)) == len(told)
    assert all("cannot read was refused (" in line for line in told)
    assert all(line.isprintable() for line in told)
