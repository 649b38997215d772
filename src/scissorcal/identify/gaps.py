"""What a log does not tell of its joint, and which motion would."""

from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.result import PRIOR_ONLY, FitResult
from scissorcal.identify.simple import law_of
from scissorcal.identify.words import plain
from scissorcal.model import FrictionLaw, friction_torque
from scissorcal.model.friction_terms import PARAMETERS, side_of
from scissorcal.model.terms import LOG

DECADE = 10.0
"""Ratio of the ends of a 90 % interval from which not even the order of magnitude is known."""


@dataclass(frozen=True)
class Gap:
    """A quantity that the log does not determine: ``what``, ``why``, and the ``motion`` for it."""

    what: str
    why: str
    motion: str

    @property
    def sentence(self) -> str:
        """All of it in words."""
        return f"{self.what}: {self.why} {self.motion}"


def gaps_of(fit: FitResult) -> tuple[Gap, ...]:
    """What is not identified: parameters, choices between laws, and what no log tells."""
    rows = [gap for parameter in fit.parameters if (gap := _of_parameter(fit, parameter.name))]
    return (*_one_speed(fit), *rows, *_undecided(fit), *_beyond(fit))


def identified(fit: FitResult, name: str) -> str:
    """How well a parameter is known: "yes", "roughly" or "no".

    No: its posterior is at least 0.9 as wide as its prior, or the ends of its 90 % interval differ
    by a factor of 10; or, of Coulomb friction, viscous friction may take more of it than that
    interval has. Roughly: the interval is wider than its middle. Else yes. A term of either
    sign is known where its interval is narrower than half of its prior's sd.
    """
    parameter = fit.parameter(name)
    width = parameter.q95 - parameter.q05
    row = PARAMETERS.get(side_of(name, PARAMETERS) or "")
    if parameter.identifiability >= PRIOR_ONLY or _taken(fit, name):
        return "no"
    if row is None or row.transform != LOG:
        return "yes" if parameter.identifiability < 0.5 else "roughly"
    if parameter.q95 >= DECADE * max(parameter.q05, 0.0):
        return "no"
    return "roughly" if width > parameter.q50 else "yes"


def _of_parameter(fit: FitResult, name: str) -> Gap | None:
    verdict = identified(fit, name)
    if verdict == "yes":
        return None
    parameter = fit.parameter(name)
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    lies = f"90 % between {parameter.q05:.3g} and {parameter.q95:.3g}{unit}"
    stem = side_of(name, PARAMETERS) or name
    if _taken(fit, name):
        return _in_sum(fit, name)
    if verdict == "no":
        why = f"not identified ({lies}, {parameter.identifiability:.0%} of the prior's width)."
    else:
        why = f"known roughly ({lies})."
    return Gap(plain(name), why, _motion(fit, stem))


def _taken(fit: FitResult, name: str) -> bool:
    """Whether viscous friction, which is not identified, may take a part of Coulomb friction.

    In logarithms the posterior of draft effort is straight, and does not show by how much: what the
    95 % of the viscous part have at the usual speed is compared with Coulomb's own interval.
    """
    viscous = name.replace("coulomb", "viscous")
    if viscous == name or viscous not in [parameter.name for parameter in fit.parameters]:
        return False
    if identified(fit, viscous) != "no":
        return False
    coulomb = fit.parameter(name)
    return fit.parameter(viscous).q95 * _usual_speed(fit) > coulomb.q95 - coulomb.q05


def _usual_speed(fit: FitResult) -> float:
    return float(np.median(np.abs(fit.series.opening_rate)))


def _in_sum(fit: FitResult, name: str) -> Gap:
    """Coulomb and viscous friction of which the log tells the sum alone."""
    viscous, speed = name.replace("coulomb", "viscous"), _usual_speed(fit)
    total = fit.best[name] + fit.best[viscous] * speed
    return Gap(
        name,
        f"known in sum with {viscous} alone: together {total:.3g} {fit.effort_unit} at "
        f"{speed:.2g} {fit.position_unit}/s, of which {name} may be anything from 0 on, below "
        "its interval too.",
        _motion(fit, "coulomb"),
    )


def _motion(fit: FitResult, stem: str) -> str:
    """Which motion would determine a parameter."""
    series, unit = fit.series, fit.position_unit
    speeds = np.abs(series.opening_rate)
    slow, fast = (float(value) for value in np.quantile(speeds, [0.05, 0.95]))
    travel = float(np.ptp(series.opening))
    now = f"the log has {slow:.2g} to {fast:.2g} {unit}/s"
    if stem == "inertia":
        return (
            "Accelerate more: reversals so quick, or a chirp so high, that inertia takes as much "
            "effort as friction."
        )
    if stem in ("coulomb", "viscous"):
        return (
            f"Record strokes in both directions at several constant speeds, the fastest at least 3 "
            f"times the slowest ({now})."
        )
    if stem in ("stribeck", "stribeck_rate"):
        return (
            f"Record strokes at constant speeds down to a tenth of the slowest, "
            f"{0.1 * slow:.1g} {unit}/s ({now})."
        )
    if stem.startswith("presliding"):
        return (
            f"Record small motion to and fro, of {travel / 1000:.1g} to {travel / 20:.1g} {unit}, "
            "with reversals at rest."
        )
    if stem.startswith("angle"):
        return f"Record strokes over more travel than {travel:.2g} {unit}."
    if stem.startswith("load"):
        return "Record the same strokes under several loads."
    if stem == "offset":
        return "Record the joint at rest with the drive off before and after."
    return "Record more varied motion."


def _undecided(fit: FitResult) -> list[Gap]:
    """Laws that the log does not tell from the chosen one, and how far apart they are."""
    rivals = [
        entry
        for entry in fit.candidates
        if entry["equivalent"] and not entry["chosen"] and "values" in entry
    ]
    if not rivals:
        return []
    apart = max(_apart(fit, entry["values"]) for entry in rivals)
    names = plain(", ".join(f'"{entry["name"]}"' for entry in rivals))
    return [
        Gap(
            "form of the law",
            f'hold-out strokes do not tell "{fit.candidate}" from {names}; over the measured '
            f"motion they differ by at most {apart:.2g} {fit.effort_unit}.",
            "More strokes, slower and faster ones among them, would decide.",
        )
    ]


def _one_speed(fit: FitResult) -> list[Gap]:
    """That friction at other speeds is not known, where the check of the strokes' speeds fails."""
    failed = [v for v in fit.verdicts if v.check == "strokes" and v.status == "fail"]
    if not failed:
        return []
    return [
        Gap(
            "friction at other speeds",
            "all strokes are alike in speed, so that viscous, Coulomb and Stribeck friction differ "
            "only by how the speed changes within a stroke.",
            _motion(fit, "viscous"),
        )
    ]


def _apart(fit: FitResult, values: dict[str, float]) -> float:
    rate, opening = fit.series.opening_rate, fit.series.opening
    law = law_of(fit)
    other = FrictionLaw.of_fit(values, law.angle_center)

    def drive(of: FrictionLaw, offset: float) -> Array:
        return friction_torque(of, opening, rate) + offset

    apart = drive(law, fit.best.get("offset", 0.0)) - drive(other, values.get("offset", 0.0))
    return float(np.max(np.abs(apart), initial=0.0))


def _beyond(fit: FitResult) -> list[Gap]:
    """What no log of motion and effort alone tells."""
    rows = [
        Gap(
            "gain of the effort",
            "it multiplies inertia and all friction alike, so that no log tells it.",
            "Weigh the joint, or hang a known weight on it, and state --gain effort=NUMBER.",
        )
    ]
    if not fit.structure.get("symmetric", True):
        rows.append(
            Gap(
                "offset of the effort",
                "unequal Coulomb friction by direction contains a constant effort, such as weight.",
                "Record the joint at rest with the drive off, or state --offset effort=NUMBER.",
            )
        )
    if "stribeck" not in fit.structure.get("law", ""):
        rows.append(
            Gap(
                "Stribeck friction",
                "the law has none: hold-out strokes are not predicted better with it.",
                _motion(fit, "stribeck"),
            )
        )
    if "presliding" not in fit.structure.get("law", ""):
        rows.append(
            Gap(
                "presliding",
                "the law has none: what this log has of reversals is not explained better by it.",
                _motion(fit, "presliding_share"),
            )
        )
    return rows
