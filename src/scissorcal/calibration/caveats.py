"""Parameters whose intervals are known to be poorly calibrated for a kind of data: one table.

A row stands for a coverage that was measured on rigs with known truth (docs/uncertainty.md), or for
a parameter that data of the kind cannot identify. A measured improvement removes its row. What no
interval holds, by how much one more recording would differ, stands beside each.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from scissorcal.calibration.parameters import FittedParameter
from scissorcal.calibration.result import FitResult

FEW_COUNTS = 1.0
"""Encoder counts per sample of a closing stroke (median) below which an encoder is coarse."""

LONG_WINDOWS = 2.0
"""Lengthening of friction's windows from which sweeps do not show the inertia. Where a probe found
it, the fit takes it from there, and ``OF_PROBE`` stands in its diagnostics."""
OF_PROBE = "inertia_of_probe"

NEXT_RECORDING = "next_recording_sd"
"""Diagnostic of fits of several recordings: sd between recordings by parameter, in its unit."""
ON_RECORD = "next_recording_sd_on_record"
"""The same of an earlier fit of several recordings, beside a fit of one."""
STEP_VERSION = "step_version"
"""Diagnostic: the version of the step that made a fit, so that a later one does not build on it."""
COLUMN = "sd, next recording"
NOT_KNOWN = "not known"
ONE_RECORDING = (
    "One recording does not show how far the next would differ, and the intervals do not include "
    "it: masses from two recordings of one positioning system (EMPS) were five standard deviations "
    "apart. Record again after a new set-up."
)
EARLIER = (
    "The intervals are of one recording; a second may differ by more, as earlier fits of several "
    f"recordings found ({COLUMN})."
)

RESPONSE = ("response_force", "response_exponent")


@dataclass(frozen=True)
class Caveat:
    """Why the intervals of ``parameters`` are poorly calibrated, and the remedy."""

    parameters: tuple[str, ...]
    sentence: str


def caveats_of(fit: FitResult) -> tuple[Caveat, ...]:
    """The rows of the table that hold for a fit, with the parameters that they concern."""
    names = [parameter.name for parameter in (*fit.parameters, *fit.derived)]
    caveats = []
    for holds, parameters, sentence in _ROWS:
        concerned = tuple(name for name in names if _concerns(parameters, name))
        if concerned and holds(fit):
            caveats.append(Caveat(concerned, sentence(fit)))
    return tuple(caveats)


def caveats_by_parameter(fit: FitResult) -> Mapping[str, tuple[str, ...]]:
    """The sentences by parameter, for those that have one."""
    sentences: dict[str, tuple[str, ...]] = {}
    for caveat in caveats_of(fit):
        for name in caveat.parameters:
            sentences[name] = (*sentences.get(name, ()), caveat.sentence)
    return sentences


def next_recording_sd(fit: FitResult, parameter: FittedParameter) -> float | None:
    """Standard deviation, in the parameter's unit, by which single recordings differ from the fit.

    By the recordings of the fit, else by those of an earlier one; None where neither shows it.
    """
    known = fit.diagnostics
    scatter = known.get(NEXT_RECORDING) or known.get(ON_RECORD) or {}
    sd = scatter.get(parameter.name)
    return None if sd is None else float(sd)


def next_recording_words(fit: FitResult, parameter: FittedParameter) -> str:
    """The same for a table: in brackets by an earlier fit, or that it is not known."""
    sd = next_recording_sd(fit, parameter)
    if sd is None:
        return NOT_KNOWN
    return f"{sd:.2g}" if fit.diagnostics.get(NEXT_RECORDING) else f"({sd:.2g})"


def next_recording_sentence(fit: FitResult) -> str:
    """What stands below the table of parameters; empty where the recordings show the size."""
    if fit.diagnostics.get(NEXT_RECORDING):
        return ""
    return EARLIER if fit.diagnostics.get(ON_RECORD) else ONE_RECORDING


def _concerns(parameters: tuple[str, ...], name: str) -> bool:
    return any(
        name == parameter or (parameter.endswith("*") and name.startswith(parameter[:-1]))
        for parameter in parameters
    )


def _number(fit: FitResult, name: str) -> float | None:
    value: Any = fit.diagnostics.get(name)
    return float(value) if isinstance(value, (int, float)) else None


def _coarse(fit: FitResult) -> bool:
    counts = _number(fit, "counts_per_sample")
    return counts is not None and counts < FEW_COUNTS


def _coarse_words(fit: FitResult) -> str:
    counts = fit.diagnostics["counts_per_sample"]
    return (
        f"{counts:.2g} encoder counts per sample are few: on 31 simulated days with fewer than 1, "
        "the 90 % intervals contained force and exponent 27 times each, fracture energy 28 and "
        "kappa 29 times. Use a finer encoder."
    )


def _long_windows(fit: FitResult) -> bool:
    if fit.what == "cut" or fit.diagnostics.get(OF_PROBE):
        return False
    return (_number(fit, "window_lengthening") or 1.0) >= LONG_WINDOWS


def _long_windows_words(fit: FitResult) -> str:
    times = float(fit.diagnostics["window_lengthening"])
    return (
        f"The windows are {times:.2g} times longer because the encoder is coarse: on 20 simulated "
        "days with such windows, the 90 % intervals contained the inertia 10 times, which was 2 % "
        "low. Use a finer encoder, or probe the rig before the capture."
    )


def _no_line(fit: FitResult) -> bool:
    return fit.structure.get("fracture") == "rippled" and fit.diagnostics.get("teeth_line") is False


def _no_line_words(_: FitResult) -> str:
    return (
        "No spectral line of the teeth was accepted, so kappa stays near its prior and is "
        "correlated with the fracture energy. Capture slower strokes, at two or more speeds."
    )


def _spline_words(fit: FitResult) -> str:
    deepest = 1e3 * float(max(fit.structure["response_knots_m"]))
    return (
        f"{deepest:.2g} mm is the deepest indentation in the data: beyond it the spline "
        "extrapolates, and its band is too narrow. Press as deep as the scene does."
    )


_ROWS: tuple[
    tuple[Callable[[FitResult], bool], tuple[str, ...], Callable[[FitResult], str]], ...
] = (
    (_coarse, (*RESPONSE, "fracture_energy", "toughness", "kappa"), _coarse_words),
    (_long_windows, ("inertia",), _long_windows_words),
    (_no_line, ("kappa", "fracture_energy", "toughness"), _no_line_words),
    (lambda fit: fit.structure.get("response") == "spline", ("response_*",), _spline_words),
)
"""Of each kind of data: when a fit is of it, which parameters it concerns, the sentence."""
