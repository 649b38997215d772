"""Fits on disk: netCDF in the ArviZ schema, readable without this project."""

import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.calibration.result import FitResult, FitSeries, FittedParameter, StrokeError
from scissorcal.errors import InputError
from scissorcal.verdicts import Verdict

FORMAT = "scissorcal-fit/1"


def save_fit(result: FitResult, path: Path) -> None:
    """Write a fit to ``path``, complete or not at all.

    Group ``posterior`` has every parameter over (chain, draw) as ArviZ expects it;
    ``observed_data`` the band-limited data, ``constant_data`` what belongs to each point,
    ``posterior_predictive`` the mean's 5 % and 95 %. All else stands as JSON in the attribute
    ``scissorcal`` of ``posterior``.
    """
    import xarray

    names = [parameter.name for parameter in result.parameters]
    posterior = xarray.Dataset(
        {
            name: (("chain", "draw"), result.draws[None, :, index])
            for index, name in enumerate(names)
        },
        coords={"chain": [0], "draw": np.arange(len(result.draws))},
        attrs={
            "format": FORMAT,
            "inference_library": "scissorcal",
            "scissorcal": json.dumps(_facts(result), allow_nan=True),
        },
    )
    for parameter in result.parameters:
        posterior[parameter.name].attrs.update(unit=parameter.unit, long_name=parameter.meaning)
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
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    for index, (group, dataset) in enumerate(groups.items()):
        dataset.to_netcdf(part, mode="a" if index else "w", group=group, engine="h5netcdf")
    part.replace(path)


def load_fit(path: Path) -> FitResult:
    """Read a fit written by :func:`save_fit`. Raises InputError if it is not one."""
    import xarray

    try:
        with xarray.open_dataset(path, group="posterior", engine="h5netcdf") as posterior:
            facts = json.loads(posterior.attrs["scissorcal"])
            draws = np.stack([posterior[p["name"]].values[0] for p in facts["parameters"]], axis=1)
        arrays: dict[str, Any] = {}
        for group in ("observed_data", "posterior_predictive", "constant_data"):
            with xarray.open_dataset(path, group=group, engine="h5netcdf") as dataset:
                arrays.update({str(name): dataset[name].values for name in dataset.data_vars})
    except (OSError, KeyError, ValueError) as error:
        raise InputError(
            f"{path} is not a fit of scissorcal, or it is damaged ({error}); "
            "remove it and run 'scissorcal fit' again."
        ) from error
    arrays["measured"] = arrays.pop("torque")
    series = FitSeries(**{field.name: arrays[field.name] for field in fields(FitSeries)})
    return FitResult(
        what=facts["what"],
        effort=facts["effort"],
        rung=facts["rung"],
        structure=facts["structure"],
        parameters=tuple(FittedParameter(**row) for row in facts["parameters"]),
        draws=draws,
        map_point=np.array(facts["map_point"]),
        series=series,
        held_out=tuple(StrokeError(**row) for row in facts["held_out"]),
        rungs=tuple(facts["rungs"]),
        diagnostics=facts["diagnostics"],
        verdicts=tuple(Verdict(**row) for row in facts["verdicts"]),
        effort_unit=facts["effort_unit"],
        position_unit=facts["position_unit"],
        inputs_hash=facts["inputs_hash"],
        sources=tuple(facts["sources"]),
        notes=tuple(facts["notes"]),
    )


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
    }
