"""The filter of a plate's pose in a second world, of other construction: errors and consistency.

    python -m benchmarks.second_world --count 100

Each row draws as many worlds and follows the plate by pictures alone and with contacts, with the
settings that the first world is followed with. Prints the table of docs/tracking.md.
"""

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from benchmarks.consistency import mean_band, nees, share_held
from scipy.spatial.transform import Rotation
from tests.second_world import SHAPES, Scene, World, draw_world

from scissorcal.model.surface import Cylinder, Plane, Sphere, Surface
from scissorcal.tracking.rows import CameraPose
from scissorcal.tracking.settings import PlateMotion, TrackingSettings
from scissorcal.tracking.tracker import PoseTracker

SURFACES: dict[str, Surface] = {
    "plane": Plane(),
    "cylinder 30 mm": Cylinder(30e-3),
    "sphere 30 mm": Sphere(30e-3),
}
MOTIONS = {
    "clamped": PlateMotion(0.01e-3, np.radians(0.002), 0.5),
    "hand": PlateMotion(),
    "springs": PlateMotion(time_s=0.25),
}
"""What is stated of a plate's motion: the recipe's default for a clamped plate, its figures for one
in a hand, and for the body on springs the time over which its velocity keeps.
All else is default."""
ROWS = {
    "fixed": Scene(),
    "fixed, 40 s": Scene(seconds=40.0),
    "carried by hand": Scene("hand"),
    "on springs": Scene("springs"),
    "carried, 1 s without pictures": Scene("hand", blind_s=1.0),
    "on springs, 1 s without pictures": Scene("springs", blind_s=1.0),
    "fixed, mirrored poses": Scene(flat=True),
}
CASES = (
    *(("plane", name) for name in ROWS),
    ("cylinder 30 mm", "fixed"),
    ("sphere 30 mm", "fixed"),
)
SEED = 149


@dataclass(frozen=True)
class Ended:
    """Errors at the end of a run: along the normal under the tip, across it, and NEES."""

    normal_m: float
    across_m: float
    nees: float
    restarts: int


def settings_of(scene: Scene) -> TrackingSettings:
    """The defaults, and how the plate moves."""
    return TrackingSettings(plate=MOTIONS[scene.motion])


def follow(
    world: World, surface: Surface, settings: TrackingSettings, *, contacts: bool
) -> PoseTracker:
    """Feed a tracker with pictures as they arrive, and with contacts."""
    tracker, waiting = PoseTracker(surface, settings), list(world.pictures)
    rows = world.touches
    for stamp, point, force in zip(
        rows.stamp_s.tolist(), rows.point_m, rows.force_N.tolist(), strict=True
    ):
        while waiting and waiting[0].arrives_s <= stamp:
            picture = waiting.pop(0)
            tracker.picture(
                CameraPose(
                    picture.stamp_s,
                    picture.rotation,
                    picture.place_m,
                    picture.covariance,
                    picture.certain,
                )
            )
        if contacts:
            tracker.contact(stamp, point, force)
    return tracker


def judge(world: World, tracker: PoseTracker) -> Ended:
    """Compare the pose at the last row's stamp with the truth at that time."""
    stamp = float(world.touches.stamp_s[-1])
    estimate = tracker.estimate(stamp)
    (axes,), (place,) = world.motion(np.array([stamp]))
    turn = (Rotation.from_matrix(axes) * Rotation.from_matrix(estimate.rotation).inv()).as_rotvec()
    error = np.concatenate([turn, place - estimate.place_m])
    (touched,), (normal,), _ = world.shape.walk(world.touches.arcs_m[-1:])
    away = estimate.place_m + estimate.rotation @ touched - place - axes @ touched
    along = float(axes @ normal @ away)
    across = float(np.linalg.norm(away - along * (axes @ normal)))
    return Ended(along, across, nees(error, estimate.covariance), estimate.counts.restarts)


def runs(
    case: tuple[str, str], seeds: Iterable[int], settings: TrackingSettings | None = None
) -> tuple[list[Ended], list[Ended]]:
    """Runs of a case by pictures alone, and with contacts."""
    shape, scene = case[0], ROWS[case[1]]
    ended: tuple[list[Ended], list[Ended]] = ([], [])
    for seed in seeds:
        world = draw_world(scene, SHAPES[shape], np.random.default_rng([SEED, seed]))
        for contacts in (False, True):
            tracker = follow(
                world, SURFACES[shape], settings or settings_of(scene), contacts=contacts
            )
            ended[contacts].append(judge(world, tracker))
    return ended


def line(case: tuple[str, str], ended: tuple[Sequence[Ended], Sequence[Ended]]) -> str:
    """A row of the table."""
    parts = [f"| {case[0]}, {case[1]} "]
    medians = [1e3 * float(np.median([abs(run.normal_m) for run in part])) for part in ended]
    parts.append(f"| {medians[0]:.3f} | {medians[1]:.3f} | {medians[1] / medians[0]:.2f} ")
    across = (1e3 * float(np.median([run.across_m for run in part])) for part in ended)
    parts += [f"| {value:.2f} " for value in across]
    for part in ended:
        values = [run.nees for run in part]
        parts.append(f"| {np.mean(values):.1f}, {100.0 * share_held(values):.0f} % ")
    return "".join(parts) + "|"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=100, help="worlds for each row")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--only", default="", help="rows whose name has this")
    given = parser.parse_args()
    print(
        "| plate | vision: along the normal, mm | with contact, mm | ratio | across, vision "
        "| with contact | NEES and share held, vision | with contact |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for case in CASES:
        if given.only in ", ".join(case):
            print(line(case, runs(case, range(given.first, given.first + given.count))), flush=True)
    low, high = mean_band(given.count)
    print(f"\nA consistent filter has a NEES of {low:.1f} to {high:.1f} (95 %).")


if __name__ == "__main__":
    main()
