from .chunks import run_end as run_end
from .faulty_values import continued_clock as continued_clock
from .faulty_values import jumps_in as jumps_in
from .faulty_values import lone_excursion as lone_excursion
from .faulty_values import marks_in as marks_in
from .faulty_values import overflows as overflows
from .following import RecordingFollower as RecordingFollower
from .from_arrays import recording_from_arrays as recording_from_arrays
from .from_arrays import recording_from_pandas as recording_from_pandas
from .header import UNTIL_MARK as UNTIL_MARK
from .header import Joint as Joint
from .header import Kind as Kind
from .header import RecordingHeader as RecordingHeader
from .header import Stroke as Stroke
from .header import StrokeKind as StrokeKind
from .header import UntilMark as UntilMark
from .header_reader import read_header as read_header
from .importing import ImportOptions as ImportOptions
from .importing import import_table as import_table
from .layout import CONTROL as CONTROL
from .layout import FRAME as FRAME
from .layout import MESSAGE_DTYPE as MESSAGE_DTYPE
from .layout import PICTURE as PICTURE
from .layout import POSE as POSE
from .layout import SAMPLE_DTYPE as SAMPLE_DTYPE
from .layout import empty_samples as empty_samples
from .probe import PROBE_KEY as PROBE_KEY
from .probe import Estimate as Estimate
from .probe import Posterior as Posterior
from .probe import ProbeResult as ProbeResult
from .probe import Swing as Swing
from .probe import probe_from_dict as probe_from_dict
from .probe import probe_of as probe_of
from .reader import Recovered as Recovered
from .reader import content_hash as content_hash
from .reader import read_attachments as read_attachments
from .reader import read_recording as read_recording
from .reader import read_telemetry as read_telemetry
from .reader import recover as recover
from .recording import UNLOADED_MARK as UNLOADED_MARK
from .recording import Recording as Recording
from .recording import RecordingSummary as RecordingSummary
from .recording import gap_cost as gap_cost
from .recording import summary as summary
from .scan import Attachment as Attachment
from .schema import RecordingFacts as RecordingFacts
from .schema import recording_schema as recording_schema
from .strokes import StrokeLabels as StrokeLabels
from .strokes import TurningPoints as TurningPoints
from .strokes import label_strokes as label_strokes
from .strokes import resolution_of as resolution_of
from .table import size_note as size_note
from .table import unit_in as unit_in
from .table_export import export_channel as export_channel
from .table_export import export_table as export_table
from .table_file import read_headings as read_headings
from .writer import RecordingWriter as RecordingWriter
from .writer import create_locked as create_locked
from .writer import write_recording as write_recording

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
