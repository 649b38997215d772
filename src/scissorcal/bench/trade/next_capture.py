"""The next capture of a specimen, simulated from its fits, and what a setting gives on it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.fits import fit_case
from scissorcal.bench.trade.models import held_law, model_of_law, tables_of
from scissorcal.bench.trade.point import Error, NextCapture, Sample, Setting
from scissorcal.bench.trade.together import Together, expected_chain_s, rendered_torque
from scissorcal.bench.trade.torque import band_errors, fitted_torque, torque_errors
from scissorcal.calibration.parameters import Layout
from scissorcal.calibration.signals.zeros import without_zeros
from scissorcal.calibration.verify.simulator import cut_simulator, friction_simulator
from scissorcal.errors import MissingError

Record = Mapping[str, Any]

NEXT_CAPTURE = "next capture"
PRESENT_CHOICE = ("", "")
CAPTURES = 4
"""Captures that are simulated with the present settings, and as many with each that is recommended:
the limit of 90 % then lies 1.8 standard deviations above the mean, with two captures 3.8."""

FEWEST_CAPTURES = 2
"""One capture shows no scatter."""

CONFIDENCE = 0.9

BY_NAME = Layout(())
"""Truths are given by name, so that simulators need no layout of their coordinates."""

STREAM = 7
"""Random numbers of simulated captures are others than those of fits."""


class Recapture(Together):
    """The whole chain as in `Together`, on a capture that is simulated from the present fits.

    Repeat k is one and the same capture for all settings, so that settings compare in pairs.
    Errors are those of the tables' torque against the law that the capture is simulated of, and of
    the band against that of the present fits. The rig's probe and photographs are not taken anew.
    """

    name = NEXT_CAPTURE
    title = "The next capture, simulated from the fits"
    against = "the law that it is simulated of"

    def expected_s(self, case: Case, setting: Setting) -> float:
        """The fits as they are now, the simulation, and the package's law and tables."""
        return expected_chain_s(case)

    def repeats(self, case: Case, setting: Setting) -> int:
        """As many captures."""
        return CAPTURES

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Simulate a capture, and fit and compile it with this setting."""
        chosen, _ = self.prepared(recaptured(case, repeat), setting, repeat)
        cut, friction, costs, rejected = fit_case(chosen, repeat)
        known = fitted_torque(case, case.cut_fit, case.friction_fit)
        found = fitted_torque(chosen, cut, friction)
        if cut is not None:
            model = model_of_law(held_law(chosen, cut, friction))
            torque = rendered_torque(chosen, model, tables_of(chosen, model))
            found = replace(found, torque=np.asarray(torque, dtype=float))
        errors = {
            **torque_errors(case, found.torque, known.torque),
            **band_errors(case, found, known),
        }
        return Sample(costs, {n: e.share for n, e in errors.items()}, rejected=rejected)

    def errors(self, case: Case, sample: Sample, reference: Sample | None) -> Mapping[str, Error]:
        """Of torque and of its band, against the present fits, whatever the reference."""
        return {name: Error(share, "", share) for name, share in sample.outcome.items()}


def recaptured(case: Case, repeat: int) -> Case:
    """The case with recordings simulated from its fits: equal motion, other noise, other sheets.

    As `scissorcal verify` simulates them, of the law at the most probable point. Raises
    MissingError without a fit of friction.
    """
    if case.friction_fit is None:
        raise MissingError("There is no fit of friction, so no capture can be simulated.")
    rng = np.random.default_rng([case.seed, repeat, STREAM])
    settings, fit = case.recipe.fit.friction, case.friction_fit
    kind = case.friction[0].joint.kind
    unmeasured_sd = settings.priors.of(kind).zero(kind)
    still, zero = without_zeros(case.friction, unmeasured_sd)
    friction = friction_simulator(still, settings, fit, BY_NAME).recordings_of(fit.best, rng)
    if case.cut_fit is None:
        return replace(case, friction=friction)
    still, _ = without_zeros(case.cut, unmeasured_sd, zero) if zero else (case.cut, None)
    simulator = cut_simulator(still, case.recipe, fit, case.cut_fit, BY_NAME, case.edge)
    cut = simulator.recordings_of(case.cut_fit.best, rng)
    return replace(case, friction=friction, cut=cut)


def next_capture(present: Sequence[float], own: Sequence[float]) -> NextCapture:
    """What the next capture gives, by errors on equal simulated captures, shares (n,) by capture.

    ValueError where there are fewer than two, or not as many of each.

    >>> next_capture([0.01, 0.03], [0.02, 0.03]).captures
    2
    """
    larger = np.maximum(np.subtract(own, present), 0.0)
    return NextCapture(len(larger), upper_limit(own), upper_limit(larger))


def by_choice(records: Sequence[Record], error: str) -> dict[tuple[str, str], dict[int, float]]:
    """Error of this name by simulated capture, of each choice (knob, label) that was tried.

    ``("", "")`` stands for the present settings. Records of other measurements are passed over.
    """
    found: dict[tuple[str, str], dict[int, float]] = {}
    for record in records:
        if record["knob"] == NEXT_CAPTURE and "failed" not in record:
            chosen = [(knob, label) for knob, label in record["choices"]] or [PRESENT_CHOICE]
            shares = found.setdefault(chosen[0], {})
            shares[int(record["repeat"])] = float(record["outcome"][error])
    return found


def upper_limit(values: Sequence[float] | NDArray[np.float64]) -> float:
    """What the next of some values (n,) does not exceed, with a confidence of 90 %.

    The one-sided prediction limit of a normal distribution, mean + t sqrt(1 + 1/n) s with n - 1
    degrees of freedom (Hahn 1970, doi:10.1080/00224065.1970.11980425). ValueError for fewer than 2.

    >>> round(upper_limit([1.0, 2.0, 3.0]), 3)
    4.177
    """
    if len(values) < FEWEST_CAPTURES:
        raise ValueError("One value shows no scatter.")
    count = len(values)
    factor = float(stdtrit(count - 1, CONFIDENCE)) * np.sqrt(1.0 + 1.0 / count)
    return float(np.mean(values) + factor * np.std(values, ddof=1))
