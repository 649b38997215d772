"""One probe of one random rig, and what it said."""

import math
from dataclasses import dataclass

from scissorcal.device import Operator, ProbeRefusedError, RigSession
from scissorcal.device.probe.probe import probe
from scissorcal.errors import DeviceError
from scissorcal.recipe import builtin_recipe
from scissorcal.recording import ProbeResult

from .link import RigLink
from .person import Person
from .rigs import RigParameters

NORMAL_90 = 1.645


@dataclass(frozen=True)
class Trial:
    """``outcome`` is "right", "named" or "not determined"; ``said`` the refusal.

    ``z`` is the error of ln inertia in standard deviations (NaN without an estimate), ``error`` its
    share. ``largest_rate`` (rad/s) is the truth while a motor was on, ``seconds`` virtual time.
    """

    seed: int
    outcome: str
    said: str
    z: float
    error: float
    largest_rate: float
    seconds: float
    stalls: bool

    @property
    def inside(self) -> bool:
        """Whether the inertia lies in its interval of 90 %."""
        return abs(self.z) <= NORMAL_90


def trial_of(
    rig: RigParameters, *, follows: bool = True, swaps: bool = False, clings: bool = False
) -> Trial:
    """Probe a rig with a person beside it."""
    said, result = "", None
    link = None
    try:
        link = RigLink(rig)
        person = Person(link, follows=follows, swaps=swaps, clings=clings)
        result = probe(RigSession(link, builtin_recipe("paper-80gsm"), Operator(person)))
    except ProbeRefusedError as refused:
        said = str(refused)
    except DeviceError as refused:
        said = str(refused)
    undetermined = said.startswith("Not determined")
    outcome = "right" if not said else "not determined" if undetermined else "named"
    z = error = math.nan
    if isinstance(result, ProbeResult) and result.inertia_kg_m2 is not None:
        found = result.inertia_kg_m2
        error = found.mean / rig.inertia - 1.0
        z = math.log(found.mean / rig.inertia) / (found.sd / found.mean)
    rate = link.largest_rate if link is not None else 0.0
    seconds = link.time_s if link is not None else 0.0
    return Trial(rig.seed, outcome, said, z, error, rate, seconds, rig.stalls_per_s > 0.0)
