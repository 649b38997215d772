"""A fit's design without its outcome: what is needed to simulate it and to fit it again."""

from typing import Literal, Protocol

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.fit_candidate import Candidate
from scissorcal.calibration.parameters import Layout


class Experiment(Protocol):
    """Motion, law and priors of a finished fit, over which other efforts may be thought measured.

    Picklable (arrays and plain values, no closures), so that worker processes can refit.
    ``observed`` (n,) is the effort that was measured at each bin; ``series`` and ``strokes`` (n,)
    label bins as the fit did. ``layout`` holds the priors as the original data and recipe fixed
    them: they are never derived again from simulated data. ``nuisance`` names parameters that are
    inferred and not reported.
    """

    @property
    def what(self) -> Literal["friction", "cut"]: ...

    @property
    def observed(self) -> Array: ...

    @property
    def series(self) -> Integers: ...

    @property
    def strokes(self) -> Integers: ...

    @property
    def layout(self) -> Layout: ...

    @property
    def nuisance(self) -> tuple[str, ...]: ...

    def candidate(self, measured: Array) -> Candidate:
        """Give the fit's candidate over other outcomes (n,) of the same design."""
        ...

    def mean(self, u: Array) -> Array:
        """Expected effort (n,) at unconstrained parameters ``u`` (p,)."""
        ...
