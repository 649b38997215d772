"""Fits on disk: netCDF in the ArviZ schema, readable without this project."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
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
    import h5netcdf
    import h5py

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
    import h5netcdf

    part = path.with_name(path.name + ".part")
    path.parent.mkdir(parents=True, exist_ok=True)
    with h5netcdf.File(part, "w") as file:
        for name, group in _groups(result).items():
            _write_group(file.create_group(name), group)
        file["posterior"].attrs.update(
            format=FORMAT,
            inference_library="scissorcal",
            scissorcal=json.dumps(_facts(result), allow_nan=True),
        )
    part.replace(path)


@dataclass(frozen=True)
class _Variable:
    """An array with the names of its dimensions; a coordinate is named as its dimension."""

    dimensions: tuple[str, ...]
    values: NDArray[Any]
    attributes: Mapping[str, str] = field(default_factory=dict)


def _write_group(group: "h5netcdf.Group", variables: Mapping[str, _Variable]) -> None:
    for variable in variables.values():
        for dimension, size in zip(variable.dimensions, variable.values.shape, strict=True):
            if dimension not in group.dimensions:
                group.dimensions[dimension] = size
    for name, variable in variables.items():
        written = group.create_variable(name, variable.dimensions, data=variable.values)
        written.attrs.update(variable.attributes)


def _draws_group(parameters: Sequence[FittedParameter], draws: Array) -> dict[str, _Variable]:
    """Draws (n, parameters) as ArviZ names them."""
    columns = {
        parameter.name: _Variable(
            ("chain", "draw"),
            draws[None, :, index],
            {"unit": parameter.unit, "long_name": parameter.meaning},
        )
        for index, parameter in enumerate(parameters)
    }
    return {
        "chain": _Variable(("chain",), np.array([0])),
        "draw": _Variable(("draw",), np.arange(len(draws))),
        **columns,
    }


_PREDICTED = ("predicted", "band_low", "band_high")
_CONSTANT = ("time_s", "recording", "stroke", "opening", "opening_rate", "contact")


def _groups(result: FitResult) -> dict[str, dict[str, _Variable]]:
    series = result.series

    def by_point(names: Sequence[str]) -> dict[str, _Variable]:
        return {name: _Variable(("point",), getattr(series, name)) for name in names}

    groups = {
        "posterior": _draws_group(result.parameters, result.draws),
        "observed_data": {"torque": _Variable(("point",), series.measured)},
        "posterior_predictive": by_point(_PREDICTED),
        "constant_data": by_point(_CONSTANT),
    }
    if result.prior_draws is not None:
        groups["prior"] = _draws_group(result.parameters, result.prior_draws)
    if result.nuisance_draws is not None and result.nuisance:
        groups["nuisance_posterior"] = _draws_group(result.nuisance, result.nuisance_draws)
    if result.derived_draws is not None and result.derived:
        groups["derived_posterior"] = _draws_group(result.derived, result.derived_draws)
    return groups


@dataclass(frozen=True)
class FitHeader:
    """What a stored fit is of: enough to tell whether it is current, and what law it chose."""

    what: str
    effort: str
    rung: str
    inputs_hash: str


def load_header(path: Path) -> FitHeader:
    """Read what a stored fit is of, without its arrays.

    Raises InputError if it is no fit, damaged, or of a later version.
    """
    with _opened(path) as file:
        facts = _stored_facts(path, file)
        return FitHeader(facts["what"], facts["effort"], facts["rung"], facts["inputs_hash"])


def load_fit(path: Path) -> FitResult:
    """Read a fit written by :func:`save_fit`, of this version or of one before.

    Raises InputError if it is no fit, damaged, or of a later version.
    """
    with _opened(path) as file:
        return _result(file, _stored_facts(path, file))


def _result(file: "h5py.File", facts: Mapping[str, Any]) -> FitResult:
    parameters = _rows(FittedParameter, facts["parameters"])
    nuisance = _rows(FittedParameter, facts.get("nuisance", ()))
    derived = _rows(FittedParameter, facts.get("derived", ()))
    arrays = {name: file["posterior_predictive"][name][...] for name in _PREDICTED}
    arrays |= {name: file["constant_data"][name][...] for name in _CONSTANT}
    return FitResult(
        what=facts["what"],
        effort=facts["effort"],
        rung=facts["rung"],
        structure=facts["structure"],
        parameters=parameters,
        draws=_read_draws(file, "posterior", parameters),
        map_point=np.array(facts["map_point"]),
        series=FitSeries(measured=file["observed_data"]["torque"][...], **arrays),
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
        prior_draws=_read_draws(file, "prior", parameters) if facts.get("has_prior") else None,
        nuisance=nuisance,
        nuisance_draws=_read_draws(file, "nuisance_posterior", nuisance) if nuisance else None,
        derived=derived,
        derived_draws=_read_draws(file, "derived_posterior", derived) if derived else None,
    )


@contextmanager
def _opened(path: Path) -> "Iterator[h5py.File]":
    """Open a stored fit; what is wrong with it is an InputError."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            yield file
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise InputError(
            f"{path} is not a fit of scissorcal, or it is damaged ({error}); "
            "remove it and run 'scissorcal fit' again."
        ) from error


def _stored_facts(path: Path, file: "h5py.File") -> dict[str, Any]:
    attributes = file["posterior"].attrs
    facts: dict[str, Any] = json.loads(attributes["scissorcal"])
    version = str(attributes.get("format", "of no version"))
    if version not in READABLE:
        raise InputError(
            f"{path} is {version}, and this scissorcal reads {' and '.join(READABLE)}: it was "
            "written by a later version; install that one, or run 'scissorcal fit --force'."
        )
    return facts


def _read_draws(file: "h5py.File", group: str, parameters: Sequence[FittedParameter]) -> Array:
    return np.stack([file[group][p.name][0] for p in parameters], axis=1)


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
