"""The section of a plate in space with the rig's plane, in which the blades meet."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.kernel import Section

STEEPEST_RAD = np.radians(45.0)
"""Beyond, between the plate's axes and the rig's, a plate is not one that the blades can cut."""


@dataclass(frozen=True, eq=False)
class PoseSection:
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
