"""What the verification results in: calibration, halves, prior sensitivity, verdicts."""

from dataclasses import dataclass
from typing import Literal, get_args

from scissorcal.calibration.result import Effort, Result
from scissorcal.verdicts import Verdict

FORMAT: Literal["scissorcal-verify/1"] = "scissorcal-verify/1"

CheckKind = Literal["sbc", "halves", "prior"]
CHECKS: tuple[CheckKind, ...] = get_args(CheckKind)
Diagnosis = Literal["fine", "prior-data conflict", "weak likelihood"]
PriorKind = Literal["local", "recipe"]


@dataclass(frozen=True)
class Coverage:
    """Coverage: the share of central intervals of probability ``level`` that contain the truth.

    Where intervals are right, ``share`` is between ``low`` and ``high`` for all quantities and
    levels of one check simultaneously.
    """

    level: float
    share: float
    low: float
    high: float


@dataclass(frozen=True)
class RankedQuantity:
    """One parameter, or the predicted effort, over all simulated fits.

    ``ranks`` and ``truths`` (fits,) are the truth's rank among the posterior's draws and its value
    in ``unit``. ``ecdf_p`` and ``chi_square_p`` test the ranks' uniformity, by their empirical
    distribution and in bins (None with too few fits). ``width`` is the factor by which intervals
    are too narrow (above 1) or too wide (below 1), ``shift`` how far they lie below the truth, in
    their own standard deviations.
    """

    name: str
    unit: str
    ranks: tuple[int, ...]
    truths: tuple[float, ...]
    ecdf_p: float
    chi_square_p: float | None
    width: float
    shift: float
    coverage: tuple[Coverage, ...]


@dataclass(frozen=True)
class RankBand:
    """Simultaneous band for the share of ranks below ``z`` of their range, all (k,).

    The probability that one calibrated quantity leaves it is ``alpha``.
    """

    alpha: float
    z: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]


@dataclass(frozen=True)
class Calibration:
    """Simulation-based calibration of a whole fit, with its motion and its noise.

    Ranks run from 0 to ``levels`` - 1. ``generating`` and ``noise`` name the distributions of
    truths and data; ``spread`` is the factor by which the local prior is wider than the posterior.
    ``escalated`` is the share of fits that continued at a higher effort, ``unreliable`` that of
    fits whose posterior failed its own diagnostics, ``broken`` the error messages of fits without
    a result; ``other_law`` the share that chose another model, whose ranks count for the
    quantities that both models have. ``effective`` is the median
    number of independent draws of a posterior, ``seconds`` the median time of a fit.
    """

    fits: int
    levels: int
    prior: PriorKind
    spread: float
    generating: str
    noise: str
    quantities: tuple[RankedQuantity, ...]
    band: RankBand
    escalated: float
    unreliable: float
    broken: tuple[str, ...]
    effective: float
    seconds: float
    other_law: float = 0.0


@dataclass(frozen=True)
class HalvesRow:
    """One parameter by two halves of the data: ``z`` is the difference over its ``sd``.

    ``first``, ``second`` and ``sd`` are in ``unit``; ``z`` is taken in the fit's unconstrained
    coordinates. ``z`` is None where both halves repeat their common prior.
    """

    name: str
    unit: str
    first: float
    second: float
    sd: float
    z: float | None


@dataclass(frozen=True)
class Halves:
    """Two fits to disjoint strokes: their difference over its standard error.

    ``first_strokes`` and ``second_strokes`` label the strokes, ``split`` names the rule by
    which they were divided. ``statistic`` is the difference's squared Mahalanobis length over
    ``dimensions``, ``p_value`` its probability, from an F distribution with ``independent``
    observations.
    ``effort_difference`` is the rms difference of the predicted effort over all the motion, as a
    share of its rms; ``effort_expected`` is its expected value by the stated uncertainty, and
    ``effort_p_value`` the probability of at least this difference.
    """

    split: str
    first_strokes: tuple[int, ...]
    second_strokes: tuple[int, ...]
    rows: tuple[HalvesRow, ...]
    statistic: float | None
    dimensions: int
    independent: float
    p_value: float | None
    effort_difference: float
    effort_expected: float
    effort_p_value: float | None


@dataclass(frozen=True)
class SensitivityRow:
    """Sensitivity of one quantity's posterior to the powers of prior and likelihood."""

    name: str
    prior: float
    likelihood: float
    diagnosis: Diagnosis


@dataclass(frozen=True)
class Sensitivity:
    """Power-scaling sensitivities, the predicted effort's last; relevant above ``threshold``."""

    threshold: float
    rows: tuple[SensitivityRow, ...]


@dataclass(frozen=True, repr=False)
class VerifyResult(Result):
    """The verification of one fit, as stored in fits/<what>.verify.json.

    ``fit_hash`` is the inputs hash of the fit that was checked, ``fit_content`` the SHA-256 of its
    file. Checks that were not requested are None; ``not_done`` gives the reason for each requested
    check that could not be made. ``false_alarm`` is the probability that any statistical verdict
    fails although the fit is right.
    """

    title = "verification"
    command = "scissorcal verify"

    format: Literal["scissorcal-verify/1"]
    what: Literal["friction", "friction-advance", "cut"]
    fit_hash: str
    candidate: str
    effort: Effort
    seed: int
    calibration: Calibration | None
    halves: Halves | None
    sensitivity: Sensitivity | None
    not_done: tuple[str, ...]
    false_alarm: float
    verdicts: tuple[Verdict, ...]
    fit_content: str = ""

    @property
    def counted_coverage(self) -> bool:
        """Whether coverage was counted, on enough simulated fits to judge it.

        Only such a check verifies a fit; halves and prior sensitivity alone do not.
        """
        return any(v.check == "calibration" and v.status != "not_evaluated" for v in self.verdicts)
