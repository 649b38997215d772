"""Parameters of a fit: names, units, transforms, priors, and summaries of their draws."""

from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.result import FittedParameter
from scissorcal.model.transforms import Transform


@dataclass(frozen=True)
class Parameter:
    """One parameter with its prior: normal in u, where its value is ``transform.natural(u)``.

    ``mean`` and ``sd`` are the prior's in u. ``believed`` marks a prior from other measurements:
    these data need not narrow it.
    """

    name: str
    unit: str
    transform: Transform
    mean: float
    sd: float
    meaning: str
    believed: bool = False


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
                    believed=parameter.believed,
                )
            )
        return tuple(rows)
