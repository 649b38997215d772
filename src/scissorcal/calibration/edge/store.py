"""A blade's fit on disk: one JSON file."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from scissorcal.calibration.edge.cells import FoundNick
from scissorcal.calibration.edge.result import (
    Band,
    BladeFit,
    BladeResult,
    PhotographRow,
    RungRow,
    SeenOpening,
)
from scissorcal.errors import InputError
from scissorcal.model import Edge, EdgeBelief
from scissorcal.verdicts import Verdict

Array = NDArray[np.float64]

FORMAT: Literal["scissorcal-blade/1"] = "scissorcal-blade/1"

Row = tuple[float, ...]
Table = tuple[Row, ...]


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class EdgeRecord(_Record):
    """See Edge; metres, or blade lengths where the fit is not ``metric``."""

    family: Literal["line", "arc", "cubic", "spline"]
    offset_m: float
    taper_rad: float
    length_m: float = Field(gt=0)
    curvature_per_m: float = 0.0
    bend_per_m2: float = 0.0
    spline_m: Row = ()
    spline_start_m: float = 0.0


class BandRecord(_Record):
    """Mean, sd, 5 % and 95 %; flat, row by row."""

    mean: Row
    sd: Row
    q05: Row
    q95: Row


class FitRecord(_Record):
    """See BladeFit for what its members mean."""

    name: str
    metric: bool
    edge: EdgeRecord
    names: tuple[str, ...]
    covariance: Table
    draws: Table
    rungs: tuple[RungRow, ...]
    station_m: Row
    offset_m: BandRecord
    taper_rad: BandRecord
    nicks: tuple[FoundNick, ...]
    photographs: tuple[PhotographRow, ...]
    length_sd_m: float
    pivot_sd_m: float
    opening_rad: Row
    contact_m: Row
    height_m: BandRecord | None
    verdicts: tuple[Verdict, ...]
    notes: tuple[str, ...]


class BladeDocument(_Record):
    """The file fits/blade.json."""

    format: Literal["scissorcal-blade/1"] = FORMAT
    blades: tuple[FitRecord, ...]
    openings: tuple[SeenOpening, ...]
    inputs_hash: str
    sources: tuple[str, ...]
    pictures: tuple[str, ...] = ()


def save_blade(result: BladeResult, path: Path) -> None:
    """Write a blade's fit to ``path``, complete or not at all."""
    document = BladeDocument(
        blades=tuple(_record(fit) for fit in result.blades),
        openings=result.openings,
        inputs_hash=result.inputs_hash,
        sources=result.sources,
        pictures=result.pictures,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_text(document.model_dump_json(indent=1) + "\n", "utf-8")
    part.replace(path)


def load_blade(path: Path) -> BladeResult:
    """Read a blade's fit; its ``belief`` is the edge for a cut. Raises InputError if it is none."""
    try:
        found = BladeDocument.model_validate_json(path.read_text("utf-8"))
        blades = tuple(_fit(record) for record in found.blades)
    except (OSError, ValueError, json.JSONDecodeError, ValidationError) as error:
        why = str(error).splitlines()[0]
        raise InputError(
            f"{path} is not a blade's fit of scissorcal, or it is damaged ({why}); remove it and "
            "run 'scissorcal fit blade' again."
        ) from None
    return BladeResult(blades, found.openings, found.inputs_hash, found.sources, found.pictures)


def _record(fit: BladeFit) -> FitRecord:
    edge = EdgeRecord(**asdict(fit.belief.edge))
    return FitRecord(
        name=fit.name,
        metric=fit.metric,
        edge=edge,
        names=fit.belief.names,
        covariance=_table(fit.belief.covariance),
        draws=_table(fit.draws),
        rungs=fit.rungs,
        station_m=_row(fit.station),
        offset_m=_band(fit.offset),
        taper_rad=_band(fit.taper),
        nicks=fit.nicks,
        photographs=fit.photographs,
        length_sd_m=fit.length_sd,
        pivot_sd_m=fit.pivot_sd,
        opening_rad=_row(fit.opening),
        contact_m=_row(fit.contact),
        height_m=_band(fit.height) if fit.height is not None else None,
        verdicts=fit.verdicts,
        notes=fit.notes,
    )


def _fit(record: FitRecord) -> BladeFit:
    edge = Edge(**record.edge.model_dump())
    count = len(record.names)
    opening, contact = np.array(record.opening_rad), np.array(record.contact_m)
    return BladeFit(
        name=record.name,
        belief=EdgeBelief(
            edge, record.names, np.array(record.covariance, dtype=np.float64).reshape(count, count)
        ),
        draws=np.array(record.draws, dtype=np.float64).reshape(-1, count),
        rungs=record.rungs,
        station=np.array(record.station_m),
        offset=_bands(record.offset_m, (-1,)),
        taper=_bands(record.taper_rad, (-1,)),
        nicks=record.nicks,
        photographs=record.photographs,
        length_sd=record.length_sd_m,
        pivot_sd=record.pivot_sd_m,
        metric=record.metric,
        opening=opening,
        contact=contact,
        height=_bands(record.height_m, (len(opening), len(contact))) if record.height_m else None,
        verdicts=record.verdicts,
        notes=record.notes,
    )


def _band(band: Band) -> BandRecord:
    return BandRecord(
        mean=_row(band.mean), sd=_row(band.sd), q05=_row(band.q05), q95=_row(band.q95)
    )


def _bands(record: BandRecord, shape: tuple[int, ...]) -> Band:
    rows = (record.mean, record.sd, record.q05, record.q95)
    return Band(*(np.array(row, dtype=np.float64).reshape(shape) for row in rows))


def _row(values: Array) -> Row:
    return tuple(np.asarray(values, dtype=np.float64).ravel().tolist())


def _table(values: Array) -> Table:
    return tuple(tuple(row) for row in np.asarray(values, dtype=np.float64).tolist())
