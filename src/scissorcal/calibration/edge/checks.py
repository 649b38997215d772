"""Checks of a blade's fit: each photograph, the photographs together, both blades of a pair."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from scissorcal.calibration.camera.checks import MOST_SD_PX
from scissorcal.calibration.edge.model import MOST_EVALUATIONS
from scissorcal.calibration.edge.result import BladeFit, EdgeCandidate, PhotographRow, SeenPair
from scissorcal.inference import Effort, SamplingStatus
from scissorcal.verdicts import INTERVALS, STATED, Check, Verdict

MOST_DISAGREEMENT = 3.5
MOST_APART = 0.005
"""Shares of the blade's length by which photographs of one blade may differ."""

FALSE_ALARMS = 0.01
"""Share of sound fits that *residual against claimed sd* may fail, and of sound photographs that
*blade lengths* may: each is judged by the normal distribution's quantile for it."""

STRETCHES = 8
"""Parts of the edge of which residuals are averaged: longer than the reach of its roughness."""


UNTRUSTED = (
    SamplingStatus.HEAVY_WEIGHTS,
    SamplingStatus.DISAGREEING,
    SamplingStatus.BUDGET_USED_UP,
    SamplingStatus.STUCK,
)
EDGE = "shape of the edge, which torque follows"
CLEAR_EDGE = Check(
    "fit.blade clear edge", f"{EDGE}: share of points that are neither edge nor nick", at_most=0.15
)
PHOTOGRAPHS_AGREE = Check(
    "fit.blade photographs agree", f"{EDGE}: sds between them, or share of length", at_most=STATED
)
RESIDUAL = Check(
    "fit.blade residual against claimed sd",
    f"{INTERVALS} of the edge: mean residual of an eighth of the edge in sds that are claimed "
    "there",
    at_most=STATED,
)
CAMERA = Check(
    "fit.blade camera", f"{EDGE}: camera's standard error at the blade, px", at_most=MOST_SD_PX
)
SIZES_OF_ERRORS = Check("fit.blade sizes of the errors", f"{INTERVALS} of the edge")
BLADE_LENGTHS = Check(
    "fit.blade blade lengths",
    f"{EDGE}: difference of a pair's blades in length, in sds of equally long ones",
    at_most=STATED,
)
LAMPS_APART = Check(
    "fit.blade lamps apart",
    f"{EDGE}: whether a shadow taken for metal would show: angle between lamps, deg",
    at_least=45.0,
)
"""Least angle between lamps: a shadow that widens one side of a blade by w changes by 0.7 w."""


def blade_verdicts(
    fit: BladeFit, best: EdgeCandidate, status: SamplingStatus, sentence: str, effort: Effort
) -> tuple[Verdict, ...]:
    """The verdicts on one blade's fit."""
    spoilt = max(row.spoilt_share for row in fit.photographs)
    worst = max(fit.photographs, key=lambda row: row.spoilt_share).source
    checks = [
        CLEAR_EDGE.judge(
            spoilt,
            f"In {worst} {100 * spoilt:.1f} % of the edge's points belong neither to a smooth edge "
            f"nor to a nick; {100 * CLEAR_EDGE.threshold:.0f} % are allowed.",
        ),
        _agreement(fit, best),
        _residuals(fit, best),
    ]
    if status in UNTRUSTED:
        checks.append(
            SIZES_OF_ERRORS.verdict(
                "fail",
                None,
                f"{sentence} Sampling may take {MOST_EVALUATIONS[effort]} evaluations at "
                f"{effort} effort, and {MOST_EVALUATIONS['thorough']} with --effort thorough.",
            )
        )
    scope = "fit.blade" if fit.name == "blade" else f"fit.blade.{fit.name}"
    return tuple(verdict.of(scope) for verdict in checks)


def pair_verdicts(pairs: Sequence[SeenPair]) -> tuple[Verdict, ...]:
    """The verdicts on photographs of open scissors: both blades' lengths, and the lamps."""
    opened = [pair for pair in pairs if pair.length_ratio_sd > 0.0]
    if not opened:
        return ()
    return (_lengths(opened), _lamps(opened))


def _agreement(fit: BladeFit, best: EdgeCandidate) -> Verdict:
    """Whether photographs show one blade: first by what the fit had to allow them, then by each."""
    if len(fit.photographs) < 2:
        why = "One photograph does not show how far others of the same blade would agree."
        return PHOTOGRAPHS_AGREE.not_evaluated(why)
    apart = best.between_m / fit.edge_posterior.edge.length_m
    if apart > MOST_APART:
        return PHOTOGRAPHS_AGREE.judge(
            apart,
            f"The photographs differ by {100 * apart:.1f} % of the blade's length; "
            f"{100 * MOST_APART:g} % are allowed. Photograph one blade only, and from straight "
            "above where there is no mat.",
            threshold=MOST_APART,
        )
    spread = max(np.median([abs(row.away) for row in fit.photographs]) * 1.4826, 1e-12)
    scale = [max(row.away_sd, spread) for row in fit.photographs]
    value = max(abs(row.away) / s for row, s in zip(fit.photographs, scale, strict=True))
    return PHOTOGRAPHS_AGREE.judge(
        float(value),
        f"The photograph farthest from the joint edge is {value:.1f} standard deviations "
        f"away; {MOST_DISAGREEMENT:g} are allowed.",
        threshold=MOST_DISAGREEMENT,
    )


def _residuals(fit: BladeFit, best: EdgeCandidate) -> Verdict:
    """Whether the fitted edge follows the measured one as closely as its sd claims.

    The statistic is the largest mean residual of a stretch over its sd: that of the edge there, of
    the mean of its points, and what photographs of one blade may differ by. Each is normal with at
    most unit variance where the fit is sound, so the quantile of `FALSE_ALARMS` over twice their
    number bounds false alarms however stretches depend on one another (Bonferroni).
    """
    from scipy.special import ndtri

    rows = [row for row in fit.photographs if len(row.residual) > 2]
    if not rows:
        return RESIDUAL.not_evaluated("The residuals of the points were not kept.")
    worst_by_row = [(_worst_stretch(row, fit, best), row) for row in rows]
    (value, place, off, sd), row = max(worst_by_row, key=lambda pair: pair[0][0])
    limit = float(-ndtri(0.5 * FALSE_ALARMS / (STRETCHES * len(rows))))
    size, unit = (1e3, "mm") if fit.metric else (100.0, "% of the length")
    return RESIDUAL.judge(
        value,
        f"In {row.source} the measured edge is at most {value:.1f} standard deviations from the "
        f"fitted one over an eighth of its length: {size * off:.3f} {unit} at station "
        f"{size * place:.3g}, where {size * sd:.3f} are claimed. At most {100 * FALSE_ALARMS:g} % "
        f"of sound fits exceed {limit:.2f}.",
        f"In {row.source} the measured edge is {value:.1f} standard deviations from the fitted one "
        f"over an eighth of its length: {size * off:.3f} {unit} at station {size * place:.3g}, "
        f"where {size * sd:.3f} are claimed; {limit:.2f} are allowed. Photograph the blade again "
        "with the lamp elsewhere, and leave this photograph out if the others agree.",
        threshold=limit,
    )


def _worst_stretch(
    row: PhotographRow, fit: BladeFit, best: EdgeCandidate
) -> tuple[float, float, float, float]:
    """Largest mean residual over its sd in one photograph; its place, size and sd."""
    station, residual = np.array(row.station), np.array(row.residual)
    several = len(fit.photographs) > 1
    parts = np.array_split(np.argsort(station), min(STRETCHES, len(station) // 2))
    stretches = []
    for part in parts:
        place, off = float(station[part].mean()), float(residual[part].mean())
        noise = float(residual[part].std(ddof=1)) / np.sqrt(len(part))
        apart = (
            best.between_m * np.hypot(1.0, place / fit.edge_posterior.edge.length_m)
            if several
            else 0.0
        )
        of_photograph = row.away_sd if several else 0.0
        claimed = float(np.interp(place, fit.station, fit.offset.sd))
        sd = float(np.sqrt(claimed**2 + noise**2 + apart**2 + of_photograph**2))
        stretches.append((abs(off) / sd, place, off, sd))
    return max(stretches)


def _lengths(pairs: Sequence[SeenPair]) -> Verdict:
    """Whether both blades look equally long, as far as tips and the camera's tilt allow."""
    from scipy.special import ndtri

    worst = max(pairs, key=lambda pair: abs(pair.length_log_ratio) / pair.length_ratio_sd)
    value = abs(worst.length_log_ratio) / worst.length_ratio_sd
    limit = float(-ndtri(0.5 * FALSE_ALARMS / len(pairs)))
    shorter = 100.0 * float(np.exp(-abs(worst.length_log_ratio)))
    said = (
        f"In {worst.source} one blade is {shorter:.1f} % as long as the other, {value:.1f} "
        "standard deviations from a pair of one length"
    )
    leaning = (
        f" A camera that leans by {worst.tilt_deg:.0f} deg or more would show that; hold it "
        "straight above."
        if worst.tilt_deg > 0.0
        else ""
    )
    return BLADE_LENGTHS.judge(
        value,
        f"{said}; at most {100 * FALSE_ALARMS:g} % of sound pairs exceed {limit:.2f}.",
        f"{said}; {limit:.2f} are allowed.{leaning} Or a tip was not found, or is broken: look at "
        "the picture.",
        threshold=limit,
    )


def _lamps(pairs: Sequence[SeenPair]) -> Verdict:
    """Whether photographs of one pair were lit from several sides of it."""
    if len(pairs) < 2:
        why = "One photograph has one lamp: a shadow taken for metal would not be noticed."
        return LAMPS_APART.not_evaluated(f"{why} Take another with the lamp elsewhere.")
    lamps = [pair.lamp_deg for pair in pairs if pair.lamp_deg is not None]
    if len(lamps) < len(pairs):
        return LAMPS_APART.not_evaluated(
            f"{len(pairs) - len(lamps)} of {len(pairs)} photographs show no cast shadow that tells "
            "where the lamp is."
        )
    apart = max(abs((a - b + 180.0) % 360.0 - 180.0) for a, b in combinations(lamps, 2))
    return LAMPS_APART.judge(
        apart,
        f"The scissors were lit from directions up to {apart:.0f} deg apart.",
        f"All photographs have the lamp on one side of the scissors, within {apart:.0f} deg, so "
        "that their agreement is no evidence: a shadow taken for metal is the same in all. Turn "
        f"the scissors or move the lamp by {LAMPS_APART.threshold:.0f} deg or more, and take "
        "another.",
    )
