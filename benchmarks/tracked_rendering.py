"""A plate that is tracked while a package renders, and moved: the torque against the true plate's.

    python -m benchmarks.tracked_rendering [--rendered] [--count 4]

The blade's tip taps the plate, it is carried between the blades, and while they cut it goes by
10 mm along the cut and 5 degrees of pitch within a second. Pictures are located in renderings
(--rendered), or have the pose errors that one rendered picture states: one draw of what all share,
noise anew in each. Prints the table of docs/tracking.md.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from tests.render.conftest import package_for
from tests.workday.carried_plate import Case, run


def row(case: Case, seeds: range, folder: Path) -> str:
    """A row of the table: medians over seeds of the errors, means of the shares without force."""
    package = package_for(folder, case.recipe, energy=0.52)
    runs = [run(case, seed, package, folder) for seed in seeds]
    cells = [case.name]
    for window in ("before", "during", "after"):
        found = np.array([one.error(window) for one in runs])
        felt = found[np.isfinite(found[:, 0]), 0]
        error = f"{100 * np.median(felt):.2f} %" if len(felt) else "none"
        cells.append(f"{error}, {100 * np.mean(found[:, 1]):.0f} %")
    heights, pitches = [], []
    for one in runs:
        rms, _ = one.pose_error("after")
        heights.append(1e3 * rms[4])
        pitches.append(np.degrees(rms[2]))
    cells.append(f"{np.median(heights):.3f} mm, {np.median(pitches):.3f} deg")
    return "| " + " | ".join(cells) + " |"


SLOWER = Case("5 mm/s, 2 deg/s, 30 Hz", speed_mm_per_s=5.0, turn_deg_per_s=2.0)
CASES = (
    SLOWER,
    replace(SLOWER, name="the same, without taps", taps=False),
    replace(SLOWER, name="without taps, 12 % allowed", taps=False, tolerance_percent=12.0),
    replace(SLOWER, name="rig's bias as by default", contact_bias_mm=0.05, contact_bias_deg=0.2),
    replace(SLOWER, name="without play", steady=False),
    replace(SLOWER, name="noise of pictures 4 times as large", noise=4.0),
    replace(SLOWER, name="10 Hz", frames_Hz=10.0),
    replace(SLOWER, name="10 Hz, 30 % allowed", frames_Hz=10.0, tolerance_percent=30.0),
    replace(SLOWER, name="60 Hz", frames_Hz=60.0),
    replace(SLOWER, name="60 Hz, up to 10 ms late", frames_Hz=60.0, jitter_s=0.01),
    Case("20 mm/s, 5 deg/s, 30 Hz"),
    Case("20 mm/s, 5 deg/s, 30 Hz, 15 % allowed", tolerance_percent=15.0),
    Case("20 mm/s, 5 deg/s, 60 Hz, up to 10 ms late", frames_Hz=60.0, jitter_s=0.01),
)


def main() -> None:
    """Print a row for each case."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=4, help="worlds for each row")
    parser.add_argument("--rendered", action="store_true", help="locate rendered pictures")
    given = parser.parse_args()
    cases = CASES[:1] if given.rendered else CASES
    print("| plate moves as, pictures | before | during | after | pose after |")
    print("|---|---|---|---|---|")
    for case in cases:
        with tempfile.TemporaryDirectory() as folder:
            chosen = replace(case, rendered=given.rendered)
            print(row(chosen, range(given.count), Path(folder)), flush=True)


if __name__ == "__main__":
    main()
