"""A plate and a rig's card before one camera, composed from exact geometry."""

from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.vision.sim.lens import SimPose, about
from scissorcal.vision.sim.photograph import PaintLayer
from scissorcal.vision.sim.targets import target_layers
from scissorcal.vision.targets.boards import RIG_MARKERS, MarkedBoard

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
        """The target on the plate, and the card at the rig's stance."""
        stance = SimPose(about(2, blade_angle), np.array([advance_m, 0.0, 0.0]))
        card = chained(self.camera_rig, stance, self.rig_card)
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
