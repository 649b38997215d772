"""Parameters of a fit: names, units, transforms, priors, and summaries of their draws."""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.result import FittedParameter
from scissorcal.model.transforms import Transform


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
