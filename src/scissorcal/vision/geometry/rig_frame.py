"""The camera's pose in the rig's frame, from a card of markers on the moving rig.

With it, the plate's pose in one picture: what is new in that picture, and what all pictures share.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.recipe.priors import PlatePriors
from scissorcal.vision.geometry.board_pose import (
    LEAST_SD_PX,
    BoardPose,
    Corners,
    UndeterminedPoseError,
    locate_board,
    near,
    print_slopes,
    project_pose,
)
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import UNMOVED, Pose, between, left_jacobian
from scissorcal.vision.targets.boards import RIG_MARKERS
from scissorcal.vision.targets.detect import Detection


@dataclass(frozen=True, eq=False)
class PicturePose:
    """T_rig_plate, or T_camera_plate where the rig's frame is not known.

    The covariance of ``pose`` is the whole one. It is the sum of ``noise`` (6, 6), from the errors
    of corners, which are new in each picture, and ``shared`` (6, 6), from the errors of camera,
    print and rig card, which are the same in all of them. ``other`` is the second pose that a plane
    allows, None where there is none, ``odds`` those of the first against it, NaN where unknown:
    below 20 they leave it open which of both is true.
    """

    pose: Pose
    other: Pose | None
    noise: Array
    shared: Array
    odds: float = math.nan


OPEN = 3.0
"""Prior standard deviation (rad and m) of both poses: a turn that may be any has 1.8 rad, and no
camera stands so far away. It bounds what the motion leaves open, and decides nothing else."""

UNDETERMINED_SD = 0.1
"""A direction of the camera's pose with a larger standard deviation (rad or m) is undetermined by
the motion."""

STEP = 1e-6
REJECTIONS = 3
"""Times that corners which least squares leave far off are left out, and it is tried again."""
MOST_OF_A_VIEW = 0.25
"""Share of a picture's corners, those of one marker of the card's four, beyond which it is not
single corners that are wrong, but the position that was stated: then none is left out."""


class CardView(NamedTuple):
    """The card in one picture, and the rig's position: ``advance_m`` and, for a card on a moving
    blade, that blade's angle ``blade_angle_rad`` (zero for a card on the carriage)."""

    corners: Corners
    advance_m: float
    blade_angle_rad: float


CARD_MIDDLE_M = (0.5 * RIG_MARKERS.width_m, 0.5 * RIG_MARKERS.height_m, 0.0)
"""The middle of the printed rig card in its own frame."""


def card_view(
    detection: Detection, advance_m: float, opening_rad: float, moving_blades: int
) -> CardView:
    """The rig card as detected in one photograph, and where the rig stood.

    ``opening_rad`` is the angle between the blades, shared by ``moving_blades`` (1 or 2) of them.
    """
    return CardView(Corners.of(detection), advance_m, opening_rad / moving_blades)


@dataclass(frozen=True)
class RigPose:
    """``camera_rig`` is T_camera_rig, ``rig_card`` T_rig_card at no advance and blade angle zero.

    The rig's frame has its origin on the pivot's axis at no advance, level with the middle of the
    card; x is the direction in which the pivot advances, z the pivot's axis, and blades open about
    +z. ``undetermined`` names the directions that the motion does not determine. ``by_camera`` (6,
    9) says how ``camera_rig`` moves with the camera's parameters.
    """

    camera_rig: Pose
    rig_card: Pose
    rms_px: float
    undetermined: tuple[str, ...]
    by_camera: Array

    def holds(self, board: BoardPose, camera: Camera) -> Pose:
        """T_rig_target of a target seen by the same camera, with the common camera errors."""
        known = camera.covariance
        shared = np.zeros((6, 6))
        if known is not None:
            shared = self.by_camera @ known @ board.by_camera.T
        return between(self.camera_rig, board.pose, shared)


def locate_rig(
    views: Sequence[CardView],
    camera: Camera,
    middle_m: ArrayLike = CARD_MIDDLE_M,
    priors: PlatePriors = PlatePriors(),
) -> RigPose:
    """Find the rig's frame from pictures of a card that moves in a known way.

    T_camera_card(i) = T_camera_rig Shift(advance_i) Turn_z(blade_angle_i) T_rig_card, by least
    squares on all corners, both poses unknown at once. Corners that the other pictures contradict
    (a blade's edge taken for one of a marker's) are left out. Advances determine the x axis, turns
    the pivot's axis and place; with one of them only, ``undetermined`` names the undetermined
    directions. The covariance includes the camera's and that of the card's print.
    ``views`` are from `card_view`; ``middle_m`` (3,) is the card's middle in its own frame, that of
    the printed rig card where none is given. Raises UndeterminedPoseError (a
    VerdictError) where a card cannot be located at all, or where fewer than two different positions
    were seen, InputError where a picture has another size than the camera's.
    """
    views, middle_m = tuple(views), np.asarray(middle_m, dtype=np.float64)
    positions = {(round(v.advance_m, 6), round(v.blade_angle_rad, 6)) for v in views}
    if len(positions) < 2:
        raise UndeterminedPoseError(
            "The rig has the same position in all pictures: take pictures at several advances and "
            "several openings."
        )
    located = [locate_board(view.corners, camera) for view in views]
    views = tuple(view._replace(corners=view.corners.unbent(camera)) for view in views)
    start = _start(views, tuple(board.pose for board in located), middle_m)
    all_rows = _Rows(views, camera, middle_m, tuple(board.used for board in located))
    rows, point = all_rows, all_rows.nearest(start)
    for _ in range(REJECTIONS):
        away = rows.residuals(point).reshape(-1, 2)
        sound = near(away, np.ones(len(away), dtype=bool))
        if np.all(sound):
            break
        rows = rows.where(sound)
        if rows.most_lost(all_rows) > MOST_OF_A_VIEW:
            rows, point = all_rows, all_rows.nearest(start)
            break
        point = rows.nearest(point)
    residual, slope, shared = rows.residuals(point), rows.by_point(point), rows.by_shared(point)
    square, normal, slopes = float(residual @ residual), slope.T @ slope, slope.T @ shared
    noise = max(square / max(len(residual) - len(point), 1), LEAST_SD_PX**2)
    prior = np.diag(np.full(len(point), 1.0 / OPEN**2))
    inverse = np.linalg.inv(normal / noise + prior)
    known = np.zeros((11, 11))
    known[9:, 9:] = (0.01 * priors.print_scale_sd_percent) ** 2 * np.eye(2)
    if camera.covariance is not None:
        known[:9, :9] = camera.covariance
    drawn = slopes / noise
    spread = normal / noise + drawn @ known @ drawn.T
    turn = np.eye(len(point))
    turn[:3, :3] = left_jacobian(point[:3])
    covariance = turn @ inverse @ (spread + prior) @ inverse @ turn.T
    deviation = np.sqrt(np.diag(covariance)[:6])
    undetermined = tuple(
        name for name, sd in zip(_DIRECTIONS, deviation, strict=True) if not sd < UNDETERMINED_SD
    )
    rig, card = _poses(point, middle_m)
    return RigPose(
        Pose(rig.quaternion, rig.translation_m, covariance[:6, :6]),
        card,
        float(np.sqrt(2.0 * square / len(residual))),
        undetermined,
        -(turn @ inverse @ drawn)[:6, :9],
    )


_DIRECTIONS = (
    "tilt about the camera's x axis",
    "tilt about the camera's y axis",
    "turn about the camera's z axis",
    "place along the camera's x axis",
    "place along the camera's y axis",
    "distance from the camera",
)


def _poses(point: Array, middle_m: Array) -> tuple[Pose, Pose]:
    """T_camera_rig and T_rig_card of parameters (11,); the card's middle has z = 0 in the rig."""
    rig = Pose.from_rotation_vector(point[:3], point[3:6])
    turned = Pose.from_rotation_vector(point[6:9], np.zeros(3))
    place = np.append(point[9:11], 0.0) - turned.apply([middle_m])[0]
    return rig, Pose(turned.quaternion, (float(place[0]), float(place[1]), float(place[2])))


def _motion(view: CardView) -> Pose:
    return Pose.from_rotation_vector([0.0, 0.0, view.blade_angle_rad], [view.advance_m, 0.0, 0.0])


def _start(views: tuple[CardView, ...], poses: tuple[Pose, ...], middle_m: Array) -> Array:
    """Axes from the pictures' own poses: advances give x, turns give z and the pivot's place."""
    first = views[0]
    shifts, turns = [], []
    for view, pose in zip(views[1:], poses[1:], strict=True):
        moved = view.advance_m - first.advance_m
        turned = view.blade_angle_rad - first.blade_angle_rad
        relative = Pose.from_matrix(pose.matrix @ poses[0].matrix.T, (0.0, 0.0, 0.0))
        if abs(turned) > 1e-3:
            turns.append(relative.rotation_vector * np.sign(turned))
        if abs(turned) <= 1e-3 and abs(moved) > 1e-6:
            shift = pose.apply([middle_m])[0] - poses[0].apply([middle_m])[0]
            shifts.append(shift * np.sign(moved))
    z = _unit(np.sum(turns, axis=0)) if turns else _unit(poses[0].matrix[:, 2])
    x = np.sum(shifts, axis=0) if shifts else poses[0].matrix[:, 0]
    x = _unit(x - z * (x @ z))
    axes = np.stack([x, np.cross(z, x), z], axis=1)
    rows, wanted = [], []
    for view, pose in zip(views, poses, strict=True):
        # middle_i = origin + x advance_i + R(angle_i) (middle_0 in the rig): linear in both places
        angle = view.blade_angle_rad
        turn = axes @ Pose.from_rotation_vector([0.0, 0.0, angle], np.zeros(3)).matrix
        rows.append(np.concatenate([np.eye(3), turn[:, :2]], axis=1))
        wanted.append(pose.apply([middle_m])[0] - x * view.advance_m)
    places = np.linalg.lstsq(np.concatenate(rows), np.concatenate(wanted), rcond=1e-6)[0]
    rig = Pose.from_matrix(axes, places[:3])
    turn0 = _motion(first).matrix.T @ axes.T @ poses[0].matrix
    card = Pose.from_matrix(turn0, np.zeros(3))
    return np.concatenate([rig.rotation_vector, places[:3], card.rotation_vector, places[3:5]])


def _unit(vector: Array) -> Array:
    length = float(np.linalg.norm(vector))
    if length == 0.0:
        raise UndeterminedPoseError(
            "The card did not move with the rig: fix it to the moving part, and take the pictures "
            "again."
        )
    return np.asarray(vector / length)


@dataclass(frozen=True)
class _Rows:
    """Rows of the least squares over the corners of all pictures that ``used`` selects."""

    views: tuple[CardView, ...]
    camera: Camera
    middle_m: Array
    used: tuple[NDArray[np.bool_], ...]

    def nearest(self, start: Array) -> Array:
        """The parameters (11,) that leave the least squares, sought from ``start``."""
        from scipy.optimize import least_squares

        solved = least_squares(
            self.residuals,
            start,
            jac=self.by_point,
            method="lm",
            x_scale="jac",
            xtol=1e-14,
            ftol=1e-12,
        )
        return np.asarray(solved.x)

    def most_lost(self, all_rows: "_Rows") -> float:
        """The largest share of one picture's corners that ``every`` uses and this does not."""
        pairs = zip(self.used, all_rows.used, strict=True)
        return float(max(1.0 - now.sum() / max(begun.sum(), 1) for now, begun in pairs))

    def where(self, sound: NDArray[np.bool_]) -> "_Rows":
        """The rows of those of the used corners that ``sound`` (corners,) selects."""
        ends = np.cumsum([int(mask.sum()) for mask in self.used])[:-1]
        kept = []
        for mask, here in zip(self.used, np.split(sound, ends), strict=True):
            fewer = mask.copy()
            fewer[mask] = here
            kept.append(fewer)
        return replace(self, used=tuple(kept))

    def residuals(self, point: Array) -> Array:
        """Predicted minus measured pixels (n,) at parameters (11,)."""
        poses = _poses(point, self.middle_m)
        away = [
            project_pose(_card(poses, view), view.corners, self.camera)[0][mask]
            for view, mask in zip(self.views, self.used, strict=True)
        ]
        return -np.concatenate(away).ravel()

    def by_point(self, point: Array) -> Array:
        """Slopes (n, 11) of predicted pixels by the parameters."""
        here = _poses(point, self.middle_m)
        steps = STEP * np.eye(len(point))
        beside = [[_poses(point + s * e, self.middle_m) for s in (1, -1)] for e in steps]
        rows = []
        for view, mask in zip(self.views, self.used, strict=True):
            _, slope = project_pose(_card(here, view), view.corners, self.camera)
            chain = [(_card(a, view) - _card(b, view)) / (2 * STEP) for a, b in beside]
            rows.append(slope[np.repeat(mask, 2), :6] @ np.stack(chain, axis=1))
        return np.concatenate(rows)

    def by_shared(self, point: Array) -> Array:
        """Slopes (n, 11) by what all pictures share: the camera and the print's scales."""
        here = _poses(point, self.middle_m)
        rows = []
        for view, mask in zip(self.views, self.used, strict=True):
            card = _card(here, view)
            _, slope = project_pose(card, view.corners, self.camera)
            shared = np.hstack([slope[:, 6:15], print_slopes(card, slope, view.corners)])
            rows.append(shared[np.repeat(mask, 2)])
        return np.concatenate(rows)


def _card(poses: tuple[Pose, Pose], view: CardView) -> Array:
    """The card's pose before the camera (6,): rotation vector and translation."""
    rig, card = poses
    in_camera = rig.after(_motion(view)).after(card)
    return np.concatenate([in_camera.rotation_vector, in_camera.translation_m])


def locate_plate(
    seen: Detection | Sequence[Detection] | BoardPose,
    camera: Camera,
    plate_target: Pose = UNMOVED,
    rig: RigPose | None = None,
    priors: PlatePriors = PlatePriors(),
) -> PicturePose:
    """Find the plate of a target that was found, before the camera or in the rig's frame.

    ``seen`` is what `scissorcal.vision.find_board` found in one picture, or in several where camera
    and plate are at rest, or what `locate_board` made of it. ``plate_target`` is T_plate_target:
    how the target lies on the plate, whose frame has x along the cut from its near edge and z out
    of its upper face. ``rig`` (`locate_rig`) takes the pose into the rig's frame, with the errors
    of the camera that both share. A filter over many pictures takes ``noise`` for each and
    ``shared`` once, as its bias: counted in each picture, the shared errors would seem to average
    out. `scissorcal.calibration.fit_plate` gives the same pose with verdicts. Raises as
    `locate_board` does.

    A target whose upper left corner lies 40 mm behind the plate's near edge; printed y runs down,
    hence the half turn:

    >>> import numpy as np
    >>> from scissorcal.vision import (
    ...     PLATE_BOARD, Camera, Lens, Looks, Pose, SimPose, find_board, locate_plate, render,
    ...     target_layers,
    ... )
    >>> camera = Camera(600.0, 600.0, 319.5, 239.5, (0.0,) * 5, 640, 480)
    >>> lens = Lens(600.0, (319.5, 239.5), 640, 480)
    >>> truth = SimPose.looking_at((0.07, 0.05), 0.25, tilt=0.4)
    >>> picture = render(target_layers(PLATE_BOARD, truth), lens, Looks(), np.random.default_rng(0))
    >>> target = Pose.from_rotation_vector([np.pi, 0.0, 0.0], [0.04, 0.0, 0.0])
    >>> plate = locate_plate(find_board(picture, "plate board"), camera, target)
    >>> near_edge_m = truth.shift_m - 0.04 * truth.rotation[:, 0]
    >>> bool(np.abs(plate.pose.translation_m - near_edge_m).max() < 0.3e-3), plate.odds > 20.0
    (True, True)
    """
    board = seen if isinstance(seen, BoardPose) else locate_board(seen, camera, priors)
    back = plate_target.inverse()
    pose = (rig.holds(board, camera) if rig else board.pose).after(back)
    exact = replace(rig.camera_rig, covariance=None).inverse() if rig else None

    def placed(pose_of_board: Pose) -> Pose:
        return (exact.after(pose_of_board) if exact else pose_of_board).after(back)

    alone = placed(replace(board.pose, covariance=board.noise))
    assert pose.covariance is not None
    assert alone.covariance is not None
    shared = pose.covariance - alone.covariance
    other = placed(board.other) if board.other else None
    return PicturePose(pose, other, alone.covariance, 0.5 * (shared + shared.T), board.odds)
