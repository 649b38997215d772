"""The metadata of a recording: its validation and its JSON Schema."""

import json
import math
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from scissorcal.recording.header import FORMAT, Joint, Kind, Stroke, StrokeKind, checksum


class StrokeRecord(BaseModel):
    """One planned movement; see Stroke. ``speed`` is null where there is no single speed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    index: int = Field(ge=0)
    kind: StrokeKind
    speed: float | None = Field(default=None, description="rad/s, or m/s for a linear joint")
    sheet: int = Field(default=-1, ge=-1, description="fresh pieces of material, from 0")


class RecordingMetadata(BaseModel):
    """Description of a recording, stored as MCAP metadata named ``scissorcal.recording``."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    format: Literal["scissorcal-recording/1"] = FORMAT
    kind: Kind
    joint: Literal["rotary", "linear"] = "rotary"
    handle_radius_m: float | None = Field(default=None, description="null where not known")
    strokes: tuple[StrokeRecord, ...] = ()
    min_travel: float | None = Field(
        default=None,
        gt=0,
        description="if set, strokes are found from the motion when the file is read: legs of "
        "at least this travel (rad, or m for a linear joint)",
    )
    recipe_toml: str = Field(default="", description="text of the recipe at capture")
    device: dict[str, Any] = Field(default_factory=dict, description="identity stated by the rig")
    versions: dict[str, str] = Field(default_factory=dict, description="software that wrote it")
    recovered_from: str = Field(
        default="", description="SHA-256 of the half-written file this one was recovered from"
    )

    @property
    def joint_of_recording(self) -> Joint:
        return Joint(self.joint)

    @property
    def strokes_of_recording(self) -> tuple[Stroke, ...]:
        return tuple(
            Stroke(s.index, s.kind, math.nan if s.speed is None else s.speed, s.sheet)
            for s in self.strokes
        )


@dataclass(frozen=True)
class RecordingFacts:
    """What is known of a recording before its first sample, as in Recording.

    ``recipe_toml`` is the recipe's text, ``device`` the rig's identity (plain numbers and
    strings), ``handle_radius_m`` NaN where it is not known. ``min_travel`` [rad, or m] is for
    motion that was not planned, in place of ``strokes``: they are then found from the motion
    (``label_strokes``) whenever the file is read.
    """

    recipe_toml: str = ""
    device: Mapping[str, Any] = field(default_factory=dict)
    handle_radius_m: float = math.nan
    strokes: tuple[Stroke, ...] = ()
    min_travel: float | None = None


def describe(kind: Kind, joint: Joint, facts: RecordingFacts) -> RecordingMetadata:
    """Describe a recording, as its file and a table of it hold it (NaN becomes null)."""
    radius_m = facts.handle_radius_m
    return RecordingMetadata(
        kind=kind,
        joint=joint.kind,
        handle_radius_m=radius_m if math.isfinite(radius_m) else None,
        strokes=stroke_records(facts.strokes),
        min_travel=facts.min_travel,
        recipe_toml=facts.recipe_toml,
        device=dict(facts.device),
        versions=versions(),
    )


def recording_schema() -> dict[str, Any]:
    """Return the JSON Schema of a recording's metadata, as ``data_schemas`` has it.

    It describes the object that the entries of the metadata record encode: text as it is,
    everything else as JSON.
    """
    schema = RecordingMetadata.model_json_schema()
    dialect = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": dialect, "$id": "recording.schema.json", **schema}


def stroke_records(strokes: tuple[Stroke, ...]) -> tuple[StrokeRecord, ...]:
    """Turn strokes into what the metadata holds (a speed of NaN becomes null)."""
    return tuple(
        StrokeRecord(
            index=stroke.index,
            kind=stroke.kind,
            speed=stroke.speed if math.isfinite(stroke.speed) else None,
            sheet=stroke.sheet,
        )
        for stroke in strokes
    )


def to_entries(metadata: RecordingMetadata) -> dict[str, str]:
    """Encode the metadata as the text entries of an MCAP metadata record, with a checksum.

    MCAP protects chunks by a checksum but not metadata; ``crc32`` over the other entries lets a
    reader prefer an intact copy (a finished file holds two).
    """
    plain = metadata.model_dump(mode="json")
    entries = {
        key: value if isinstance(value, str) else json.dumps(value, sort_keys=True)
        for key, value in plain.items()
    }
    return {**entries, "crc32": checksum(entries)}


def from_entries(entries: Mapping[str, str]) -> RecordingMetadata:
    """Read the metadata back; ValueError with a sentence if it is damaged or of another format."""
    body = {key: value for key, value in entries.items() if key != "crc32"}
    stated = body.get("format", "")
    if entries.get("crc32") != checksum(body):
        raise ValueError("its description does not match its checksum; restore it from a backup")
    if stated != FORMAT:
        raise ValueError(
            f"its format is {stated!r}, and this version reads {FORMAT!r}; use the "
            "version of scissorcal that wrote it"
        )
    text_fields = {
        name for name, spec in RecordingMetadata.model_fields.items() if _is_text(spec.annotation)
    }
    try:
        return RecordingMetadata.model_validate(
            {key: value if key in text_fields else json.loads(value) for key, value in body.items()}
        )
    except (ValidationError, json.JSONDecodeError) as error:
        lines = [line.strip() for line in str(error).splitlines()]
        what = " ".join(lines[1:3] or lines)
        raise ValueError(
            f"its description is not valid ({what}); restore it from a backup"
        ) from None


def versions() -> dict[str, str]:
    """Return the versions of what writes the file."""
    import mcap
    import numpy as np

    from scissorcal.identity import VERSION

    return {
        "scissorcal": VERSION,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "mcap": mcap.__version__,
    }


def _is_text(annotation: Any) -> bool:
    if annotation is str:
        return True
    arguments = getattr(annotation, "__args__", ())
    return bool(arguments) and all(isinstance(argument, str) for argument in arguments)
