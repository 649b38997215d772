"""A simulated world for tracking: one plate, seen by a rendered camera, touched by a rig."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.sim.plate import plate_pose
from scissorcal.device.sim.specimen import TouchedPlate, load_specimen
from scissorcal.errors import InputError
from scissorcal.kernel import ConfigKey
from scissorcal.vision.live import Frame
from scissorcal.vision.sim.lens import Pose
from scissorcal.vision.sim.sim_camera import render_frame, sim_plate_scene

if TYPE_CHECKING:
    from scissorcal.device.motion import Motion
    from scissorcal.recipe.schema import Recipe

Array = NDArray[np.float64]

FRAMES_HZ = 10.0
BLACK_EVERY = 8
JITTER_S = 0.04
CAMERA_OFFSET_S, CAMERA_DRIFT = 3000.0, 80e-6
"""The camera's clock: when it was switched on, and that it runs faster."""
STANCE = (0.0, 8.0)
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

_LEVEL_PLATE = TouchedPlate(place_mm=(20.0, 10.0, 0.0))


class SimWorld:
    """The plate of the recipe's specimen, moving as fast as the recipe's plate.tracking says.

    It sways in all axes and turns about the rig's z, with the stated speeds as rms. A rendered
    camera sees it ten times a second, by another clock and late by camera_delay_ms to 40 ms
    more; every eighth picture is black. With ``rig``, a virtual hand taps it with the blade's tip,
    motors off, in virtual time. ``truth`` is for tests.
    """

    def __init__(self, recipe: "Recipe", seed: int, *, rig: bool) -> None:
        """Raise InputError where the recipe names no specimen."""
        if recipe.specimen is None:
            raise InputError(
                "The recipe names no specimen, so there is nothing to simulate: add "
                'specimen = "office-paper" at its top, or name a camera and a port.'
            )
        self._recipe, self._seed = recipe, seed
        specimen = load_specimen(recipe.specimen)
        stands = specimen.plate or _LEVEL_PLATE
        self._plate = stands.model_copy(update=_sway(recipe, stands.sway_Hz))
        self._rng = np.random.default_rng([seed, 12])
        self._link: LockstepLink | None = None
        self._begun_s = 0.0
        self._first_s = 1.0 / FRAMES_HZ
        self._number = 0
        self._late: list[Frame] = []
        if rig:
            hand = specimen.hand.model_copy(update=HAND)
            changed = specimen.model_copy(update={"plate": self._plate, "hand": hand})
            self._link = LockstepLink(changed, np.random.default_rng([seed, 13]))

    @property
    def link(self) -> LockstepLink:
        """The virtual rig."""
        if self._link is None:
            raise ValueError("this world has no rig")
        return self._link

    def begin(self, motion: "Motion") -> None:
        """Put the plate in, and let the hand tap it."""
        motion.configure(ConfigKey.MATERIAL, PLATE)
        motion.configure(ConfigKey.HAND_STROKES, HAND_STROKES)
        motion.configure(ConfigKey.HAND_SPEED_rad_per_s, HAND_SPEED_RAD_PER_S)
        plate = self.link.rig.plate
        assert plate is not None
        self._begun_s = self.link.virtual_time - plate.time_s
        self._first_s = self.link.virtual_time + 1.0 / FRAMES_HZ

    def truth(self, host_s: float) -> tuple[Array, Array]:
        """True rotation (3, 3) and place (3,) in the rig's frame, at a time of the host's clock."""
        axes, place = plate_pose(self._plate, host_s - self._begun_s)
        return np.stack(axes, axis=1), np.array(place)

    def frames(self, until_s: float = math.inf) -> Iterator[Frame]:
        """Render pictures in the order of their arrival, up to a time of the host's clock."""
        while True:
            exposed = self._first_s + self._number / FRAMES_HZ
            soonest = exposed + 1e-3 * self._recipe.plate.tracking.camera_delay_ms
            self._late.sort(key=lambda frame: frame.arrived_s)
            if self._late and self._late[0].arrived_s < min(soonest, until_s):
                yield self._late.pop(0)
            elif exposed <= until_s:
                self._late.append(self._render(exposed, soonest + JITTER_S * self._rng.random()))
            else:
                return

    def _render(self, exposed: float, arrives: float) -> Frame:
        rotation, place = self.truth(exposed)
        scene = sim_plate_scene(self._recipe, self._seed, Pose(rotation, place))
        stance = STANCE
        if self._link is not None:
            rig = self._link.rig
            stance = (1e3 * rig.advance, math.degrees(rig.opening))
        image = render_frame(scene, self._recipe, stance, self._seed, self._number)
        if self._number % BLACK_EVERY == BLACK_EVERY - 1:
            image = np.zeros_like(image)
        stamp = CAMERA_OFFSET_S + (1.0 + CAMERA_DRIFT) * exposed
        frame = Frame(self._number, exposed - self._first_s, image, None, stamp, arrives)
        self._number += 1
        return frame


def _sway(recipe: "Recipe", frequency_Hz: float) -> dict[str, object]:
    tracking = recipe.plate.tracking
    reach = math.sqrt(2.0) / (2.0 * math.pi * frequency_Hz)
    return {
        "sway_mm": (reach * tracking.speed_mm_per_s,) * 3,
        "sway_turn_deg": min(reach * tracking.turn_deg_per_s, 45.0),
    }
