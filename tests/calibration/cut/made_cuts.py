"""Recordings of smooth cuts by the model's own crack, with any way of closing and opening."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.cut.geometry import Geometry
from scissorcal.calibration.cut.guess import Guess
from scissorcal.calibration.cut.path_motion import PathMotion, path_motion
from scissorcal.calibration.cut.path_work import Material, material_of
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.model import (
    Cutting,
    Edge,
    EdgeDistribution,
    FrictionLaw,
    Response,
    cut_torque_along,
    torque_at,
)
from scissorcal.recording import Stroke
from tests.calibration.cut.path.made import COULOMB, INERTIA, RATE_HZ, Made, record
from tests.calibration.truth import Truth, sweep

TRUTH = Truth()
EDGE = Edge("line", TRUTH.edge_offset, TRUTH.taper, 0.075)
RESPONSE = Response("power", TRUTH.force, TRUTH.exponent, TRUTH.reference)
LAW = Cutting(EDGE, RESPONSE, 2, TRUTH.upper_face, TRUTH.fracture_energy)
GEOMETRY = Geometry(
    EdgeDistribution(EDGE, (), np.zeros((0, 0))), TRUTH.upper_face, 2, TRUTH.reference
)
GUESS = Guess(RESPONSE, TRUTH.fracture_energy, 1.0)
FRICTION = FrictionLaw({"coulomb": COULOMB})
NOISE = TorqueNoise(1e-4, 1e-4, 0.01)

HIGH, LOW = 0.85, 0.25


@dataclass(frozen=True)
class Cut:
    """A recording with its motion, the material's true torque and the crack's true place."""

    made: Made
    motions: tuple[PathMotion, ...]
    materials: tuple[Material, ...]
    torque: Array
    tip: Array


def way(*turns: float, speed: float = 0.4) -> Array:
    """An opening (n,) that goes through ``turns`` and waits for 0.1 s at each."""
    parts = []
    for a, b in pairwise(turns):
        parts += [sweep(a, b, speed), np.full(RATE_HZ // 10, b)]
    return np.concatenate(parts)


def cut(
    *ways: Array,
    places: tuple[float, ...] | None = None,
    kinds: tuple[int, ...] | None = None,
    usable: NDArray[np.bool_] | None = None,
    cuts: bool = True,
    step_rad: float = 2e-6,
) -> Cut:
    """Cut along ``ways``, each a stroke with the pivot at its place; ``kinds`` number sheets."""
    places = places or tuple(-0.018 + 0.03 * k for k in range(len(ways)))
    kinds = kinds or tuple(0 for _ in ways)
    torque, tips, cracks = [], [], {}
    for one, place, sheet in zip(ways, places, kinds, strict=True):
        advance = np.full(len(one), place)
        if cuts:
            felt, tip = cut_torque_along(LAW, one, advance, cracks.get(sheet, 0.0))
            cracks[sheet] = float(tip[-1])
        else:
            tip = np.zeros(len(one))
            felt = torque_at(LAW, one, tip - advance)
        torque.append(felt)
        tips.append(tip)
    whole = np.concatenate(torque)
    labels = np.repeat(np.arange(len(ways)), [len(one) for one in ways])
    made = record(
        np.concatenate(ways),
        lambda _: whole,
        step_rad=step_rad,
        stroke=labels,
        strokes=tuple(Stroke(k, "closing", 0.4, sheet) for k, sheet in enumerate(kinds)),
        advance=np.repeat(places, [len(one) for one in ways]),
    )
    motions = path_motion((made.recording,), INERTIA, None if usable is None else (usable,))
    materials = tuple(material_of(motion, FRICTION, 0.0) for motion in motions)
    return Cut(made, motions, materials, whole, np.concatenate(tips))
