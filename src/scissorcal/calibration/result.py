"""What a fit results in: posterior draws, parameters, diagnostics, verdicts."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.fit_views import FitViews
from scissorcal.calibration.parameters import FittedParameter
from scissorcal.recipe.requirements import command_words
from scissorcal.verdicts import Verdict, failed

Effort = Literal["draft", "standard", "thorough"]

PRIOR_ONLY = 0.9
"""A posterior at least this share of its prior's width says that the data are silent."""

MANY = 10.0
"""Degrees of freedom from which the approximation of Wilson and Hilferty is the closer one."""


@dataclass(frozen=True)
class Stored:
    """Where :mod:`scissorcal.calibration.store` writes an array: the annotation of a field.

    ``dims`` names the dimensions; a leading "chain" of length one is added to the array. ``group``
    is the netCDF group, below the object's own unless it begins with "/"; ``name`` is the
    variable's, by default the field's. ``columns`` is an attribute of the same object that names
    the columns of the array's last axis: each column becomes a variable over ``dims``.
    """

    dims: tuple[str, ...]
    group: str = ""
    name: str = ""
    columns: str = ""


def by_name(group: str, columns: str) -> Stored:
    """Draws (n, k) as ArviZ reads them: a variable (chain, draw) for each named column."""
    return Stored(("chain", "draw"), group, columns=columns)


class Result:
    """What every stored result has, and a short ``repr``.

    ``title`` names the kind of result in messages, ``command`` computes it again. ``what`` names
    the quantity, ``inputs_hash`` identifies all that the result depends on, as the
    workspace states it (empty outside one). Where a result has
    them, ``effort``, ``candidate`` (the chosen candidate model), ``candidates``, ``verdicts``,
    ``sources`` and ``notes`` are fields. Subclasses are frozen dataclasses with ``repr=False``; the
    store writes their fields as they are annotated.
    """

    title: ClassVar[str] = "fit"
    command: ClassVar[str] = "scissorcal fit"
    what: str
    inputs_hash: str

    @property
    def model(self) -> str:
        """The chosen candidate model in words; empty where there is only one model."""
        return str(getattr(self, "candidate", ""))

    @property
    def words(self) -> str:
        """What commands call the result: 'scissorcal fit <words>', 'scissorcal verify <words>'.

        >>> command_words("friction-advance")
        'friction --axis advance'
        """
        return command_words(self.what)

    @property
    def rejected(self) -> tuple[Verdict, ...]:
        """The verdicts that forbid to use this result: all that failed."""
        verdicts: tuple[Verdict, ...] = getattr(self, "verdicts", ())
        return failed(verdicts)

    def __repr__(self) -> str:
        words = [self.what, self.model, str(getattr(self, "effort", ""))]
        bad = ", ".join(verdict.check for verdict in self.rejected)
        words.append(f"failed: {bad}" if bad else "no check failed")
        return f"<{type(self).__name__} {'; '.join(word for word in words if word)}>"


@dataclass(frozen=True)
class Header:
    """What a stored result is of: enough for its state, without its arrays.

    ``model`` is the chosen candidate model in words, ``failed`` names the checks that failed,
    ``origin`` is "fitted" or "imported"; ``effort`` is empty where a result has none.
    """

    what: str
    effort: str
    model: str
    inputs_hash: str
    failed: tuple[str, ...]
    origin: str = "fitted"


@dataclass(frozen=True)
class StrokeError:
    """Hold-out error: one stroke as predicted by a fit without it.

    ``rms`` and ``relative_rms`` (``rms`` over that of the measured effort of all strokes) are of
    the band-limited samples that the likelihood uses, ``independent`` is how many independent ones
    these are worth, NaN where that is not known.
    """

    stroke: int
    recording: str
    kind: str
    speed: float
    rms: float
    relative_rms: float
    independent: float = float("nan")

    def interval(self, tail: float = 0.05) -> tuple[float, float]:
        """Interval of ``relative_rms``: see :func:`rms_interval`."""
        return rms_interval(self.relative_rms, self.independent, tail)


def rms_interval(rms: float, independent: float, tail: float = 0.05) -> tuple[float, float]:
    """Interval of an rms error that leaves ``tail`` on either side; NaN where not known.

    Of n independent normal errors, n rms^2 over their variance is chi-squared with n degrees of
    freedom; its quantiles are those of Wilson and Hilferty (doi:10.1073/pnas.17.12.684), the lower
    one for few degrees that of the density's first term.
    """
    from statistics import NormalDist

    n, few = independent, min(independent, MANY)
    if not n > 0.0:
        return float("nan"), float("nan")
    reach = NormalDist().inv_cdf(1.0 - tail) * (2.0 / (9.0 * n)) ** 0.5
    middle = 1.0 - 2.0 / (9.0 * n)
    upper = n * max(middle + reach, 0.0) ** 3
    first = 2.0 * (tail * math.gamma(0.5 * few + 1.0)) ** (2.0 / few)
    lower = max(n * max(middle - reach, 0.0) ** 3, first)
    low = (n / upper) ** 0.5 if upper > 0.0 else 0.0
    high = (n / lower) ** 0.5 if lower > 0.0 else float("inf")
    return rms * low, rms * high


def worst_stroke(errors: Sequence[StrokeError]) -> StrokeError | None:
    """The stroke that is shown to be predicted worst; None where no error is finite.

    The largest of many errors is that of the smallest stroke: of two samples, one in twenty is 1.7
    times their true size. So the lower ends of intervals are compared, together of 95 %
    (Bonferroni): a stroke of a few samples is the worst only if chance would not make it so. Where
    no stroke states its independent samples, errors are compared.
    """
    known = [error for error in errors if np.isfinite(error.relative_rms)]
    if not known:
        return None
    tail = 0.05 / len(known)
    return max(known, key=lambda one: (np.nan_to_num(one.interval(tail)[0]), one.relative_rms))


_CONSTANT = Stored(("point",), "/constant_data")
_PREDICTED = Stored(("point",), "/posterior_predictive")


@dataclass(frozen=True)
class FitSeries:
    """Band-limited data and the fitted model, for plots: all arrays have shape (n,).

    ``time_s`` restarts at every recording; ``recording`` and ``stroke`` are the indices of a
    point's recording and stroke. ``measured``, ``predicted``, ``band_low`` and ``band_high`` (5 %
    and 95 % of the posterior of the mean) are torque in N m (force in N for a linear joint), with
    the sign of the quantity that was fitted.
    """

    time_s: Annotated[Array, _CONSTANT]
    recording: Annotated[Integers, _CONSTANT]
    stroke: Annotated[Integers, _CONSTANT]
    opening: Annotated[Array, _CONSTANT]
    opening_rate: Annotated[Array, _CONSTANT]
    contact: Annotated[Array, _CONSTANT]
    measured: Annotated[Array, Stored(("point",), "/observed_data", "torque")]
    predicted: Annotated[Array, _PREDICTED]
    band_low: Annotated[Array, _PREDICTED]
    band_high: Annotated[Array, _PREDICTED]


@dataclass(frozen=True)
class Proposal:
    """A term that the critic found in the residuals, as a proposal for the model.

    The term ``name`` (``formula`` in words) has a ``coefficient`` in ``unit`` with the standard
    deviation ``coefficient_sd``. ``size`` is twice the rms of what it adds to the law, in the unit
    of the measured effort. ``inclusion`` is the share of searches without a quarter of the strokes
    that found it, ``held_out_gain`` the share by which it lowers the rms hold-out error,
    ``held_out_nats`` its gain in log density, independent points only. ``adopted_by`` is the line
    of the recipe that adds it to the model; empty where there is none.
    """

    name: str
    formula: str
    coefficient: float
    coefficient_sd: float
    unit: str
    size: float
    inclusion: float
    held_out_gain: float
    held_out_nats: float
    adopted_by: str
    sentence: str


@dataclass(frozen=True)
class ReplayRow:
    """One stroke that neither the replay nor the fit has used, as predicted by both.

    ``novelty`` names the differences from the replayed stroke: "speed", "contact" (position of the
    material along the blades), "place" (position in the material), joined by " + ", or "none".
    Errors are rms in the unit of the measured effort, over the share ``covered`` of the stroke
    within the replay's range of opening. ``model_rms`` is of a fit without the stroke,
    ``one_stroke_rms`` of the same model fitted to the replayed stroke alone, NaN where that was
    not done.
    """

    stroke: int
    recording: str
    novelty: str
    speed: float
    covered: float
    measured_rms: float
    replay_rms: float
    model_rms: float
    one_stroke_rms: float


@dataclass(frozen=True)
class ReplayComparison:
    """The model compared with record-and-replay of the stroke ``stroke`` of ``recording``.

    ``opening`` and ``torque`` (k,) are the replay's table; ``sentence`` is the summary.
    """

    stroke: int
    recording: str
    kind: str
    speed: float
    opening: Annotated[Array, Stored(("opening",))]
    torque: Annotated[Array, Stored(("opening",))]
    rows: tuple[ReplayRow, ...]
    sentence: str


@dataclass(frozen=True)
class Predictive:
    """Replicated data and log-likelihoods, which ``arviz.plot_ppc`` and ``arviz.loo`` read.

    ``torque`` (replicates, n) is what the model would measure at the points of
    :class:`FitSeries`: the mean by a draw of the posterior, and a draw of the noise. ``stroke``
    (strokes,) labels the log-likelihoods: whole strokes are the independent units.
    ``log_likelihood`` (draws, strokes) is the chosen candidate's, ``candidate_log_likelihoods``
    (draws, strokes, candidates) those of all that came near the best; None at draft effort. They
    are multiplied by ``independent_share``, the share of points that are independent, the same for
    all candidates of a fit, and relative to ``log_likelihood_reference`` (strokes,), each stroke's
    largest value, since their level depends on the unit of torque. ``log_likelihood_draws`` (draws,
    parameters), columns in the order of ``parameters``, in SI, are the draws of the chosen
    candidate at which they hold, row by row: equally weighted draws of the posterior whose
    likelihood is taken to such a power
    (:func:`scissorcal.calibration.candidates.leave_strokes_out`). The draws of the result are of
    another, which is wider by what recordings differ in and by what the law lacks.
    """

    torque: Annotated[
        NDArray[np.float32], Stored(("chain", "draw", "point"), "/posterior_predictive")
    ]
    stroke: Annotated[Integers, Stored(("stroke",), "/log_likelihood")]
    log_likelihood: Annotated[
        Array | None, Stored(("chain", "draw", "stroke"), "/log_likelihood", "torque")
    ]
    log_likelihood_reference: Annotated[Array, Stored(("stroke",), "/reference", "log_likelihood")]
    independent_share: float
    log_likelihood_draws: Annotated[
        Array | None, by_name("/log_likelihood_posterior", "parameters")
    ] = None
    parameters: tuple[str, ...] = ()
    candidates: tuple[str, ...] = ()
    candidate_log_likelihoods: Annotated[
        Array | None, Stored(("chain", "draw", "stroke"), "/candidates", columns="candidates")
    ] = None


@dataclass(frozen=True, repr=False)
class FitResult(FitViews, Result):
    """The result of one fit: the same type for friction and for a cut.

    ``what`` is "friction" (of the opening), "friction-advance" (of the carriage) or "cut".
    ``candidate`` names the chosen candidate model in words ("coulomb + viscous, asymmetric");
    ``structure`` holds the discrete choices that, with a draw, define the model (the package
    compiler reads them). ``draws`` (draws, parameters) are in SI, columns in the order of
    ``parameters``; ``map_point`` has shape (parameters,). ``candidates`` lists the laws that were
    compared, cheapest first, each with ``name``, ``bic``, ``held_out_rms``, ``held_out_elpd``,
    ``loo``, ``loo_se``, ``loo_k_hat``, ``chosen`` (it is the one used) and ``equivalent`` (not
    distinguishable from the best); ``selection`` is the same in words. ``critic`` holds the terms
    that the critic proposes, ``proposed`` (n,) what they add to the law at the points of
    ``series``, ``replay`` the comparison with record-and-replay. ``prior_draws`` (k, parameters)
    are the prior's, in SI. ``nuisance`` and ``nuisance_draws`` (draws, nuisance) are parameters
    that are inferred and not reported, row by row with ``draws``. ``derived`` follow from
    parameters and the recipe, with ``derived_draws`` (draws, derived) row by row; no model needs
    them. ``diagnostics`` are plain numbers and strings (k_hat, ess, evaluations, whiteness_p, ...).
    ``sources`` names the recordings, and ``used`` has an array (k, 2) for each: first and one past
    the last sample of each part that the fit uses. ``inputs_hash`` identifies recordings, recipe
    and settings: equal hashes need no second fit.
    """

    title = "friction or cut fit"

    what: Literal["friction", "friction-advance", "cut"]
    effort: Effort
    candidate: str
    structure: Mapping[str, Any]
    parameters: tuple[FittedParameter, ...]
    draws: Annotated[Array, by_name("/posterior", "parameters")]
    map_point: Annotated[Array, Stored((), "/optimum", columns="parameters")]
    series: FitSeries
    held_out: tuple[StrokeError, ...]
    candidates: tuple[Mapping[str, Any], ...]
    diagnostics: Mapping[str, Any]
    verdicts: tuple[Verdict, ...]
    effort_unit: str
    position_unit: str
    inputs_hash: str
    sources: tuple[str, ...] = ()
    used: tuple[Integers, ...] = ()
    notes: tuple[str, ...] = field(default=())
    selection: str = ""
    critic: tuple[Proposal, ...] = ()
    proposed: Annotated[Array | None, Stored(("point",), "/posterior_predictive")] = None
    replay: ReplayComparison | None = None
    prior_draws: Annotated[Array | None, by_name("/prior", "parameters")] = None
    nuisance: tuple[FittedParameter, ...] = ()
    nuisance_draws: Annotated[Array | None, by_name("/nuisance_posterior", "nuisance")] = None
    derived: tuple[FittedParameter, ...] = ()
    derived_draws: Annotated[Array | None, by_name("/derived_posterior", "derived")] = None
    predictive: Predictive | None = None

    def parameter(self, name: str) -> FittedParameter:
        """Return the parameter called ``name``; KeyError if this fit has none."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(name)

    @property
    def best(self) -> dict[str, float]:
        """Values by name: the most probable point, with nuisance parameters at their means."""
        values = {p.name: float(v) for p, v in zip(self.parameters, self.map_point, strict=True)}
        return values | {p.name: p.mean for p in self.nuisance}

    @property
    def columns(self) -> dict[str, Array]:
        """Posterior draws (draws,) by name, those of nuisance parameters among them."""
        columns = {p.name: self.draws[:, i] for i, p in enumerate(self.parameters)}
        if self.nuisance_draws is None:
            return columns
        return columns | {p.name: self.nuisance_draws[:, i] for i, p in enumerate(self.nuisance)}

    def column(self, name: str) -> NDArray[np.float64]:
        """Return the posterior draws of one parameter, shape (draws,)."""
        names = [parameter.name for parameter in self.parameters]
        return self.draws[:, names.index(name)]
