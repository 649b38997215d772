"""Write the small examples that travel with scissorcal, from a day on a virtual rig.

    python benchmarks/make_examples.py

Writes ``friction.npz`` (empty motion of the virtual rig's blades, every fifth sample) and
``paper-package.zip`` (the package of paper-80gsm, draft effort) into src/scissorcal/examples. Time
is virtual and seeds are fixed, so that equal code writes equal numbers.
"""

import shutil
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scissorcal.recording import Recording, read_recording
from scissorcal.workday import create_workspace, make_day
from scissorcal.workday.engine import Engine
from scissorcal.workday.runs.package import build_workspace_package

TARGET = Path(__file__).resolve().parents[1] / "src" / "scissorcal" / "examples"
RECIPE, SEED = "paper-80gsm", 0
EVERY = 5
"""Samples of the rig (1 kHz) for one of the example (200 Hz)."""
FROM_S = 87.5
"""From here on the capture has sweeps at five speeds, and the excited motion at its end."""


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        workspace = create_workspace(Path(folder) / "day", RECIPE)
        make_day(workspace, seed=SEED, effort="draft")
        built = build_workspace_package(Engine.of(workspace), seed=SEED, allow_failed=True)
        shutil.copyfile(built.path, TARGET / "paper-package.zip")
        recording = read_recording(workspace.recordings("friction")[0])
    np.savez_compressed(TARGET / "friction.npz", **thinned(recording))
    for name in ("friction.npz", "paper-package.zip"):
        print(f"{name}: {(TARGET / name).stat().st_size} bytes")


def thinned(recording: Recording) -> dict[str, NDArray[np.int32]]:
    """Whole numbers of the last part, sweeps and excited motion, in us, urad and uN m."""
    samples = recording.samples[recording.device_time_s >= FROM_S][::EVERY]
    time_us = samples["device_time_us"] - samples["device_time_us"][0]
    return {
        "time_us": time_us.astype(np.int32),
        "opening_urad": np.rint(1e6 * samples["opening"]).astype(np.int32),
        "torque_uNm": np.rint(1e6 * samples["motor_torque"]).astype(np.int32),
    }


if __name__ == "__main__":
    main()
