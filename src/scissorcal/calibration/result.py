"""What a fit ends in: posterior draws, parameters as people read them, diagnostics, verdicts."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.verdicts import Verdict, failed

Effort = Literal["draft", "standard", "thorough"]


@dataclass(frozen=True)
class FittedParameter:
    """One parameter with its marginal posterior, in the unit that stands beside it.

    ``believed`` marks what another measurement told before, as photographs tell the edge.
    ``identifiability`` is the ratio of posterior to prior standard deviation: near 0 the data
    speak, near 1 the prior does.
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
    believed: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Give the parameter as the plain object that ``--json`` prints."""
        return {
            "name": self.name,
            "unit": self.unit,
            "mean": self.mean,
            "sd": self.sd,
            "q05": self.q05,
            "q50": self.q50,
            "q95": self.q95,
            "identifiability": self.identifiability,
        }


@dataclass(frozen=True)
class StrokeError:
    """Error on one stroke by a fit that had not seen it.

    ``rms`` and ``relative_rms`` (``rms`` over the rms of what all strokes measured) are taken on
    the band-limited samples that the likelihood uses.
    """

    stroke: int
    recording: str
    kind: str
    speed: float
    rms: float
    relative_rms: float


@dataclass(frozen=True)
class FitSeries:
    """Band-limited data against the fitted model, for plots: all arrays have shape (n,).

    ``time_s`` restarts at every recording; ``recording`` and ``stroke`` index what a point came
    from. ``measured``, ``predicted``, ``band_low`` and ``band_high`` (5 % and 95 % of the
    posterior of the mean) are torque in N m (force in N for a linear joint), signed as the
    quantity that was fitted.
    """

    time_s: NDArray[np.float64]
    recording: NDArray[np.int64]
    stroke: NDArray[np.int64]
    opening: NDArray[np.float64]
    opening_rate: NDArray[np.float64]
    contact: NDArray[np.float64]
    measured: NDArray[np.float64]
    predicted: NDArray[np.float64]
    band_low: NDArray[np.float64]
    band_high: NDArray[np.float64]


@dataclass(frozen=True)
class Proposal:
    """A term that the critic found in what a law leaves unexplained. It proposes; people decide.

    The law would gain ``coefficient`` (``unit``, standard deviation ``coefficient_sd``) times the
    term ``name``, whose ``formula`` is in words. ``inclusion`` is the share of resamples of whole
    strokes in which the search found it; ``held_out_gain`` the share by which it lowers the rms
    error on unseen strokes, ``held_out_nats`` what that is in log density, independent bins only.
    ``adopted_by`` is the recipe's line that takes it into the law; empty where there is none.
    """

    name: str
    formula: str
    coefficient: float
    coefficient_sd: float
    unit: str
    inclusion: float
    held_out_gain: float
    held_out_nats: float
    adopted_by: str
    sentence: str


@dataclass(frozen=True)
class ReplayRow:
    """One stroke that neither side had seen: what a replay and what the model make of it.

    ``novelty`` says in what the stroke differs from the replayed one: "speed", "contact" (where
    along the blades the material is met), "place" (where in the material), joined by " + ", or
    "none". Errors are rms in the unit of the measured effort, over the share ``covered`` of the
    stroke that lies within the replay's range of opening. ``model_rms`` is of a fit that had not
    seen the stroke; ``one_stroke_rms`` of the same law fitted to the replayed stroke alone, NaN
    where that was not done.
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
    """The model against record-and-replay of the stroke ``stroke`` of ``recording``.

    ``opening`` and ``torque`` (k,) are the replay's table; ``sentence`` sums it up.
    """

    stroke: int
    recording: str
    kind: str
    speed: float
    opening: NDArray[np.float64]
    torque: NDArray[np.float64]
    rows: tuple[ReplayRow, ...]
    sentence: str


@dataclass(frozen=True)
class FitResult:
    """The result of one fit: the same type for friction and for a cut.

    ``what`` is "friction" or "cut". ``rung`` names the chosen law in words ("coulomb + viscous,
    asymmetric"); ``structure`` holds the discrete choices that, with a draw, define the law (read
    back by the package compiler). ``draws`` has shape (draws, parameters) in SI, columns in the
    order of ``parameters``; ``map_point`` has shape (parameters,). ``rungs`` lists the rungs that
    were compared, cheapest first, each with ``name``, ``bic``, ``held_out_rms``,
    ``held_out_score``, ``loo``, ``loo_se``, ``loo_k_hat``, ``chosen`` (it is the one used) and
    ``equivalent`` (it cannot be told from the best); ``selection`` says so in words.
    ``critic`` holds what the critic proposes, ``replay`` the comparison with record-and-replay.
    ``prior_draws`` (k, parameters) are the prior's, in SI. ``nuisance`` and ``nuisance_draws``
    (draws, nuisance) are the parameters that nobody asked for, row by row with ``draws``.
    ``derived`` follow from parameters and what the recipe states, with ``derived_draws`` (draws,
    derived) row by row; no law needs them.
    ``diagnostics`` are plain numbers and strings (k_hat, ess, evaluations, whiteness_p, ...).
    ``inputs_hash`` identifies recordings, recipe and settings: equal hashes need no second fit.
    """

    what: Literal["friction", "cut"]
    effort: Effort
    rung: str
    structure: Mapping[str, Any]
    parameters: tuple[FittedParameter, ...]
    draws: NDArray[np.float64]
    map_point: NDArray[np.float64]
    series: FitSeries
    held_out: tuple[StrokeError, ...]
    rungs: tuple[Mapping[str, Any], ...]
    diagnostics: Mapping[str, Any]
    verdicts: tuple[Verdict, ...]
    effort_unit: str
    position_unit: str
    inputs_hash: str
    sources: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=())
    selection: str = ""
    critic: tuple[Proposal, ...] = ()
    replay: ReplayComparison | None = None
    prior_draws: NDArray[np.float64] | None = None
    nuisance: tuple[FittedParameter, ...] = ()
    nuisance_draws: NDArray[np.float64] | None = None
    derived: tuple[FittedParameter, ...] = ()
    derived_draws: NDArray[np.float64] | None = None

    def __repr__(self) -> str:
        """One line: what was fitted, its law, draws and failed verdicts."""
        return (
            f"<{self.what} fit: {self.rung}, {len(self.parameters)} parameters, "
            f"{len(self.draws)} draws, {self.effort}, {len(self.rejected)} of "
            f"{len(self.verdicts)} verdicts failed>"
        )

    @property
    def rejected(self) -> tuple[Verdict, ...]:
        """The verdicts that forbid to use this fit as a calibration: all that failed."""
        return failed(self.verdicts)

    def parameter(self, name: str) -> FittedParameter:
        """Return the parameter called ``name``; KeyError if this fit has none."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(name)

    def column(self, name: str) -> NDArray[np.float64]:
        """Return the posterior draws of one parameter, shape (draws,)."""
        names = [parameter.name for parameter in self.parameters]
        return self.draws[:, names.index(name)]
