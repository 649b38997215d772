"""Simulated recordings: friction, cracks and what sensors measure of them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.cut.known import KnownFriction
from scissorcal.calibration.cut.structure import cutting_from
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.calibration.verify.simulated_motion import DriveTruth, Motion, measured_drive
from scissorcal.kernel import CrackLaw, CrackPath, Curve, walk_crack
from scissorcal.model import Cutting, Edge, FrictionLaw, Response
from scissorcal.recording.recording import Recording


@dataclass(frozen=True)
class CutTruth:
    """A material, and the rig that cuts it."""

    cutting: Cutting
    uneven: "Unevenness"
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


EDGE_KNOTS = 385
EDGE_FROM, EDGE_TO = -1.0, 3.0
"""Stations of the edge's table, in blade lengths: a cubic edge is exact between any knots."""
RESPONSE_KNOTS = 801
RESPONSE_SPAN = (1e-4, 1e2)
"""Indentations of the response's table, in references; a power law is exact at any."""
SMOOTH_FROM = 0.999
"""Kappa from which a crack is simulated as smooth, since its teeth are very short."""
CELLS = 40
"""Cells of the toughness over the length on which it varies."""
MOST_CELLS = 100_000
LEAST_TOUGHNESS = 0.05
"""Least local energy, as a share of the mean."""


@dataclass(frozen=True)
class Unevenness:
    """How toughness varies: an Ornstein-Uhlenbeck process over each sheet, and between sheets.

    ``variation`` and ``sheet_variation`` are relative standard deviations, ``length_m`` is the
    correlation length.
    """

    variation: float = 0.0
    length_m: float = 1e-3
    sheet_variation: float = 0.0


@dataclass(frozen=True)
class Sheet:
    """Toughness of one sheet over its mean, (k,), at places ``step_m`` apart from 0 on."""

    relative: Array
    step_m: float

    @classmethod
    def draw(cls, uneven: Unevenness, reach_m: float, rng: np.random.Generator) -> "Sheet":
        """Draw a sheet that reaches from 0 to ``reach_m`` at least."""
        from scipy.signal import lfilter

        mean = 1.0 + uneven.sheet_variation * rng.standard_normal()
        if not uneven.variation > 0.0:
            return cls(np.full(2, max(mean, LEAST_TOUGHNESS)), max(reach_m, 1e-3))
        step = max(uneven.length_m / CELLS, reach_m / MOST_CELLS)
        noise = rng.standard_normal(int(np.ceil(reach_m / step)) + 2)
        keep = float(np.exp(-step / uneven.length_m))
        noise[1:] *= np.sqrt(1.0 - keep**2)
        process = np.asarray(lfilter([1.0], [1.0, -keep], noise))
        return cls(np.maximum(mean + uneven.variation * process, LEAST_TOUGHNESS), step)


def crack_law(cutting: Cutting, tick_s: float, sheet: Sheet | None = None) -> CrackLaw:
    """The law of a cut in tables that C walks by, over a ``sheet`` (an even one if None).

    ``cutting`` has scalar parameters. A kappa that is next to 1 counts as 1.
    """
    even = sheet or Sheet(np.ones(2), 1.0)
    energy = 0.0 if cutting.fracture_energy is None else float(cutting.fracture_energy)
    kappa = float(cutting.kappa)
    fracture = "smooth" if kappa > SMOOTH_FROM else "rippled"
    response, stored = _response(cutting.response)
    return CrackLaw(
        edge=_edge(cutting.edge),
        response=response,
        energy=stored,
        moving_blades=cutting.moving_blades,
        upper_face_m=cutting.upper_face_m,
        closure=cutting.closure,
        fracture="none" if cutting.fracture_energy is None else fracture,
        kappa=kappa,
        damping_s_per_m=float(cutting.rate_damping),
        tick_s=tick_s,
        tough=energy * even.relative,
        tough_first=0.0,
        tough_step=even.step_m,
    )


def material_torque(
    cutting: Cutting,
    uneven: Unevenness,
    motion: tuple[Array, Array, NDArray[np.int64]],
    tick_s: float,
    rng: np.random.Generator,
) -> tuple[Array, tuple[CrackPath, ...]]:
    """Mean torque (n - 1,) of the material over each tick, and the walk through each sheet.

    ``motion`` is opening, advance and sheet (n,) by sample; a sheet that is put in (a change of
    its number, -1 for none) is cut from its near edge on. Torque in N m, positive as it opens.
    """
    opening, advance, sheets = motion
    torque = np.zeros(len(opening) - 1)
    bounds = np.concatenate([[0], np.flatnonzero(np.diff(sheets)) + 1, [len(sheets)]])
    paths = []
    for low, high in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        if sheets[low] < 0 or high - low < 2:
            continue
        span = slice(low, high)
        reach = max(float(advance[span].max()), 0.0) + EDGE_TO * cutting.edge.length_m
        law = crack_law(cutting, tick_s, Sheet.draw(uneven, reach, rng))
        path = walk_crack(law, opening[span], advance[span])
        torque[low : high - 1] = path.torque
        paths.append(path)
    return torque, tuple(paths)


def _edge(edge: Edge) -> Curve:
    station = np.linspace(EDGE_FROM, EDGE_TO, EDGE_KNOTS) * edge.length_m
    return Curve(
        float(station[0]),
        float(station[1] - station[0]),
        np.broadcast_to(edge.offset_at(station), station.shape),
        np.broadcast_to(edge.slope_at(station), station.shape),
    )


def _response(response: Response) -> tuple[Curve, Curve]:
    low, high = np.log(RESPONSE_SPAN[0]), np.log(RESPONSE_SPAN[1])
    log_depth = np.log(response.reference_m) + np.linspace(low, high, RESPONSE_KNOTS)
    depth = np.exp(log_depth)
    force, energy = response.force_at(depth), response.energy_at(depth)
    first, step = float(log_depth[0]), float(log_depth[1] - log_depth[0])
    sound = np.isfinite(force) & np.isfinite(energy) & (force > 0) & (energy > 0)
    count = int(np.argmin(sound)) if not sound.all() else len(sound)
    kept = slice(0, max(count, 2))
    stiffening = response.stiffness_at(depth[kept]) * depth[kept] / force[kept]
    grows = force[kept] * depth[kept] / energy[kept]
    return (
        Curve(first, step, np.log(force[kept]), stiffening),
        Curve(first, step, np.log(energy[kept]), grows),
    )
