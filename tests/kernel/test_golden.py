"""The golden vectors agree with their references, and the kernel with both."""

import json
import math
from typing import Any

import numpy as np
import pytest

from scissorcal.kernel import (
    SCHEMA_HASH,
    FrameDecoder,
    Kernel,
    Mode,
    ModelTables,
    Row16,
    Servo,
    ServoConfig,
    State,
    Table,
    Table16,
    crc16,
    decode,
    encode,
    encode_frame,
)
from tests.kernel.golden import FOLDER, STEP_COLUMNS, VECTORS

WIRE, TABLES, MODEL, SERVO = (
    json.loads((FOLDER / name).read_text(encoding="utf-8")) for name in VECTORS
)


def titles(cases: list[dict[str, Any]]) -> list[str]:
    return [case["title"] for case in cases]


def table_of(columns: dict[str, list[float]]) -> Table:
    return Table(columns["x"], columns["y"], columns["slope"])


def same(made: Any, stored: Any) -> bool:
    """Equal, numbers up to what another computer's libm may do differently."""
    if isinstance(made, dict):
        return made.keys() == stored.keys() and all(same(made[k], stored[k]) for k in made)
    if isinstance(made, list):
        return len(made) == len(stored) and all(map(same, made, stored))
    if isinstance(made, float):
        return math.isclose(made, stored, rel_tol=1e-6, abs_tol=1e-10)
    return bool(made == stored)


@pytest.mark.parametrize("name", VECTORS)
def test_stored_vectors_are_what_the_references_give(name: str) -> None:
    stored = json.loads((FOLDER / name).read_text(encoding="utf-8"))
    made = json.loads(json.dumps(VECTORS[name]()))
    assert same(made, stored), f"run: python -m tests.kernel.golden, and review {name}"


def test_vectors_carry_the_schema_hash() -> None:
    assert WIRE["schema_hash"] == f"{SCHEMA_HASH:016x}"


@pytest.mark.parametrize("case", WIRE["crc16"], ids=lambda case: case["data"][:20] or "nothing")
def test_crc(case: dict[str, Any]) -> None:
    assert crc16(bytes.fromhex(case["data"])) == case["crc"]


@pytest.mark.parametrize("case", WIRE["messages"], ids=titles(WIRE["messages"]))
def test_messages_become_frames_and_back(case: dict[str, Any]) -> None:
    payload, frame = bytes.fromhex(case["payload"]), bytes.fromhex(case["frame"])
    message = decode(payload)
    assert encode(message) == frame
    assert FrameDecoder().feed(frame) == [payload]
    in_vector = [value for value in case["fields"][1:] if not isinstance(value, str)]
    in_message = [value for value in message if not isinstance(value, str | bytes)]
    if case["message"] in {"CONFIG", "LOAD_BEGIN"}:
        assert in_message == in_vector
    else:  # other order of fields
        in_vector = [value for value in case["fields"] if not isinstance(value, str)]
        assert set(in_message) | {0} == set(in_vector) | {0}


@pytest.mark.parametrize("case", WIRE["payloads"], ids=lambda case: case["payload"][:8])
def test_any_payload_becomes_a_frame(case: dict[str, Any]) -> None:
    payload = bytes.fromhex(case["payload"])
    assert encode_frame(payload).hex() == case["frame"]
    assert FrameDecoder().feed(bytes.fromhex(case["frame"])) == [payload]


@pytest.mark.parametrize("chunk", [1, 3, 1000])
@pytest.mark.parametrize("case", WIRE["streams"], ids=titles(WIRE["streams"]))
def test_streams(case: dict[str, Any], chunk: int) -> None:
    data = bytes.fromhex(case["bytes"])
    decoder = FrameDecoder()
    got = [p for i in range(0, len(data), chunk) for p in decoder.feed(data[i : i + chunk])]
    assert [p.hex() for p in got] == case["payloads"]
    assert decoder.garbled == case["garbled"]
    assert decoder.bytes_received == len(data)


@pytest.mark.parametrize("case", TABLES["tables"], ids=titles(TABLES["tables"]))
def test_tables(case: dict[str, Any]) -> None:
    table = table_of(case)
    for name, held in (("value", False), ("held", True)):
        expected = np.array(case[name])
        error = np.abs(table.evaluate(case["at"], held=held) - expected)
        assert error.max() <= TABLES["tolerance"] * np.abs(expected).max()


@pytest.mark.parametrize("case", TABLES["stored"], ids=titles(TABLES["stored"]))
def test_stored_tables(case: dict[str, Any]) -> None:
    names = ("x", "y", "slope")
    numbers = np.array([case[f"{name}_numbers"] for name in names], dtype=np.int16)
    first, second, third = (Row16(*case[f"{name}_row"]) for name in names)
    table = Table16(numbers, (first, second, third)).decoded()
    for name, row, part in zip(names, (first, second, third), numbers, strict=True):
        assert getattr(table, name).tolist() == case[name]
        assert row.values(part).tolist() == case[name]


@pytest.mark.parametrize("case", MODEL["cases"], ids=titles(MODEL["cases"]))
def test_model_steps(case: dict[str, Any]) -> None:
    fields = {k: table_of(v) if isinstance(v, dict) else v for k, v in case["model"].items()}
    kernel = Kernel(ModelTables(**fields))
    out = kernel.step_many(case["opening"], case["rate"], case["advance"])
    for name in STEP_COLUMNS:
        expected = np.array(case[name])
        error = np.abs(out[name] - expected)
        assert error.max() <= case["tolerance"] * np.abs(expected).max() + 1e-12, name
    assert abs(kernel.crack - case["crack"]) < 3e-7 * max(1.0, case["crack"])
    settled = kernel.torque(case["opening"], case["rate"], case["settled_contact"])
    expected = np.array(case["settled_torque"])
    assert np.abs(settled - expected).max() <= case["tolerance"] * np.abs(expected).max() + 1e-12


@pytest.mark.parametrize("case", SERVO["cases"], ids=titles(SERVO["cases"]))
def test_servo_steps(case: dict[str, Any]) -> None:
    servo = Servo(None, ServoConfig(**case["config"]))
    reference = SERVO["reference"]
    n = len(reference["opening"])
    servo.set_reference(*(reference[k] for k in ("opening", "opening_rate", "advance")), [3] * n)
    servo.engage(Mode[case["mode"].upper()])
    columns = (case[k] for k in ("sequence", "device_us", "opening", "advance"))
    got = []
    for sequence, us, opening, advance in zip(*columns, strict=True):
        command = servo.step(State(1, sequence, us, opening, advance, 0.0, 0.0))
        assert command.echo_sequence == sequence
        assert command.flags == (0 if case["mode"] == "idle" else 1)
        got.append((command.torque, command.force, *servo.rates))
    for i, name in enumerate(("torque", "force", "opening_rate", "advance_rate")):
        expected = np.array(case[name])
        error = np.abs(np.array(got)[:, i] - expected)
        assert error.max() <= SERVO["tolerance"] * np.abs(expected).max(), name
