"""A page of another site gets nothing, and neither does another program without the token."""

import asyncio
import socket
from pathlib import Path
from urllib.parse import urlsplit

import aiohttp
import pytest

from scissorcal.errors import InputError
from scissorcal.prototype.server import PrototypeServer
from tests.guard import GUARD_S

from .made import a_browser, a_server, small_page

SECRETS = ("<title>", "/rig?token")


def own(server: PrototypeServer) -> str:
    """The server's origin."""
    return server.url.partition("/?")[0]


def changed(server: PrototypeServer, what: str) -> tuple[str, dict[str, str]]:
    """The page's address and headers, with one thing wrong."""
    url, port = server.url, urlsplit(server.url).port
    headers: dict[str, str] = {}
    match what:
        case "no token":
            url = url.partition("?")[0]
        case "empty token":
            url = url.partition("=")[0] + "="
        case "shorter token":
            url = url[:-1]
        case "longer token":
            url += "x"
        case "another token":
            url = url[:-1] + ("a" if url[-1] != "a" else "b")
        case "token twice":
            url += "&" + url.partition("?")[2]
        case "token that is no text":
            url = url.partition("=")[0] + "=%ff%00%f0"
        case "name that points here":
            headers["Host"] = f"evil.example:{port}"
        case "name that begins as ours":
            headers["Host"] = f"127.0.0.1.evil.example:{port}"
        case "another port":
            headers["Host"] = "127.0.0.1:80"
        case "no port":
            headers["Host"] = "127.0.0.1"
        case "another site":
            headers["Origin"] = "https://evil.example"
        case "a file or a frame without origin":
            headers["Origin"] = "null"
        case "another program's page":
            headers["Origin"] = "http://127.0.0.1:80"
        case "the other name":
            headers["Origin"] = f"http://localhost:{port}"
        case "https":
            headers["Origin"] = f"https://127.0.0.1:{port}"
    return url, headers


WRONG = (
    "no token",
    "empty token",
    "shorter token",
    "longer token",
    "another token",
    "token twice",
    "token that is no text",
    "name that points here",
    "name that begins as ours",
    "another port",
    "no port",
    "another site",
    "a file or a frame without origin",
    "another program's page",
    "the other name",
    "https",
)


def test_whatever_is_wrong_gets_nothing_and_learns_nothing(tmp_path: Path) -> None:
    async def trial() -> None:
        async with a_server(tmp_path) as server, aiohttp.ClientSession() as session:
            answers = set()
            for what in WRONG:
                url, headers = changed(server, what)
                for path in ("/?", "/rig?", "/nothing?"):
                    there = url.replace("/?", path) if "?" in url else url + path[1:-1]
                    async with session.get(there, headers=headers) as answer:
                        text = await answer.text()
                        assert answer.status == 403, (what, path)
                        assert not any(word in text for word in SECRETS)
                        assert not any(h.lower().startswith("access-") for h in answer.headers)
                        kept = {k: v for k, v in answer.headers.items() if k != "Date"}
                        answers.add((text, tuple(sorted(kept.items()))))
            assert len(answers) == 1

    asyncio.run(trial())


@pytest.mark.parametrize("what", WRONG)
def test_no_socket_opens_where_anything_is_wrong(what: str, tmp_path: Path) -> None:
    async def trial() -> None:
        async with a_server(tmp_path) as server, aiohttp.ClientSession() as session:
            url, headers = changed(server, what)
            there = url.replace("/?", "/rig?") if "?" in url else url + "rig"
            with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
                await session.ws_connect(there, headers=headers)
            assert refused.value.status == 403
            assert not server.watching

    asyncio.run(trial())


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "HEAD", "PATCH"])
def test_only_get_is_answered_and_a_preflight_allows_nothing(method: str, tmp_path: Path) -> None:
    async def trial() -> None:
        async with a_server(tmp_path) as server, aiohttp.ClientSession() as session:
            asks = {"Origin": "https://evil.example", "Access-Control-Request-Method": "GET"}
            async with session.request(method, server.url, headers=asks) as answer:
                assert answer.status == 403
            async with session.request(method, server.url, data=b"x" * 100) as answer:
                assert answer.status == 405
                assert not any(h.lower().startswith("access-") for h in answer.headers)

    asyncio.run(trial())


def test_who_has_the_address_gets_the_page_with_headers_that_keep_it_closed(
    tmp_path: Path,
) -> None:
    async def trial() -> None:
        async with a_server(tmp_path) as server, aiohttp.ClientSession() as session:
            for url in (server.url, server.url.replace("127.0.0.1", "localhost")):
                async with session.get(url) as answer:
                    assert answer.status == 200
                    assert "<title>Rig" in await answer.text()
                    headers = answer.headers
                    assert headers["Content-Type"] == "text/html; charset=utf-8"
                    policy = headers["Content-Security-Policy"]
                    assert policy == "default-src 'none'; frame-ancestors 'none'"
                    assert headers["X-Content-Type-Options"] == "nosniff"
                    assert headers["Referrer-Policy"] == "no-referrer"
                    assert headers["Cache-Control"] == "no-store"
                    assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
                    assert headers["Cross-Origin-Opener-Policy"] == "same-origin"
                    assert headers["X-Frame-Options"] == "DENY"
                    assert headers["Server"] == "scissorcal"
                    assert not any(name.lower().startswith("access-") for name in headers)
            async with session.get(server.url.replace("/?", "/etc/passwd?")) as answer:
                assert answer.status == 404
            async with session.get(server.url.replace("/?", "/rig?")) as answer:
                assert answer.status == 400

    asyncio.run(trial())


def test_a_program_without_origin_and_a_page_of_the_other_name_may_watch(tmp_path: Path) -> None:
    async def trial() -> None:
        async with a_server(tmp_path) as server, aiohttp.ClientSession() as session:
            there = server.url.replace("/?", "/rig?")
            async with session.ws_connect(there) as program:
                assert (await program.receive_json())["state"] == "idle"
            there = there.replace("127.0.0.1", "localhost")
            origin = {"Origin": own(server).replace("127.0.0.1", "localhost")}
            async with session.ws_connect(there, headers=origin) as page:
                assert (await page.receive_json())["state"] == "idle"

    asyncio.run(trial())


def test_two_hosts_in_one_request_are_refused(tmp_path: Path) -> None:
    async def trial() -> None:
        async with a_server(tmp_path) as server:
            parts = urlsplit(server.url)
            reader, writer = await asyncio.open_connection("127.0.0.1", parts.port)
            hosts = f"Host: 127.0.0.1:{parts.port}\r\nHost: evil.example\r\n"
            writer.write(f"GET /?{parts.query} HTTP/1.1\r\n{hosts}\r\n".encode())
            line = await reader.readline()
            assert line.split()[1] in (b"400", b"403")
            writer.close()
            await writer.wait_closed()

    asyncio.run(trial())


def test_it_listens_on_this_computer_alone(tmp_path: Path) -> None:
    async def trial() -> None:
        async with a_server(tmp_path) as server:
            port = urlsplit(server.url).port
            assert port is not None
            with socket.socket() as other:
                other.settimeout(GUARD_S)
                assert other.connect_ex(("127.0.0.2", port)) != 0

    asyncio.run(trial())


def test_each_server_has_a_token_of_its_own_and_a_taken_port_is_a_sentence(
    tmp_path: Path,
) -> None:
    async def trial() -> None:
        async with a_server(tmp_path) as first, a_server(tmp_path) as second:
            tokens = {server.url.partition("=")[2] for server in (first, second)}
            assert len(tokens) == 2
            assert all(len(token) == 43 for token in tokens)
            port = urlsplit(first.url).port
            third = PrototypeServer(small_page, tmp_path, tmp_path, port=port or 0)
            with pytest.raises(InputError, match=f"Port {port} .* --port"):
                await third.__aenter__()
            async with a_browser(first) as page:
                assert (await page.receive_json())["kind"] == "state"

    asyncio.run(trial())
