"""Simulated recordings of friction and cuts."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.cut.known import KnownFriction
from scissorcal.calibration.cut.structure import cutting_from
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.calibration.verify.simulation.crack import Unevenness, material_torque
from scissorcal.calibration.verify.simulation.drive import DriveTruth, measured_drive
from scissorcal.calibration.verify.simulation.motion import Motion
from scissorcal.model import Cutting, FrictionLaw
from scissorcal.recording.recording import Recording


@dataclass(frozen=True)
class CutTruth:
    """A material, and the rig that cuts it."""

    cutting: Cutting
    uneven: Unevenness
    drive: DriveTruth


def friction_truth(
    values: Mapping[str, float],
    structure: Mapping[str, Any],
    noise: TorqueNoise,
    stroke_sd: float = 0.0,
) -> DriveTruth:
    """The rig that parameters of a friction fit, by name, and its structure describe.

    ``noise`` and ``stroke_sd`` (N m) are by sample and by stroke.
    """
    return DriveTruth(
        inertia=float(values["inertia"]),
        friction=FrictionLaw.of_fit(values, float(structure["angle_center"])),
        noise=noise,
        offset=float(values.get("offset", 0.0)),
        cogging=(
            float(values.get("cogging_cos", 0.0)),
            float(values.get("cogging_sin", 0.0)),
            float(structure.get("cogging_periods_per_turn", 0.0)),
        ),
        stroke_sd=stroke_sd,
        delay_s=float(values.get("delay", 0.0)),
    )


def cut_truth(
    values: Mapping[str, float], structure: Mapping[str, Any], known: KnownFriction, tick_s: float
) -> CutTruth:
    """The material and the rig that parameters of a cut's fit, by name, and its structure describe.

    Friction, inertia and cogging are those of the empty sweeps; their uncertainty is in the
    offsets among ``values``. Unevenness counts only where something is cut.
    """
    cutting = cutting_from(structure, {n: np.asarray(v) for n, v in values.items()})
    scale = float(values.get("noise_scale", 1.0))
    noise = replace(
        known.noise,
        white_Nm=scale * known.noise.white_Nm,
        slow_Nm=scale * known.noise.slow_Nm,
    )
    cosine, sine, number = known.cogging
    return CutTruth(
        cutting=cutting,
        uneven=Unevenness(
            float(values.get("variation", 0.0)),
            float(values.get("variation_length", 1e-3)),
            float(values.get("sheet_variation", 0.0)),
        ),
        drive=DriveTruth(
            inertia=known.inertia,
            friction=known.law,
            fine_rad=known.fine_rad,
            noise=noise,
            offset=known.offset,
            cogging=(-cosine, -sine, number),
            load_share=float(values.get("load_share", 0.0)),
            closing_offset=float(values.get("offset_closing", 0.0)),
            opening_offset=float(values.get("offset_opening", 0.0)),
            stroke_sd=known.stroke_sd,
            delay_s=float(values.get("torque_delay", 0.0)) * tick_s,
        ),
    )


def simulate_friction(
    motions: tuple[Motion, ...], truth: DriveTruth, rng: np.random.Generator
) -> tuple[Recording, ...]:
    """Recordings of empty motion, raw samples with the truth's noise."""
    return tuple(
        motion.with_drive(
            [measured_drive(p, truth, np.zeros(len(p.opening) - 1), rng) for p in motion.pieces],
            rng,
        )
        for motion in motions
    )


def simulate_cut(
    motions: tuple[Motion, ...], truth: CutTruth, rng: np.random.Generator
) -> tuple[Recording, ...]:
    """Recordings of cuts (or presses), raw samples; every sheet is a new draw.

    A sheet that lies in two pieces of a recording, with a gap between them, is walked as one.
    """
    return tuple(motion.with_drive(_cut_drives(motion, truth, rng), rng) for motion in motions)


def _cut_drives(motion: Motion, truth: CutTruth, rng: np.random.Generator) -> list[Array]:
    if not motion.pieces:
        return []
    lengths = [len(piece.opening) for piece in motion.pieces]
    opening, advance, sheet = (
        np.concatenate([getattr(piece, name) for piece in motion.pieces])
        for name in ("opening", "advance", "sheet")
    )
    tick_s = motion.pieces[0].tick_s
    torque, _ = material_torque(truth.cutting, truth.uneven, (opening, advance, sheet), tick_s, rng)
    first = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    return [
        measured_drive(piece, truth.drive, torque[low : low + length - 1], rng)
        for piece, low, length in zip(motion.pieces, first.tolist(), lengths, strict=True)
    ]
