"""Fits on disk: netCDF in the ArviZ schema, readable without this project."""

import json
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.result import (
    FitResult,
    FitSeries,
    FittedParameter,
    Proposal,
    ReplayComparison,
    ReplayRow,
    StrokeError,
)
from scissorcal.errors import InputError
from scissorcal.verdicts import Verdict

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]
Row = TypeVar("Row")

FORMAT = "scissorcal-fit/2"
READABLE = ("scissorcal-fit/1", FORMAT)
"""Files of before lack what came later, which is then empty."""


def save_fit(result: FitResult, path: Path) -> None:
    """Write a fit to ``path``, complete or not at all.

    Group ``posterior`` has every parameter over (chain, draw) as ArviZ expects it;
    ``prior`` draws of the prior where there are any, ``nuisance_posterior`` the draws of nuisance
    parameters, ``derived_posterior`` those of what follows from parameters, ``observed_data`` the
    band-limited data, ``constant_data`` what belongs to each point, ``posterior_predictive`` the
    mean's 5 % and 95 %. All else stands as JSON in the attribute ``scissorcal`` of ``posterior``.
    """
    posterior = _draws_group(result.parameters, result.draws)
    posterior.attrs.update(
        format=FORMAT,
        inference_library="scissorcal",
        scissorcal=json.dumps(_facts(result), allow_nan=True),
    )
    part = path.with_name(path.name + ".part")
    path.parent.mkdir(parents=True, exist_ok=True)
    for index, (group, dataset) in enumerate(_groups(result, posterior).items()):
        dataset.to_netcdf(part, mode="a" if index else "w", group=group, engine="h5netcdf")
    part.replace(path)


def _draws_group(parameters: Sequence[FittedParameter], draws: Array) -> "xarray.Dataset":
    """Draws (n, parameters) as ArviZ names them."""
    import xarray

    group = xarray.Dataset(
        {
            parameter.name: (("chain", "draw"), draws[None, :, index])
            for index, parameter in enumerate(parameters)
        },
        coords={"chain": [0], "draw": np.arange(len(draws))},
    )
    for parameter in parameters:
        group[parameter.name].attrs.update(unit=parameter.unit, long_name=parameter.meaning)
    return group


def _groups(result: FitResult, posterior: "xarray.Dataset") -> dict[str, "xarray.Dataset"]:
    import xarray

    series = asdict(result.series)
    groups = {
        "posterior": posterior,
        "observed_data": xarray.Dataset({"torque": ("point", series["measured"])}),
        "posterior_predictive": xarray.Dataset(
            {name: ("point", series[name]) for name in ("predicted", "band_low", "band_high")}
        ),
        "constant_data": xarray.Dataset(
            {
                name: ("point", series[name])
                for name in ("time_s", "recording", "stroke", "opening", "opening_rate", "contact")
            }
        ),
    }
    if result.prior_draws is not None:
        groups["prior"] = _draws_group(result.parameters, result.prior_draws)
    if result.nuisance_draws is not None and result.nuisance:
        groups["nuisance_posterior"] = _draws_group(result.nuisance, result.nuisance_draws)
    if result.derived_draws is not None and result.derived:
        groups["derived_posterior"] = _draws_group(result.derived, result.derived_draws)
    return groups


def load_fit(path: Path) -> FitResult:
    """Read a fit written by :func:`save_fit`, of this version or of one before.

    Raises InputError if it is no fit, damaged, or of a later version.
    """
    import xarray

    try:
        with xarray.open_dataset(path, group="posterior", engine="h5netcdf") as posterior:
            facts = json.loads(posterior.attrs["scissorcal"])
            _refuse_later(path, str(posterior.attrs.get("format", "of no version")))
        parameters = _rows(FittedParameter, facts["parameters"])
        nuisance = _rows(FittedParameter, facts.get("nuisance", ()))
        derived = _rows(FittedParameter, facts.get("derived", ()))
        draws = _read_draws(path, "posterior", parameters)
        prior = _read_draws(path, "prior", parameters) if facts.get("has_prior") else None
        others = _read_draws(path, "nuisance_posterior", nuisance) if nuisance else None
        arrays: dict[str, Any] = {}
        for group in ("observed_data", "posterior_predictive", "constant_data"):
            with xarray.open_dataset(path, group=group, engine="h5netcdf") as dataset:
                arrays.update({str(name): dataset[name].values for name in dataset.data_vars})
        arrays["measured"] = arrays.pop("torque")
        return FitResult(
            what=facts["what"],
            effort=facts["effort"],
            rung=facts["rung"],
            structure=facts["structure"],
            parameters=parameters,
            draws=draws,
            map_point=np.array(facts["map_point"]),
            series=FitSeries(**{field.name: arrays[field.name] for field in fields(FitSeries)}),
            held_out=_rows(StrokeError, facts["held_out"]),
            rungs=tuple(facts["rungs"]),
            diagnostics=facts["diagnostics"],
            verdicts=_rows(Verdict, facts["verdicts"]),
            effort_unit=facts["effort_unit"],
            position_unit=facts["position_unit"],
            inputs_hash=facts["inputs_hash"],
            sources=tuple(facts["sources"]),
            notes=tuple(facts["notes"]),
            selection=facts.get("selection", ""),
            critic=_rows(Proposal, facts.get("critic", ())),
            replay=_replay(facts.get("replay")),
            prior_draws=prior,
            nuisance=nuisance,
            nuisance_draws=others,
            derived=derived,
            derived_draws=_read_draws(path, "derived_posterior", derived) if derived else None,
        )
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise InputError(
            f"{path} is not a fit of scissorcal, or it is damaged ({error}); "
            "remove it and run 'scissorcal fit' again."
        ) from error


def _refuse_later(path: Path, version: str) -> None:
    if version not in READABLE:
        raise InputError(
            f"{path} is {version}, and this scissorcal reads {' and '.join(READABLE)}: it was "
            "written by a later version; install that one, or run 'scissorcal fit --force'."
        )


def _read_draws(path: Path, group: str, parameters: Sequence[FittedParameter]) -> Array:
    import xarray

    with xarray.open_dataset(path, group=group, engine="h5netcdf") as dataset:
        return np.stack([dataset[p.name].values[0] for p in parameters], axis=1)


def _rows(kind: type[Row], rows: Sequence[dict[str, Any]]) -> tuple[Row, ...]:
    return tuple(kind(**row) for row in rows)


def _replay(facts: dict[str, Any] | None) -> ReplayComparison | None:
    if facts is None:
        return None
    arrays = {name: np.array(facts[name], dtype=np.float64) for name in ("opening", "torque")}
    return ReplayComparison(**{**facts, **arrays, "rows": _rows(ReplayRow, facts["rows"])})


def _facts(result: FitResult) -> dict[str, Any]:
    return {
        "what": result.what,
        "effort": result.effort,
        "rung": result.rung,
        "structure": dict(result.structure),
        "parameters": [asdict(parameter) for parameter in result.parameters],
        "map_point": result.map_point.tolist(),
        "held_out": [asdict(error) for error in result.held_out],
        "rungs": [dict(rung) for rung in result.rungs],
        "diagnostics": dict(result.diagnostics),
        "verdicts": [asdict(verdict) for verdict in result.verdicts],
        "effort_unit": result.effort_unit,
        "position_unit": result.position_unit,
        "inputs_hash": result.inputs_hash,
        "sources": list(result.sources),
        "notes": list(result.notes),
        "selection": result.selection,
        "critic": [asdict(proposal) for proposal in result.critic],
        "replay": _replay_facts(result.replay),
        "has_prior": result.prior_draws is not None,
        "nuisance": [asdict(parameter) for parameter in result.nuisance],
        "derived": [asdict(parameter) for parameter in result.derived],
    }


def _replay_facts(replay: ReplayComparison | None) -> dict[str, Any] | None:
    if replay is None:
        return None
    arrays = {"opening": replay.opening.tolist(), "torque": replay.torque.tolist()}
    return {**asdict(replay), **arrays}
