"""What the rendered camera sees: printed targets, blades with known edges, plate and card."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.vision.sim.optics import SimPose, about
from scissorcal.vision.sim.photograph import PaintLayer
from scissorcal.vision.targets.boards import RIG_MARKERS, Board, Chessboard, MarkedBoard
from scissorcal.vision.targets.sheet import board_ink

STEEL = 0.28
_SCREW = 0.12
_STEP_M = 1e-4
_ROUND = np.linspace(0.0, 2.0 * np.pi, 241)[:-1]


@dataclass(frozen=True)
class Nick:
    """A notch in the edge: where from the pivot, how wide and how deep."""

    station_m: float
    width_m: float
    depth_m: float


@dataclass(frozen=True)
class BladeShape:
    """One blade in its own frame: x from the pivot to the tip, the edge below, the back above.

    The edge is ``offset + s tan(taper) + curvature s^2/2 + bend s^3/6 + wave sin(2 pi s / wave
    length + phase)``, in metres; the back is a straight line that rounds down to the tip over the
    last ``tip_share`` of the blade. Behind the pivot the body ends round at ``-tang_m``.
    """

    length_m: float = 0.075
    offset_m: float = -0.008
    taper_rad: float = 0.035
    curvature_per_m: float = 0.0
    bend_per_m2: float = 0.0
    wave_m: float = 0.0
    wave_length_m: float = 0.03
    wave_phase: float = 0.0
    back_m: float = 0.008
    back_slope: float = -0.035
    tip_share: float = 0.15
    tang_m: float = 0.016
    hole_m: float = 0.003
    nicks: tuple[Nick, ...] = ()

    def edge_at(self, station: ArrayLike, *, nicked: bool = False) -> Array:
        """Offset of the edge at stations."""
        s = np.asarray(station, dtype=np.float64)
        e = self.offset_m + s * np.tan(self.taper_rad)
        e = e + self.curvature_per_m * s**2 / 2.0 + self.bend_per_m2 * s**3 / 6.0
        e = e + self.wave_m * np.sin(2.0 * np.pi * s / self.wave_length_m + self.wave_phase)
        if nicked:
            for nick in self.nicks:
                across = (s - nick.station_m) / (0.5 * nick.width_m)
                e = e + nick.depth_m * np.maximum(1.0 - across**2, 0.0)
        return np.asarray(e)

    def back_at(self, station: ArrayLike) -> Array:
        """Offset of the back at stations."""
        s = np.asarray(station, dtype=np.float64)
        straight = self.back_m + self.back_slope * s
        near = np.clip((s / self.length_m - 1.0 + self.tip_share) / self.tip_share, 0.0, 1.0)
        edge = self.edge_at(s)
        return np.asarray(edge + (straight - edge) * np.sqrt(1.0 - near**2))

    def outlines(self, *, tail: Array | None = None) -> list[Array]:
        """The body's outline and the pivot's hole, polygons in the blade's frame.

        ``tail`` (n, 2) replaces the round end behind the pivot, from the back to the edge.
        """
        stop = self.length_m * (1.0 - 1e-9)
        start = -self.tang_m
        s = np.linspace(start, stop, int((stop - start) / _STEP_M))
        fine = stop - (stop - 0.8 * stop) * np.linspace(1.0, 0.0, 600) ** 2
        s = np.union1d(s, fine)
        lower = np.column_stack([s, self.edge_at(s, nicked=True)])
        upper = np.column_stack([s, self.back_at(s)])[::-1]
        if tail is None:
            middle = 0.5 * (lower[0] + upper[-1])
            half = 0.5 * (upper[-1, 1] - lower[0, 1])
            turn = np.linspace(0.5, 1.5, 121)[1:-1] * np.pi
            tail = middle + half * np.column_stack([np.cos(turn), np.sin(turn)])
        outline = np.vstack([lower, upper, tail])
        if self.hole_m <= 0.0:
            return [outline]
        return [outline, self.hole_m * np.column_stack([np.cos(_ROUND), -np.sin(_ROUND)])]


_RING = (-0.075, -0.022, 0.022, 0.015)
"""Centre x, y and half axes of a handle's ring in the blade's frame."""


PAPER, INK = 0.85, 0.04
MARGIN_M = 0.012


LEVEL = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""A level plate in the rig's frame: its upper face looks along y, in which the blades close."""


@dataclass(frozen=True)
class PlateScene:
    """True poses. The card moves with a blade; ``rig_card`` is its pose at no advance and blade
    angle zero. The target is on the plate's upper face at ``plate_target``."""

    camera_rig: SimPose
    rig_card: SimPose
    rig_plate: SimPose
    plate_target: SimPose

    @property
    def camera_plate(self) -> SimPose:
        """The plate as the camera has it."""
        return chained(self.camera_rig, self.rig_plate)

    def layers(
        self, target: MarkedBoard, advance_m: float = 0.0, blade_angle: float = 0.0
    ) -> list[PaintLayer]:
        """The target on the plate, and the card at the rig's position."""
        position = SimPose(about(2, blade_angle), np.array([advance_m, 0.0, 0.0]))
        card = chained(self.camera_rig, position, self.rig_card)
        lying = chained(self.camera_plate, self.plate_target)
        return [*target_layers(RIG_MARKERS, card), *target_layers(target, lying)]


def plate_scene(
    rng: np.random.Generator, place_m: tuple[float, float] = (0.0, 0.0), turn: float = 0.0
) -> PlateScene:
    """Draw a scene: the camera above and aside, plate and card slightly displaced.

    ``place_m`` is the place of the pattern's upper left corner on the plate, ``turn`` (rad) the
    rotation of its upper edge.
    """
    eye = np.array([0.15, 0.7, 0.75]) + rng.normal(0.0, 0.05, 3)
    to_rig = _looking(eye / np.linalg.norm(eye))
    middle = np.array([0.09, 0.03, 0.04])
    camera_rig = SimPose(to_rig, np.array([0.0, 0.0, rng.uniform(0.4, 0.46)]) - to_rig @ middle)
    facing = np.diag([1.0, -1.0, -1.0]) @ _leaned(rng, 0.05)
    centre = np.array([0.5 * RIG_MARKERS.width_m, 0.5 * RIG_MARKERS.height_m, 0.0])
    card = np.array([0.03, 0.075, 0.0]) + np.append(rng.normal(0.0, 2e-3, 2), 0.0)
    lying = LEVEL @ _leaned(rng, 0.02)
    near_edge = np.array([0.03, 0.0, 0.012]) + rng.normal(0.0, 1.5e-3, 3)
    pattern = about(2, turn) @ np.diag([1.0, -1.0, -1.0])
    return PlateScene(
        camera_rig,
        SimPose(facing, card - facing @ centre),
        SimPose(lying, near_edge),
        SimPose(pattern, np.array([*place_m, 0.0])),
    )


def chained(*poses: SimPose) -> SimPose:
    """One pose after the other, the outermost first."""
    rotation, shift = np.eye(3), np.zeros(3)
    for pose in reversed(poses):
        rotation, shift = pose.rotation @ rotation, pose.rotation @ shift + pose.shift_m
    return SimPose(rotation, shift)


def _looking(towards_eye: Array) -> Array:
    """Rotation into a camera that looks from a direction, its x axis near the rig's."""
    forward = -towards_eye
    right = np.array([1.0, 0.0, 0.0]) - forward * forward[0]
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def _leaned(rng: np.random.Generator, size: float) -> Array:
    angles = rng.normal(0.0, size, 3)
    return np.asarray(about(0, angles[0]) @ about(1, angles[1]) @ about(2, angles[2]))


def target_layers(
    board: Board,
    pose: SimPose,
    *,
    print_scale: tuple[float, float] = (1.0, 1.0),
    ids: Sequence[int] | None = None,
) -> list[PaintLayer]:
    """The sheet and its ink. ``print_scale`` is the printer's scale error by axis; ``ids`` leaves
    out all other markers."""
    scale = np.asarray(print_scale)
    sheet = _rectangle(-MARGIN_M, -MARGIN_M, board.width_m + MARGIN_M, board.height_m + MARGIN_M)
    ink = [outline * scale for outline in _ink(board, ids)]
    return [PaintLayer([sheet], pose, PAPER), PaintLayer(ink, pose, INK)]


def _ink(board: Board, ids: Sequence[int] | None) -> list[Array]:
    if isinstance(board, Chessboard):
        size = board.square_m
        return [
            _rectangle(c * size, r * size, (c + 1) * size, (r + 1) * size)
            for r in range(board.rows + 1)
            for c in range(board.columns + 1)
            if (r + c) % 2 == 0
        ]
    return [
        1e-3 * _rectangle(part.x, part.y, part.x + part.width, part.y + part.height)
        for part in board_ink(board, ids=ids)
    ]


def _rectangle(left: float, top: float, right: float, bottom: float) -> Array:
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])


def blade_layer(
    shape: BladeShape,
    pose: SimPose,
    pivot_m: tuple[float, float],
    turn: float = 0.0,
    **look: Any,
) -> PaintLayer:
    """One blade on a sheet: its pivot at ``pivot_m`` of the sheet's frame, turned by ``turn``.

    Unturned, it points along the sheet's x axis with its edge towards +y, which is downward in
    print. ``look`` are fields of `PaintLayer`.
    """
    look = {"reflectance": STEEL, "brushed": 0.04, "grain": turn, **look}
    outlines = [_on_sheet(outline, pivot_m, turn) for outline in shape.outlines()]
    return PaintLayer(outlines, pose, **look)


def scissors_layers(
    upper: BladeShape,
    lower: BladeShape,
    opening: float,
    pose: SimPose,
    pivot_m: tuple[float, float],
    turn: float = 0.0,
    **look: Any,
) -> list[PaintLayer]:
    """Both blades, open by ``opening`` about one pivot, with ring handles behind it.

    Each blade is turned away from the common axis by half the opening; its handle lies beyond the
    pivot on the other side. A dark screw fills the upper blade's hole.
    """
    look = {"reflectance": STEEL, "brushed": 0.04, **look}
    layers = []
    for shape, side in ((replace(lower, hole_m=0.0), -1.0), (upper, 1.0)):
        outlines = [*shape.outlines(tail=_handle(shape)), _ring_hole()]
        placed = []
        for outline in outlines:
            mirrored = outline * (1.0, side)
            mirrored = mirrored if side > 0 else mirrored[::-1]
            placed.append(_on_sheet(mirrored, pivot_m, turn - 0.5 * side * opening))
        layers.append(PaintLayer(placed, pose, **{"grain": turn - 0.5 * side * opening, **look}))
    screw = 0.9 * upper.hole_m * np.column_stack([np.cos(_ROUND), np.sin(_ROUND)])
    layers.append(PaintLayer([screw + np.asarray(pivot_m)], pose, _SCREW))
    return layers


def _on_sheet(points: ArrayLike, pivot_m: tuple[float, float], turn: float) -> Array:
    """Take points of a blade's frame, y upward, to the sheet's, whose y points down."""
    c, s = np.cos(turn), np.sin(turn)
    flipped = np.asarray(points, dtype=np.float64) * (1.0, -1.0)
    return np.asarray(flipped @ np.array([[c, s], [-s, c]]) + np.asarray(pivot_m))


def _handle(shape: BladeShape) -> Array:
    """From the back behind the pivot around the ring to the edge's side."""
    x, y, along, across = _RING
    start = -shape.tang_m
    turn = np.linspace(0.35, 2.0 * np.pi - 0.35, 121)
    ring = np.column_stack([x + along * np.cos(turn), y + across * np.sin(turn)])
    back = np.array([[start - 0.004, float(shape.back_at(start)) - 0.003]])
    edge = np.array([[start - 0.004, float(shape.edge_at(start)) - 0.001]])
    return np.vstack([back, ring, edge])


def _ring_hole() -> Array:
    x, y, along, across = _RING
    turn = -_ROUND
    inner = 0.68
    return np.column_stack([x + inner * along * np.cos(turn), y + inner * across * np.sin(turn)])
