"""Builds of the firmware's core give the golden records, byte for byte."""

import struct
import subprocess

import pytest

from scissorcal.kernel import (
    RECORD_BYTES,
    FaultCause,
    FirmwareCore,
    FirmwarePhase,
    FrameDecoder,
    HomeResult,
    State,
    StateFlag,
    decode,
)

from . import records
from .test_c_tests import BUILD, make, pytestmark  # noqa: F401

PHASE_AT, SENT_AT = 12, 16
"""Offsets in fw_record_out: phase, cause and result of homing; size of what was sent."""


ALL_FLAGS = int(
    StateFlag.MOTOR_ENABLED
    | StateFlag.FAULT_LATCHED
    | StateFlag.COMMANDS_LOST
    | StateFlag.OPENING_AT_STOP
    | StateFlag.TORQUE_SATURATED
    | StateFlag.ENCODER_FAULT
    | StateFlag.NOT_HOMED
    | StateFlag.HOMING
)


@pytest.fixture(scope="module")
def golden() -> tuple[bytes, list[tuple[bytes, bytes]]]:
    return records.read_golden()


def test_the_library_gives_them(golden: tuple[bytes, list[tuple[bytes, bytes]]]) -> None:
    board, pairs = golden
    assert FirmwareCore(records.BOARD).table == board
    for tick, (pair, made) in enumerate(zip(pairs, records.session(), strict=True)):
        assert made == pair, f"tick {tick}"


def test_the_process_gives_them(golden: tuple[bytes, list[tuple[bytes, bytes]]]) -> None:
    board, pairs = golden
    make("all")
    ran = subprocess.run(
        [BUILD / "posix", "--records"],
        input=board + b"".join(given for given, _ in pairs),
        capture_output=True,
        check=True,
    )
    made = [ran.stdout[at : at + RECORD_BYTES] for at in range(0, len(ran.stdout), RECORD_BYTES)]
    assert made == [out for _, out in pairs]


def test_they_hold_every_phase_cause_and_message(
    golden: tuple[bytes, list[tuple[bytes, bytes]]],
) -> None:
    outs = [out for _, out in golden[1]]
    phases, causes, results = ({out[PHASE_AT + which] for out in outs} for which in range(3))
    assert phases == {int(phase) for phase in FirmwarePhase}
    provoked = set(FaultCause) - {FaultCause.SPEED}
    assert causes >= {int(cause) for cause in provoked}
    assert int(HomeResult.FOUND) in results
    decoder, sent = FrameDecoder(), []
    for out in outs:
        (size,) = struct.unpack_from("<I", out, SENT_AT)
        sent += [decode(payload) for payload in decoder.feed(out[20 : 20 + size])]
    assert decoder.garbled == 0
    assert {type(message).__name__ for message in sent} == {"State", "Identity", "ConfigEcho"}
    states = [message for message in sent if isinstance(message, State)]
    assert len(states) > len(outs) // 2
    flags = 0
    for state in states:
        flags |= state.flags
    assert flags & ALL_FLAGS == ALL_FLAGS
