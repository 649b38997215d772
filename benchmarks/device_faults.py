"""Faults of a device against probe, capture and rendering: what is said, and what moved until then.

    python -m benchmarks.device_faults [--out docs/device-faults.md] [NAME ...]

The device is that of tests/strange_device, in virtual time: each trial is short, and the same
everywhere. Captures and renderings are not probed before, as they are in a workspace.
"""

import argparse
import re
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from tests.package.fits import cut_fit, friction_fit, recipe
from tests.strange_device import FAULTS
from tests.strange_device.trials import Outcome, capture_trial, probe_trial, render_trial

from scissorcal.package import ModelPackage, build_package, open_package

HEAD = """# Faults of a device

What each fault of a device leads to: exit code, what is said or which [stop](loop.md#stops) it
is, and the largest torque (N m) and rate (rad/s) at the device until it stopped. Written by
`python -m benchmarks.device_faults --out docs/device-faults.md` from the device in
`tests/strange_device`, which is written from the [protocol](protocol.md) alone (motor of 0.8 N m,
inertia 0.6 g m^2, dry friction 0.012 N m). In a workspace the first motor run of a session is
preceded by the probe, so a fault that the probe refuses never reaches a capture; the columns of
captures and of the rendering are without it. Faults that come with time come 2 s after the stream
began. In the rendering a hand moves the blades, at up to 0.8 rad/s.

"""
COLUMNS = ("fault", "probe", "friction capture", "cut capture", "rendering")
LONGEST = 90


def main() -> None:
    """Print the table, or write it into a page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="faults; all if not given")
    parser.add_argument("--out", type=Path, help="write a page instead of printing")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        package = paper(Path(folder))
        rows = [row(name, package, Path(folder)) for name in arguments.names or FAULTS]
    lines = ["| " + " | ".join(cells) + " |" for cells in (COLUMNS, ["---"] * len(COLUMNS), *rows)]
    text = "\n".join(lines) + "\n"
    if arguments.out:
        arguments.out.write_text(HEAD + text, encoding="utf-8")
    else:
        print(text)


def row(name: str, package: ModelPackage, folder: Path) -> Sequence[str]:
    """The cells of one fault."""
    trials: list[Callable[[Path], Outcome]] = [
        lambda _: probe_trial(name),
        lambda at: capture_trial(name, "friction", at),
        lambda at: capture_trial(name, "cut", at),
        lambda at: render_trial(name, package, at),
    ]
    cells = [name]
    for trial in trials:
        with tempfile.TemporaryDirectory(dir=folder) as at:
            cells.append(cell(trial(Path(at))))
    return cells


def cell(outcome: Outcome) -> str:
    """Exit code, what was said, torque and rate."""
    said = outcome.stop.replace("_", " ").lower() or _shortened(outcome.said)
    return f"{outcome.exit_code}: {said} ({outcome.torque:.2f}, {outcome.rate:.1f})"


def paper(folder: Path) -> ModelPackage:
    """A package of paper that ripples, with friction."""
    chosen = recipe()
    summary = build_package(
        chosen,
        friction_fit(coulomb=0.014, stribeck=0.004, viscous=0.002),
        cut_fit(chosen, kappa=0.75, energy=0.52),
        folder / "package.zip",
        np.random.default_rng(1),
    )
    return open_package(summary.path, warn=False)


def _shortened(said: str) -> str:
    words = re.sub(r"\s+", " ", said).replace("|", "/")
    return words if len(words) <= LONGEST else words[: words.rfind(" ", 0, LONGEST)] + " ..."


if __name__ == "__main__":
    main()
