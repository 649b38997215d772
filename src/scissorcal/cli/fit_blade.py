"""What ``scissorcal fit blade`` says."""

from typing import TYPE_CHECKING

from scissorcal.cli.output import table

if TYPE_CHECKING:
    from scissorcal.calibration.edge.result import BladeFit, BladeResult, SeenPair
    from scissorcal.workday.runs.fit import FitOutcome


def facts(outcome: "FitOutcome") -> dict[str, object]:
    """What ``--json`` prints of a blade's fit."""
    from scissorcal.calibration.edge.result import blade_facts

    result: BladeResult = outcome.result
    return {
        "cached": outcome.cached,
        "blades": [blade_facts(fit) for fit in result.blades],
        "openings": result.openings,
        "inputs_hash": result.inputs_hash,
        "pictures": outcome.pictures,
        "notes": [note for fit in result.blades for note in fit.notes],
    }


def text(outcome: "FitOutcome") -> str:
    """What people read of a blade's fit."""
    lines = ["blade: nothing changed since the last fit"] if outcome.cached else []
    for fit in outcome.result.blades:
        lines += [_head(fit), _places(fit), *_nicks(fit), *fit.notes[:-1]]
    lines += [_pair(seen) for seen in outcome.result.openings]
    return "\n".join(lines)


def _pair(seen: "SeenPair") -> str:
    from math import exp

    text = f"{seen.source}: open by {57.29578 * seen.opening_rad:.2f} deg"
    if seen.length_ratio_sd > 0.0:
        text += f", one blade {100.0 * exp(-abs(seen.length_log_ratio)):.1f} % as long as the other"
    if seen.lamp_deg is not None:
        text += f", shadow towards {seen.lamp_deg:.0f} deg"
    return text


def _head(fit: "BladeFit") -> str:
    count = len(fit.photographs)
    length = fit.edge_posterior.edge.length_m
    size = f"{1e3 * length:.2f} mm long" if fit.metric else "of unknown size"
    return f"{fit.name}: {fit.family}, {size}, {count} photograph{'s' if count > 1 else ''}"


def _places(fit: "BladeFit") -> str:
    unit = "mm" if fit.metric else "lengths"
    size = 1e3 if fit.metric else 1.0
    head = [f"station {unit}", f"offset {unit}", "sd", "alpha deg", "sd"]
    rows = [
        [
            f"{size * fit.station[index]:.4g}",
            f"{size * fit.offset.mean[index]:.5g}",
            f"{size * fit.offset.sd[index]:.2g}",
            f"{57.29578 * fit.taper.mean[index]:.4f}",
            f"{57.29578 * fit.taper.sd[index]:.2g}",
        ]
        for index in range(0, len(fit.station), 10)
    ]
    return table([head, *rows], right=range(5))


def _nicks(fit: "BladeFit") -> list[str]:
    size, unit = (1e3, "mm") if fit.metric else (100.0, "% of the length")
    return [
        f"nick {size * nick.station_m:.2f} {unit} from the pivot, {size * nick.width_m:.2f} wide, "
        f"{size * nick.depth_m:.3f} deep ({nick.source})"
        for nick in fit.nicks
    ]
