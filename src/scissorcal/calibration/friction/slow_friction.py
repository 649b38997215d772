"""What a rig's probe found of slow friction, as the prior of a fit to sweeps.

Sweeps are no slower than an encoder lets a loop make them. Below, a law's rise towards rest is
extrapolated: behind 8,192 counts a turn, 0.2 mN m that a law lacked at 0.28 rad/s became 75 mN m of
static friction where there were 5. Pushes of a probe begin at rest, and its law has the same rise.
"""

import math

from scissorcal.model.friction_terms import PARAMETERS
from scissorcal.recipe.priors import FrictionPriors, LogNormalPrior
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording.probe import Posterior, probe_of
from scissorcal.recording.recording import Recording

FOUND = {"stribeck": "log_rise_share", "stribeck_rate": "log_rise_rate"}
"""Parameters of the law by the names of the probe's; the first is a share of Coulomb friction."""
LEFT_OUT = 0.5
"""Error of either logarithm by what the probe's law lacks. With it, errors of level and rate are
1.1 and 1.0 of their sd (rms) on the 14 of 24 random rigs (63000 to 63023) whose probe tells them.
"""
QUANTILE_90 = 1.645


def with_probed(settings: FitFriction, recordings: tuple[Recording, ...]) -> FitFriction:
    """Settings whose priors of slow friction are what the recordings' probe found, if it did.

    A prior that a recipe states stays, and so does one that is narrower than what was found.
    """
    found = next((one for one in map(_posterior, recordings) if one is not None), None)
    if found is None or recordings[0].joint.kind != "rotary":
        return settings
    priors = settings.priors.rotary
    changed = {}
    for name, probed in FOUND.items():
        place, key = found.names.index(probed), _key(name)
        sd = math.hypot(math.sqrt(found.covariance[place][place]), LEFT_OUT)
        if key in priors.model_fields_set or sd >= _sd(priors, key):
            continue
        median = math.exp(found.mean[place])
        own = PARAMETERS[name].prior
        if own is not None and own.beside:
            median *= getattr(priors, _key(own.beside)).median
        changed[key] = LogNormalPrior(median=median, factor_90=math.exp(QUANTILE_90 * sd))
    rotary = priors.model_copy(update=changed)
    joints = settings.priors.model_copy(update={"rotary": rotary})
    return settings.model_copy(update={"priors": joints})


def _posterior(recording: Recording) -> Posterior | None:
    probe = probe_of(recording.device)
    if probe is None or probe.posterior is None:
        return None
    return probe.posterior if set(FOUND.values()) <= set(probe.posterior.names) else None


def _key(name: str) -> str:
    return PARAMETERS[name].prior_key("rotary")


def _sd(priors: FrictionPriors, key: str) -> float:
    stated: LogNormalPrior = getattr(priors, key)
    return stated.normal()[1]
