"""The parameter table: posterior summaries, and in a word whether the data speak."""

from dataclasses import dataclass
from typing import Literal

from scissorcal.calibration.caveats import caveats_by_parameter
from scissorcal.calibration.checks import PRIOR_ONLY
from scissorcal.calibration.result import FitResult
from scissorcal.report.numbers import Number, finite

Word = Literal["identified", "prior only", "measured before", "not available"]


@dataclass(frozen=True)
class ParameterRow:
    """One parameter; ``identifiability`` is posterior sd / prior sd, ``word`` its meaning.

    ``caveats`` say why its interval is known to be poor for this kind of data.
    """

    name: str
    meaning: str
    unit: str
    mean: Number
    sd: Number
    q05: Number
    q50: Number
    q95: Number
    identifiability: Number
    word: Word
    caveats: tuple[str, ...] = ()


def tabulate_parameters(fit: FitResult) -> tuple[ParameterRow, ...]:
    """One row per parameter, in the fit's order, then what follows from them."""
    known = caveats_by_parameter(fit)
    return tuple(
        ParameterRow(
            parameter.name,
            parameter.meaning,
            parameter.unit,
            finite(parameter.mean),
            finite(parameter.sd),
            finite(parameter.q05),
            finite(parameter.q50),
            finite(parameter.q95),
            finite(parameter.identifiability),
            "measured before"
            if parameter.believed
            else identifiability_word(finite(parameter.identifiability)),
            known.get(parameter.name, ()),
        )
        for parameter in (*fit.parameters, *fit.derived)
    )


def identifiability_word(ratio: Number) -> Word:
    """Say what the ratio of posterior to prior standard deviation means.

    >>> identifiability_word(0.02), identifiability_word(0.99)
    ('identified', 'prior only')
    """
    if ratio is None:
        return "not available"
    return "identified" if ratio <= PRIOR_ONLY else "prior only"
