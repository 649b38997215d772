"""What the probe of a rig found before its motors ran: zeros, delay, inertia, friction.

It stands here, and not with the probe, because it travels in recordings: a fit reads it there.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from datetime import datetime
from typing import Any, Literal

from scissorcal.verdicts import Verdict

FORMAT: Literal["scissorcal-probe/1"] = "scissorcal-probe/1"
PROBE_KEY = "probe"
"""The entry of a recording's ``device`` that holds the probe."""

NORMAL_90 = 1.6448536269514722
"""Half the width of an interval of 90 % of a normal distribution, in standard deviations."""

ESTIMATES = (
    ("torque zero", "torque_zero_Nm", 1e3, "mN m"),
    ("force zero", "force_zero_N", 1.0, "N"),
    ("delay", "delay_s", 1e3, "ms"),
    ("measured over commanded torque", "torque_gain", 1.0, ""),
    ("inertia", "inertia_kg_m2", 1e6, "kg mm^2"),
    ("dry friction", "coulomb_Nm", 1e3, "mN m"),
    ("viscous friction", "viscous_Nm_s_per_rad", 1e3, "mN m s/rad"),
)
"""Estimates of a probe as people read them: name, field, factor to the unit, unit."""

FACTS = (
    ("breakaway", "breakaway_Nm", 1e3, "mN m"),
    ("encoder step", "encoder_step_rad", 1e6, "urad"),
    ("command to flag", "command_lag_ticks", 1.0, "ticks"),
    ("torque noise (sd)", "torque_noise_Nm", 1e3, "mN m"),
    ("force noise (sd)", "force_noise_N", 1.0, "N"),
    ("largest torque used", "largest_torque_Nm", 1e3, "mN m"),
    ("largest rate seen", "largest_rate_rad_per_s", 1.0, "rad/s"),
)
"""Facts of a probe that people ask for, in the same way."""


@dataclass(frozen=True)
class Estimate:
    """Mean and standard deviation of a posterior that is close to normal.

    >>> Estimate(0.02, 0.001).interval
    (0.01835514637304853, 0.021644853626951472)
    """

    mean: float
    sd: float

    @property
    def interval(self) -> tuple[float, float]:
        """Interval of 90 %."""
        return self.mean - NORMAL_90 * self.sd, self.mean + NORMAL_90 * self.sd


@dataclass(frozen=True)
class RestFacts:
    """What the watches need to know of a rig: above all, blades at rest from a stuck encoder.

    ``handle_zero_N`` is what the force sensor shows without a hand, 0 where nobody measured it;
    ``breakaway_Nm`` the least torque that moves the blades, None where nobody found it;
    ``torque_noise_Nm`` and ``force_noise_N`` are standard deviations. ``jitters``: the encoder's
    readings are noisy enough never to stay the same. ``inertia_kg_m2`` and ``delay_s``, until a
    command acts, tell a swing that the loop drives from one that a cut's teeth do; None where
    nobody measured them.
    """

    handle_zero_N: float = 0.0
    breakaway_Nm: float | None = None
    torque_noise_Nm: float = 0.0
    force_noise_N: float = 0.0
    jitters: bool = False
    inertia_kg_m2: float | None = None
    delay_s: float | None = None


UNKNOWN_REST = RestFacts()
"""Of a rig that nobody probed."""


@dataclass(frozen=True)
class Posterior:
    """What the pushes say of the joint: close to normal in ``names``, with ``covariance`` (n, n).

    docs/files.md explains the names.
    """

    names: tuple[str, ...]
    mean: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Swing:
    """A push of ``torque_Nm`` as the encoder showed it, and as the fitted joint goes, all (n,).

    ``times_s`` and places count from where the push began.
    """

    torque_Nm: float
    times_s: tuple[float, ...]
    places_rad: tuple[float, ...]
    model_rad: tuple[float, ...]


@dataclass(frozen=True)
class ProbeResult:
    """What a probe found; an estimate is None where the device or the motion did not show it.

    ``device`` names the rig, ``identity`` is the digest of all that it states, ``made_at`` the time
    (UTC, ISO 8601). ``motor_sign`` is the recipe's: estimates are of corrected signs.

    ``torque_zero_Nm`` and ``force_zero_N`` are what the sensors show with motors off and nobody at
    the handles. ``delay_s``: from a measurement to the action of the torque that answers it,
    through line, host and motor, as far as `motor_torque` and the device's flags show it.
    ``torque_gain``: measured over commanded torque. ``coulomb_Nm`` is the dry friction that the
    longest push met, the mean of both directions; it, ``viscous_Nm_s_per_rad`` and
    ``inertia_kg_m2`` are of small motions: rough, not what a friction fit gives. ``posterior`` is
    what the pushes say of the joint (docs/files.md; estimates have besides what its law leaves
    out), ``swings`` are the strongest pushes beside the model.

    ``facts`` are plain numbers by name, with their unit in it.
    """

    device: str
    identity: str
    made_at: str
    motor_sign: int = 1
    torque_zero_Nm: Estimate | None = None
    force_zero_N: Estimate | None = None
    delay_s: Estimate | None = None
    torque_gain: Estimate | None = None
    inertia_kg_m2: Estimate | None = None
    coulomb_Nm: Estimate | None = None
    viscous_Nm_s_per_rad: Estimate | None = None
    posterior: Posterior | None = None
    swings: tuple[Swing, ...] = ()
    facts: Mapping[str, float] = field(default_factory=dict)
    verdicts: tuple[Verdict, ...] = ()
    format: Literal["scissorcal-probe/1"] = FORMAT

    @property
    def rest(self) -> RestFacts:
        """What it found of blades at rest."""
        facts = self.facts
        return RestFacts(
            handle_zero_N=0.0 if self.force_zero_N is None else self.force_zero_N.mean,
            breakaway_Nm=facts.get("breakaway_Nm"),
            torque_noise_Nm=facts.get("torque_noise_Nm", 0.0),
            force_noise_N=facts.get("force_noise_N", 0.0),
            jitters=facts.get("encoder_jitters", 0.0) > 0.0,
            inertia_kg_m2=_above_zero(self.inertia_kg_m2),
            delay_s=_above_zero(self.delay_s),
        )

    def as_dict(self) -> dict[str, Any]:
        """Give the probe as plain values, for JSON; facts that are not finite are left out."""
        facts = {name: value for name, value in self.facts.items() if math.isfinite(value)}
        return {**asdict(self), "facts": facts}


def _above_zero(estimate: Estimate | None) -> float | None:
    return estimate.mean if estimate is not None and estimate.mean > 0.0 else None


def probe_of(device: Mapping[str, Any]) -> ProbeResult | None:
    """The probe that a recording's ``device`` holds; None where it was made without one."""
    plain = device.get(PROBE_KEY)
    return None if plain is None else probe_from_dict(plain)


def newest_probe(devices: Iterable[Mapping[str, Any]]) -> ProbeResult | None:
    """The latest probe that the ``device`` of any recording holds; None where none does."""
    made = [probe for device in devices if (probe := probe_of(device)) is not None]
    return max(made, key=lambda probe: probe.made_at, default=None)


def probe_from_dict(plain: Mapping[str, Any]) -> ProbeResult:
    """Read what `ProbeResult.as_dict` gave. ValueError where it is something else."""
    if not isinstance(plain, Mapping):
        raise ValueError("it is no object")  # noqa: TRY004 - a damaged file, not a wrong call
    if plain.get("format") != FORMAT:
        stated = plain.get("format")
        raise ValueError(f"its format is {stated!r}, and this version reads {FORMAT!r}")
    known = {item.name for item in fields(ProbeResult)}
    values = {name: value for name, value in plain.items() if name in known}
    try:
        if values.get("posterior") is not None:
            values["posterior"] = _posterior(values["posterior"])
        values["swings"] = tuple(_swing(swing) for swing in values.get("swings", ()))
        for name, value in values.items():
            if isinstance(value, Mapping) and name != "facts":
                values[name] = Estimate(float(value["mean"]), float(value["sd"]))
        values["facts"] = {name: float(value) for name, value in plain["facts"].items()}
        if datetime.fromisoformat(values["made_at"]).tzinfo is None:
            raise ValueError("its made_at states no time zone")
        values["verdicts"] = tuple(Verdict(**verdict) for verdict in plain["verdicts"])
        return ProbeResult(**values)
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"it is not a whole probe ({error})") from None


def _posterior(plain: Mapping[str, Any]) -> Posterior:
    names = tuple(str(name) for name in plain["names"])
    rows = tuple(_numbers(row) for row in plain["covariance"])
    posterior = Posterior(names, _numbers(plain["mean"]), rows)
    if len({len(names), len(posterior.mean), len(rows), *map(len, rows)}) > 1:
        raise ValueError("its posterior has not as many rows as names")
    return posterior


def _swing(plain: Mapping[str, Any]) -> Swing:
    times, places = _numbers(plain["times_s"]), _numbers(plain["places_rad"])
    model = _numbers(plain["model_rad"])
    if not len(times) == len(places) == len(model):
        raise ValueError("a swing of it has not as many places as times")
    return Swing(float(plain["torque_Nm"]), times, places, model)


def _numbers(plain: Any) -> tuple[float, ...]:
    return tuple(float(value) for value in plain)
