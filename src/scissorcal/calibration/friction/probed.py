"""What a probe of the rig shows beside sweeps: slow friction, and inertia by pushes.

Sweeps are no slower than an encoder lets a loop make them. Below, a law's rise towards rest is
extrapolated: behind 8,192 counts a turn, 0.2 mN m that a law lacked at 0.28 rad/s became 75 mN m of
static friction where there were 5. Pushes of a probe begin at rest, and its law has the same rise.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.caveats import LONG_WINDOWS, OF_PROBE
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.parameters import FittedParameter
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.inference import Posterior
from scissorcal.model.friction_terms import PARAMETERS, side_of
from scissorcal.recipe.priors import LogNormalPrior
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording import probe as probes
from scissorcal.recording.probe import Estimate, newest_probe
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Check, Verdict

FOUND = {"stribeck": "log_rise_share", "stribeck_rate": "log_rise_rate"}
"""Parameters of the law by the names of the probe's; the first is a share of Coulomb friction."""
LEFT_OUT = 0.5
"""Error of either logarithm by what the probe's law lacks. With it, errors of level and rate are
1.1 and 1.0 of their sd (rms) on the 14 of 24 random rigs (63000 to 63023) whose probe tells them.
"""
DETERMINED_SD = 0.5
"""Sd of either logarithm up to which pushes determine it: the probe's priors have 1.0 and 0.7."""
HELD_FALL = 2.0
"""Of a static friction 0.3 above Coulomb's, e^-2 is 4 %: as much as laws are off by on strokes that
they had not seen (2 to 4 %)."""
PROPOSALS = 50
"""For each draw: enough that some lie within what the law lacks, where one in ten does."""


@dataclass(frozen=True)
class SlowFriction:
    """The probe's logarithms of level and speed of Stribeck friction, with ``covariance`` (2, 2).

    The level is a share of Coulomb friction. ``held`` says that the slowest sweep, at ``slowest``,
    shows less than e^-2 of the rise: then draws keep to what the probe found (a cut posterior,
    Plummer 2015, doi:10.1007/s11222-014-9503-z), which what the law lacks there would overrule.
    """

    mean: tuple[float, float]
    covariance: Array
    slowest: float

    @classmethod
    def of(
        cls, recordings: tuple[Recording, ...], bins: Bins, settings: FitFriction
    ) -> "SlowFriction | None":
        """That of the newest probe among the recordings'.

        None without one, for a linear joint, where its pushes did not tell both values, and where a
        recipe states a prior of either.
        """
        probe = probes.newest_probe(recording.device for recording in recordings)
        found = probe.posterior if probe else None
        stated = settings.priors.rotary.model_fields_set & {_key(name) for name in FOUND}
        complete = found is not None and set(FOUND.values()) <= set(found.names)
        if found is None or not complete or stated or recordings[0].joint.kind != "rotary":
            return None
        at = [found.names.index(name) for name in FOUND.values()]
        covariance = np.array(found.covariance)[np.ix_(at, at)]
        if np.any(np.sqrt(np.diag(covariance)) > DETERMINED_SD):
            return None
        covariance = covariance + LEFT_OUT**2 * np.eye(2)
        return cls((found.mean[at[0]], found.mean[at[1]]), covariance, bins.slowest_rate)

    @property
    def held(self) -> bool:
        return self.slowest > math.sqrt(HELD_FALL) * math.exp(self.mean[1])

    def sd(self, place: int) -> float:
        """Sd of either logarithm."""
        return math.sqrt(self.covariance[place, place])


def with_probed(settings: FitFriction, slow: SlowFriction | None) -> FitFriction:
    """Settings whose priors of slow friction are what the probe found."""
    if slow is None:
        return settings
    priors, changed = settings.priors.rotary, {}
    for place, name in enumerate(FOUND):
        median, own = math.exp(slow.mean[place]), PARAMETERS[name].prior
        if own is not None and own.beside:
            median *= getattr(priors, _key(own.beside)).median
        width = math.exp(probes.NORMAL_90 * slow.sd(place))
        changed[_key(name)] = LogNormalPrior(median=median, factor_90=width)
    rotary = priors.model_copy(update=changed)
    joints = settings.priors.model_copy(update={"rotary": rotary})
    return settings.model_copy(update={"priors": joints})


def opened(
    posterior: Posterior,
    law: FrictionExperiment,
    slow: SlowFriction | None,
    lacking: float,
    rng: np.random.Generator,
) -> Posterior:
    """The posterior with slow friction as wide as the probe knows it, where sweeps do not show it.

    Each draw gets a level and a speed of the probe's, weighed by how little they change friction at
    the slowest sweep: by ``lacking`` (N m), the error of the law on strokes that it had not seen.
    """
    names = law.layout.names
    if slow is None or not slow.held or not set(FOUND) <= set(names):
        return posterior
    level, rate = (names.index(name) for name in FOUND)
    coulomb = [place for place, name in enumerate(names) if side_of(name, ("coulomb",))]
    draws = posterior.draws.copy()
    size = (len(draws), PROPOSALS)
    tried = rng.multivariate_normal(np.array(slow.mean), slow.covariance, size)
    levels = tried[..., 0] + draws[:, coulomb].mean(axis=1)[:, None]

    def seen(log_level: Array, log_rate: Array) -> Array:
        return np.asarray(np.exp(log_level - np.exp(2.0 * (math.log(slow.slowest) - log_rate))))

    change = seen(levels, tried[..., 1]) - seen(draws[:, [level]], draws[:, [rate]])
    height = -0.5 * (change / lacking) ** 2
    height += rng.gumbel(size=size)  # the largest is a draw by weight
    chosen = np.argmax(height, axis=1)[:, None]
    draws[:, level] = np.take_along_axis(levels, chosen, 1)[:, 0]
    draws[:, rate] = np.take_along_axis(tried[..., 1], chosen, 1)[:, 0]
    return replace(posterior, draws=draws)


def _key(name: str) -> str:
    return PARAMETERS[name].prior_key("rotary")


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
    place = [parameter.name for parameter in fit.parameters].index(NAME)
    own = fit.parameters[place]
    sweeps = Estimate(own.mean, own.sd)
    spread = pushed.sd / pushed.mean
    draws = fit.draws.copy()
    draws[:, place] = pushed.mean * np.exp(spread * rng.standard_normal(len(draws)))
    point = fit.map_point.copy()
    point[place] = pushed.mean
    prior_sd = next(parameter.sd for parameter in law.layout.parameters if parameter.name == NAME)
    stated = replace(
        own,
        **FittedParameter.summary_of(draws[:, place]),
        identifiability=min(spread / prior_sd, 1.0),
        measured_prior=True,
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
    probe = newest_probe(recording.device for recording in recordings)
    return probe.inertia_kg_m2 if probe and law.joint.kind == "rotary" else None


def _shown(inertia: Estimate) -> str:
    return f"{KG_MM2 * inertia.mean:.0f} +- {KG_MM2 * inertia.sd:.0f} kg mm^2"
