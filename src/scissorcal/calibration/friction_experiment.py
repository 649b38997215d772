"""The design of a friction fit: motion, law and priors, over which efforts may be measured."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.conditioning import Bins
from scissorcal.calibration.ladder import Likelihood, Rung
from scissorcal.calibration.layout import Layout, Parameter
from scissorcal.model import FrictionLaw, friction_torque
from scissorcal.recording.recording import Joint

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

NUISANCE = ("noise",)
WIDE = 2.8
"""Prior standard deviation of a logarithm: 90 % within a factor of 100 of its centre."""


@dataclass(frozen=True)
class FrictionExperiment:
    """One friction law over one set of motions (see :class:`~.experiment.Experiment`).

    ``bins`` are those that count, ``strokes`` (n,) their labels. ``key`` holds the law's discrete
    choices: ``law``, ``symmetric`` and ``angle_center``. ``tails`` are the degrees of freedom of
    the noise.
    """

    bins: Bins
    strokes: Integers
    key: Mapping[str, Any]
    layout: Layout
    joint: Joint
    tails: float = np.inf
    what: Literal["friction", "cut"] = "friction"
    nuisance: tuple[str, ...] = NUISANCE

    @property
    def observed(self) -> Array:
        """Drive effort that was measured at each bin (n,)."""
        return self.bins.drive

    @property
    def series(self) -> Integers:
        """Pieces without a gap (n,)."""
        return self.bins.series

    @property
    def name(self) -> str:
        """The law in words."""
        words = str(self.key["law"]).replace("+", " + ")
        return words + (", symmetric" if self.key["symmetric"] else ", asymmetric")

    def mean(self, u: Array) -> Array:
        """Drive that inertia, friction and offset ask for (n,), at unconstrained ``u`` (p,)."""
        values = self.layout.natural(u)
        law = friction_law(values, float(self.key["angle_center"]))
        offset = values.get("offset", np.asarray(0.0))
        friction = friction_torque(law, self.bins.opening, self.bins.rate)
        return np.asarray(values["inertia"] * self.bins.acceleration + offset + friction)

    def simulate(self, u: Array, rng: np.random.Generator) -> Array:
        """Give the mean (n,): a friction law has no irregularities of its own."""
        return self.mean(u)

    def rung(self, measured: Array) -> Rung:
        """Give the law over ``measured`` (n,), ready to be fitted."""

        def residuals(u: Array) -> Array:
            return measured - self.mean(u)

        def normal(u: Array) -> tuple[Array, Array]:
            return np.asarray(residuals(u) / np.exp(u[-1])), np.full(len(measured), u[-1])

        layout = self.layout
        return Rung(
            name=self.name,
            key=self.key,
            layout=layout,
            likelihood=Likelihood(residuals, normal, self.tails),
            starts=self._starts(measured),
            prior_mean=layout.mean,
            prior_precision=np.diag(1 / layout.sd**2),
            blocks=self.strokes,
        )

    def _starts(self, measured: Array) -> Array:
        """Starts from linear least squares of Coulomb, viscous, inertia and offset."""
        bins, layout = self.bins, self.layout
        sign = np.sign(bins.rate)
        columns = np.stack([bins.acceleration, np.ones_like(sign), sign, bins.rate], axis=1)
        inertia, offset, coulomb, viscous = np.linalg.lstsq(columns, measured, rcond=None)[0]
        effort = float(np.std(measured))
        begin = {
            "inertia": max(inertia, 1e-3 * float(np.exp(layout.mean[0]))),
            "offset": offset,
            "coulomb": max(coulomb, 1e-2 * effort),
            "viscous": max(viscous, 1e-2 * effort / float(np.sqrt(np.mean(bins.rate**2)))),
            "stribeck": 0.1 * effort,
            "angle_slope": 0.0,
            "angle_curvature": 0.0,
            "noise": 0.1 * effort,
        }
        rows = []
        for factor in (0.4, 1.5) if "stribeck" in layout.names else (1.0,):
            point = []
            for parameter in layout.parameters:
                stem = parameter.name.removesuffix("_pos").removesuffix("_neg")
                if stem == "stribeck_rate":
                    point.append(parameter.mean + np.log(factor))
                else:
                    point.append(float(parameter.unconstrained(np.asarray(begin[stem]))))
            u = np.array(point)
            u[-1] = np.log(max(float(np.std(measured - self.mean(u))), 1e-6 * effort))
            rows.append(u)
        return np.stack(rows)


def design(
    bins: Bins, strokes: Integers, law: str, symmetric: bool, joint: Joint
) -> FrictionExperiment:
    """One law over bins, with priors of the data's own size."""
    center = float(np.round(np.mean([bins.opening.min(), bins.opening.max()]), 3))
    key = {"law": law, "symmetric": symmetric, "angle_center": center}
    return FrictionExperiment(bins, strokes, key, _layout(bins, law, symmetric, joint), joint)


def friction_law(values: dict[str, Array], angle_center: float) -> FrictionLaw:
    """Friction law from a fit's parameters by name; those a rung lacks are zero.

    ``values`` may hold scalars or arrays that broadcast (posterior draws).
    """
    coulomb = values.get("coulomb")
    viscous = values.get("viscous", np.asarray(0.0))
    return FrictionLaw(
        coulomb_pos=values["coulomb_pos"] if coulomb is None else coulomb,
        coulomb_neg=values["coulomb_neg"] if coulomb is None else coulomb,
        viscous_pos=values.get("viscous_pos", viscous),
        viscous_neg=values.get("viscous_neg", viscous),
        stribeck=values.get("stribeck", np.asarray(0.0)),
        stribeck_rate=values.get("stribeck_rate", np.asarray(1.0)),
        angle_slope=values.get("angle_slope", np.asarray(0.0)),
        angle_curvature=values.get("angle_curvature", np.asarray(0.0)),
        angle_center=angle_center,
    )


def _layout(bins: Bins, law: str, symmetric: bool, joint: Joint) -> Layout:
    effort, rate = float(np.std(bins.drive)), float(np.sqrt(np.mean(bins.rate**2)))
    acceleration = float(np.sqrt(np.mean(bins.acceleration**2)))
    span = float(np.ptp(bins.opening))
    unit, rate_unit = joint.effort_unit, f"{joint.position_unit}/s"

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
    if law != "coulomb":
        viscous_unit = f"{unit} s/{joint.position_unit}"
        for suffix, words in sides:
            rows.append(
                level("viscous" + suffix, viscous_unit, effort / rate, "viscous friction" + words)
            )
    if law.startswith("stribeck"):
        slow = float(np.quantile(np.abs(bins.rate), 0.25))
        rows.append(level("stribeck", unit, 0.3 * effort, "static minus Coulomb friction"))
        rows.append(
            Parameter("stribeck_rate", rate_unit, "log", float(np.log(slow)), 1.0, "Stribeck speed")
        )
    if law.endswith("+angle"):
        position = joint.position_unit
        rows.append(
            Parameter(
                "angle_slope", f"1/{position}", "identity", 0.0, 1 / span, "change with angle"
            )
        )
        rows.append(
            Parameter(
                "angle_curvature",
                f"1/{position}^2",
                "identity",
                0.0,
                2 / span**2,
                "curvature of the change with angle",
            )
        )
    rows.append(level("noise", unit, 0.1 * effort, "standard deviation of what is left"))
    return Layout(tuple(rows))
