"""What ``scissorcal fit friction`` (of either axis) and ``scissorcal fit cut`` say."""

from typing import TYPE_CHECKING

from scissorcal.cli.output import table

if TYPE_CHECKING:
    from collections.abc import Collection

    from scissorcal.calibration.parameters import FittedParameter
    from scissorcal.calibration.result import FitResult
    from scissorcal.workday.runs.fit import FitOutcome


def facts(outcome: "FitOutcome") -> dict[str, object]:
    """What ``--json`` prints of a fit, but for its parameters."""
    fitted: FitResult = outcome.result
    return {
        "what": outcome.what,
        "cached": outcome.cached,
        "state": outcome.state.state,
        "candidate": fitted.candidate,
        "parameters": [parameter.name for parameter in fitted.parameters],
        "effort": fitted.effort,
        "calibration": not fitted.rejected,
        "candidates": fitted.candidates,
        "selection": fitted.selection,
        "critic": fitted.critic,
        "replay": fitted.replay,
        "diagnostics": fitted.diagnostics,
        "held_out": fitted.held_out,
        "inputs_hash": fitted.inputs_hash,
        "notes": fitted.notes,
    }


def text(outcome: "FitOutcome") -> str:
    """What people read of a fit of friction or of a cut."""
    fitted: FitResult = outcome.result
    head = f"{outcome.what}: {fitted.candidate} ({fitted.effort})"
    if outcome.cached:
        head = (
            f"{outcome.what}: nothing changed since the last fit; {fitted.candidate} is as it was"
        )
    if fitted.rejected:
        reasons = "\n".join(f"  {verdict.check}: {verdict.why}" for verdict in fitted.rejected)
        shown = _shown(outcome).replace("\n", "\n  ")
        return (
            f"{outcome.what}: not a calibration:\n{reasons}\n"
            f"{head}; the search ended with these numbers, which are not to be used:\n  {shown}"
        )
    said = [head, _shown(outcome), fitted.selection]
    said += [proposal.sentence for proposal in fitted.critic]
    said += [fitted.replay.sentence] if fitted.replay else []
    said += outcome.state.notes
    if outcome.state.state == "unverified":
        said.append(
            f"unverified: 'scissorcal verify {fitted.words}' checks in about a minute whether "
            "these intervals hold."
        )
    return "\n".join(line for line in said if line)


def critic_text(outcome: "FitOutcome") -> str:
    """What the critic of a fit tried, and how much torque recurs that the law lacks."""
    fitted: FitResult = outcome.result
    judged = [one.why for one in fitted.verdicts if one.check == "structure left"]
    return "\n".join(["", str(fitted.diagnostics["critic"]), *judged])


def _reported(outcome: "FitOutcome") -> "tuple[FittedParameter, ...]":
    return (*outcome.result.parameters, *outcome.result.derived)


def parameter_facts(outcome: "FitOutcome") -> list[dict[str, object]]:
    """Parameters as ``--json`` prints them, each with what is known to be poor about it."""
    from scissorcal.calibration.caveats import (
        NEXT_RECORDING,
        caveats_by_parameter,
        next_recording_sd,
    )

    fit = outcome.result
    known = caveats_by_parameter(fit)
    return [
        {
            **parameter.as_dict(),
            NEXT_RECORDING: next_recording_sd(fit, parameter),
            "caveats": list(known.get(parameter.name, ())),
        }
        for parameter in _reported(outcome)
    ]


def _shown(outcome: "FitOutcome") -> str:
    """The table of parameters, and below it which of their intervals are known to be poor."""
    from scissorcal.calibration.caveats import caveats_of, next_recording_sentence

    fit = outcome.result
    known = caveats_of(fit)
    marked = {name for caveat in known for name in caveat.parameters}
    lines = [_parameter_table(fit, _reported(outcome), marked), next_recording_sentence(fit)]
    lines += [f"* {', '.join(caveat.parameters)}: {caveat.sentence}" for caveat in known]
    return "\n".join(line for line in lines if line)


def _parameter_table(
    fit: "FitResult", parameters: "tuple[FittedParameter, ...]", marked: "Collection[str]" = ()
) -> str:
    """Set out parameters of a fit for people; those that are ``marked`` get an asterisk.

    Where mean and sd do not agree with the quantiles, the median stands in their place.
    """
    from scissorcal.calibration.caveats import COLUMN, next_recording_words

    rows = [["parameter", "unit", "mean", "sd", "5 %", "95 %", COLUMN, "identifiability"]]
    for parameter in parameters:
        mean, sd = f"{parameter.q50:.4g} (median)", "-"
        if parameter.moments:
            mean, sd = (f"{number:.4g}" for number in parameter.moments)
        rows.append(
            [
                f"{parameter.name} *" if parameter.name in marked else parameter.name,
                parameter.unit,
                mean,
                sd,
                f"{parameter.q05:.4g}",
                f"{parameter.q95:.4g}",
                next_recording_words(fit, parameter),
                f"{parameter.identifiability:.2f}",
            ]
        )
    return table(rows, right=range(2, 8))
