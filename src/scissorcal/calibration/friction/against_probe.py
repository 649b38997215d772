"""The fit's inertia and the one that the rig's probe found: two measurements of one thing."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.caveats import LONG_WINDOWS
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.inference.posterior import Posterior
from scissorcal.recording.probe import Estimate, newest_probe
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Verdict, judge

APART = 3.29
"""Standard deviations by which two measurements of one inertia differ once in 1,000."""
KG_MM2 = 1e6
NAME = "inertia"


def with_pushed_inertia(
    posterior: Posterior,
    law: FrictionExperiment,
    recordings: tuple[Recording, ...],
    rng: np.random.Generator,
) -> tuple[Posterior, str]:
    """The posterior with the inertia of the probe's pushes where steps hide how sweeps swing.

    Pushes begin at rest and are as large as the encoder needs. Behind coarse steps the blades of a
    sweep swing by less than a step, and what moves them is taken for inertia: on 19 days on a rig
    of other construction with windows that much longer it came out up to 9.9 sds off, and that of
    the pushes at most 1.3. The second value is a note on it, empty where nothing is replaced.
    """
    pushed = _pushed(law, recordings)
    if pushed is None or law.windows.lengthening < LONG_WINDOWS:
        return posterior, ""
    place = law.layout.names.index(NAME)
    transform = law.layout.parameters[place].transform
    spread = pushed.sd / pushed.mean
    draws = posterior.draws.copy()
    draws[:, place] = transform.unconstrained(
        pushed.mean * np.exp(spread * rng.standard_normal(len(draws)))
    )
    note = (
        f"The inertia is that of the probe's pushes, {_shown(pushed)}: the encoder's steps hide "
        f"how sweeps swing, which would give {_shown(_swept(law, posterior.draws))}."
    )
    return replace(posterior, draws=draws), note


def inertia_verdict(
    law: FrictionExperiment, draws: NDArray[np.float64], recordings: tuple[Recording, ...]
) -> Verdict | None:
    """Judge whether the inertia of sweeps is that of the newest probe's pushes.

    None without a probe, and where the pushes' stands in the place of the sweeps'. ``draws`` (k, p)
    are the posterior's, unconstrained.
    """
    pushed = _pushed(law, recordings)
    if pushed is None or law.windows.lengthening >= LONG_WINDOWS:
        return None
    swept = _swept(law, draws)
    off = math.hypot(swept.sd / swept.mean, pushed.sd / pushed.mean)
    apart = abs(math.log(swept.mean / pushed.mean)) / off
    said = (
        f"Sweeps give an inertia of {_shown(swept)}, the probe's pushes {_shown(pushed)}: "
        f"{apart:.2g} standard deviations apart"
    )
    cure = (
        "something on the blades has changed since the probe, or the swings are not theirs alone. "
        "Probe again, and capture anew"
    )
    return judge("fit.friction", NAME, apart, APART, f"{said}.", f"{said}; {cure}.")


def _pushed(law: FrictionExperiment, recordings: tuple[Recording, ...]) -> Estimate | None:
    """The inertia of the newest probe's pushes; None without one, or of another joint."""
    probe = newest_probe(one.device for one in recordings)
    return probe.inertia_kg_m2 if probe and law.joint.kind == "rotary" else None


def _swept(law: FrictionExperiment, draws: NDArray[np.float64]) -> Estimate:
    every = law.layout.natural(draws)[NAME]
    return Estimate(float(every.mean()), float(every.std(ddof=1)))


def _shown(inertia: Estimate) -> str:
    return f"{KG_MM2 * inertia.mean:.0f} +- {KG_MM2 * inertia.sd:.0f} kg mm^2"
