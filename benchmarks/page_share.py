"""What the page takes of a processor: at rest, in strokes, in 3-D, and behind a rig.

    python -m benchmarks.page_share WORKSPACE [--rounds 3] [--seconds 6] [--cases rest plain ...]
        [--profile FOLDER] [--json FILE]

Each case runs in a Chromium of its own without a graphics card, in which a served page of the
workspace's package is shown (1280 x 900). The share is that of all its processes: their processor
time, less that of a page without anything, over the time that passed. Beside it stand those of the
page's process and of what draws for it, and of the page's main thread, also in processor time: its
tasks, and of them script, style, and layout. ``canvas`` is a page that does nothing but fill a
drawing of the same size in each frame: what sixty pictures a second cost without anything in them.
The rig is the workspace's newest rendering, written anew into a recording as it went by.
``--profile`` writes a profile of the main thread of each case, for a browser's developer tools.
"""

import argparse
import json
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Browser, CDPSession, Page
from tests.browser import open_browser
from tests.prototype.made import running

from scissorcal.prototype.document import page_of, policy_of
from scissorcal.prototype.server import PrototypeServer
from scissorcal.recording import Recording, RecordingFacts, RecordingWriter, read_recording
from scissorcal.workday.runs.prototype import workspace_scene
from scissorcal.workday.workspace import Workspace

VIEW = {"width": 1280, "height": 900}
SETTLES_s = 1.5
CHUNK = 25
EMPTY = "<!doctype html><title>Nothing</title>"
CANVAS = """<!doctype html><style>canvas {{ display: block; width: {width}px; height: {height}px; }}
</style><canvas width={width} height={height}></canvas><script>
const context = document.querySelector("canvas").getContext("2d");
let shade = 0;
function frame() {{
  shade = (shade + 1) % 200;
  context.fillStyle = `rgb(${{shade}} 200 200)`;
  context.fillRect(0, 0, {width}, {height});
  requestAnimationFrame(frame);
}}
frame();
</script>"""
SIZE = """() => { const { clientWidth: width, clientHeight: height } =
  document.querySelector("canvas.plain"); return { width, height }; }"""
COUNTS = """() => { const a = window.scissorcal; return a ? { time: performance.now(),
  frames: a.frames.count, charts: a.frames.charts } : null; }"""
THREAD = {"main": "TaskDuration", "script": "ScriptDuration", "style": "RecalcStyleDuration"}
THREAD |= {"layout": "LayoutDuration"}
COLUMNS = ("all", "renderer", "GPU", "browser", *THREAD, "frames", "charts")
CASES = ("rest", "plain", "solid", "rig", "canvas")


def main() -> None:
    """Measure each case in each round, and print the medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("workspace", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--profile", type=Path)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    workspace = Workspace(options.workspace)
    found: list[dict[str, Any]] = []
    for number in range(options.rounds):
        empty = measure(workspace, "empty", options)
        for case in options.cases:
            figures = measure(workspace, case, options)
            own = {name: value - empty.get(name, 0.0) for name, value in figures.items()}
            found.append({"case": case, "round": number, **own})
            print(".", end="", flush=True)
    print()
    show(found, options.cases)
    if options.json:
        options.json.write_text(json.dumps(found, indent=1))


def show(found: list[dict[str, Any]], cases: list[str]) -> None:
    """Medians over the rounds, in percent of a processor; frames and charts a second."""
    print(f"{'':>9}" + "".join(f"{name:>19}" for name in COLUMNS))
    for case in cases:
        line = f"{case:>9}"
        for name in COLUMNS:
            values = [one[name] for one in found if one["case"] == case and name in one]
            if not values:
                line += f"{'':>19}"
                continue
            scale = 1.0 if name in ("frames", "charts") else 100.0
            middle, low, high = (f"{scale * f(values):.1f}" for f in (statistics.median, min, max))
            line += f"{f'{middle} ({low}-{high})':>19}" if len(values) > 1 else f"{middle:>19}"
        print(line)


def measure(workspace: Workspace, case: str, options: argparse.Namespace) -> dict[str, float]:
    """Shares of a case, 1: a whole processor."""
    with tempfile.TemporaryDirectory() as folder, open_browser() as browser:
        captures = Path(folder) / "captures"
        captures.mkdir()
        page = browser.new_page(viewport=VIEW)  # type: ignore[arg-type]
        with served(workspace, captures) as url:
            began = start(page, case, url)
            if case == "rig":
                with replayed(workspace, captures):
                    return watched(browser, page, case, options)
            began()
            return watched(browser, page, case, options)


def start(page: Page, case: str, url: str) -> Callable[[], None]:
    """Open the page of a case; what sets it moving."""
    if case == "empty":
        page.set_content(EMPTY)
        return lambda: None
    page.goto(url)
    page.wait_for_selector("canvas.plain")
    if case == "canvas":
        size = page.evaluate(SIZE)
        page.goto("about:blank")
        page.set_content(CANVAS.format(**size))
        return lambda: None
    if case == "solid":
        page.get_by_label("3-D").check()
    if case in ("plain", "solid"):
        page.wait_for_timeout(1e3 * SETTLES_s)
        return lambda: page.get_by_role("button", name="Strokes", exact=True).click()
    return lambda: None


def watched(
    browser: Browser, page: Page, case: str, options: argparse.Namespace
) -> dict[str, float]:
    """Processor time of a few seconds, over them."""
    page.wait_for_timeout(1e3 * SETTLES_s)
    whole, own = browser.new_browser_cdp_session(), page.context.new_cdp_session(page)
    own.send("Performance.enable", {"timeDomain": "threadTicks"})
    profiles = options.profile is not None and case != "empty"
    if profiles:
        own.send("Profiler.enable")
        own.send("Profiler.start")
    before, began = used(whole, own), time.monotonic()
    counted = page.evaluate(COUNTS)
    page.wait_for_timeout(1e3 * options.seconds)
    counted_after = page.evaluate(COUNTS)
    after, passed = used(whole, own), time.monotonic() - began
    if profiles:
        options.profile.mkdir(parents=True, exist_ok=True)
        profile = own.send("Profiler.stop")["profile"]
        (options.profile / f"{case}.cpuprofile").write_text(json.dumps(profile))
    found = {name: (after[name] - before.get(name, 0.0)) / passed for name in after}
    if counted and counted_after:
        spent = 1e-3 * (counted_after["time"] - counted["time"])
        for name in ("frames", "charts"):
            if counted.get(name) is not None:
                found[name] = (counted_after[name] - counted[name]) / spent
    return found


def used(whole: CDPSession, own: CDPSession) -> dict[str, float]:
    """Processor seconds so far, of each kind of process and of parts of the main thread."""
    found = {"all": 0.0, "renderer": 0.0, "GPU": 0.0, "browser": 0.0}
    for process in whole.send("SystemInfo.getProcessInfo")["processInfo"]:
        kind = process["type"]
        found["all"] += process["cpuTime"]
        found[kind] = found.get(kind, 0.0) + process["cpuTime"]
    metrics = {one["name"]: one["value"] for one in own.send("Performance.getMetrics")["metrics"]}
    return found | {name: metrics[metric] for name, metric in THREAD.items()}


@contextmanager
def served(workspace: Workspace, captures: Path) -> Iterator[str]:
    """Address of the page, served in a thread."""
    scene = workspace_scene(workspace)
    server = PrototypeServer(
        lambda socket: (page_of(scene, socket=socket), policy_of(served=True)),
        captures,
        captures.parent,
    )
    with running(server):
        yield server.url


@contextmanager
def replayed(workspace: Workspace, captures: Path) -> Iterator[None]:
    """The newest rendering, written again as it went by, over and over."""
    recording = read_recording(workspace.recordings("render")[-1])
    over = threading.Event()
    thread = threading.Thread(target=lambda: replay(recording, captures, over))
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def replay(recording: Recording, captures: Path, over: threading.Event) -> None:
    own = recording.samples
    for turn in range(1000):
        path = captures / f"render-{turn}.mcap"
        began, began_ns = time.monotonic(), time.time_ns()
        time_s = 1e-6 * (own["device_time_us"] - own["device_time_us"][0])
        with RecordingWriter(
            path, "render", facts=RecordingFacts(handle_radius_m=recording.handle_radius_m)
        ) as writer:
            for first in range(0, len(own), CHUNK):
                chunk, at = own[first : first + CHUNK].copy(), time_s[first : first + CHUNK]
                chunk["host_time_ns"] = began_ns + np.round(1e9 * at).astype(np.int64)
                if over.wait(max(at[-1] - (time.monotonic() - began), 0.0)):
                    return
                writer.append(chunk)


if __name__ == "__main__":
    main()
