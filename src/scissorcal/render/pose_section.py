"""The section of a plate in space with the rig's plane, in which the blades meet."""

import math
from dataclasses import fields, replace
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.kernel import Kernel, ModelTables, PlacedModel, Section
from scissorcal.package.grid import FELT_SHARE

STEEPEST_RAD = np.radians(45.0)
"""Beyond, between the plate's axes and the rig's, a plate is not one that the blades can cut."""


class PoseSection(NamedTuple):
    """What of a plate's pose reaches the torque.

    ``section`` is what the kernel takes. ``slopes`` (5, 6) are its numbers' derivatives by a
    rotation vector in the rig's axes (rad) and the translation (m). ``pitch_rad`` is the face's
    rise against the advance, and ``height_m`` how far the plate's middle lies above the pivot's
    path at the near edge, also where neither is rendered (two moving blades).
    """

    section: Section
    slopes: Array
    pitch_rad: float
    height_m: float


def pose_section(
    rotation: ArrayLike, translation_m: ArrayLike, upper_face_m: float, moving_blades: int
) -> PoseSection | None:
    """Cut a plate at T_rig_plate (rotation (3, 3), translation (3,)) with the rig's plane z = 0.

    The plate's frame lies in its upper face, x along the cut from the near edge and z out of the
    face (r_1, r_2, r_3 in the rig's axes, origin t). The near edge meets the plane at o = t -
    (t_z / r_2z) r_2, the face rises by atan2(-r_3x, r_3y), and is |r_1 - (r_1z / r_2z) r_2| long
    for each metre of the plate. A plane that is not normal to the faces meets 1 / |(r_3x, r_3y)|
    times the thickness. ``upper_face_m`` is the model's y_top: h where one blade moves, h/2 where
    two do.

    Two moving blades hold the plate in their middle: only the place of its near edge along the
    advance counts, and lengths, depths and thickness as seen along it
    (docs/decisions/142-a-plate-between-two-blades.md). None where the plate stands at more than 45
    degrees to where it can be cut.

    >>> upright = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]
    >>> pose_section(upright, [0.03, 0.002, 0.01], 0.002, 1).section
    Section(edge_x=0.03, edge_y=0.002, pitch=0.0, stretch=1.0, thickening=1.0)
    """
    axes, t = np.asarray(rotation, dtype=np.float64), np.asarray(translation_m, dtype=np.float64)
    if not (np.all(np.isfinite(axes)) and np.all(np.isfinite(t))) or not _can_be_cut(axes):
        return None
    along, across, out = axes.T
    turned = [_cross(axis) for axis in (along, across, out)]  # d(axis) / d(rotation vector)
    place, by_place = _on_plane(t, across, turned[1])
    run, by_run = _direction(along, across, turned[0], turned[1])
    pitch, by_pitch = _pitch(out, turned[2])
    if moving_blades == 1:
        length = float(np.linalg.norm(run))
        flat = float(np.hypot(out[0], out[1]))
        numbers = (*place[:2], pitch, length, 1.0 / flat)
        slopes = np.stack(
            [
                by_place[0],
                by_place[1],
                by_pitch,
                run @ by_run / length,
                _widen(-(out[:2] @ turned[2][:2]) / flat**3),
            ]
        )
    else:
        numbers, slopes = _between_blades(
            (place, by_place), (run, by_run), (out, turned[2]), upper_face_m
        )
    below = upper_face_m if moving_blades == 1 else upper_face_m * out[1] / (out[:2] @ out[:2])
    section = Section(*(float(number) for number in numbers))
    return PoseSection(section, slopes, pitch, float(place[1] - below))


def _between_blades(
    near_edge: tuple[Array, Array],
    length: tuple[Array, Array],
    normal: tuple[Array, Array],
    upper_face_m: float,
) -> tuple[tuple[float, ...], Array]:
    """Numbers of a plate that gives way along its normal until the crack is in the middle.

    A point of its middle over (x, y) then stands at x + y tan(pitch). The plate's closing depth
    and its length count as seen along the advance, whence cos(pitch) in the fracture energy.
    ``near_edge``, ``length`` and ``normal`` are vectors with their slopes.
    """
    (place, by_place), (run, by_run), (out, turned) = near_edge, length, normal
    square, by_square = out[:2] @ out[:2], _widen(2.0 * out[:2] @ turned[:2])
    tan, by_tan = -out[0] / out[1], _widen(-(turned[0] - out[0] / out[1] * turned[1]) / out[1])
    by_upward = _widen(turned[1])
    longer, by_longer = 1.0 + tan**2, 2.0 * tan * by_tan
    numbers = (
        place[0] + place[1] * tan,
        upper_face_m / out[1],
        0.0,
        run[0] * longer,
        out[1] / square,
    )
    slopes = [
        by_place[0] + by_place[1] * tan + place[1] * by_tan,
        -upper_face_m / out[1] ** 2 * by_upward,
        np.zeros(6),
        by_run[0] * longer + run[0] * by_longer,
        by_upward / square - out[1] / square**2 * by_square,
    ]
    return tuple(float(number) for number in numbers), np.stack(slopes)


def _can_be_cut(axes: Array) -> bool:
    """Whether the plate lies about along the advance, its face up."""
    least = np.cos(STEEPEST_RAD)
    return bool(axes[0, 0] >= least and axes[1, 2] >= least and -axes[2, 1] >= least)


def _on_plane(t: Array, across: Array, turned: Array) -> tuple[Array, Array]:
    """Where the line t + b across meets z = 0 (3,), and its slopes (3, 6)."""
    b = -t[2] / across[2]
    by_b = np.concatenate([-b * turned[2] / across[2], [0.0, 0.0, -1.0 / across[2]]])
    slopes = np.outer(across, by_b)
    slopes[:, :3] += b * turned
    slopes[:, 3:] += np.eye(3)
    return t + b * across, slopes


def _direction(
    along: Array, across: Array, by_along: Array, by_across: Array
) -> tuple[Array, Array]:
    """What a metre of the plate becomes in the plane (3,), and its slopes (3, 6)."""
    share = along[2] / across[2]
    by_share = (by_along[2] - share * by_across[2]) / across[2]
    slopes = by_along - np.outer(across, by_share) - share * by_across
    return along - share * across, np.hstack([slopes, np.zeros((3, 3))])


def _pitch(out: Array, turned: Array) -> tuple[float, Array]:
    square = out[0] ** 2 + out[1] ** 2
    slope = (out[0] * turned[1] - out[1] * turned[0]) / square
    return float(np.arctan2(-out[0], out[1])) + 0.0, _widen(slope)


def _widen(by_rotation: Array) -> Array:
    """Slopes (6,) of what the translation does not change."""
    return np.concatenate([by_rotation, np.zeros(3)])


def _cross(axis: Array) -> Array:
    """Slopes (3, 3) of an axis by a rotation vector in the outer frame: d(axis) = d(phi) x axis."""
    x, y, z = axis
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])


OPENINGS, CONTACTS = 24, 12


class TorqueSpread(NamedTuple):
    """What the pose's uncertainty does to the torque at one state of the rig.

    ``torque_Nm`` is the package's there, ``sd_Nm`` its standard deviation by the pose.
    ``half_width`` is half of the interval at the scene's confidence over the torque, or over 5 % of
    the scene's largest where that is more.
    """

    torque_Nm: float
    sd_Nm: float
    half_width: float


class PoseTorque:
    """The torque of a package as its plate's section has it.

    Where the scene cuts it is that of a running crack at the opening: a place of the near edge that
    is wrong by a constant moves crack and plate alike and leaves it as it is. Where the scene
    presses, it is that of the pressed edge. ``limit_Nm`` is the torque limit of the rendering.
    """

    def __init__(self, tables: ModelTables, confidence: float, limit_Nm: float) -> None:
        self._tables = tables
        self._placed = PlacedModel(tables)
        self._widths = NormalDist().inv_cdf(0.5 + 0.5 * confidence)
        self._limit = limit_Nm
        self._least = FELT_SHARE * _largest(tables, limit_Nm)

    def spread(
        self, section: Section, covariance: Array, opening: float, advance: float
    ) -> TorqueSpread:
        """The spread of torque by ``covariance`` (5, 5) of the section's numbers.

        One standard deviation either way along each principal axis, so that bends within the
        uncertainty count; infinite where the torque is not defined that near. ``opening`` (rad) is
        taken within the scene's range.
        """
        theta = float(np.clip(opening, self._tables.opening_min, self._tables.opening_max))
        middle = _numbers(section)
        torque = self._torque(middle, theta, advance)
        if not np.all(np.isfinite(covariance)):
            return TorqueSpread(torque, np.inf, np.inf)
        changes = self._changes(middle, _principal(covariance), theta, advance)
        sd = float(np.sqrt(np.sum(np.square(changes))))
        sd = sd if np.isfinite(sd) and np.isfinite(torque) else np.inf
        size = max(abs(torque), self._least) if np.isfinite(torque) else self._least
        width = self._widths * sd / size if size > 0.0 else (0.0 if sd == 0.0 else np.inf)
        return TorqueSpread(torque, sd, width)

    def largest_share(
        self, section: Section, covariance: Array, opening: float, advance: float
    ) -> int:
        """Which of the section's numbers would spread the torque most by its own uncertainty."""
        theta = float(np.clip(opening, self._tables.opening_min, self._tables.opening_max))
        alone = np.diag(np.sqrt(np.maximum(np.diag(covariance), 0.0)))
        changes = np.abs(self._changes(_numbers(section), alone, theta, advance))
        return int(np.argmax(np.where(np.isfinite(changes), changes, np.inf)))

    def _changes(self, middle: Array, ways: Array, opening: float, advance: float) -> Array:
        """Half of the torque's change from one side of the middle to the other, (n,)."""
        return np.array(
            [
                0.5
                * (
                    self._torque(middle + way, opening, advance)
                    - self._torque(middle - way, opening, advance)
                )
                for way in ways
            ]
        )

    def _torque(self, numbers: Array, opening: float, advance: float) -> float:
        torque = self._placed.torque(Section(*numbers.tolist()), opening, advance, 0.0)
        return min(max(torque, -self._limit), self._limit)  # not a number stays one


def _largest(tables: ModelTables, limit_Nm: float) -> float:
    """Largest torque of the material over the scene, within the limit."""
    openings = np.linspace(tables.opening_min, tables.opening_max, OPENINGS)[:, None]
    contacts = np.linspace(tables.contact_min, tables.contact_max, CONTACTS)[None]
    torque = Kernel(replace(tables, render_friction=False)).torque(openings, 0.0, contacts)
    return float(np.nanmax(np.minimum(np.abs(torque), limit_Nm), initial=0.0))


def _numbers(section: Section) -> Array:
    return np.array([getattr(section, field.name) for field in fields(Section)])


def _principal(covariance: Array) -> Array:
    """Rows: one standard deviation along each principal axis, in units of each number's own sd."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    unit = np.where(sd > 0.0, sd, 1.0)
    values, axes = np.linalg.eigh(covariance / np.outer(unit, unit))
    ways: Array = (axes * np.sqrt(np.maximum(values, 0.0))).T * unit
    return ways[np.any(ways != 0.0, axis=1)]


ACROSS = (
    "The plate stands across the blades (more than 45 degrees from where it can be cut). Turn it "
    "so that its cut runs along the advance, its printed face up."
)
NONE_YET = (
    "No estimate of the plate's pose has come: check that the tracker runs and sees the plate's "
    "target."
)
_NAMES = ("place along the cut", "height", "pitch", "direction", "roll")


def lost_sentence(why: str) -> str:
    """The source has lost the plate."""
    cause = f": {why.rstrip('.')}" if why else ""
    return (
        f"The plate's pose was lost{cause}. Keep the plate's target in the camera's view; the "
        "force returns with the pose."
    )


def late_sentence(age_s: float) -> str:
    """The source gives nothing new."""
    return (
        f"No new estimate of the plate's pose came for {age_s:.2f} s. Check that the tracker runs, "
        "and close programs that load the processor."
    )


def leapt_sentence(by_m: float) -> str:
    """The pose went farther between two estimates than a plate moves."""
    return (
        f"The plate's pose leapt by {by_m * 1e3:.1f} mm between two estimates, farther than a "
        "plate moves. The force returns where the pose is now. If that repeats, check the tracker "
        "for mirrored or mistaken poses."
    )


def beside_sentence(
    height_m: float, pitch_rad: float, most_height_m: float, most_pitch_rad: float
) -> str:
    """Two moving blades cannot be taken to hold the plate in their middle."""
    return (
        f"The plate's middle lies {height_m * 1e3:.1f} mm beside the blades' and is pitched by "
        f"{math.degrees(pitch_rad):.1f} deg; two moving blades are taken to hold it in their "
        f"middle, up to {most_height_m * 1e3:.0f} mm and {math.degrees(most_pitch_rad):.0f} deg. "
        "Bring it back between them."
    )


def uncertain_sentence(
    covariance: Array, half_width: float, worst: int, confidence: float, tolerance: float
) -> str:
    """The pose leaves the torque less certain than the scene allows."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return (
        f"The plate's pose was known to {sd[0] * 1e3:.2g} mm along the cut, {sd[1] * 1e3:.2g} mm "
        f"in height and {math.degrees(sd[2]):.2g} deg in pitch (sd), which leaves the torque "
        f"uncertain by {half_width:.1%} ({confidence:.0%}); the scene allows "
        f"{tolerance:.1%}. Most of it comes from its {_NAMES[worst]}. Bring the camera closer, "
        "touch the plate with the blades so that contact narrows the pose, or raise "
        "scene.tolerance_percent."
    )
