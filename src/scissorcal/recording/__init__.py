"""Recordings: write, read, recover, import and export what a rig did."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissorcal.recording.header import (
        Joint,
        Kind,
        RecordingHeader,
        Stroke,
        StrokeKind,
    )
    from scissorcal.recording.header_reader import read_header
    from scissorcal.recording.importing import ImportOptions, import_table
    from scissorcal.recording.layout import SAMPLE_DTYPE
    from scissorcal.recording.reader import (
        Recovered,
        content_hash,
        read_attachments,
        read_recording,
        read_telemetry,
        recover,
    )
    from scissorcal.recording.recording import Recording, RecordingSummary, summary
    from scissorcal.recording.scan import Attachment
    from scissorcal.recording.schema import RecordingFacts, recording_schema
    from scissorcal.recording.strokes import StrokeLabels, TurningPoints, label_strokes
    from scissorcal.recording.table_file import export_channel, export_table
    from scissorcal.recording.writer import RecordingWriter, write_recording

__all__ = [
    "SAMPLE_DTYPE",
    "Attachment",
    "ImportOptions",
    "Joint",
    "Kind",
    "Recording",
    "RecordingFacts",
    "RecordingHeader",
    "RecordingSummary",
    "RecordingWriter",
    "Recovered",
    "Stroke",
    "StrokeKind",
    "StrokeLabels",
    "TurningPoints",
    "content_hash",
    "export_channel",
    "export_table",
    "import_table",
    "label_strokes",
    "read_attachments",
    "read_header",
    "read_recording",
    "read_telemetry",
    "recording_schema",
    "recover",
    "summary",
    "write_recording",
]

_HOMES = {
    "table_file": ("export_channel", "export_table"),
    "header": ("Joint", "Kind", "RecordingHeader", "Stroke", "StrokeKind"),
    "header_reader": ("read_header",),
    "importing": ("ImportOptions", "import_table"),
    "layout": ("SAMPLE_DTYPE",),
    "reader": (
        "Recovered",
        "content_hash",
        "read_attachments",
        "read_recording",
        "read_telemetry",
        "recover",
    ),
    "recording": ("Recording", "RecordingSummary", "summary"),
    "scan": ("Attachment",),
    "schema": ("RecordingFacts", "recording_schema"),
    "strokes": ("StrokeLabels", "TurningPoints", "label_strokes"),
    "writer": ("RecordingWriter", "write_recording"),
}


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
