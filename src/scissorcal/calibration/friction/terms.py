"""The parameters of a friction law, with priors of the data's own size."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.calibration.signals.weak_form import Windows
from scissorcal.model.terms import TERMS, Motion, evaluate
from scissorcal.recording.recording import Joint

Array = NDArray[np.float64]

NUISANCE = ("cogging_cos", "cogging_sin", "delay", "noise")
WIDE = 2.8
"""Prior standard deviation of a logarithm: 90 % within a factor of 100 of its centre."""
EXCESS = 1.4
"""The same for static minus Coulomb friction, 90 % within a factor of 10: of sweeps that are all
faster than Stribeck's speed only the prior says that it is no multiple of the whole drive."""
DELAY_TICKS = (0.1, 0.15)
"""Mean and standard deviation of how late a held torque is: at most half a tick, by the motor."""


@dataclass(frozen=True)
class LawParts:
    """What a law's name says: "stribeck+angle+load" has Stribeck's base, place and load."""

    base: str
    angle: bool
    load: bool
    presliding: bool

    @classmethod
    def of(cls, law: str) -> "LawParts":
        """Take a law's name apart.

        >>> LawParts.of("coulomb+viscous+load").base
        'coulomb+viscous'
        """
        words = law.split("+")
        base = "+".join(word for word in words if word in ("coulomb", "viscous", "stribeck"))
        return cls(base, "angle" in words, "load" in words, "presliding" in words)


def friction_layout(
    windows: Windows,
    law: str,
    symmetric: bool,
    joint: Joint,
    adopt: tuple[str, ...] = (),
    *,
    cogging: bool = False,
) -> Layout:
    """Lay out a law's parameters over windowed data; ``noise`` stands last.

    Wide priors are centred on the drive's, the rate's and the opening's own size. ``cogging`` adds
    the two parameters of a torque that repeats over the opening.
    """
    parts, bins = LawParts.of(law), windows.bins
    effort, rate = float(np.std(bins.drive)), float(np.sqrt(np.mean(bins.rate**2)))
    acceleration = float(np.sqrt(np.mean(bins.acceleration**2)))
    unit, position = joint.effort_unit, joint.position_unit

    def level(name: str, unit: str, centre: float, meaning: str) -> Parameter:
        return Parameter(name, unit, "log", float(np.log(centre)), WIDE, meaning)

    rows = [
        level("inertia", joint.inertia_unit, effort / acceleration, "inertia of the moving joint")
    ]
    if symmetric:
        rows.append(Parameter("offset", unit, "identity", 0.0, effort, "constant offset"))
    sides = (("", ""),) if symmetric else (("_pos", ", positive rate"), ("_neg", ", negative rate"))
    for suffix, words in sides:
        rows.append(level("coulomb" + suffix, unit, effort, "Coulomb friction" + words))
    if parts.base != "coulomb":
        viscous_unit = f"{unit} s/{position}"
        for suffix, words in sides:
            rows.append(
                level("viscous" + suffix, viscous_unit, effort / rate, "viscous friction" + words)
            )
    if parts.base == "stribeck":
        slow = float(np.log(np.quantile(np.abs(bins.rate), 0.25)))
        excess = Parameter(
            "stribeck",
            unit,
            "log",
            float(np.log(0.3 * effort)),
            EXCESS,
            "static minus Coulomb friction",
        )
        rows.append(excess)
        rows.append(Parameter("stribeck_rate", f"{position}/s", "log", slow, 1.0, "Stribeck speed"))
    rows += _place(parts, float(np.ptp(bins.opening)), position)
    rows += _load(parts)
    rows += _adopted(adopt, windows, joint, effort)
    if cogging:
        meaning = "torque that repeats over the opening, in the drive"
        rows += [
            Parameter(f"cogging_{wave}", unit, "identity", 0.0, effort, meaning)
            for wave in ("cos", "sin")
        ]
    if windows.held:
        mean, sd = (share * windows.tick_s for share in DELAY_TICKS)
        rows.append(Parameter("delay", "s", "identity", mean, sd, "torque is measured late"))
    rows.append(level("noise", unit, 0.1 * effort, "standard deviation of what is left"))
    return Layout(tuple(rows))


def _place(parts: LawParts, span: float, position: str) -> list[Parameter]:
    rows = []
    if parts.angle:
        per = f"1/{position}"
        rows += [
            Parameter("angle_slope", per, "identity", 0.0, 1 / span, "change with angle"),
            Parameter(
                "angle_curvature",
                f"{per}^2",
                "identity",
                0.0,
                2 / span**2,
                "curvature of the change with angle",
            ),
        ]
    if parts.presliding:
        rows += [
            Parameter(
                "presliding_share",
                "1",
                "logit",
                0.0,
                1.5,
                "share of Coulomb friction that builds up after a reversal",
            ),
            Parameter(
                "presliding_length",
                position,
                "log",
                float(np.log(0.03 * span)),
                1.2,
                "way over which it builds up",
            ),
        ]
    return rows


def _load(parts: LawParts) -> list[Parameter]:
    if not parts.load:
        return []
    share, gain = "friction per load", "load that the drive bears in excess"
    return [
        Parameter("load_share", "1", "log", float(np.log(0.1)), 1.5, share),
        Parameter("load_gain", "1", "identity", 0.0, 0.3, gain),
    ]


def _adopted(
    names: tuple[str, ...], windows: Windows, joint: Joint, effort: float
) -> list[Parameter]:
    """Adopted terms, each with a prior in which it may be as large as the drive itself."""
    motion = Motion(windows.opening, windows.rate, np.zeros_like(windows.rate), windows.load)
    columns = evaluate(names, motion)
    rows = []
    for name, column in zip(names, columns.T, strict=True):
        size = float(np.sqrt(np.mean(column**2)))
        unit = TERMS[name].unit(joint.position_unit, joint.effort_unit)
        meaning = f"adopted: {TERMS[name].meaning}"
        rows.append(Parameter(name, unit, "identity", 0.0, effort / max(size, 1e-12), meaning))
    return rows
