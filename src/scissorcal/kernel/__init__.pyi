from .compiled_step import c_sources as c_sources
from .compiled_step import missing_tools as missing_tools
from .control import CONTROL_DTYPE as CONTROL_DTYPE
from .control import AxisFriction as AxisFriction
from .control import Contour as Contour
from .control import ControlConfig as ControlConfig
from .control import ControlFlag as ControlFlag
from .control import ControlTask as ControlTask
from .control import Mode as Mode
from .cut_fit import CrackLaw as CrackLaw
from .cut_fit import CrackPath as CrackPath
from .cut_fit import Curve as Curve
from .cut_fit import CutFitData as CutFitData
from .cut_fit import CutFitParameters as CutFitParameters
from .cut_fit import cut_log_likelihood as cut_log_likelihood
from .cut_fit import cut_log_likelihoods as cut_log_likelihoods
from .cut_fit import walk_crack as walk_crack
from .firmware import HOME_CAUSE as HOME_CAUSE
from .firmware import RECORD_BYTES as RECORD_BYTES
from .firmware import Drive as Drive
from .firmware import FirmwareBoard as FirmwareBoard
from .firmware import FirmwareCore as FirmwareCore
from .firmware import FirmwareInputs as FirmwareInputs
from .firmware import FirmwareOutputs as FirmwareOutputs
from .firmware import FirmwarePhase as FirmwarePhase
from .firmware import HomeResult as HomeResult
from .firmware import InputFlag as InputFlag
from .hybrid import HYBRID_INPUT_DTYPE as HYBRID_INPUT_DTYPE
from .hybrid import HYBRID_OUTPUT_DTYPE as HYBRID_OUTPUT_DTYPE
from .hybrid import Hybrid as Hybrid
from .hybrid import HybridConfig as HybridConfig
from .hybrid import HybridFlag as HybridFlag
from .hybrid import NormalLaw as NormalLaw
from .hybrid import hybrid_inputs as hybrid_inputs
from .image import IMAGE_FORMAT as IMAGE_FORMAT
from .image import model_image as model_image
from .joint import estimated_rates as estimated_rates
from .joint import presliding_path as presliding_path
from .layout import fill_struct as fill_struct
from .loop import Histogram as Histogram
from .loop import LoopBlock as LoopBlock
from .loop import LoopCounters as LoopCounters
from .loop import ask_for_slice as ask_for_slice
from .loop import lock_memory as lock_memory
from .loop import run_loop as run_loop
from .messages import EARLIER_SCHEMAS as EARLIER_SCHEMAS
from .messages import PROTOCOL_VERSION as PROTOCOL_VERSION
from .messages import SCHEMA_HASH as SCHEMA_HASH
from .messages import Capability as Capability
from .messages import Command as Command
from .messages import CommandFlag as CommandFlag
from .messages import Config as Config
from .messages import ConfigEcho as ConfigEcho
from .messages import ConfigKey as ConfigKey
from .messages import ConfigStatus as ConfigStatus
from .messages import FaultCause as FaultCause
from .messages import Hello as Hello
from .messages import Identity as Identity
from .messages import LoadBegin as LoadBegin
from .messages import LoadChunk as LoadChunk
from .messages import LoadCommit as LoadCommit
from .messages import LoadEcho as LoadEcho
from .messages import LoadStatus as LoadStatus
from .messages import Message as Message
from .messages import State as State
from .messages import StateFlag as StateFlag
from .plate import MOST_PIECES as MOST_PIECES
from .plate import MOST_STRIPS as MOST_STRIPS
from .plate import Piece as Piece
from .plate import PiecesModel as PiecesModel
from .plate import PlacedModel as PlacedModel
from .plate import PlateConfig as PlateConfig
from .plate import Pull as Pull
from .plate import Section as Section
from .plate import Strip as Strip
from .plate import largest_overlap as largest_overlap
from .servo import SAMPLE_DTYPE as SAMPLE_DTYPE
from .servo import SampleFlag as SampleFlag
from .servo import Servo as Servo
from .servo import ServoConfig as ServoConfig
from .servo import ServoCounters as ServoCounters
from .stepping import STEP_DTYPE as STEP_DTYPE
from .stepping import Kernel as Kernel
from .stepping import StepFlag as StepFlag
from .stepping import StepOutput as StepOutput
from .stop_reason import StopReason as StopReason
from .tables import TABLE_NAMES as TABLE_NAMES
from .tables import ModelTables as ModelTables
from .tables import Row16 as Row16
from .tables import Table as Table
from .tables import Table16 as Table16
from .watching import EnergyLedger as EnergyLedger
from .watching import LagCounts as LagCounts
from .watching import PassivityConfig as PassivityConfig
from .watching import WatchConfig as WatchConfig
from .wire import FrameDecoder as FrameDecoder
from .wire import crc16 as crc16
from .wire import decode as decode
from .wire import encode as encode
from .wire import encode_frame as encode_frame

__all__ = [
    "CONTROL_DTYPE",
    "EARLIER_SCHEMAS",
    "HYBRID_INPUT_DTYPE",
    "HYBRID_OUTPUT_DTYPE",
    "IMAGE_FORMAT",
    "MOST_PIECES",
    "MOST_STRIPS",
    "PROTOCOL_VERSION",
    "RECORD_BYTES",
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
    "Drive",
    "EnergyLedger",
    "FaultCause",
    "FirmwareBoard",
    "FirmwareCore",
    "FirmwareInputs",
    "FirmwareOutputs",
    "FirmwarePhase",
    "FrameDecoder",
    "Hello",
    "Histogram",
    "HomeResult",
    "Hybrid",
    "HybridConfig",
    "HybridFlag",
    "Identity",
    "InputFlag",
    "Kernel",
    "LagCounts",
    "LoadBegin",
    "LoadChunk",
    "LoadCommit",
    "LoadEcho",
    "LoadStatus",
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
    "model_image",
    "presliding_path",
    "run_loop",
    "walk_crack",
]
