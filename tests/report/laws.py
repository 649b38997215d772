"""Fits whose law is known: parameters at a truth, series from it, nothing inferred."""

from dataclasses import replace
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration import FitResult, FitSeries, FittedParameter
from scissorcal.recording import Recording
from tests.calibration.truth import Truth
from tests.report.fits import cut_fit, friction_fit

SPREAD = 0.01
DRAWS = 120


def known_cut(truth: Truth, recording: Recording | None = None, seed: int = 5) -> FitResult:
    """A cut's fit with draws one percent around the truth; its series is left to the caller."""
    values = {
        "response_force": truth.force,
        "response_exponent": truth.exponent,
        "fracture_energy": truth.fracture_energy,
    }
    structure = {
        "response": "power",
        "fracture": "smooth",
        "closure": "work",
        "reference_indentation_m": truth.reference,
        "moving_blades": 2,
        "upper_face_m": truth.upper_face,
        "edge": {
            "family": "line",
            "offset_m": truth.edge_offset,
            "taper_rad": truth.taper,
            "length_m": 0.075,
            "curvature_per_m": 0.0,
        },
    }
    return _known(cut_fit(), values, structure, recording, seed)


def known_friction(truth: Truth, recording: Recording | None = None, seed: int = 6) -> FitResult:
    """A friction fit with draws one percent around the truth."""
    values = {
        "inertia": truth.inertia,
        "coulomb_pos": truth.coulomb_pos,
        "coulomb_neg": truth.coulomb_neg,
        "viscous": truth.viscous,
    }
    structure = {"law": "coulomb+viscous", "symmetric": False, "angle_center": 0.54}
    return _known(friction_fit(), values, structure, recording, seed)


def _normal(name: str, value: float) -> FittedParameter:
    sd = SPREAD * abs(value)
    return FittedParameter(name, "1", value, sd, value - 1.645 * sd, value, value + 1.645 * sd, 0.1)


def _known(
    fit: FitResult,
    values: dict[str, float],
    structure: dict[str, Any],
    recording: Recording | None,
    seed: int,
) -> FitResult:
    point = np.array(list(values.values()))
    rng = np.random.default_rng(seed)
    draws = point * (1.0 + SPREAD * rng.normal(size=(DRAWS, len(point))))
    parameters = tuple(_normal(name, value) for name, value in values.items())
    sources = fit.sources
    if recording is not None:
        sources = (f"{recording.source} sha256:{recording.content_hash}",)
    diagnostics = {**fit.diagnostics, "residual_rms": 1e-3, "independent_share": 0.1}
    return replace(
        fit,
        parameters=parameters,
        draws=draws,
        map_point=point,
        structure=structure,
        sources=sources,
        diagnostics=diagnostics,
        candidates=(),
    )


def strokes_along_edge(
    fit: FitResult, ratio: Array, strokes: int, rng: np.random.Generator
) -> FitResult:
    """The fit with strokes that sweep its edge; ``ratio`` (n,) is measured over modelled force.

    Samples of a stroke share an error of 2 %, so that only strokes are independent.
    """
    edge = fit.structure["edge"]
    station = np.linspace(0.016, 0.064, len(ratio))
    opening = np.linspace(0.85, 0.25, len(ratio))
    beta = opening / 2
    height = edge["offset_m"] + station * np.tan(edge["taper_rad"])
    contact = station * np.cos(beta) - height * np.sin(beta)
    torque = 0.02 + 0.5 * station
    n = len(ratio) * strokes
    label = np.repeat(np.arange(strokes), len(ratio))
    shared = np.repeat(1.0 + 0.02 * rng.normal(size=strokes), len(ratio))
    scatter = 1.0 + 0.03 * rng.normal(size=n)
    predicted = np.tile(torque, strokes)
    series = FitSeries(
        time_s=np.arange(n) * 0.005,
        recording=np.zeros(n, np.int64),
        stroke=label,
        opening=np.tile(opening, strokes),
        opening_rate=np.full(n, -0.25),
        contact=np.tile(contact, strokes),
        measured=predicted * np.tile(ratio, strokes) * shared * scatter,
        predicted=predicted,
        band_low=0.98 * predicted,
        band_high=1.02 * predicted,
    )
    return replace(fit, series=series, held_out=())
