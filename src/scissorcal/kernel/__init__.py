"""The C core and its thin binding: wire frames, tables, the model's step, the servo loop."""

from scissorcal.kernel.control import (
    CONTROL_DTYPE,
    AxisFriction,
    Contour,
    ControlConfig,
    ControlFlag,
    ControlTask,
)
from scissorcal.kernel.crack import CrackLaw, CrackPath, Curve, walk_crack
from scissorcal.kernel.cut_fit import (
    CutFitData,
    CutFitParameters,
    cut_log_likelihood,
    cut_log_likelihoods,
)
from scissorcal.kernel.hybrid import (
    HYBRID_INPUT_DTYPE,
    HYBRID_OUTPUT_DTYPE,
    Hybrid,
    HybridConfig,
    HybridFlag,
    NormalLaw,
    hybrid_inputs,
)
from scissorcal.kernel.loop import (
    Histogram,
    LoopBlock,
    LoopCounters,
    ask_for_slice,
    lock_memory,
    run_loop,
)
from scissorcal.kernel.messages import (
    PROTOCOL_VERSION,
    SCHEMA_HASH,
    Capability,
    Command,
    CommandFlag,
    Config,
    ConfigEcho,
    ConfigKey,
    ConfigStatus,
    Hello,
    Identity,
    Message,
    State,
    StateFlag,
)
from scissorcal.kernel.modes import Mode
from scissorcal.kernel.passivity import EnergyLedger, PassivityConfig
from scissorcal.kernel.paths import estimated_rates, presliding_path
from scissorcal.kernel.pieces import (
    MOST_PIECES,
    MOST_STRIPS,
    Piece,
    PiecesModel,
    Strip,
    largest_overlap,
)
from scissorcal.kernel.plate import PlacedModel, PlateConfig, Pull, Section
from scissorcal.kernel.servo import (
    SAMPLE_DTYPE,
    SampleFlag,
    Servo,
    ServoConfig,
    ServoCounters,
)
from scissorcal.kernel.sources import c_sources
from scissorcal.kernel.stepping import STEP_DTYPE, Kernel, StepFlag, StepOutput
from scissorcal.kernel.stop_reason import StopReason
from scissorcal.kernel.table16 import Row16, Table16
from scissorcal.kernel.tables import ModelTables, Table
from scissorcal.kernel.watching import LagCounts, WatchConfig
from scissorcal.kernel.wire import FrameDecoder, crc16, decode, encode, encode_frame

__all__ = [
    "CONTROL_DTYPE",
    "HYBRID_INPUT_DTYPE",
    "HYBRID_OUTPUT_DTYPE",
    "MOST_PIECES",
    "MOST_STRIPS",
    "PROTOCOL_VERSION",
    "SAMPLE_DTYPE",
    "SCHEMA_HASH",
    "STEP_DTYPE",
    "AxisFriction",
    "Capability",
    "Command",
    "CommandFlag",
    "Config",
    "ConfigEcho",
    "ConfigKey",
    "ConfigStatus",
    "Contour",
    "ControlConfig",
    "ControlFlag",
    "ControlTask",
    "CrackLaw",
    "CrackPath",
    "Curve",
    "CutFitData",
    "CutFitParameters",
    "EnergyLedger",
    "FrameDecoder",
    "Hello",
    "Histogram",
    "Hybrid",
    "HybridConfig",
    "HybridFlag",
    "Identity",
    "Kernel",
    "LagCounts",
    "LoopBlock",
    "LoopCounters",
    "Message",
    "Mode",
    "ModelTables",
    "NormalLaw",
    "PassivityConfig",
    "Piece",
    "PiecesModel",
    "PlacedModel",
    "PlateConfig",
    "Pull",
    "Row16",
    "SampleFlag",
    "Section",
    "Servo",
    "ServoConfig",
    "ServoCounters",
    "State",
    "StateFlag",
    "StepFlag",
    "StepOutput",
    "StopReason",
    "Strip",
    "Table",
    "Table16",
    "WatchConfig",
    "ask_for_slice",
    "c_sources",
    "crc16",
    "cut_log_likelihood",
    "cut_log_likelihoods",
    "decode",
    "encode",
    "encode_frame",
    "estimated_rates",
    "hybrid_inputs",
    "largest_overlap",
    "lock_memory",
    "presliding_path",
    "run_loop",
    "walk_crack",
]
