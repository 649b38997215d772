"""Felt lag of rendering and capture against a bare C loop, on a device that paces itself.

    python -m benchmarks.latency [--rates 1000 2000 4000] [--loads idle busy track page]
        [--seconds 10] [--rounds 3] [--no-rights]

A device in C on a pseudo-terminal (benchmarks/latency_c/device.c) counts the lag in ticks by
``echo_sequence`` and the time from each STATE to the command that answers it, while its motors are
on. Against it run, one after the other in each round: the shortest loop in C that answers
(benchmarks/latency_c/echo.c), a rendering and a capture that are recorded, each idle and with a
busy Python thread beside it: a thread of the same process for rendering and capture, a process
for the bare loop. With ``track`` the thread follows a plate instead, by 100 contacts and 33 late
pictures a second, and with ``page`` a page follows the recording, served by another process, to
a third; the bare loop is idle then. Ratios are medians over the rounds of the figure over
the bare loop's of the same round. ``--no-rights`` takes real-time priority and locked memory from
the loops (not from the device, which in a lab has a processor of its own).
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.kernel import c_sources

HERE = Path(__file__).parent / "latency_c"
FIGURES = ("p50", "p99", "p99.9", "worst")
SUBJECTS = ("echo", "render", "capture")
UNPRIVILEGED = ("setpriv", "--bounding-set=-sys_nice,-ipc_lock", "--")
BUSY = "while True: pass"


def main() -> None:
    """Measure, print a table of ratios, and all figures as JSON with ``--json``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rates", type=int, nargs="+", default=[1000, 2000, 4000])
    parser.add_argument("--loads", nargs="+", default=["idle", "busy"])
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--no-rights", action="store_true")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--run", nargs=4, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run:
        subject, port, seconds, load = options.run
        run_host(subject, port, float(seconds), load)
        return
    found = []
    with tempfile.TemporaryDirectory() as folder:
        build(Path(folder))
        for rate in options.rates:
            for load in options.loads:
                for number in range(options.rounds):
                    for subject in SUBJECTS:
                        figures = measure(Path(folder), subject, rate, load, options)
                        found.append({"rate": rate, "load": load, "round": number} | figures)
                print_ratios(found, rate, load)
    if options.json:
        options.json.write_text(json.dumps(found, indent=1))


def build(folder: Path) -> None:
    """Compile the two programs and build the package that is rendered."""
    core = c_sources()
    wire = [str(core / name) for name in ("sc_wire.c", "sc_messages.c")]
    for name in ("device", "echo"):
        program = [str(HERE / f"{name}.c"), *wire, "-o", str(folder / name), "-lm"]
        subprocess.run(["cc", "-std=c99", "-O2", "-Wall", f"-I{core}", *program], check=True)
    from tests.package.fits import cut_fit, friction_fit, recipe

    from scissorcal.package import build_package

    chosen = recipe()
    friction = friction_fit(coulomb=0.014, stribeck=0.004, viscous=0.002)
    cut = cut_fit(chosen, kappa=0.75, energy=0.52)
    build_package(chosen, friction, cut, folder / "package.zip", np.random.default_rng(1))


def measure(
    folder: Path, subject: str, rate: int, load: str, options: argparse.Namespace
) -> dict[str, Any]:
    """Run one subject against a device; the device's figures."""
    device = subprocess.Popen(
        [str(folder / "device"), str(round(1e6 / rate))],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert device.stdout is not None
    port = device.stdout.readline().strip()
    rights = UNPRIVILEGED if options.no_rights else ()
    with ExitStack() as stack:
        if subject == "echo":
            if load == "busy":
                spinning = subprocess.Popen([sys.executable, "-c", BUSY])
                stack.callback(spinning.wait)
                stack.callback(spinning.kill)
            command = [str(folder / "echo"), port, str(options.seconds)]
        else:
            own = [sys.executable, "-W", "ignore", "-m", "benchmarks.latency", "--run"]
            command = [*own, subject, port, str(options.seconds), load]
        found = {**os.environ, "PYTHONPATH": str(HERE.parents[1])}  # from another folder
        words = [*rights, *command]
        said = subprocess.run(words, cwd=folder, env=found, capture_output=True, text=True)
        if said.returncode:
            raise SystemExit(said.stderr)
    figures = json.loads(device.communicate("end\n")[0])
    own_view = json.loads(said.stdout) if said.stdout else {}
    return {"subject": subject, **figures, "host": own_view}


def run_host(subject: str, port: str, seconds: float, load: str) -> None:
    """Render or capture, recorded into the current folder; print the host's own figures."""
    from scissorcal.device.link import open_link
    from scissorcal.kernel import ConfigKey

    if load in ("busy", "track"):
        threading.Thread(target={"busy": spin, "track": track}[load], daemon=True).start()
    shown: dict[str, Any] = {}
    with open_link(port) as link, tempfile.TemporaryDirectory() as folder:
        link.configure(ConfigKey.BRAKE_AFTER_MS, 500.0)
        path = Path(folder) / "recording.mcap"
        with page_of(folder, shown) if load == "page" else nullcontext():
            report = (render_on if subject == "render" else capture_on)(link, path, seconds)
    lag = report.lag
    ticks = [lag.ticks.p50, lag.ticks.p99, lag.ticks.p999, lag.ticks.worst]
    facts = {"lag": ticks, "held_share": lag.held_share, "transport_ms": lag.transport_ms}
    print(json.dumps({**facts, "realtime": report.rights.realtime, "page": shown}))


@contextmanager
def page_of(folder: str, shown: dict[str, Any]) -> Iterator[None]:
    """Serve a page of what is recorded into a folder; ``shown`` gets what the page got."""
    words = [sys.executable, "-W", "ignore", "-m", "benchmarks.latency_page", folder]
    pipe = subprocess.PIPE
    with subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True) as server:
        assert server.stdout is not None
        assert server.stdout.readline() == "ready\n"
        yield
        time.sleep(0.5)  # until the page has the last samples
        shown.update(json.loads(server.communicate()[0]))


def spin() -> None:
    """Keep a processor and the interpreter busy."""
    while True:
        pass


def track() -> None:
    """Feed a pose filter as a track does, in real time."""
    from benchmarks.tracking_rows import LATE_ROWS, Fed

    from scissorcal.model.surface import Plane

    fed = Fed(Plane(), LATE_ROWS)
    due = time.monotonic()
    while True:
        fed.between()
        fed.picture()
        due += 0.03
        time.sleep(max(due - time.monotonic(), 0.0))


def render_on(link: Any, path: Path, seconds: float) -> Any:
    """Render the package for some seconds, strokes of the device's own hand."""
    from scissorcal.device.session import RigSession
    from scissorcal.package import open_package
    from scissorcal.render import Rendering, VirtualStrokes, open_writer, render

    package = open_package(Path("package.zip"), warn=False)
    how = Rendering(seconds, VirtualStrokes(1000, 0.6))
    session = RigSession(link, package.recipe)
    with open_writer(session, package, path) as writer:
        return render(session, package, how, writer=writer)


def capture_on(link: Any, path: Path, seconds: float) -> Any:
    """Capture friction for about some seconds."""
    from tests.device.recipes import changed

    from scissorcal.device.capture import capture, open_writer
    from scissorcal.device.session import RigSession

    friction = {"speeds_rad_per_s": (1.0,), "repeats": 1, "excitation_s": max(seconds - 5.0, 1.0)}
    recipe = changed("paper-80gsm", capture__friction=friction)
    session = RigSession(link, recipe)
    with open_writer(session, "friction", path) as writer:
        return capture(session, "friction", writer).motion


def print_ratios(found: list[dict[str, Any]], rate: int, load: str) -> None:
    """Print the bare loop's figures and the others' ratios, medians over the rounds."""
    rows = [each for each in found if each["rate"] == rate and each["load"] == load]
    print(f"\n{rate} Hz, {load:4}          " + "".join(f"{name:>10}" for name in FIGURES))
    base = {each["round"]: each for each in rows if each["subject"] == "echo"}
    for kind, unit in (("reply_us", "us"), ("lag", "ticks")):
        bare = np.median([each[kind] for each in base.values()], axis=0)
        print(f"{'echo':8} {unit:12} " + "".join(f"{value:10.1f}" for value in bare))
        for subject in SUBJECTS[1:]:
            mine = [each for each in rows if each["subject"] == subject]
            ratio = [np.array(each[kind]) / base[each["round"]][kind] for each in mine]
            values = "".join(f"{value:10.2f}" for value in np.median(ratio, axis=0))
            print(f"{subject:8} {'x echo':12} {values}")
    pages = [each["host"]["page"] for each in rows if each["host"].get("page")]
    for page in pages:
        print("page     " + ", ".join(f"{name} {value}" for name, value in page.items()))
    for subject in SUBJECTS:
        mine = [each for each in rows if each["subject"] == subject]
        shares = [100 * each["held"] / max(each["ticks"], 1) for each in mine]
        faults = sum(each["faults"] for each in mine)
        print(f"{subject:8} {np.median(shares):.3f} % of ticks held, {faults} faults")


if __name__ == "__main__":
    main()
