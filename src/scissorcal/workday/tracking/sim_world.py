"""A simulated world for tracking: one plate, seen by a rendered camera, touched by a rig."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from scissorcal.aliases import Array
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.motion import Motion
from scissorcal.device.sim.hand import minimum_jerk
from scissorcal.device.sim.plate_contact import plate_pose
from scissorcal.device.sim.specimen import Specimen, TouchedPlate, load_specimen
from scissorcal.errors import InputError
from scissorcal.kernel import ConfigKey
from scissorcal.recipe.schema import Recipe
from scissorcal.tracking.plate_pose import rotation_of, rotation_vector
from scissorcal.vision.live import Frame
from scissorcal.vision.sim.optics import SimPose
from scissorcal.vision.sim.scenes import LEVEL
from scissorcal.vision.sim.sim_camera import render_frame, sim_plate_scene

CAMERA_OFFSET_S, CAMERA_DRIFT = 3000.0, 80e-6
"""The camera's clock: when it was switched on, and that it runs faster."""
POSITION = (0.0, 8.0)
PLATE = 2.0
"""MATERIAL that puts the specimen's plate in."""
HAND = {
    "strength_N": 2.5,
    "open_deg": 34.0,
    "closed_deg": 12.0,
    "tremor_N": 0.03,
    "pause_s": 0.4,
    "margin_mm": -6.0,
}
"""A hand that taps a plate with 3.5 N at the tip, for half a second, at one place after another."""
HAND_SPEED_RAD_PER_S, HAND_STROKES = 0.3, 1000.0

CARRY_S = 1.5
"""How long a hand takes to bring a plate from where it is tapped to between the blades."""
CUTTING_HAND = {**HAND, "strength_N": 6.0, "margin_mm": 1.0}
"""A hand that taps and cuts: stronger than the torque of paper, and with 5 N at the tip."""

_LEVEL_PLATE = TouchedPlate(place_mm=(20.0, 10.0, 0.0))


class SimCamera(NamedTuple):
    """A rendered camera: its rate, by how much more than camera_delay_ms a picture may come late,
    and every how many pictures one is black."""

    frames_Hz: float = 10.0
    jitter_s: float = 0.04
    black_every: int = 8


class SimWorld:
    """The plate of the recipe's specimen, moving as fast as the recipe's plate.tracking says.

    It sways in all axes and turns about the rig's z, with the stated speeds as rms. A rendered
    ``camera`` sees it, by another clock and late. With ``rig``, a virtual hand taps it with the
    blade's tip, motors off, in virtual time. With ``cut`` the plate is the one between the blades
    that photographs of the seed show; it is tapped at rest where the specimen has it, and then
    carried there. ``specimen`` takes the place of the recipe's, with
    its own motion and hand. ``truth`` is for tests.
    """

    def __init__(
        self,
        recipe: Recipe,
        seed: int,
        *,
        rig: bool,
        cut: bool = False,
        specimen: Specimen | None = None,
        camera: SimCamera | None = None,
    ) -> None:
        """Raise InputError where the recipe names no specimen."""
        if recipe.specimen is None:
            raise InputError(
                "The recipe names no specimen, so there is nothing to simulate: add "
                'specimen = "office-paper" at its top, or name a camera and a port.'
            )
        self._recipe, self._seed = recipe, seed
        self._camera = camera or SimCamera()
        specimen = specimen or _swaying(recipe, cut=cut)
        self._tapped = self._plate = specimen.plate or _LEVEL_PLATE
        if cut:
            self._plate = _between_blades(recipe, seed)
        self._rng = np.random.default_rng([seed, 12])
        self._link: _WorldLink | None = None
        self._begun_s = 0.0
        self._carried_s = -math.inf
        self._first_s = 1.0 / self._camera.frames_Hz
        self._number = 0
        self._late: list[Frame] = []
        if rig:
            self._link = _WorldLink(specimen, np.random.default_rng([seed, 13]))

    @property
    def link(self) -> LockstepLink:
        """The virtual rig."""
        if self._link is None:
            raise ValueError("this world has no rig")
        return self._link

    def begin(self, motion: Motion, *, taps: bool = True) -> None:
        """Put the plate in where the tip reaches it, and let the hand tap it."""
        motion.configure(ConfigKey.MATERIAL, PLATE)
        if taps:
            motion.configure(ConfigKey.HAND_STROKES, HAND_STROKES)
            motion.configure(ConfigKey.HAND_SPEED_rad_per_s, HAND_SPEED_RAD_PER_S)
        plate = self.link.rig.plate
        assert plate is not None
        self._begun_s = self.link.virtual_time - plate.time_s
        self._first_s = self.link.virtual_time + 1.0 / self._camera.frames_Hz
        if taps:
            self._carried_s = math.inf

    def keep_plate(self) -> None:
        """The plate stays where it is and moves on, whatever is said to the rig about it."""
        assert self._link is not None
        self._link.keeps = True

    def take_out(self, motion: Motion) -> None:
        """Take the plate out of the tip's reach; one that was tapped goes between the blades."""
        motion.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.0)
        motion.configure(ConfigKey.MATERIAL, 0.0)
        if self._carried_s > 0.0:
            self._carried_s = self.link.virtual_time

    def truth(self, host_s: float) -> tuple[Array, Array]:
        """True rotation (3, 3) and place (3,) in the rig's frame, at a time of the host's clock."""
        rotation, place = _pose(self._plate, host_s - self._begun_s)
        share = minimum_jerk(min(max((host_s - self._carried_s) / CARRY_S, 0.0), 1.0))[0]
        if self._tapped is self._plate or share == 1.0:
            return rotation, place
        first, start = _pose(self._tapped, min(host_s, self._carried_s) - self._begun_s)
        turn = rotation_of(share * rotation_vector(rotation @ first.T))
        return turn @ first, start + share * (place - start)

    def frames(self, until_s: float = math.inf) -> Iterator[Frame]:
        """Render pictures in the order of their arrival, up to a time of the host's clock."""
        while True:
            exposed = self._first_s + self._number / self._camera.frames_Hz
            soonest = exposed + 1e-3 * self._recipe.plate.tracking.camera_delay_ms
            self._late.sort(key=lambda frame: frame.arrived_s)
            if self._late and self._late[0].arrived_s < min(soonest, until_s):
                yield self._late.pop(0)
            elif exposed <= until_s:
                late = self._camera.jitter_s * self._rng.random()
                self._late.append(self._shot(exposed, soonest + late))
            else:
                return

    def image(self, exposed: float) -> NDArray[np.uint8]:
        """What the camera shows at a time of the host's clock, (height, width, 3)."""
        rotation, place = self.truth(exposed)
        scene = sim_plate_scene(self._recipe, self._seed, SimPose(rotation, place))
        position = POSITION
        if self._link is not None:
            rig = self._link.rig
            position = (1e3 * rig.advance, math.degrees(rig.opening))
        return render_frame(scene, self._recipe, position, self._seed, self._number)

    def _shot(self, exposed: float, arrives: float) -> Frame:
        image = self.image(exposed)
        every = self._camera.black_every
        if self._number % every == every - 1:
            image = np.zeros_like(image)
        stamp = CAMERA_OFFSET_S + (1.0 + CAMERA_DRIFT) * exposed
        frame = Frame(self._number, exposed - self._first_s, image, None, stamp, arrives)
        self._number += 1
        return frame


class _WorldLink(LockstepLink):
    """A virtual rig whose plate may be kept in."""

    keeps = False

    def configure(self, key: int, value: float) -> float:
        if self.keeps and int(key) == ConfigKey.MATERIAL and self.rig.plate is not None:
            return float(value)
        return super().configure(key, value)


def _swaying(recipe: Recipe, *, cut: bool) -> Specimen:
    """The recipe's specimen with a plate that moves, and a hand that taps it."""
    base = load_specimen(str(recipe.specimen))
    plate = base.plate or _LEVEL_PLATE
    hand = base.hand.model_copy(update=CUTTING_HAND if cut else HAND)
    swaying = plate if cut else plate.model_copy(update=_sway(recipe, plate.sway_Hz))
    return base.model_copy(update={"plate": swaying, "hand": hand})


def _between_blades(recipe: Recipe, seed: int) -> TouchedPlate:
    """The plate where photographs of this seed show it, swaying."""
    drawn = sim_plate_scene(recipe, seed).rig_plate
    lean = Rotation.from_matrix(drawn.rotation @ LEVEL.T).as_euler("ZYX", degrees=True)
    plate = TouchedPlate(
        place_mm=tuple((1e3 * drawn.shift_m).tolist()),
        pitch_deg=lean[0],
        yaw_deg=lean[1],
        roll_deg=lean[2],
    )
    return plate.model_copy(update=_sway(recipe, plate.sway_Hz))


def _pose(plate: TouchedPlate, time_s: float) -> tuple[Array, Array]:
    axes, place = plate_pose(plate, time_s)
    return np.stack(axes, axis=1), np.array(place)


def _sway(recipe: Recipe, frequency_Hz: float) -> dict[str, object]:
    tracking = recipe.plate.tracking
    reach = math.sqrt(2.0) / (2.0 * math.pi * frequency_Hz)
    return {
        "sway_mm": (reach * tracking.speed_mm_per_s,) * 3,
        "sway_turn_deg": min(reach * tracking.turn_deg_per_s, 45.0),
    }
