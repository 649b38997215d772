"""Tracks of a plate in rendered worlds against the truth: errors and NEES with and without contact.

    python -m benchmarks.tracks --count 8

Each world has a camera and a rig frame of its own, off as their covariances say; pictures are
rendered and located, a virtual hand taps the plate. Prints the table of docs/tracking.md.
"""

import argparse

import numpy as np
from tests.workday.track_world import a_recipe, score, tracked

MOVES = ("speed_mm_per_s = 5", "turn_deg_per_s = 1")
PLATES = {
    "clamped": (),
    "moving, 5 mm/s and 1 deg/s": MOVES,
    "the same, motion_time_s = 4": (*MOVES, "motion_time_s = 4"),
}
"""The simulated plate sways at 0.3 Hz: over 0.14 s its velocity changes as in a process of 4 s."""
SECONDS = {False: 1.5, True: 3.0}
"""With contact, the second tap is under way at the end."""


def main() -> None:
    """Print a row for each plate and source."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=8, help="worlds for each row")
    count = parser.parse_args().count
    print("| plate | told by | NEES | along the normal | along the face | turn |")
    print("|---|---|---|---|---|---|")
    for plate, lines in PLATES.items():
        for rig, source in ((False, "pictures"), (True, "pictures and contacts")):
            runs = []
            for seed in range(count):
                session, world, end = tracked(a_recipe(*lines), seed, SECONDS[rig], rig=rig)
                runs.append(score(session, world, end))
            mean = float(np.mean([value for value, _ in runs]))
            errors = np.array([error for _, error in runs])
            normal = 1e3 * np.sqrt(np.mean(errors[:, 4] ** 2))
            along = 1e3 * np.sqrt(np.mean(errors[:, 3] ** 2 + errors[:, 5] ** 2))
            turn = np.degrees(np.sqrt(np.mean(np.sum(errors[:, :3] ** 2, axis=1))))
            print(
                f"| {plate} | {source} | {mean:.1f} | {normal:.2f} mm | {along:.2f} mm | "
                f"{turn:.2f} deg |",
                flush=True,
            )


if __name__ == "__main__":
    main()
