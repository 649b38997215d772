"""A short capture of the virtual rig in virtual time, as a case."""

import tempfile
from pathlib import Path

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.device import LockstepLink, RigSession, load_specimen, open_writer
from scissorcal.device.capture import capture
from scissorcal.recording import Recording, read_recording
from tests.device.recipes import short


def captured(name: str) -> Case:
    """Empty strokes and one sheet of a library's recipe; no fits yet."""
    recipe = short(name)
    link = LockstepLink(load_specimen(recipe.specimen), np.random.default_rng(11))
    found: dict[str, tuple[Recording, ...]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("friction", "cut"):
            path = Path(folder) / f"{kind}.mcap"
            with open_writer(RigSession(link, recipe), kind, path) as writer:
                capture(RigSession(link, recipe), kind, writer)
            found[kind] = (read_recording(path),)
    link.close()
    return Case(recipe, found["friction"], found["cut"], None, (), None, None, "draft")
