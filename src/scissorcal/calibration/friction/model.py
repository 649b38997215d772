"""The design of a friction fit: motion, law and priors, over which efforts may be measured."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.fit_candidate import Candidate, Likelihood
from scissorcal.calibration.friction.columns import SCALES, FrictionBasis
from scissorcal.calibration.friction.layout import LawChoice, friction_layout, friction_precision
from scissorcal.calibration.friction.moments import ReducedLaw, StrokeMoments
from scissorcal.calibration.friction.search import search
from scissorcal.calibration.parameters import Layout, StatedPrior
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.calibration.signals.weak_form import Windows
from scissorcal.model.friction_terms import CANDIDATES, NUISANCE, side_of, terms_of
from scissorcal.model.terms import LOG, Role, Term
from scissorcal.recipe.priors import JointPriors
from scissorcal.recording.recording import Joint

BESIDE = 1.02
"""A search begins a little beside least squares: for the simplest law they are its optimum, and a
parameter that has not moved is one that the data do not know."""

LEAST_OFFSET = 1e-3
"""Share of the drive's spread from which a search for the offset begins at least: beside zero it
would end where it began."""

CURVED = ("stribeck", SCALES[0], "presliding_share")
"""Parameters along which a posterior bends: motion shows what is left of Stribeck friction at the
slowest rate, and the product of share and length of what builds up after a reversal."""

SHORT = 0.03
"""Share of the range that is travelled, at which a search for Dahl's length begins."""


@dataclass(frozen=True)
class FrictionExperiment:
    """One friction law over one set of motions, as :mod:`scissorcal.calibration.fit_model` asks.

    ``windows`` are those that count, ``strokes`` (n,) their labels. ``key`` holds the law's
    discrete choices: ``law``, ``symmetric``, ``angle_center``, ``adopt``, the names of adopted
    terms, and ``cogging_periods_per_turn`` where cogging was found. ``tails`` are the degrees of
    freedom of the noise. ``shared`` are moments that another law over the same windows has made
    already, if any. ``prior_precision`` (p, p) is that of all parameters together. ``share`` is the
    share of the windows that count as independent, where it is known.
    """

    windows: Windows
    strokes: Integers
    key: Mapping[str, Any]
    layout: Layout
    prior_precision: Array
    joint: Joint
    tails: float = np.inf
    share: float | None = None
    what: Literal["friction", "cut"] = "friction"
    nuisance: tuple[str, ...] = NUISANCE
    shared: StrokeMoments | None = field(default=None, repr=False, compare=False)

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
        law, adopt = str(self.key["law"]), tuple(self.key["adopt"])
        shared = [term for name in CANDIDATES for term in terms_of(name)]
        basis = FrictionBasis(
            self.windows,
            float(self.key["angle_center"]),
            tuple(dict.fromkeys([*shared, *terms_of(law, adopt)])),
            cogging=float(self.key.get("cogging_periods_per_turn", 0.0)),
        )
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

    def contact(self, point: Array) -> Array:
        """Nothing is cut: NaN (n,)."""
        return np.full_like(self.observed, np.nan)

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
            prior_precision=self.prior_precision,
            blocks=self.strokes,
            reduced=reduced,
            search=search if reduced else None,
            share=self.share,
            curved=self._curved if reduced else (),
        )

    @property
    def _curved(self) -> tuple[int, ...]:
        return tuple(n for n, name in enumerate(self.layout.names) if name in CURVED)

    def _reduced(self, measured: Array) -> ReducedLaw | None:
        """The law over products of columns, where its noise is normal."""
        if np.isfinite(self.tails):
            return None
        own = measured is self.observed or np.array_equal(measured, self.moments.measured)
        moments = self.moments if own else self.moments.of(measured)
        return ReducedLaw(self.layout, moments)

    def _starts(self, measured: Array) -> Array:
        """Starts from linear least squares of Coulomb, viscous, inertia and offset.

        Other levels begin where they are a tenth of the drive, scales at two places within the
        motion, the rest at the prior's mean.
        """
        bins, layout = self.bins, self.layout
        sign = np.sign(bins.rate)
        columns = np.stack([bins.acceleration, np.ones_like(sign), sign, bins.rate], axis=1)
        inertia, offset, coulomb, viscous = np.linalg.lstsq(columns, measured, rcond=None)[0]
        effort, rate = float(np.std(measured)), float(np.sqrt(np.mean(bins.rate**2)))
        least = effort / float(np.sqrt(np.mean(bins.acceleration**2)))
        begin = {
            **{term.name: 0.1 * effort / self._size(term) for term in self._levels},
            "inertia": BESIDE * max(inertia, 1e-3 * least),
            "offset": BESIDE * np.copysign(max(abs(offset), LEAST_OFFSET * effort), offset),
            "coulomb": BESIDE * max(coulomb, 1e-2 * effort),
            "viscous": BESIDE * max(viscous, 1e-2 * effort / rate),
            "noise": 0.1 * effort,
            SCALES[0]: self.slow_rate,
            SCALES[1]: SHORT * float(np.ptp(bins.opening)),
        }
        scaled = any(name in layout.names for name in SCALES)
        rows = []
        for factor in (0.4, 1.5) if scaled else (1.0,):
            point = []
            for parameter in layout.parameters:
                stem = side_of(parameter.name, begin)
                start = parameter.mean
                if stem is not None and not parameter.measured_prior:
                    value = begin[stem] * (factor if stem in SCALES else 1.0)
                    start = float(parameter.transform.unconstrained(np.asarray(value)))
                point.append(start)
            u = np.array(point)
            u[-1] = np.log(max(float(np.std(measured - self.mean(u))), 1e-6 * effort))
            rows.append(u)
        return np.stack(rows)

    @property
    def slow_rate(self) -> float:
        """A slow rate of the motion: its lower quartile."""
        return float(np.quantile(np.abs(self.bins.rate), 0.25))

    @property
    def _levels(self) -> list[Term]:
        """Rows of the law whose parameter is a positive level."""
        rows = terms_of(str(self.key["law"]))
        return [t for t in rows if t.role in (Role.DRY, Role.SLIDING) and t.transform == LOG]

    def _size(self, term: Term) -> float:
        """Usual size of what a level multiplies; 1 for one that depends on a scale."""
        if term.scale or term.value is None:
            return 1.0
        return max(float(np.sqrt(np.mean(term.column(self.basis.motion) ** 2))), 1e-12)


def design(
    windows: Windows,
    strokes: Integers,
    choice: LawChoice,
    joint: Joint,
    priors: JointPriors,
    prior: StatedPrior | None = None,
) -> FrictionExperiment:
    """One law over windows, with the recipe's priors, or those that ``prior`` states."""
    opening = windows.bins.opening
    center = float(np.round(np.mean([opening.min(), opening.max()]), 3))
    key: dict[str, Any] = {
        "law": choice.name,
        "symmetric": choice.symmetric,
        "angle_center": center,
        "adopt": list(choice.adopt),
    }
    if choice.cogging:
        key["cogging_periods_per_turn"] = choice.cogging
    held_tick_s = windows.tick_s if windows.held else None
    layout = friction_layout(choice, joint, priors.of(joint.kind), held_tick_s)
    precision = friction_precision(layout)
    if prior is not None:
        precision = prior.precision(layout, precision)
        layout = prior.layout(layout)
    return FrictionExperiment(windows, strokes, key, layout, precision, joint)
