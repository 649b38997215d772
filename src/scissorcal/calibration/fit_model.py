"""A fit's design, how it is run, and what it came to."""

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol, TypeVar

from scissorcal.aliases import Array, Integers, Progress
from scissorcal.calibration.fit_candidate import Candidate, FittedCandidate
from scissorcal.calibration.parameters import Layout, StatedPrior
from scissorcal.calibration.result import Effort
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.calibration.signals.zeros import FELT
from scissorcal.inference import Posterior, Stop
from scissorcal.model import EdgeDistribution
from scissorcal.verdicts import Verdict


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


@dataclass(frozen=True)
class FitRun:
    """How a fit is run, beside its data, recipe, effort and random numbers.

    ``checkpoint`` is a file from which an interrupted thorough fit continues, ``last_chosen`` the
    law that draft effort fits where the recipe allows several. ``stop`` says whether the time
    allowed is used up. ``prior`` replaces the recipe's in a study of simulated data, which goes
    without the verdicts and diagnostics of a fit alone.
    """

    progress: Progress | None = None
    checkpoint: Path | None = None
    last_chosen: str | None = None
    stop: Stop | None = None
    prior: StatedPrior | None = None

    def tell(self, done: float, sentence: str) -> None:
        """Report progress to who follows the fit, if anyone."""
        if self.progress:
            self.progress(done, sentence)


@dataclass(frozen=True)
class FrictionRun(FitRun):
    """How a fit of friction is run: ``critic`` asks for the critic at draft effort too.

    ``tolerance`` is the share of torque by which what the critic finds is judged. ``all_laws``
    compares all candidate laws at draft effort too: they cost less than a second.
    """

    critic: bool = False
    tolerance: float = FELT
    all_laws: bool = False


@dataclass(frozen=True)
class CutRun(FitRun):
    """How a fit of a cut is run, with the edge that photographs gave in the place of the recipe's.

    Where one of ``edge_verdicts``, those on that edge, failed, the fit fails too.
    """

    edge: EdgeDistribution | None = None
    edge_verdicts: tuple[Verdict, ...] = ()


class Named(Protocol):
    """A candidate model, which has its law's name in words."""

    @property
    def name(self) -> str:
        """Name of the law, as :attr:`FitResult.candidate` has it."""
        ...


Law = TypeVar("Law", bound=Named)


def candidates_for(
    effort: Effort,
    candidates: Sequence[Law],
    usual: Callable[[Sequence[Law]], Law],
    last_chosen: str | None = None,
    among: Container[str] = (),
) -> tuple[Law, ...]:
    """The candidates that are fitted at an effort, simplest first.

    Draft fits one: the only one that the recipe leaves, else the one that the last fit of the
    workspace chose (``last_chosen``, its :attr:`FitResult.candidate`), else the one that such data
    usually support, which ``usual`` picks of them. Standard and thorough compare all of them, or
    those that ``among`` names, if any. A name that no candidate has is passed over: the recipe may
    have changed since. ValueError where there is no candidate.
    """
    candidates = [candidate for candidate in candidates if candidate.name in among] or candidates
    if not candidates:
        raise ValueError("The recipe allows no law, so there is no candidate model to fit.")
    if effort != "draft" or len(candidates) == 1:
        return tuple(candidates)
    chosen = [candidate for candidate in candidates if candidate.name == last_chosen]
    return tuple(chosen[:1]) or (usual(candidates),)


def draft_note(
    effort: Effort, candidates: Sequence[Named], fitted: Sequence[Named]
) -> tuple[str, ...]:
    """The note for a result of which one candidate alone was fitted; empty elsewhere."""
    if effort != "draft" or len(fitted) == len(candidates):
        return ()
    return (
        f"Draft effort fitted one law of {len(candidates)}, {fitted[0].name}, and compared it with "
        "none; use standard effort to have the law chosen by the data.",
    )
