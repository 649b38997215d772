"""In a browser: the page's line to its server, and a page of another site that gets nothing."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from scissorcal.prototype.rig_commands import RigCommand
from scissorcal.prototype.server import MOST_PAGES, PrototypeServer
from tests.browser import bundled, wait_until, watch

from .made import a_writer, running, samples_of

POLICY = "default-src 'none'; script-src 'unsafe-inline'; connect-src 'self'"
REQUEST = "Take everything out."
HARNESS = """
import { connect, Recent } from "./src/socket";
const recent = new Recent(2);
const [why, refused] = [[] as string[], [] as string[]];
const told = { connected: [], why, states: [], refused, samples: 0 };
const server = JSON.parse(document.getElementById("server")!.textContent!);
const line = connect(server, {
  connected: (is, why) => { told.connected.push(is); told.why.push(why); },
  state: (state) => told.states.push(state),
  samples: (samples) => { told.samples += samples.time_s.length; recent.add(samples); },
  refused: (sentence) => told.refused.push(sentence),
});
Object.assign(window, { line, told, recent, connect, server });
"""

GONE = "start scissorcal prototype again and open the address that it prints"
OTHER_TOKEN = """() => { window.other = [];
  connect({ socket: server.socket.replace(/=./, "=") }, { connected: (_, why) => other.push(why),
    state: () => {}, samples: () => {}, refused: () => {} }); }"""

STRANGER = """<!doctype html><title>Another site</title><script>
const found = [];
window.tried = (async () => {
  for (const url of URLS) {
    for (const mode of ["cors", "no-cors", "same-origin"]) {
      try { found.push(await (await fetch(url, { mode })).text()); } catch { found.push(""); }
    }
    found.push(await new Promise((done) => {
      const socket = new WebSocket(url.replace("http:", "ws:").replace("/?", "/rig?"));
      socket.onmessage = (event) => done(event.data);
      socket.onclose = () => done("");
    }));
    found.push(await new Promise((done) => {
      const frame = document.createElement("iframe");
      frame.onload = () => {
        try { done(frame.contentDocument.body.textContent); } catch { done(""); }
      };
      frame.src = url;
      document.body.append(frame);
    }));
  }
  return found;
})();
</script><body></body>"""


def until(page: Page, expression: str) -> None:
    """Wait until it is true; the page's policy lets no text be evaluated within the page."""
    wait_until(page, lambda: page.evaluate(expression), expression)


@contextmanager
def served(folder: Path, page: str) -> Iterator[PrototypeServer]:
    """A page in which ``SERVER`` stands for the socket, served in a thread."""
    command = RigCommand("render", ("render",), REQUEST)

    def page_of(socket: str) -> tuple[str, str]:
        told = f'<script type="application/json" id="server">{{"socket": "{socket}"}}</script>'
        return page.replace("SERVER", told), POLICY

    with running(PrototypeServer(page_of, folder / "captures", folder, [command])) as server:
        yield server


@contextmanager
def another_site(text: str) -> Iterator[str]:
    """A web server of somebody else on this computer, with one page."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.end_headers()
            self.wfile.write(text.encode())

        def log_message(self, *_: Any) -> None:
            """Say nothing."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as site:
        thread = threading.Thread(target=site.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{site.server_port}/"
        finally:
            site.shutdown()
            thread.join()


def test_the_page_follows_asks_and_connects_again(browser: Browser, tmp_path: Path) -> None:
    page_text = f"<!doctype html><title>Rig</title>SERVER<script>{bundled(HARNESS)}</script>"
    with served(tmp_path, page_text) as server, browser.new_context() as context:
        page = context.new_page()
        seen = watch(page)
        page.goto(server.url)
        until(page, "told.states.length > 0")
        assert page.evaluate("told.states[0].commands") == ["render"]
        page.evaluate("line.start('render')")
        until(page, "told.refused.length > 0")
        page.evaluate("line.arm('render')")
        until(page, f"told.states.at(-1).request === '{REQUEST}'")
        with a_writer(tmp_path) as writer:
            for number in range(50):
                writer.append(samples_of(100 * number, 100))
            until(page, "told.samples > 100")
            assert "Following" in page.evaluate("told.states.at(-1).following")
            page.reload()
            until(page, "told.states.length > 0")
            for number in range(50, 100):
                writer.append(samples_of(100 * number, 100))
            until(page, "recent.columns.time_s.at(-1) > 9.5")
        columns = page.evaluate("recent.columns")
        assert columns["time_s"][0] >= columns["time_s"][-1] - 2.0
        assert len({len(column) for column in columns.values()}) == 1
        assert not seen.errors
        assert not seen.elsewhere


def test_a_page_says_that_its_server_has_ended_and_what_to_do(
    browser: Browser, tmp_path: Path
) -> None:
    page_text = f"<!doctype html><title>Rig</title>SERVER<script>{bundled(HARNESS)}</script>"
    with browser.new_context() as context:
        page = context.new_page()
        with served(tmp_path, page_text) as server:
            page.goto(server.url)
            until(page, "told.connected.at(-1) === true")
        until(page, "told.connected.at(-1) === false")
        assert GONE in page.evaluate("told.why.at(-1)")
        page.evaluate("line.stop()")
        (refused,) = page.evaluate("told.refused")
        assert "cannot be reached" in refused


def test_a_page_tries_again_for_some_seconds_and_then_says_what_to_do(
    browser: Browser, tmp_path: Path
) -> None:
    """A server that was killed says nothing; its port refuses."""
    page_text = f"<!doctype html><title>Rig</title>SERVER<script>{bundled(HARNESS)}</script>"
    told = '<script type="application/json" id="server">{"socket": "/rig?token=t"}</script>'
    with browser.new_context() as context:
        page = context.new_page()
        page.clock.install()
        with another_site(page_text.replace("SERVER", told)) as site:
            page.goto(site)
            until(page, "told.why.length > 0")
        assert page.evaluate("told.why.at(-1)").endswith("trying again.")

        def is_gone() -> bool:
            page.clock.run_for(1000)  # what does not go by it is the network
            return GONE in page.evaluate("told.why.at(-1)")

        wait_until(page, is_gone, GONE)
        count = page.evaluate("told.why.length")
        page.clock.run_for(60_000)
        assert page.evaluate("told.why.length") == count, "it is over"


def test_another_server_at_the_same_port_can_never_take_the_page_over(
    browser: Browser, tmp_path: Path
) -> None:
    page_text = f"<!doctype html><title>Rig</title>SERVER<script>{bundled(HARNESS)}</script>"
    with served(tmp_path, page_text) as server, browser.new_context() as context:
        page = context.new_page()
        page.goto(server.url)
        until(page, "told.connected.at(-1) === true")
        page.evaluate(OTHER_TOKEN)
        until(page, "other.length > 1")
        assert GONE in page.evaluate("other.at(-1)")


def test_two_pages_of_one_server_follow_the_same_rig(browser: Browser, tmp_path: Path) -> None:
    page_text = f"<!doctype html><title>Rig</title>SERVER<script>{bundled(HARNESS)}</script>"
    with served(tmp_path, page_text) as server, browser.new_context() as context:
        pages = [context.new_page() for _ in range(2)]
        for page in pages:
            page.goto(server.url)
            until(page, "told.states.length > 0")
        with a_writer(tmp_path) as writer:
            for number in range(50):
                writer.append(samples_of(100 * number, 100))
            for page in pages:
                until(page, "recent.columns.time_s.at(-1) > 4.5")
        last = [page.evaluate("recent.columns.torque_Nm.at(-1)") for page in pages]
        assert last[0] == pytest.approx(last[1], abs=0.5)  # 0.5 s at 1 N m/s
        pages[0].close()
        with a_writer(tmp_path, name="render-2.mcap") as writer:
            writer.append(samples_of(0, 1000))
            until(pages[1], "recent.recording.includes('render-2')")


@pytest.mark.slow
def test_a_page_too_many_waits_until_another_one_is_closed(
    browser: Browser, tmp_path: Path
) -> None:
    page_text = f"<!doctype html><title>Rig</title>SERVER<script>{bundled(HARNESS)}</script>"
    with served(tmp_path, page_text) as server, browser.new_context() as context:
        pages = [context.new_page() for _ in range(MOST_PAGES + 1)]
        for page in pages:
            page.goto(server.url)
            until(page, "told.connected.length > 0")
        last = pages[-1]
        until(last, "told.why.at(-1).includes('close another one')")
        pages[0].close()
        until(last, "told.states.length > 0")
        assert server.watching == MOST_PAGES


def test_a_page_of_another_site_gets_nothing_even_with_the_address(
    browser: Browser, tmp_path: Path
) -> None:
    with served(tmp_path, "<!doctype html><title>Rig</title><p>secret</p>SERVER") as server:
        bare = server.url.partition("?")[0]
        urls = [server.url, server.url.replace("127.0.0.1", "localhost"), f"{bare}?token="]
        text = STRANGER.replace("URLS", str(urls))
        with another_site(text) as site, browser.new_context() as context:
            page = context.new_page()
            page.goto(site)
            found = page.evaluate("tried")
            assert found == [""] * 5 * len(urls)
            assert not server.watching
            own = context.new_page()
            own.goto(server.url)
            assert own.inner_text("p") == "secret"
