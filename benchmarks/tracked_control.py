"""Control of force and path on a plate that a camera and the tip's contacts track.

    python -m benchmarks.tracked_control --count 3

The virtual rig's plate rests or moves; pictures are rendered ten times a second and located, camera
and rig frame are off as their covariances say. Prints the table of docs/control.md: errors of the
true force, and of the tip's true place along the true plate.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
from tests.control.virtual import Run, go, mechanics, points, prepare, rms, specimen
from tests.workday.track_world import a_recipe, an_eye

from scissorcal.aliases import Array
from scissorcal.control.surface_path import map_contour
from scissorcal.device.session import RigSession
from scissorcal.device.sim.specimen import Specimen
from scissorcal.kernel import ControlFlag
from scissorcal.model.friction import AxisLaw
from scissorcal.model.surface import Plane
from scissorcal.recipe.schema import Recipe
from scissorcal.tracking.plate_pose import PlatePose, level_plate
from scissorcal.tracking.rows import TipContacts
from scissorcal.tracking.tracker import Outcome
from scissorcal.vision.sim.sim_camera import SIM_LENS
from scissorcal.workday.tracking.feeds import idle_rig
from scissorcal.workday.tracking.inputs import REST_RATE_RAD_PER_S
from scissorcal.workday.tracking.session import RigDrive, TrackFacts, TrackSession
from scissorcal.workday.tracking.sim_world import SimWorld
from scissorcal.workday.tracking.track_recorder import TrackAbout, TrackPicture
from scissorcal.workday.tracking.tracking_camera import TrackedPose

PATH_MM = (10.0, 40.0)
FORCE_N = 2.0
CASES: dict[str, tuple[tuple[str, ...], dict[str, Any]]] = {
    "at rest, taken to be clamped": ((), {}),
    "at rest, taken to move by 5 mm/s": (("speed_mm_per_s = 5", "turn_deg_per_s = 1"), {}),
    "drifting by 1 mm/s along and up": (
        ("speed_mm_per_s = 5", "turn_deg_per_s = 1"),
        {"drift_mm_per_s": (1.0, 1.0, 0.0)},
    ),
    "swaying by 2 mm at 0.1 Hz": (
        ("speed_mm_per_s = 5", "turn_deg_per_s = 1"),
        {"sway_mm": (2.0, 2.0, 0.0), "sway_Hz": 0.1},
    ),
    "swaying by 2 mm at 0.5 Hz": (
        ("speed_mm_per_s = 20", "turn_deg_per_s = 5"),
        {"sway_mm": (2.0, 2.0, 0.0), "sway_Hz": 0.5},
    ),
}


class _Patch:
    """What `go` needs of pytest's monkeypatch."""

    def setattr(self, module: Any, name: str, function: Any) -> None:
        """Replace a function until `patch.stopall`."""
        patch.object(module, name, function).start()


def run(
    lines: tuple[str, ...], plate: dict[str, Any], seed: int
) -> tuple[Run, TrackSession, Array]:
    """Control on a tracked plate; also the tip's true places along the plate (m), a tick each."""
    recipe, truth = a_recipe(*lines), specimen(pitch_deg=3.0, **plate)
    world = SimWorld(recipe, seed, rig=True, specimen=truth)
    eye = an_eye(recipe, seed)
    places: list[float] = []

    def each(rig: Any) -> None:
        if rig.plate is None:
            places.append(np.nan)
            return
        turn, place = world.truth(rig.time_s)
        tip = np.array((*rig.plate.tip(rig.opening, rig.advance), 0.0))
        places.append(float((tip - place) @ turn[:, 0]))

    job = prepare(points(*PATH_MM, force=FORCE_N), link=world.link, each=each)
    session = _session(recipe, truth)

    def due(now_s: float) -> Iterator[TrackPicture]:
        return (eye.picture(found) for found in eye.locate(world.frames(now_s)))

    source = TrackedPose(session, due)
    with idle_rig(RigSession(world.link, recipe)) as motion:
        world.begin(motion, taps=False)
        world.keep_plate()
        begun = motion.now_s
        while motion.now_s < begun + 1.0:
            source(motion.now_s, motion.step())
    session.follower.restart_rig()
    job.job = replace(job.job, source=source)
    try:
        return go(job, _Patch()), session, np.array(places)
    finally:
        patch.stopall()


def _session(recipe: Recipe, truth: Specimen) -> TrackSession:
    rig = mechanics(truth)
    opening = rig.opening
    axis = AxisLaw(opening.inertia, opening.friction, opening.offset, REST_RATE_RAD_PER_S)
    delay = recipe.plate.tracking.camera_delay_ms
    about = TrackAbout("sim", "rig", "a" * 16, SIM_LENS.width, SIM_LENS.height, delay)
    contacts = TipContacts(rig.tip, axis)
    facts = TrackFacts(Plane(), about, RigDrive(0.06), contacts, least_N=0.5 * FORCE_N)
    return TrackSession(recipe, facts)


def path_error(job: Run, places: Array) -> Array:
    """Of the tip's true place along the true plate, m, while it presses and the path goes on."""
    rows = job.samples
    on = (rows["flags"].astype(int) & int(ControlFlag.LETS_GO) == 0) & (rows["index"] > 0.0)
    on &= rows["force_aim"] >= 0.99 * rows["force_wanted"]
    level = PlatePose(0.0, *level_plate((20.0, 10.0, 0.0)), np.zeros((6, 6)))
    begins = map_contour(job.job.points, Plane(), level, job.job.length_m).x[0]
    wanted = begins + rows["place_wanted"][on]
    return np.asarray(places[rows["sequence"][on].astype(int) - 1] - wanted)


def main() -> None:
    """Print a row for each plate."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=3, help="worlds for each row")
    count = parser.parse_args().count
    print("| plate | force, rms | path, rms | pictures and contacts refused | let go of |")
    print("|---|---|---|---|---|")
    for name, (lines, plate) in CASES.items():
        forces, paths, refused, lets_go = [], [], [], 0
        for seed in range(count):
            job, session, places = run(lines, plate, seed)
            forces.append(rms(job.errors()[0]))
            paths.append(1e3 * rms(path_error(job, places)))
            counts = session.follower.outcomes
            refused += [counts[source, Outcome.REFUSED] for source in ("picture", "contact")]
            assert job.result is not None
            lets_go += job.result.figures.let_goes
        print(
            f"| {name} | {min(forces):.3f} to {max(forces):.3f} N | {min(paths):.2f} to "
            f"{max(paths):.2f} mm | {sum(refused[::2])}, {sum(refused[1::2])} | {lets_go} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
