"""The fit's inertia and the one that the rig's probe found: two measurements of one thing."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.caveats import LONG_WINDOWS, OF_PROBE
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.result import FitResult, FittedParameter
from scissorcal.recording.probe import Estimate, newest_probe
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Check, Verdict

KG_MM2 = 1e6
NAME = "inertia"
INERTIA = Check(
    "fit.friction inertia",
    "that sweeps and the probe's pushes find one inertia: how far apart, in their sds",
    at_most=3.29,
)
"""Standard deviations by which two measurements of one inertia differ once in 1,000."""


def with_pushed_inertia(
    fit: FitResult,
    law: FrictionExperiment,
    recordings: tuple[Recording, ...],
    rng: np.random.Generator,
) -> FitResult:
    """The fit with the inertia of the probe's pushes where steps hide how sweeps swing.

    Pushes begin at rest and are as large as the encoder needs. Behind coarse steps the blades of a
    sweep swing by less than a step, and what moves them is taken for inertia: on 19 days on a rig
    of other construction with windows that much longer it came out up to 9.9 sds off, and that of
    the pushes at most 1.3. Predictions of the sweeps keep the sweeps' inertia.
    """
    pushed = hidden_from_sweeps(law, recordings)
    if pushed is None:
        return fit
    place = [one.name for one in fit.parameters].index(NAME)
    own = fit.parameters[place]
    sweeps = Estimate(own.mean, own.sd)
    spread = pushed.sd / pushed.mean
    draws = fit.draws.copy()
    draws[:, place] = pushed.mean * np.exp(spread * rng.standard_normal(len(draws)))
    point = fit.map_point.copy()
    point[place] = pushed.mean
    prior_sd = next(one.sd for one in law.layout.parameters if one.name == NAME)
    stated = replace(
        own,
        **FittedParameter.summary_of(draws[:, place]),
        identifiability=min(spread / prior_sd, 1.0),
        believed=True,
    )
    note = (
        f"Sweeps give an inertia of {_shown(sweeps)}, but the blades swing by less than an encoder "
        f"step there: the inertia is that of the probe's pushes, {_shown(pushed)}."
    )
    return replace(
        fit,
        parameters=(*fit.parameters[:place], stated, *fit.parameters[place + 1 :]),
        draws=draws,
        map_point=point,
        notes=(*fit.notes, note),
        diagnostics={**fit.diagnostics, OF_PROBE: True},
    )


def inertia_verdict(
    law: FrictionExperiment, draws: NDArray[np.float64], recordings: tuple[Recording, ...]
) -> Verdict | None:
    """Judge whether the inertia of sweeps is that of the newest probe's pushes.

    None without a probe, and where the fit takes the pushes' inertia. ``draws`` (k, p) are the
    posterior's, unconstrained.
    """
    pushed = _pushed(law, recordings)
    if pushed is None or hidden_from_sweeps(law, recordings):
        return None
    every = law.layout.natural(draws)["inertia"]
    swept = Estimate(float(every.mean()), float(every.std(ddof=1)))
    off = math.hypot(swept.sd / swept.mean, pushed.sd / pushed.mean)
    apart = abs(math.log(swept.mean / pushed.mean)) / off
    said = (
        f"Sweeps give an inertia of {_shown(swept)}, the probe's pushes {_shown(pushed)}: "
        f"{apart:.2g} standard deviations apart"
    )
    coarse = ", or the encoder's steps hide how these sweeps swing (add faster ones)"
    cure = (
        "something on the blades has changed since the probe, or the swings are not theirs alone"
        f"{coarse if law.windows.lengthening > 1.0 else ''}. Probe again, and capture anew"
    )
    return INERTIA.judge(apart, f"{said}.", f"{said}; {cure}.")


def hidden_from_sweeps(
    law: FrictionExperiment, recordings: tuple[Recording, ...]
) -> Estimate | None:
    """The pushes' inertia where sweeps do not show it; None where they do, or without a probe."""
    long = law.windows.lengthening >= LONG_WINDOWS
    return _pushed(law, recordings) if long else None


def _pushed(law: FrictionExperiment, recordings: tuple[Recording, ...]) -> Estimate | None:
    """The inertia of the newest probe's pushes; None without one, or of another joint."""
    probe = newest_probe(one.device for one in recordings)
    return probe.inertia_kg_m2 if probe and law.joint.kind == "rotary" else None


def _shown(inertia: Estimate) -> str:
    return f"{KG_MM2 * inertia.mean:.0f} +- {KG_MM2 * inertia.sd:.0f} kg mm^2"
