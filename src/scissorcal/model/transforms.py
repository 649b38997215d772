"""Transforms between a parameter's own unit and the real line, where its prior is normal.

Every parameter carries one of these: nothing concludes from a name or a sign that a parameter is
positive. numpy is imported where it is used, so that reading a recipe does not load it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Z_95 = 1.6448536269514722
"""Quantile 0.95 of the standard normal distribution: 90 % lie within +-1.645 sd."""


@dataclass(frozen=True)
class Transform:
    """The identity, and the base of the others: x = u.

    ``name`` is what files and reports call it. A prior of such a parameter is stated as ``mean``
    and ``sd``.
    """

    name: str = "identity"

    def natural(self, u: Array) -> Array:
        """Values x in the parameter's unit from unconstrained u, any shape."""
        import numpy as np

        return np.asarray(u)

    def unconstrained(self, x: Array) -> Array:
        """Unconstrained values u from x in the parameter's unit, any shape."""
        import numpy as np

        return np.asarray(x)

    def normal_prior(self, centre: float, width: float) -> tuple[float, float]:
        """Mean and standard deviation in u of the prior that two numbers of a recipe state."""
        return centre, width


@dataclass(frozen=True)
class _Log(Transform):
    """x = exp(u) > 0. A prior is stated as ``median`` and ``factor_90``."""

    def natural(self, u: Array) -> Array:
        import numpy as np

        return np.asarray(np.exp(u))

    def unconstrained(self, x: Array) -> Array:
        import numpy as np

        return np.asarray(np.log(x))

    def normal_prior(self, centre: float, width: float) -> tuple[float, float]:
        return math.log(centre), math.log(width) / Z_95


@dataclass(frozen=True)
class _Logit(Transform):
    """x = 1 / (1 + exp(-u)), in (0, 1). A prior is stated as ``median`` and ``odds_factor_90``."""

    def natural(self, u: Array) -> Array:
        import numpy as np

        return np.asarray(1.0 / (1.0 + np.exp(-np.asarray(u))))

    def unconstrained(self, x: Array) -> Array:
        import numpy as np

        return np.asarray(np.log(x) - np.log1p(-np.asarray(x)))

    def normal_prior(self, centre: float, width: float) -> tuple[float, float]:
        return math.log(centre / (1.0 - centre)), math.log(width) / Z_95


IDENTITY = Transform()
LOG = _Log("log")
LOGIT = _Logit("logit")
