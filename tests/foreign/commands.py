"""Mutants through whole commands: where a format's file lies in a workspace, and what reads it.

What a reader alone cannot show: that nothing behind it ends in a fault where the mutant is read.
"""

import contextlib
import io
import shutil
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scissorcal.cli.root import run
from scissorcal.recipe import recipe_path
from tests.foreign.samples import DRAWN, SAMPLES
from tests.recording.logs import COLUMNS, UNITS
from tests.recording.test_import_formats import MAT_COLUMNS, MAT_UNITS
from tests.workday.made import fitted_workspace

USUAL = (0, 2, 3, 5)
"""Done, an input refused, a verdict, or another step first; 4 is a device's, 1 a fault."""


@dataclass(frozen=True)
class Through:
    """Where the file lies, the command that reads it, and what the recipe has for it."""

    place: str
    words: tuple[str, ...]
    recipe: str | None = None


def _columns(columns: dict[str, str | int], units: dict[str, str]) -> tuple[str, ...]:
    named = [("-c", f"{channel}={column}") for channel, column in columns.items()]
    named += [("-u", f"{channel}={unit}") for channel, unit in units.items()]
    return tuple(word for pair in named for word in pair)


LOG = _columns(COLUMNS, UNITS)
MAT = (*_columns(MAT_COLUMNS, MAT_UNITS), "-s", "motor_torque=gain")


def _drawn() -> str:
    return recipe_path("paper-80gsm").read_text(encoding="utf-8") + DRAWN


def _imported(file: str, *words: str) -> Through:
    return Through(file, ("import", file, *words))


def _summarised(file: str, *words: str) -> Through:
    return Through(file, ("summarise", file, *words))


CAMERAS = (
    "OpenCV YAML",
    "OpenCV YAML 1.0",
    "OpenCV XML",
    "OpenCV JSON",
    "ROS YAML",
    "ROS message",
    "Kalibr YAML",
)
PHOTOGRAPHS = ("JPEG", "PNG", "PNG, 16 bits", "TIFF", "BMP", "WebP")

COMMANDS: dict[str, Through] = {
    "recipe TOML": Through("recipe.toml", ("plan",)),
    "log CSV": _summarised("log.csv", *LOG),
    "log Parquet": _summarised("log.parquet", *LOG),
    "MATLAB 5": _imported("log5.mat", *MAT),
    "MATLAB 5, not packed": _imported("plain5.mat", *MAT),
    "MATLAB 7.3": _imported("log73.mat", *MAT),
    "recording MCAP": Through("captures/a.mcap", ("recording", "show", "captures/a.mcap")),
    "fit netCDF": Through("fits/plate.nc", ("plan",)),
    "fit of friction": Through("a.nc", ("report", "compare", "a.nc", "a.nc")),
    "fit of a camera": Through("fits/camera.nc", ("export", "fits/camera.nc", "written.yaml")),
    "trust check": Through("fits/cut.verify.json", ("plan",)),
    **{name: _imported(SAMPLES[name].file) for name in CAMERAS},
    **{
        name: Through(file, ("capture", "camera", "--image", file))
        for name, file in ((name, SAMPLES[name].file) for name in PHOTOGRAPHS)
    },
    "model package": Through("paper.zip", ("package", "check", "paper.zip")),
    "report.json": Through("a.json", ("report", "compare", "a.json", "a.json")),
    "signature.json": Through("report/signature.json", ("plan",)),
    "capture.json": Through("captures/camera-a/capture.json", ("plan",)),
    "path CSV": Through(
        "path.csv", ("control", "--device", "sim", "--path", "path.csv", "--pose", "20,10,3")
    ),
    "drawing SVG": Through("plate.svg", ("plan",), _drawn()),
    "file index": Through(".scissorcal/index.json", ("plan",)),
    "private key": Through(
        "key", ("report", "sign", "--name", "A", "--decision", "accept", "--key", "key")
    ),
    "public keys": Through("keys.pub", ("package", "check", "p.zip", "--trusted-key", "keys.pub")),
}


class Commands:
    """A workspace in which one command after the other meets a mutant, and is then as before."""

    def __init__(self, folder: Path) -> None:
        self._folder = fitted_workspace(folder / "commands", "friction", "cut").root
        SAMPLES["model package"].make(self._folder / "p.zip")
        _said(("report",), self._folder)
        self._before = {path: path.read_bytes() for path in self._files()}

    def outcome(self, name: str, data: bytes) -> dict[str, Any]:
        """How the command of a format ended on these bytes."""
        through = COMMANDS[name]
        if through.recipe:
            (self._folder / "recipe.toml").write_text(through.recipe, encoding="utf-8")
        path = self._folder / through.place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        path.chmod(0o600)
        try:
            return _said(through.words, self._folder)
        finally:
            self._restore()

    def _files(self) -> Iterator[Path]:
        return (path for path in self._folder.rglob("*") if path.is_file())

    def _restore(self) -> None:
        for path in list(self._files()):
            if path not in self._before:
                path.unlink()
        for path, data in self._before.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            if not path.is_file() or path.read_bytes() != data:
                path.write_bytes(data)
        for path in self._folder.glob("captures/*-*"):
            if path.is_dir():
                shutil.rmtree(path)


def _said(words: tuple[str, ...], folder: Path) -> dict[str, Any]:
    out, err = io.StringIO(), io.StringIO()
    code, fault = 0, ""
    with (
        contextlib.chdir(folder),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            run(list(words))
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else 1
        except BaseException as error:  # noqa: BLE001 - what it is, is the outcome
            code, fault = 1, "".join(traceback.format_exception(error))[-1500:]
    said = err.getvalue()
    if code not in USUAL or "fault of scissorcal" in said + out.getvalue():
        fault = fault or f"exit code {code}: {said[-600:]}"
    return {"code": code, "said": said[:300], "fault": fault}
