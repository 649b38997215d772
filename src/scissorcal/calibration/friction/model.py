"""The design of a friction fit: motion, law and priors, over which efforts may be measured."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.fit_candidate import Candidate, Likelihood
from scissorcal.calibration.friction.columns import FrictionBasis
from scissorcal.calibration.friction.moments import ReducedLaw, StrokeMoments
from scissorcal.calibration.friction.search import search
from scissorcal.calibration.friction.terms import NUISANCE, friction_layout
from scissorcal.calibration.parameters import Layout
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.calibration.signals.weak_form import Windows
from scissorcal.calibration.stated_prior import StatedPrior
from scissorcal.model import FrictionLaw
from scissorcal.model.terms import TERMS
from scissorcal.recording.recording import Joint

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

BESIDE = 1.02
"""A search begins a little beside least squares: for the simplest law they are its optimum, and a
parameter that has not moved is one that the data do not know."""


@dataclass(frozen=True)
class FrictionExperiment:
    """One friction law over one set of motions (see :class:`~.experiment.Experiment`).

    ``windows`` are those that count, ``strokes`` (n,) their labels. ``key`` holds the law's
    discrete choices: ``law``, ``symmetric``, ``angle_center``, ``adopt``, the names of adopted
    terms, and ``cogging_periods_per_turn`` where cogging was found. ``tails`` are the degrees of
    freedom of the noise. ``shared`` are moments that another law over the same windows has made
    already, if any. ``prior_precision`` (p, p) takes the place of the layout's own, if given.
    """

    windows: Windows
    strokes: Integers
    key: Mapping[str, Any]
    layout: Layout
    joint: Joint
    tails: float = np.inf
    what: Literal["friction", "cut"] = "friction"
    nuisance: tuple[str, ...] = NUISANCE
    shared: StrokeMoments | None = field(default=None, repr=False, compare=False)
    prior_precision: Array | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Leave basis and moments out of a pickle: they are made again sooner than sent."""
        made = ("basis", "moments")
        kept = {name: value for name, value in self.__dict__.items() if name not in made}
        return {**kept, "shared": None}

    @property
    def bins(self) -> Bins:
        """Weighted means over each window (n,)."""
        return self.windows.bins

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
        words = [*str(self.key["law"]).split("+"), *self.key["adopt"]]
        return " + ".join(words) + (", symmetric" if self.key["symmetric"] else ", asymmetric")

    @cached_property
    def moments(self) -> StrokeMoments:
        """Products of the law's columns by stroke, with what was measured."""
        if self.shared is not None:
            return self.shared
        adopt, center = tuple(self.key["adopt"]), float(self.key["angle_center"])
        cogging = float(self.key.get("cogging_periods_per_turn", 0.0))
        basis = FrictionBasis(self.windows, center, angle=True, terms=adopt, cogging=cogging)
        return StrokeMoments(basis, self.observed, self.strokes)

    @property
    def basis(self) -> FrictionBasis:
        """Drive over these windows for any parameters of the law."""
        return self.moments.basis

    def mean(self, u: Array) -> Array:
        """Drive that inertia, friction and offset ask for (n,), at unconstrained ``u`` (p,)."""
        return self.mean_at(self.layout.natural(u))

    def mean_at(self, values: Mapping[str, Array]) -> Array:
        """Drive (n,) that parameters by name ask for; those that are missing are zero.

        A drive that is measured late by ``delay`` is what it should be less delay times slope.
        """
        return self.basis.drive(values)

    def candidate(self, measured: Array) -> Candidate:
        """Give the law over ``measured`` (n,), ready to be fitted."""

        def residuals(u: Array) -> Array:
            return measured - self.mean(u)

        def normal(u: Array) -> tuple[Array, Array]:
            return np.asarray(residuals(u) / np.exp(u[-1])), np.full(len(measured), u[-1])

        layout, reduced = self.layout, self._reduced(measured)
        return Candidate(
            name=self.name,
            key=self.key,
            layout=layout,
            likelihood=Likelihood(residuals, normal, self.tails),
            starts=self._starts(measured),
            prior_mean=layout.mean,
            prior_precision=(
                np.diag(1 / layout.sd**2) if self.prior_precision is None else self.prior_precision
            ),
            blocks=self.strokes,
            reduced=reduced,
            search=search if reduced else None,
        )

    def _reduced(self, measured: Array) -> ReducedLaw | None:
        """The law over products of columns, where its noise is normal."""
        if np.isfinite(self.tails):
            return None
        own = measured is self.observed or np.array_equal(measured, self.moments.measured)
        moments = self.moments if own else self.moments.of(measured)
        return ReducedLaw(self.layout, moments)

    def _starts(self, measured: Array) -> Array:
        """Starts from linear least squares of Coulomb, viscous, inertia and offset."""
        bins, layout = self.bins, self.layout
        sign = np.sign(bins.rate)
        columns = np.stack([bins.acceleration, np.ones_like(sign), sign, bins.rate], axis=1)
        inertia, offset, coulomb, viscous = np.linalg.lstsq(columns, measured, rcond=None)[0]
        effort = float(np.std(measured))
        begin = {
            "inertia": BESIDE * max(inertia, 1e-3 * float(np.exp(layout.mean[0]))),
            "offset": BESIDE * offset,
            "coulomb": BESIDE * max(coulomb, 1e-2 * effort),
            "viscous": BESIDE * max(viscous, 1e-2 * effort / float(np.sqrt(np.mean(bins.rate**2)))),
            "stribeck": 0.1 * effort,
            "noise": 0.1 * effort,
        }
        scales = [name for name in ("stribeck_rate", "presliding_length") if name in layout.names]
        rows = []
        for factor in (0.4, 1.5) if scales else (1.0,):
            point = []
            for parameter in layout.parameters:
                stem = parameter.name.removesuffix("_pos").removesuffix("_neg")
                if stem in begin:
                    point.append(float(parameter.unconstrained(np.asarray(begin[stem]))))
                else:
                    point.append(parameter.mean + (np.log(factor) if stem in scales else 0.0))
            u = np.array(point)
            u[-1] = np.log(max(float(np.std(measured - self.mean(u))), 1e-6 * effort))
            rows.append(u)
        return np.stack(rows)


def design(
    windows: Windows,
    strokes: Integers,
    law: str,
    symmetric: bool,
    joint: Joint,
    adopt: tuple[str, ...] = (),
    cogging: float = 0.0,
    prior: StatedPrior | None = None,
) -> FrictionExperiment:
    """One law over windows, with priors of the data's own size, or ``prior`` where it states them.

    ``cogging`` is the number of its periods a turn, 0 where there is none.
    """
    opening = windows.bins.opening
    center = float(np.round(np.mean([opening.min(), opening.max()]), 3))
    key: dict[str, Any] = {
        "law": law,
        "symmetric": symmetric,
        "angle_center": center,
        "adopt": list(adopt),
    }
    if cogging:
        key["cogging_periods_per_turn"] = cogging
    layout = friction_layout(windows, law, symmetric, joint, adopt, cogging=bool(cogging))
    precision = None
    if prior is not None:
        precision = prior.precision(layout, np.diag(1 / layout.sd**2))
        layout = prior.layout(layout)
    return FrictionExperiment(windows, strokes, key, layout, joint, prior_precision=precision)


def friction_law(values: dict[str, Array], angle_center: float) -> FrictionLaw:
    """Friction law from a fit's parameters by name; those a rung lacks are zero.

    ``values`` may hold scalars or arrays that broadcast (posterior draws); names of
    :data:`scissorcal.model.terms.TERMS` among them are adopted terms.
    """
    terms = tuple(name for name in values if name in TERMS)
    zero = np.asarray(0.0)
    coulomb = values.get("coulomb")
    viscous = values.get("viscous", zero)
    return FrictionLaw(
        coulomb_pos=values["coulomb_pos"] if coulomb is None else coulomb,
        coulomb_neg=values["coulomb_neg"] if coulomb is None else coulomb,
        viscous_pos=values.get("viscous_pos", viscous),
        viscous_neg=values.get("viscous_neg", viscous),
        stribeck=values.get("stribeck", zero),
        stribeck_rate=values.get("stribeck_rate", np.asarray(1.0)),
        angle_slope=values.get("angle_slope", zero),
        angle_curvature=values.get("angle_curvature", zero),
        angle_center=angle_center,
        load_share=values.get("load_share", zero),
        load_gain=values.get("load_gain", zero),
        presliding_share=values.get("presliding_share", zero),
        presliding_length=values.get("presliding_length", np.asarray(1.0)),
        terms=terms,
        coefficients=tuple(values[name] for name in terms),
    )
