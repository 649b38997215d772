"""A fit's design, which simulates it and fits it again, and what the fit came to over it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.fit_candidate import Candidate, FittedCandidate
from scissorcal.calibration.parameters import Layout
from scissorcal.calibration.result import Effort
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.inference import Posterior


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


class Design(Experiment, Protocol):
    """The design of a fit to recordings, whose bins have a motion."""

    @property
    def bins(self) -> Bins: ...

    def contact(self, point: Array) -> Array:
        """Distance (m) of the crack from the pivot by bin (n,); NaN where nothing is cut."""
        ...


@dataclass(frozen=True)
class Outcome:
    """What a fit over ``design`` came to: candidates, the chosen one and its posterior.

    ``structure`` holds the discrete choices that, with a draw, define the model. ``simulated`` says
    that the data are those of a study.
    """

    design: Design
    effort: Effort
    compared: list[FittedCandidate]
    chosen: FittedCandidate
    posterior: Posterior
    structure: Mapping[str, Any]
    simulated: bool = False

    @property
    def point(self) -> Array:
        """The optimum (p,) of the chosen candidate."""
        return self.chosen.optimum.point

    @property
    def expected(self) -> Array:
        """Effort (n,) that the chosen candidate expects at its optimum."""
        return self.design.observed - self.chosen.candidate.likelihood.residuals(self.point)
