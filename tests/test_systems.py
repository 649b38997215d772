"""On a system without Unix's modules: what works there works, and the rest gives one sentence."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from scissorcal.calibration import save
from scissorcal.recording import write_recording
from scissorcal.workday import create_workspace
from tests.calibration.results import results
from tests.recording.made import made_recording
from tests.workday.made import fitted_copy

SITE = """
import os, sys, types, warnings
for name in ("fcntl", "termios", "resource", "pty", "tty", "grp", "pwd", "syslog"):
    sys.modules[name] = None
LACKS = {"uname", "sched_getaffinity", "sched_setscheduler", "sched_getscheduler", "openpty",
    "ttyname", "fork", "forkpty", "register_at_fork", "killpg", "setsid", "geteuid", "getuid",
    "pread", "pwrite", "sysconf", "statvfs", "mkfifo", "set_blocking", "O_NOFOLLOW",
    "O_NONBLOCK", "O_CLOEXEC", "O_NOCTTY", "O_DIRECTORY"}
class Bare(types.ModuleType):
    def __getattribute__(self, name):
        if name in LACKS or name == "name":
            caller = sys._getframe(1).f_globals.get("__name__", "")
            if caller.startswith(("scissorcal", "__main__")):
                if name == "name":
                    return "nt"
                raise AttributeError(f"module 'os' has no attribute {name!r}")
        return super().__getattribute__(name)
os.__class__ = Bare
warnings.filterwarnings("ignore", "only soft file lock")
"""
"""Hides the modules that Windows lacks, and names of os from scissorcal alone: numpy and the
standard library of this system stand on some."""


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that commands work on, and the start file that hides modules."""
    folder = tmp_path_factory.mktemp("bare")
    (folder / "site").mkdir()
    (folder / "site" / "sitecustomize.py").write_text(SITE)
    create_workspace(folder / "work", "paper-80gsm")
    write_recording(made_recording(), folder / "cut.mcap")
    for what in ("friction", "cut", "camera", "blade", "plate"):
        save(results()[what], folder / f"{what}.nc")
    time = np.arange(0.0, 12.0, 0.005)
    angle = 30.0 + 15.0 * np.cos(2 * np.pi * time / 3.0)
    force = 2.0 + 0.5 * np.sign(np.gradient(angle))
    rows = [f"{t:.3f},{a:.4f},{f:.3f}" for t, a, f in zip(time, angle, force, strict=True)]
    (folder / "log.csv").write_text("time_s,angle_deg,force_N\n" + "\n".join(rows) + "\n")
    return folder


def without(folder: Path, *words: str, cwd: str = ".") -> subprocess.CompletedProcess[str]:
    source = str(Path(__file__).parents[1] / "src")
    paths = os.pathsep.join([str(folder / "site"), source])
    environment = {**os.environ, "PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder / cwd,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )


COLUMNS = ("-c", "time=time_s", "-c", "opening=angle_deg", "-c", "handle_force=force_N")
WORKS = {
    "plan": ["plan"],
    "recipe show": ["recipe", "show"],
    "recording list": ["recording", "list"],
    "recording show": ["recording", "show", "../cut.mcap"],
    "export": ["export", "../cut.mcap", "cut.csv"],
    "export a camera": ["export", "../camera.nc", "camera.yaml", "--style", "ros"],
    "summarise": ["summarise", "../log.csv", *COLUMNS, "--handle-radius-mm", "60"],
    "import": ["import", "../log.csv", *COLUMNS, "--handle-radius-mm", "60"],
    "compare": ["report", "compare", "../cut.nc", "../cut.nc", "--output", "compared"],
    "target": ["target", "camera"],
    "init": ["init", "again", "--recipe", "paper-80gsm"],
}


def test_the_modules_are_hidden(bare: Path) -> None:
    for name in ("fcntl", "termios", "resource", "pty"):
        done = without(bare, "-c", f"import {name}")
        assert "ModuleNotFoundError" in done.stderr
    assert without(bare, "-c", "import os; os.uname()").returncode == 1


@pytest.mark.parametrize("name", WORKS)
def test_a_command_without_a_rig_works(bare: Path, name: str) -> None:
    done = without(bare, "-m", "scissorcal", *WORKS[name], cwd="work")
    assert done.returncode == 0, done.stderr
    assert "fault of scissorcal" not in done.stderr


@pytest.fixture(scope="module")
def day(bare: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace beside them, with recordings and fits of friction and a cut."""
    return fitted_copy(tmp_path_factory, bare / "day", "friction", "cut").root


DAY = {
    "fit": ["fit", "friction", "--force"],
    "fit a cut": ["fit", "cut", "--force"],
    "verify in processes": ["verify", "friction", "--checks", "sbc", "--fits", "2", "--workers=2"],
    "report": ["report"],
    "package build": ["package", "build", "--allow-failed"],
    "package check": ["package", "check"],
    "bench trade": ["bench", "trade", "--knob", "tables", "--workers", "1"],
    "render": ["render", "--device", "sim", "--allow-mismatch", "--strokes", "1", "--yes"],
}
"""In the order of a day: each may take what those before it made."""
QUICK = ("fit",)


@pytest.mark.parametrize(
    "names",
    [pytest.param(QUICK, id="quick"), pytest.param(tuple(DAY), id="all", marks=pytest.mark.slow)],
)
def test_a_day_works(bare: Path, day: Path, names: tuple[str, ...]) -> None:
    for name in names:
        done = without(bare, "-m", "scissorcal", *DAY[name], cwd=day.name)
        assert done.returncode in (0, 3), f"{name}: {done.stderr}"
        assert "fault of scissorcal" not in done.stderr


PAGE = """
import asyncio, sys, urllib.request
from pathlib import Path
from scissorcal.prototype.server import PrototypeServer
async def serve():
    page = lambda path: ("<p>a page</p>", "default-src 'none'")
    async with PrototypeServer(page, Path("captures"), Path(".")) as server:
        fetch = lambda: urllib.request.urlopen(server.url, timeout=20).read()
        return await asyncio.get_running_loop().run_in_executor(None, fetch)
print(asyncio.run(serve()).decode())
"""


def test_the_page_of_a_package_is_served(bare: Path) -> None:
    done = without(bare, "-c", PAGE, cwd="work")
    assert done.stdout == "<p>a page</p>\n", done.stderr


RIG = {
    "device list": ["device", "list"],
    "device simulate": ["device", "simulate", "office-paper"],
    "device doctor": ["device", "doctor", "--device", "sim"],
    "device probe": ["device", "probe", "--device", "sim"],
    "device home": ["device", "home", "--device", "sim"],
    "capture": ["capture", "friction", "--device", "sim"],
    "capture from a port": ["capture", "friction", "--device", "/dev/ttyUSB0"],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", RIG)
def test_a_command_with_a_rig_works_or_gives_one_sentence(bare: Path, name: str) -> None:
    done = without(bare, "-m", "scissorcal", *RIG[name], cwd="work")
    if done.returncode == 0:
        return
    assert done.returncode == 4, done.stderr
    said = [line for line in done.stderr.splitlines() if line.startswith("Error: ")]
    assert len(said) == 1
    assert "fault of scissorcal" not in done.stderr
    assert "Unix terminal" in said[0] or "cannot be listed" in said[0]


LIBRARY = """
import scissorcal
from pathlib import Path
from scissorcal.recording import recover, write_recording
from scissorcal.recording.writer import RecordingWriter
found = scissorcal.open_recording("cut.mcap")
write_recording(found, "copy.mcap")
for what in ("friction", "cut", "camera", "blade", "plate"):
    assert scissorcal.open_fit(f"{what}.nc").what == what
with RecordingWriter("live.mcap", "friction") as writer:
    writer.append(found.samples[:100])
    (seen,) = recover(".")
    assert seen.status == "busy", seen
assert len(scissorcal.open_recording("live.mcap").samples) == 100
print("done")
"""


def test_recordings_and_fits_are_read_and_written(bare: Path) -> None:
    done = without(bare, "-c", LIBRARY)
    assert done.stdout == "done\n", done.stderr
