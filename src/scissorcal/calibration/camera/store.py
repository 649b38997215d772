"""A camera's fit on disk: one JSON file."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from scissorcal.calibration.camera.result import CameraFit, CrossValidation, PixelMap, ViewError
from scissorcal.errors import InputError
from scissorcal.verdicts import Verdict
from scissorcal.vision.geometry.camera import PARAMETERS, Camera

FORMAT: Literal["scissorcal-camera/1"] = "scissorcal-camera/1"

Row = tuple[float | None, ...]
Table = tuple[Row, ...]


class CameraRecord(BaseModel):
    """A camera: pixels of its focal lengths and centre, distortion, size of its pictures."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...]
    width: int
    height: int
    covariance: Table | None


class MapRecord(BaseModel):
    """See PixelMap: rows of numbers, null where the camera sees nothing."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    x: Row
    y: Row
    sd_px: Table
    inside: tuple[tuple[bool, ...], ...]
    difference_px: Table | None


class CameraDocument(BaseModel):
    """The file fits/camera.json; see CameraFit for what its members mean."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    format: Literal["scissorcal-camera/1"] = FORMAT
    camera: CameraRecord
    parameters: tuple[str, ...]
    origin: Literal["fitted", "imported"]
    board: str
    rung: str
    rungs: tuple[dict[str, Any], ...]
    draws: Table
    views: tuple[ViewError, ...]
    bulge_mm: tuple[float, float]
    noise_px: float | None
    stretch: float | None
    region: Table
    region_share: float
    pixel_map: MapRecord | None
    cross: CrossValidation | None
    verdicts: tuple[Verdict, ...]
    inputs_hash: str
    sources: tuple[str, ...]
    notes: tuple[str, ...]


def save_camera(fit: CameraFit, path: Path) -> None:
    """Write a camera's fit to ``path``, complete or not at all."""
    facts = _plain({**asdict(fit), "format": FORMAT, "parameters": PARAMETERS})
    document = CameraDocument.model_validate(facts)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_text(document.model_dump_json(indent=1) + "\n", "utf-8")
    part.replace(path)


def load_camera(path: Path) -> CameraFit:
    """Read a camera's fit. Raises InputError where the file is not one."""
    try:
        found = CameraDocument.model_validate_json(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, ValidationError) as error:
        why = str(error).splitlines()[0]
        raise InputError(
            f"{path} is not a camera of scissorcal, or it is damaged ({why}); remove it and run "
            "'scissorcal fit camera' again."
        ) from None
    record = found.camera
    camera = Camera(
        record.fx,
        record.fy,
        record.cx,
        record.cy,
        record.distortion,
        record.width,
        record.height,
        None if record.covariance is None else _array(record.covariance, (-1, len(PARAMETERS))),
    )
    return CameraFit(
        camera=camera,
        origin=found.origin,
        board=found.board,
        rung=found.rung,
        rungs=found.rungs,
        draws=_array(found.draws, (-1, len(PARAMETERS))),
        views=found.views,
        bulge_mm=found.bulge_mm,
        noise_px=_number(found.noise_px),
        stretch=_number(found.stretch),
        region=_array(found.region, (-1, 2)),
        region_share=found.region_share,
        pixel_map=_map(found.pixel_map),
        cross=found.cross,
        verdicts=found.verdicts,
        inputs_hash=found.inputs_hash,
        sources=found.sources,
        notes=found.notes,
    )


def _map(record: MapRecord | None) -> PixelMap | None:
    if record is None:
        return None
    difference = record.difference_px
    shape = (len(record.y), len(record.x))
    return PixelMap(
        _array(record.x, (-1,)),
        _array(record.y, (-1,)),
        _array(record.sd_px, shape),
        np.array(record.inside, dtype=np.bool_),
        None if difference is None else _array(difference, shape),
    )


def _array(rows: Row | Table, shape: tuple[int, ...]) -> Any:
    return np.array(rows, dtype=np.float64).reshape(shape)


def _number(value: float | None) -> float:
    return float("nan") if value is None else value


def _plain(value: Any) -> Any:
    """Turn arrays into lists and what is not finite into null."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
