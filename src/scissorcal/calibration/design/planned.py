"""Captures that were not taken yet: planned motion as a fit would see it, without noise."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.cut.known import CutBasis
from scissorcal.calibration.cut.laws import CutLaw
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.calibration.cut.path_motion import path_motion
from scissorcal.calibration.cut.scout import guess_at, make_experiment
from scissorcal.calibration.cut.segments import cut_into_segments
from scissorcal.calibration.friction.layout import LawChoice
from scissorcal.calibration.friction.model import FrictionExperiment, design
from scissorcal.calibration.parameters import Layout
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.calibration.signals.weak_form import weigh
from scissorcal.calibration.verify.simulated_motion import Motion, SmoothPiece
from scissorcal.calibration.verify.simulated_recordings import (
    cut_truth,
    friction_truth,
    simulate_cut,
    simulate_friction,
)
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording.recording import SAMPLE_DTYPE, Joint, Recording, Stroke

QUIET = TorqueNoise(0.0, 0.0, 0.01)


@dataclass(frozen=True)
class PlannedMotion:
    """A planned motion without a pause, by tick (n,): rad, m, stroke's index and sheet (-1: none).

    ``opening_step`` (rad) and ``advance_step`` (m) are the encoders'.
    """

    opening: Array
    advance: Array
    stroke: Integers
    sheet: Integers
    strokes: tuple[Stroke, ...]
    tick_s: float
    opening_step: float
    advance_step: float


def planned_friction(
    motion: PlannedMotion,
    settings: FitFriction,
    structure: Mapping[str, Any],
    layout: Layout,
    point: Array,
    zero_sd: float | None,
) -> FrictionExperiment:
    """The design of a fit to empty strokes that move as planned; its law is ``structure``'s.

    ``point`` (p,) are unconstrained parameters of ``layout``, which the fit's design has too;
    ``zero_sd`` (N m) is how well the sensors' zeros will be known.
    """
    values = {name: float(value) for name, value in layout.natural(point).items()}
    truth = friction_truth(values, structure, QUIET)
    recordings = simulate_friction((_motion(motion, "friction"),), truth, np.random.default_rng(0))
    whole = weigh(recordings, settings.cutoff_Hz)
    windows = whole.where(whole.bins.moving & (whole.bins.stroke >= 0))
    strokes, choice = windows.bins.stroke.astype(np.int64), LawChoice.of(structure, zero_sd)
    law = design(windows, strokes, choice, Joint("rotary"), settings.priors)
    return replace(law, layout=layout, key={**law.key, "angle_center": structure["angle_center"]})


def planned_cut(
    motion: PlannedMotion,
    basis: CutBasis,
    law: CutLaw,
    structure: Mapping[str, Any],
    layout: Layout,
    point: Array,
) -> CutExperiment | None:
    """The design of a fit to strokes through material that move as planned.

    The crack is walked exactly along the motion with the parameters ``point`` (p,), through even
    sheets. None where the fit would find no stroke that unloads the material.
    """
    values = {name: float(value) for name, value in layout.natural(point).items()}
    even = {**values, "variation": 0.0, "sheet_variation": 0.0}
    known = basis.friction
    truth = cut_truth(even, structure, replace(known, noise=QUIET, stroke_sd=0.0), motion.tick_s)
    recordings = simulate_cut((_motion(motion, "cut"),), truth, np.random.default_rng(0))
    motions = path_motion(recordings, known.inertia)
    guess, cuts = guess_at(structure, values), basis.recipe.scene.cut
    segments = cut_into_segments(basis.data(motions), basis.geometry, guess, cuts)
    if not segments.pieces:
        return None
    return make_experiment(segments, basis, law, values)


def _motion(planned: PlannedMotion, kind: str) -> Motion:
    """The motion as the simulation of recordings takes it, over samples without a torque yet."""
    count = len(planned.opening)
    samples = np.zeros(count, SAMPLE_DTYPE)
    samples["sequence"] = np.arange(count)
    samples["device_time_us"] = np.rint(1e6 * planned.tick_s * np.arange(count))
    samples["opening"], samples["advance"] = planned.opening, planned.advance
    samples["torque_command"] = 1e-3 * np.sign(np.arange(count) % 2 - 0.5)
    samples["stroke"] = planned.stroke
    recording = Recording(
        kind="cut" if kind == "cut" else "friction",
        samples=samples,
        strokes=planned.strokes,
        joint=Joint("rotary"),
        source="planned capture",
    )
    piece = SmoothPiece(
        start=0,
        opening=planned.opening,
        advance=planned.advance,
        load=np.zeros(count),
        stroke=np.zeros(count, dtype=np.int64),
        sheet=planned.sheet,
        tick_s=planned.tick_s,
        error=0.0,
        held=True,
    )
    recorded = np.ones(count, dtype=bool)
    steps = planned.opening_step, planned.advance_step, float("nan")
    return Motion(recording, recorded, (piece,), *steps)
