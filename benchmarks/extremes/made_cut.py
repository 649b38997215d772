"""Recordings of smooth cuts with a known material, by closed forms of a straight edge.

Everything is written out here, for two moving blades: nothing is shared with the model that is
fitted.
"""

from dataclasses import dataclass

import numpy as np
from benchmarks.extremes.made_friction import MadeFriction, Motion, record, sweeps

from scissorcal.recording import Recording, Stroke

STROKES_A_SHEET = 4
STEP_M, BEGIN_M = 0.034, -0.018
"""How far the carriage moves between strokes, and where it begins."""


@dataclass(frozen=True)
class MadeCut:
    """True values of a cut that runs smoothly (kappa = 1), SI; those of the recipe for paper."""

    force: float = 0.66
    exponent: float = 1.6
    reference: float = 1.5e-4
    fracture_energy: float = 0.5
    edge_offset: float = -0.008
    taper: float = float(np.radians(2.0))
    upper_face: float = 5e-5


def cut_motion(sheets: int = 2) -> Motion:
    """Closing and opening strokes at three speeds, four places on each sheet."""
    speeds = tuple((0.1, 0.25, 0.6)[k % 3] for k in range(STROKES_A_SHEET * sheets))
    plain = sweeps(speeds, 1)
    strokes = tuple(
        Stroke(one.index, one.kind, one.speed, k // (2 * STROKES_A_SHEET))
        for k, one in enumerate(plain.strokes)
    )
    return Motion(plain.opening, plain.rate, plain.acceleration, plain.stroke, strokes)


def record_cut(
    motion: Motion, truth: MadeCut, friction: MadeFriction, rng: np.random.Generator
) -> Recording:
    """What sensors record of a cut: the motors hold friction and the material's torque."""
    made = record(motion, friction, rng)
    number = motion.stroke // 2
    advance = BEGIN_M + STEP_M * (number % STROKES_A_SHEET)
    sheet = number // STROKES_A_SHEET
    psi = 0.5 * motion.opening + truth.taper
    base = truth.edge_offset * (np.cos(0.5 * motion.opening)
                                + np.sin(0.5 * motion.opening) * np.tan(psi))  # fmt: skip
    # the crack runs where 2 g tan(psi) = J h: there the indentation follows from the opening
    share = truth.fracture_energy / (2.0 * np.tan(psi) * truth.force)
    depth = truth.reference * share ** (1.0 / truth.exponent)
    reached = advance + (truth.upper_face - depth - base) / np.tan(psi)
    crack = np.zeros(len(reached))
    for one in np.unique(sheet):
        here = sheet == one
        crack[here] = np.maximum.accumulate(np.maximum(reached[here], 0.0))
    contact = crack - advance
    height = base + contact * np.tan(psi)
    indentation = np.maximum(truth.upper_face - height, 0.0)
    force = truth.force * (indentation / truth.reference) ** truth.exponent
    samples = made.samples.copy()
    samples["motor_torque"] -= force * (contact + height * np.tan(psi))
    samples["advance"] = advance
    return Recording(kind="cut", samples=samples, strokes=motion.strokes, source="cut.mcap")
