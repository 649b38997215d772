"""The fit's inertia beside what the rig's probe found: two measurements of one thing."""

import math

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.recording.probe import Estimate, newest_probe
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Verdict, judge

APART = 3.29
"""Standard deviations by which two measurements of one inertia differ once in 1,000."""
KG_MM2 = 1e6


def inertia_verdict(
    law: FrictionExperiment, draws: NDArray[np.float64], recordings: tuple[Recording, ...]
) -> Verdict | None:
    """Judge whether the inertia of sweeps is that of the newest probe's pushes; None without one.

    Pushes begin at rest and are as large as the encoder needs. Where sweeps are slow and steps are
    coarse, blades swing by less than a step: what moves them is then taken for inertia. ``draws``
    (k, p) are the posterior's, unconstrained.
    """
    probe = newest_probe(one.device for one in recordings)
    pushed = probe.inertia_kg_m2 if probe else None
    if pushed is None or law.joint.kind != "rotary":
        return None
    every = law.layout.natural(draws)["inertia"]
    swept = Estimate(float(every.mean()), float(every.std(ddof=1)))
    off = math.hypot(swept.sd / swept.mean, pushed.sd / pushed.mean)
    apart = abs(math.log(swept.mean / pushed.mean)) / off
    said = (
        f"Sweeps give an inertia of {_shown(swept)}, the probe's pushes {_shown(pushed)}: "
        f"{apart:.2g} standard deviations apart"
    )
    coarse = (
        "the encoder's steps hide how these sweeps swing. Add faster sweeps "
        "(capture.friction.speeds_rad_per_s), or use a finer encoder"
    )
    changed = (
        "something on the blades has changed since the probe, or the swings are not theirs alone. "
        "Probe again, and capture anew"
    )
    cure = coarse if law.windows.lengthening > 1.0 else changed
    good, bad = f"{said}.", f"{said}; {cure}."
    return judge("fit.friction", "inertia", apart, APART, good, bad)


def _shown(inertia: Estimate) -> str:
    return f"{KG_MM2 * inertia.mean:.0f} +- {KG_MM2 * inertia.sd:.0f} kg mm^2"
