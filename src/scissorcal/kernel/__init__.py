"""The C core and its thin binding: wire frames, tables, the model's step, the servo loop."""

from scissorcal.kernel.frames import (
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
    decode,
    encode,
)
from scissorcal.kernel.stepping import STEP_DTYPE, Kernel, StepFlag, StepOutput
from scissorcal.kernel.tables import ModelTables, Table
from scissorcal.kernel.wire import FrameDecoder, crc16, encode_frame

__all__ = [
    "PROTOCOL_VERSION",
    "SCHEMA_HASH",
    "STEP_DTYPE",
    "Capability",
    "Command",
    "CommandFlag",
    "Config",
    "ConfigEcho",
    "ConfigKey",
    "ConfigStatus",
    "FrameDecoder",
    "Hello",
    "Identity",
    "Kernel",
    "Message",
    "ModelTables",
    "State",
    "StateFlag",
    "StepFlag",
    "StepOutput",
    "Table",
    "crc16",
    "decode",
    "encode",
    "encode_frame",
]
