"""``scissorcal prototype`` as a person uses it: served, followed, started, stopped, killed.

What a page does with a command that runs is tested without a rig in tests/prototype:
test_server.py, test_rig_commands.py and test_rig_feed.py.
"""

import asyncio
import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import aiohttp
import pytest

from scissorcal.device import LockstepLink, SimProcess
from scissorcal.recording import RecordingFacts, RecordingWriter, Stroke, read_recording
from scissorcal.render import REQUEST
from scissorcal.workday import Workspace, workspace_hands
from tests.guard import GUARD_S
from tests.prototype.made import ask, heard, samples_of
from tests.strange_device import StrangeDevice
from tests.strange_device.terminal import serve_on_pty

from .conftest import Cli


@contextmanager
def served(workspace: Workspace, *words: str) -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """The command in a process of its own, and its address."""
    command = [sys.executable, "-m", "scissorcal", "prototype", "--no-open", "--json"]
    command += ["--workspace", str(workspace.root), *words]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as process:
        try:
            assert process.stderr is not None
            line = process.stderr.readline()
            assert line.startswith("http://127.0.0.1:"), line + process.stderr.read()
            yield process, line.split()[0]
        finally:
            process.kill()


def watch(url: str, act: "Callable[[aiohttp.ClientWebSocketResponse], Any]") -> Any:
    """Act as the page at ``url``."""

    async def run() -> Any:
        async with (
            asyncio.timeout(GUARD_S),
            aiohttp.ClientSession() as session,
            session.ws_connect(url.replace("/?", "/rig?")) as page,
        ):
            return await act(page)

    return asyncio.run(run())


def ended(message: dict[str, Any]) -> bool:
    return message["kind"] == "state" and message["code"] is not None


async def start(page: aiohttp.ClientWebSocketResponse, command: str) -> None:
    """Arm, confirm, and wait for the first samples."""
    await ask(page, "arm", command)
    assert await heard(page, lambda message: bool(message.get("request")))
    await ask(page, "start", command)
    while True:
        message = json.loads(await page.receive_str())
        assert not ended(message), message
        if message["kind"] == "samples" and message["time_s"]:
            return


@pytest.mark.realtime
def test_a_rendering_is_started_followed_and_stopped_and_keeps_its_recording(
    packed: Workspace,
) -> None:
    async def act(page: aiohttp.ClientWebSocketResponse) -> dict[str, Any]:
        await start(page, "render")
        await heard(page, lambda message: message.get("time_s", [0.0])[-1] > 1.0)
        await ask(page, "stop")
        return await heard(page, ended)

    with served(packed, "--device", "sim") as (process, url):
        said = watch(url, act)
        assert (said["code"], said["sentence"]) == (130, "Stopped.")
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=GUARD_S)
        assert process.returncode == 0
        envelope = json.loads(out)
        assert envelope["command"] == "prototype"
        assert url.startswith(envelope["result"]["address"])
        assert "token" not in out
    (path,) = packed.recordings("render")
    recording = read_recording(path)
    assert len(recording.samples) > 1000
    assert any("Ctrl-C" in note for note in recording.notes)


def test_a_rendering_that_ctrl_c_ends_keeps_its_recording(
    packed: Workspace, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same in virtual time: the interrupt comes between two ticks."""
    exchange, answered = LockstepLink.exchange, itertools.count()

    def interrupted(self: LockstepLink, command: bytes | None) -> list[bytes]:
        is_recorded = any(packed.captures_dir.glob("render-*.part"))
        if is_recorded and next(answered) == 2000:
            raise KeyboardInterrupt
        return exchange(self, command)

    monkeypatch.setattr(LockstepLink, "exchange", interrupted)
    said = cli("render", "--device", "sim", "--yes", "--workspace", packed.root)
    assert said.code == 130
    (path,) = packed.recordings("render")
    recording = read_recording(path)
    assert len(recording.samples) > 1000
    assert any("Ctrl-C" in note for note in recording.notes)


@pytest.mark.realtime
def test_a_killed_server_takes_its_command_with_it_and_the_recording_is_kept(
    packed: Workspace,
) -> None:
    with served(packed, "--device", "sim") as (process, url):
        watch(url, lambda page: start(page, "render"))
        process.kill()
        process.communicate(timeout=GUARD_S)
        until = time.monotonic() + GUARD_S
        while not packed.recordings("render"):
            assert time.monotonic() < until, "the rendering goes on without the server"
            time.sleep(0.05)
    (path,) = packed.recordings("render")
    assert any("Ctrl-C" in note for note in read_recording(path).notes)


@pytest.mark.realtime
def test_an_unplugged_rig_is_told_in_a_sentence(packed: Workspace) -> None:
    async def act(page: aiohttp.ClientWebSocketResponse) -> dict[str, Any]:
        await start(page, "render")
        said = await heard(page, ended)
        return said if said["following"].endswith("complete.") else await heard(page, whole)

    def whole(message: dict[str, Any]) -> bool:
        return bool(message["kind"] == "state" and message["following"].endswith("complete."))

    with SimProcess("office-paper", seed=1) as rig:
        probe = [sys.executable, "-m", "scissorcal", "device", "probe", "--device", rig.port]
        subprocess.run([*probe, "--workspace", str(packed.root)], check=True, capture_output=True)
    with (
        SimProcess("office-paper", seed=1, faults=["unplug=4"]) as rig,
        served(packed, "--device", rig.port) as (_, url),
    ):
        said = watch(url, act)
    assert said["code"] == 4
    assert "unplugged" in said["sentence"] or "lost" in said["sentence"]
    assert said["following"].startswith("render-")


@pytest.mark.realtime
def test_nothing_moves_before_the_rigs_own_question_is_answered_on_the_page(
    packed: Workspace,
) -> None:
    async def act(page: aiohttp.ClientWebSocketResponse) -> list[str]:
        await ask(page, "arm", "render")
        armed = await heard(page, lambda message: bool(message.get("request")))
        await ask(page, "start", "render")
        asked = await heard(
            page, lambda message: message.get("state") == "running" and bool(message["request"])
        )
        await ask(page, "stop")
        assert (await heard(page, ended))["code"] == 130
        return [armed["request"], asked["request"]]

    device = StrangeDevice(seed=3)
    with serve_on_pty(device) as port, served(packed, "--device", port) as (_, url):
        armed, asked = watch(url, act)
    assert armed == REQUEST
    assert asked.startswith("Take everything out from between the blades. The motors are off")
    assert device.largest_torque < 0.01
    assert not packed.recordings("render")


@pytest.mark.realtime
def test_what_another_terminal_started_is_followed_and_not_stopped_from_the_page(
    packed: Workspace,
) -> None:
    async def act(page: aiohttp.ClientWebSocketResponse) -> None:
        await heard(page, lambda message: message.get("time_s", [0.0])[-1] > 0.5)
        await ask(page, "stop")
        said = await heard(page, lambda message: message.get("sentence", "") != "")
        assert said["sentence"] == "Nothing is running."
        assert said["following"].startswith("Following render-")
        await heard(page, lambda message: message.get("time_s", [0.0])[-1] > 1.5)
        await ask(page, "arm", "render")
        refused = await heard(page, lambda message: message["kind"] == "refused")
        assert "there are: none" in refused["sentence"]

    words = ["render", "--device", "sim", "--realtime", "--workspace", str(packed.root)]
    command = [sys.executable, "-m", "scissorcal", *words]
    with (
        served(packed) as (_, url),
        subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as other,
    ):
        try:
            watch(url, act)
            assert other.poll() is None
        finally:
            other.send_signal(signal.SIGINT)
            other.wait(GUARD_S)


@pytest.mark.parametrize("opens", [True, False])
def test_the_browser_is_led_to_the_address_by_a_file_of_its_owner(
    opens: bool, packed: Workspace, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    led: list[tuple[str, str, int]] = []

    def browser(uri: str) -> bool:
        path = Path(uri.removeprefix("file://"))
        led.append((uri, path.read_text(encoding="utf-8"), path.stat().st_mode & 0o777))
        os.kill(os.getpid(), signal.SIGINT)
        return opens

    monkeypatch.setattr("webbrowser.open", browser)
    said = cli("prototype", "--workspace", packed.root)
    assert said.code == 0
    ((uri, text, mode),) = led
    address = said.err.split()[0]
    assert f'url={address}"' in text
    assert address.partition("=")[2] not in uri
    assert mode == 0o600
    assert ("open the address yourself" in said.err) != opens
    assert not (packed.root / "prototype-address.html").exists()


def test_a_page_needs_a_package_and_the_servers_library(
    cli: Cli, workspace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for words in (["prototype", "--no-open"], ["package", "export", "--html", "a.html"]):
        said = cli(*words)
        assert said.code == 5
        assert "no package to show yet: run 'scissorcal capture friction" in said.err
    assert not Path("a.html").exists()
    assert cli("prototype", "--no-open", "--camera", "0").code == 2
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    said = cli("prototype", "--no-open")
    assert said.code == 2
    assert "pip install 'scissorcal[prototype]', or write the page" in said.err
    assert "package export --html" in said.err


def test_the_export_is_one_file_and_replaces_nothing_unasked(
    packed: Workspace, cli: Cli, tmp_path: Path
) -> None:
    page = tmp_path / "paper.html"
    words = ("package", "export", "--html", page, "--workspace", packed.root)
    said = cli(*words, "--json")
    assert said.code == 0
    assert said.envelope["result"] == {"page": str(page), "bytes": page.stat().st_size}
    text = page.read_text(encoding="utf-8")
    assert text.startswith("<!doctype html>")
    assert "token" not in text
    before = page.stat().st_mtime_ns
    assert cli(*words).code == 2
    assert page.stat().st_mtime_ns == before
    assert cli(*words, "--overwrite").code == 0
    assert cli("package", "export", "--html", tmp_path / "a.zip", "-w", packed.root).code == 2
    nowhere = tmp_path / "nowhere" / "a.html"
    assert cli("package", "export", "--html", nowhere, "-w", packed.root).code == 2
    assert not list(tmp_path.glob("*.part"))


def test_a_recording_whose_name_is_no_text_is_a_hand_all_the_same(
    packed: Workspace, cli: Cli, tmp_path: Path
) -> None:
    stroke = Stroke(0, "closing", 0.3, 0)
    packed.captures_dir.mkdir(exist_ok=True)
    path = packed.captures_dir / os.fsdecode(b"cut-\xff.mcap")
    with RecordingWriter(path, "cut", facts=RecordingFacts(strokes=(stroke,))) as writer:
        samples = samples_of(0, 1000)
        samples["stroke"] = 0
        writer.append(samples)
    (hand,) = workspace_hands(packed)
    assert hand.name == "cut-?"
    page = tmp_path / "paper.html"
    said = cli("package", "export", "--html", page, "--workspace", packed.root)
    assert said.code == 0, said.err
