"""What is costly to make, made once in a run of the tests and shared by its worker processes.

A fixture of scope "session" is made once in each worker; what :func:`made_once` gives is made by
the first worker that asks, while the others wait for it.
"""

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from filelock import FileLock


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """Give the folder that ``make`` filled, in this process or in another of the same run.

    ``name`` states all that the content depends on besides the source, such as the recipe and the
    seed. The folder is shared, so a test that changes files works on a copy (:func:`copied`).

    >>> made_once(factory, "friction day, seed 1", lambda folder: run_day(folder, seed=1))
    """
    root = _of_the_run(factory) / "made-once"
    root.mkdir(exist_ok=True)
    folder = root / re.sub(r"[^\w.,=-]+", "-", name)
    whole = folder.with_name(f"{folder.name}.whole")
    with FileLock(f"{folder}.lock"):
        if not whole.exists():
            shutil.rmtree(folder, ignore_errors=True)  # of a set-up that failed
            folder.mkdir()
            make(folder)  # at its last place: a workspace may know its own path
            whole.touch()
    return folder


def copied(folder: Path, target: Path) -> Path:
    """Give a copy of a shared folder that a test may change; ``target`` must not exist."""
    return Path(shutil.copytree(folder, target))


def _of_the_run(factory: pytest.TempPathFactory) -> Path:
    """The run's own temporary folder, the same in all its workers."""
    base = factory.getbasetemp()
    return base.parent if base.name.startswith("popen-") else base
