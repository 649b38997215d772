"""Parameters of a fit: names, units, transforms, priors, and summaries of their draws."""

from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from scissorcal.aliases import Array
from scissorcal.model.terms import Transform


@dataclass(frozen=True)
class Parameter:
    """One parameter with its prior: normal in u, where its value is ``transform.natural(u)``.

    ``mean`` and ``sd`` are the prior's in u. ``measured_prior`` marks a prior from other
    measurements: these data need not narrow it.
    """

    name: str
    unit: str
    transform: Transform
    mean: float
    sd: float
    meaning: str
    measured_prior: bool = False


NEAREST, FARTHEST = 1.2816, 1.9600
"""Distances from a normal's mean, in standard deviations, beyond which 10 % and 2.5 % lie: twice
and half of what lies beyond an end of a 90 % interval."""


def moments_agree(mean: float, sd: float, q05: float, q95: float) -> bool:
    """Whether mean and sd say of a posterior what its 5 and 95 % quantiles say.

    They do where a normal of these moments has between half and twice of 5 % beyond each quantile.
    Long tails and skewed posteriors fail, as an sd then follows draws that no interval reaches.

    >>> moments_agree(0.0, 1.0, -1.64, 1.64), moments_agree(0.0, 1.0, -0.5, 0.5)
    (True, False)
    """
    return all(NEAREST * sd <= end <= FARTHEST * sd for end in (mean - q05, q95 - mean))


def in_words(mean: float, sd: float, q05: float, q50: float, q95: float) -> str:
    """Mean and sd for a sentence; the quantiles alone where moments do not agree with them.

    >>> in_words(0.09, 0.01, 0.075, 0.09, 0.105), in_words(0.09, 0.03, 0.075, 0.081, 0.105)
    ('0.09 (sd 0.01)', '0.081 (0.075 to 0.1)')
    """
    if moments_agree(mean, sd, q05, q95):
        return f"{mean:.2g} (sd {sd:.1g})"
    return f"{q50:.2g} ({q05:.2g} to {q95:.2g})"


@dataclass(frozen=True)
class FittedParameter:
    """One parameter with its marginal posterior, in ``unit``.

    ``measured_prior`` marks a prior from another measurement, such as photographs of the edge.
    ``identifiability`` is the ratio of posterior to prior standard deviation: near 0 the data
    determine the parameter, near 1 the prior does.
    """

    name: str
    unit: str
    mean: float
    sd: float
    q05: float
    q50: float
    q95: float
    identifiability: float
    meaning: str = ""
    measured_prior: bool = False

    @staticmethod
    def summary_of(draws: Array) -> dict[str, Any]:
        """The fields that posterior draws (n,) in the parameter's unit give."""
        q05, q50, q95 = (float(value) for value in np.quantile(draws, [0.05, 0.5, 0.95]))
        mean, sd = float(draws.mean()), float(draws.std(ddof=1))
        return {"mean": mean, "sd": sd, "q05": q05, "q50": q50, "q95": q95}

    @property
    def interval(self) -> tuple[float, float]:
        """The 5 and 95 % quantiles, in ``unit``."""
        return self.q05, self.q95

    @property
    def moments(self) -> tuple[float, float] | None:
        """Mean and sd for people to read; None where they do not agree with the quantiles."""
        agree = moments_agree(self.mean, self.sd, self.q05, self.q95)
        return (self.mean, self.sd) if agree else None

    @property
    def words(self) -> str:
        """The value for a sentence, without its unit; see :func:`in_words`."""
        return in_words(self.mean, self.sd, self.q05, self.q50, self.q95)

    def as_dict(self) -> dict[str, Any]:
        """Give the parameter as the plain object that ``--json`` prints.

        ``mean`` and ``sd`` are None where they do not agree with the quantiles.
        """
        mean, sd = self.moments or (None, None)
        return {
            "name": self.name,
            "unit": self.unit,
            "mean": mean,
            "sd": sd,
            "q05": self.q05,
            "q50": self.q50,
            "q95": self.q95,
            "identifiability": self.identifiability,
        }


@dataclass(frozen=True)
class Layout:
    """An ordered set of parameters."""

    parameters: tuple[Parameter, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def mean(self) -> Array:
        return np.array([parameter.mean for parameter in self.parameters])

    @property
    def sd(self) -> Array:
        return np.array([parameter.sd for parameter in self.parameters])

    def natural(self, u: Array) -> dict[str, Array]:
        """Values by name from unconstrained points of shape (..., p)."""
        return {
            parameter.name: parameter.transform.natural(np.asarray(u[..., index]))
            for index, parameter in enumerate(self.parameters)
        }

    def columns(self, u: Array) -> Array:
        """Natural values in the layout's order, same shape (..., p) as ``u``."""
        return np.stack(list(self.natural(u).values()), axis=-1)

    def unconstrained(self, values: dict[str, float]) -> Array:
        """An unconstrained point (p,) from values by name."""
        return np.array(
            [float(p.transform.unconstrained(np.asarray(values[p.name]))) for p in self.parameters]
        )

    def fitted(self, u_draws: Array) -> tuple[FittedParameter, ...]:
        """Summaries of posterior draws (n, p) as people read them."""
        rows = []
        natural = self.columns(u_draws)
        for index, parameter in enumerate(self.parameters):
            u = u_draws[:, index]
            rows.append(
                FittedParameter(
                    name=parameter.name,
                    unit=parameter.unit,
                    **FittedParameter.summary_of(natural[:, index]),
                    identifiability=float(min(u.std(ddof=1) / parameter.sd, 1.0)),
                    meaning=parameter.meaning,
                    measured_prior=parameter.measured_prior,
                )
            )
        return tuple(rows)


AnyLayout = TypeVar("AnyLayout", bound=Layout)


@dataclass(frozen=True)
class StatedPrior:
    """A normal distribution of unconstrained parameters by name, for fits of simulated data.

    What truths were drawn from must be the prior of the fits that are to find them. ``names`` (k,)
    go with ``mean`` (k,) and ``covariance`` (k, k); a law takes those that it has, and keeps its
    own prior for others. ``response`` is the family of a cut's response that the exponent and shape
    are of. ``laws`` names those that are compared, all where there are none.
    """

    names: tuple[str, ...]
    mean: Array
    covariance: Array
    response: str = ""
    laws: tuple[str, ...] = ()

    def of_response(self, family: str) -> "StatedPrior":
        """The prior for a law with another response, whose exponent means something else."""
        if family == self.response:
            return self
        return self._only(
            [i for i, n in enumerate(self.names) if not n.startswith("response_") or _force(n)]
        )

    def layout(self, own: AnyLayout) -> AnyLayout:
        """A layout with means and standard deviations from here where there are any."""
        sds = np.sqrt(np.diag(self.covariance))
        known = {n: (float(self.mean[i]), float(sds[i])) for i, n in enumerate(self.names)}
        rows = [
            replace(p, mean=known[p.name][0], sd=known[p.name][1]) if p.name in known else p
            for p in own.parameters
        ]
        return replace(own, parameters=tuple(rows))

    def precision(self, own: Layout, precision: Array) -> Array:
        """A prior's precision (p, p) over the layout ``own`` with what is stated here in it."""
        here = [i for i, name in enumerate(own.names) if name in self.names]
        there = [self.names.index(own.names[i]) for i in here]
        covariance = np.linalg.inv(precision)
        covariance[here, :] = 0.0
        covariance[:, here] = 0.0
        covariance[np.ix_(here, here)] = self.covariance[np.ix_(there, there)]
        return np.asarray(np.linalg.inv(covariance))

    def _only(self, kept: list[int]) -> "StatedPrior":
        return replace(
            self,
            names=tuple(self.names[i] for i in kept),
            mean=self.mean[kept],
            covariance=self.covariance[np.ix_(kept, kept)],
        )


def _force(name: str) -> bool:
    return name == "response_force"
