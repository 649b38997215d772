"""The golden vectors: made by the references in plain Python, read by the C and the Python tests.

``python -m tests.kernel.golden`` writes them anew; a test says when they no longer match.
"""

import json
import math
import struct
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.kernel import SCHEMA_HASH, ModelTables, ServoConfig, Table
from tests.kernel.reference_model import Curve, Reference
from tests.kernel.reference_servo import ReferenceServo
from tests.kernel.reference_wire import frame_of, payload_of, stuffed, with_crc
from tests.kernel.zoo import arc_edge, line_edge, make_tables, power_response, straight

FOLDER = Path(__file__).parent.parent / "golden"
STEP_COLUMNS = (
    "torque",
    "force",
    "contact",
    "indentation",
    "height",
    "response",
    "friction_torque",
    "stored_J",
    "fracture_J",
    "arrest_J",
)


def single(value: float) -> float:
    """The nearest float32, which is what goes over the wire and into the core."""
    return float(np.float32(value))


def wire_vectors() -> dict[str, Any]:
    """Messages with payload and frame, CRCs, and streams with what is to be got out of them."""
    identity = (
        *(0x8003, 0xDEADBEEF, SCHEMA_HASH, b"scissorcal-sim", b"paper-0001", 7, 1000),
        *(1.0, 30.0, 0.0, 1.0, -0.05, 0.25, 2.0**-16, 2.0**-20, 0.0625),
    )
    earlier = (*identity[:2], 0xB09FB42A7F073F64, *identity[3:])
    plain = {
        "state": ("STATE", 0, 1, 258, 16909060, 0.5, -0.25, 0.125, -2.0),
        "state of zeros": ("STATE", 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0),
        "state at the ends": ("STATE", 0, 0x3FF, 2**32 - 1, 2**32 - 1, math.pi, 1e-30, -1e30, 3e38),
        "state of a fault": ("STATE", 4, 2, 259, 16910060, 0.5, -0.25, 0.0, -2.0),
        "state while it homes": ("STATE", 0, 0x181, 5, 5000, 0.0, 0.0, -0.1, 0.0),
        "command": ("COMMAND", 0, 1, 7, 0.25, 0.0),
        "command that holds for one tick": ("COMMAND", 1, 1, 8, 0.25, 0.0),
        "command that clears a fault": ("COMMAND", 0, 3, 256, -0.75, 12.5),
        "hello": ("HELLO", 2, 0, 0x01020304),
        "identity": ("IDENTITY", 2, *identity),
        "identity of version 1": ("IDENTITY", 1, *earlier),
        "config": ("CONFIG", 0, 1, 99, 1.0),
        "config of the simulator": ("CONFIG", 0, 0x8001, 100, 0.3),
        "config that homes": ("CONFIG", 0, 3, 102, 1.0),
        "config echo": ("CONFIG_ECHO", 2, 2, 101, 10.0),
        "load begin": ("LOAD_BEGIN", 0, 1, 103, 5000, 0xCBF43926),
        "load chunk": ("LOAD_CHUNK", 192, 0, 104, 192, bytes(range(192))),
        "last load chunk": ("LOAD_CHUNK", 8, 0, 105, 4992, b"scissors".ljust(192, b"\0")),
        "load commit": ("LOAD_COMMIT", 0, 0, 106),
        "load echo": ("LOAD_ECHO", 5, 0, 106, 5000, 32768, 0),
    }
    messages = []
    for title, (name, second, *values) in plain.items():
        payload = payload_of(name, second, *values)
        messages.append(
            {
                "title": title,
                "message": name,
                "fields": [_plain(v) for v in (second, *values)],
                "payload": payload.hex(),
                "frame": frame_of(payload).hex(),
            }
        )
    return {
        "format": "scissorcal-golden-wire/1",
        "schema_hash": f"{SCHEMA_HASH:016x}",
        "crc16": [_crc(data) for data in (b"", b"\0", b"123456789", bytes(range(256)))],
        "payloads": [
            {"payload": p.hex(), "frame": frame_of(p).hex()}
            for p in (b"\1", b"\0", b"\0" * 250, b"\xff" * 250, bytes(range(1, 251)))
        ],
        "messages": messages,
        "streams": _streams(),
    }


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode() if len(value) < 192 else value.hex()
    return single(value) if isinstance(value, float) else value


def _crc(data: bytes) -> dict[str, Any]:
    return {"data": data.hex(), "crc": struct.unpack("<H", with_crc(data)[-2:])[0]}


def _streams() -> list[dict[str, Any]]:
    first = payload_of("STATE", 0, 1, 1, 1000, 0.5, 0.0, 0.0, 0.0)
    second = payload_of("STATE", 0, 1, 2, 2000, 0.5, 0.0, 0.0, 0.0)
    one, two = frame_of(first), frame_of(second)
    flipped = bytearray(one)
    flipped[5] ^= 0x10
    cases: list[tuple[str, bytes, list[bytes], int]] = [
        ("two frames", one + two, [first, second], 0),
        ("idle delimiters between", one + b"\0\0\0" + two, [first, second], 0),
        ("joined in the middle", one[7:] + two, [second], 1),
        ("a flipped bit", bytes(flipped) + two, [second], 1),
        ("a lost byte", one[:9] + one[10:] + two, [second], 1),
        ("a lost delimiter", one[:-1] + two + one, [first], 1),
        ("noise without end, then a frame", b"\x55" * 1000 + b"\0" + one, [first], 1),
        ("a code that leads beyond the frame", b"\x09\x01\0" + one, [first], 1),
        ("a code of 255", b"\xff" + b"\1" * 253 + b"\0" + one, [first], 1),
        ("only a CRC", stuffed(with_crc(b"")) + b"\0" + one, [first], 1),
        ("an unfinished frame", two + one[:-1], [second], 0),
    ]
    return [
        {
            "title": title,
            "bytes": data.hex(),
            "payloads": [payload.hex() for payload in payloads],
            "garbled": garbled,
        }
        for title, data, payloads, garbled in cases
    ]


def table_vectors() -> dict[str, Any]:
    """Tables with values, slopes, held values and integrals at many places."""
    rng = np.random.default_rng(20)
    knots = np.cumsum(rng.uniform(0.01, 1.0, 256)) - 40.0
    tables = {
        "two knots": straight(-1.0, 3.0, 0.5, 2.5),
        "a parabola": Table([0, 1, 3], [0, 1, 9], [0, 2, 6]),
        "256 uneven knots": Table(knots, np.sin(knots), np.cos(knots)),
        "a response": power_response(),
    }
    cases = []
    for title, table in tables.items():
        x0, x1 = float(table.x[0]), float(table.x[-1])
        places = [single(v) for v in rng.uniform(x0 - 0.2 * (x1 - x0), x1 + 0.2 * (x1 - x0), 40)]
        places += [float(table.x[0]), float(table.x[-1]), float(table.x[len(table.x) // 2])]
        curve = Curve(table)
        cases.append(
            {
                "title": title,
                **_table(table),
                "at": places,
                "value": [curve.at(x)[0] for x in places],
                "grade": [curve.at(x)[1] for x in places],
                "held": [curve.held(x) for x in places],
                "integral": [curve.area(x) for x in places],
            }
        )
    return {
        "format": "scissorcal-golden-tables/1",
        "tolerance": 1e-5,
        "tables": cases,
        "stored": stored_tables(),
    }


def stored_tables() -> list[dict[str, Any]]:
    """Tables in 16-bit numbers, and the float32 that is decoded from them, to the last bit."""
    rng = np.random.default_rng(16)
    shapes = {
        "the ends of 16 bits": ([-32768, 0, 32767], [-32768, -1, 32767], [32767, 0, -32768]),
        "64 knots": (
            np.linspace(-32768, 32767, 64).round().astype(int).tolist(),
            *rng.integers(-32768, 32768, (2, 64)).tolist(),
        ),
    }
    scales = [
        [(32768 * 3.0 * 2.0**-30, 3.0 * 2.0**-30), (0.0, 255 * 2.0**-20), (-7.25, 129 * 2.0**-14)],
        [(0.0123456789, 201 * 2.0**-36), (1e-3, 0.0), (single(1 / 3), 171 * 2.0**-9)],
    ]
    cases = []
    for (title, numbers), rows in zip(shapes.items(), scales, strict=True):
        case: dict[str, Any] = {"title": title}
        for name, row, (offset, scale) in zip(("x", "y", "slope"), numbers, rows, strict=True):
            offset = single(offset)
            case[f"{name}_numbers"], case[f"{name}_row"] = row, [offset, scale]
            # in double the product is exact, so that float32 alone rounds
            case[name] = [single(offset + scale * q) for q in row]
        cases.append(case)
    return cases


def _table(table: Table) -> dict[str, list[float]]:
    return {name: [float(v) for v in getattr(table, name)] for name in ("x", "y", "slope")}


Motion = tuple[np.ndarray, np.ndarray, np.ndarray]


def stroke_motion(n: int = 72, closed: float = 0.22) -> Motion:
    """Closing, half open again, closing further, while the pivot creeps on."""
    opening = np.concatenate(
        [
            np.linspace(0.87, 0.45, n // 3),
            np.linspace(0.45, 0.6, n // 6),
            np.linspace(0.6, closed, n // 2),
        ]
    )
    rate = np.gradient(opening) * 100.0
    return opening, rate, np.linspace(-0.03, -0.02, len(opening))


def model_cases() -> dict[str, tuple[ModelTables, Motion, float]]:
    """Title -> tables, motion and tolerance (of torque and force, against their largest)."""
    stroke = stroke_motion()
    press = (0.2 + 0.1 * stroke[0], stroke[1], np.full_like(stroke[2], -0.05))
    parallel = (np.linspace(0.05, 0.0, 30), np.full(30, -0.1), np.full(30, -0.03))
    coarse = power_response(knots=25)
    stiff = power_response(3e4, knots=25)
    steep = power_response(1.0, 6.0, 1e-3, knots=25)
    one = {"moving_blades": 1, "upper_face": 1e-4, "response": coarse}
    return {
        "both blades": (make_tables(response=coarse), stroke, 2e-5),
        "one blade": (make_tables(**one), stroke, 2e-5),
        "published closure": (make_tables(response=coarse, closure="eq4"), stroke, 2e-5),
        "ripple": (make_tables(response=coarse, kappa=0.7), stroke, 2e-4),
        "ripple, one blade": (make_tables(**one, kappa=0.85), stroke, 5e-4),
        "hollow edge": (make_tables(response=coarse, edge=arc_edge(2.0)), stroke, 2e-5),
        "bulging edge": (make_tables(response=coarse, edge=arc_edge(-2.0)), stroke, 2e-5),
        "pressing": (make_tables(response=coarse, fracture_energy=0.0), press, 2e-5),
        "friction and damping": (
            make_tables(response=coarse, render_friction=True, rate_damping=20.0),
            stroke,
            2e-5,
        ),
        "over the tip": (
            make_tables(response=coarse, tip_station=0.05),
            stroke_motion(closed=0.3),
            2e-5,
        ),
        "steep response": (make_tables(response=steep), stroke, 1e-4),
        "stiff response": (make_tables(response=stiff), stroke, 6e-3),
        "edges become parallel": (
            make_tables(response=coarse, edge=line_edge(slope=0.0), upper_face=2e-3),
            parallel,
            2e-5,
        ),
        "upright blade": (
            make_tables(response=coarse, moving_blades=1),
            (np.linspace(1.2, 0.6, 30), np.full(30, -3.0), np.full(30, 0.0)),
            2e-5,
        ),
    }


def model_vectors() -> dict[str, Any]:
    """Whole strokes, stepped: inputs, outputs and where the crack ends."""
    cases = []
    for title, (tables, motion, tolerance) in model_cases().items():
        opening, rate, advance = ([single(v) for v in column] for column in motion)
        reference = Reference(tables)
        rows = [reference.step(*row) for row in zip(opening, rate, advance, strict=True)]
        contacts = [max(row["contact"] - 2e-3, 0.0) for row in rows]
        settled = [
            reference.settled_torque(*row)
            for row in zip(opening, rate, map(single, contacts), strict=True)
        ]
        cases.append(
            {
                "title": title,
                "tolerance": tolerance,
                "model": model_of(tables),
                "opening": opening,
                "rate": rate,
                "advance": advance,
                **{name: [row[name] for row in rows] for name in STEP_COLUMNS},
                "crack": reference.crack,
                "settled_contact": [single(v) for v in contacts],
                "settled_torque": settled,
            }
        )
    return {"format": "scissorcal-golden-model/1", "cases": cases}


def model_of(tables: ModelTables) -> dict[str, Any]:
    """Everything in a set of tables; numbers rounded to float32, an endless blade as 1e30 m."""
    model: dict[str, Any] = {}
    for field in fields(tables):
        value = getattr(tables, field.name)
        if isinstance(value, Table):
            model[field.name] = _table(value)
        elif isinstance(value, float):
            model[field.name] = single(min(value, 1e30))
        else:
            model[field.name] = value
    return model


def servo_cases() -> dict[str, tuple[ServoConfig, str, list[tuple[int, int, float, float]]]]:
    """Title -> configuration, mode and states (sequence, microseconds, opening, advance)."""
    gains = {
        "opening_kp": 6.0,
        "opening_kd": 0.06,
        "opening_ki": 20.0,
        "advance_kp": 3000.0,
        "advance_kd": 40.0,
        "advance_ki": 10000.0,
    }
    config = ServoConfig(
        torque_limit=0.5,
        torque_slew=100.0,
        force_limit=20.0,
        force_slew=2000.0,
        damping_Nm_s_per_rad=0.5,
        **gains,
    )
    weak = ServoConfig(torque_limit=0.02, torque_slew=5.0, force_limit=0, force_slew=0, **gains)

    def lagging(k: int) -> tuple[float, float]:
        return 0.8 - 3e-4 * max(k - 12, 0), -0.02 + 4e-6 * max(k - 5, 0)

    steady = [(k, 1000 * k, *lagging(k)) for k in range(1, 80)]
    gaps = [s for s in steady if s[0] % 7 not in (3, 4)]
    wrapped = [
        ((2**32 - 30 + k) % 2**32, (2**32 - 41_500 + us) % 2**32, o, a) for k, us, o, a in steady
    ]
    pause = [s if s[0] < 40 else (s[0] + 250, s[1] + 250_000, *s[2:]) for s in steady]
    leapt = [s if s[0] < 40 else (s[0], s[1] + 250_000, *s[2:]) for s in steady]
    reborn = [s if s[0] < 40 else (s[0], s[1] - 39_000, *s[2:]) for s in steady]
    return {
        "tracking": (config, "track", steady),
        "tracking at the limit": (weak, "track", steady),
        "tracking with lost frames": (config, "track", gaps),
        "tracking while clock and sequence wrap": (config, "track", wrapped),
        "damping": (config, "damp", steady),
        "damping with lost frames": (config, "damp", gaps),
        "damping after a pause": (config, "damp", pause),
        "damping after the device restarted its clock": (config, "damp", reborn),
        "damping after the device's clock leapt": (config, "damp", leapt),
        "idle": (config, "idle", steady),
    }


def servo_vectors() -> dict[str, Any]:
    """Streams of states with the commands and rates they must give."""
    ticks = np.arange(60)
    reference = [
        (single(0.8 - 3e-4 * k), single(-0.3), single(-0.02 + 5e-6 * k)) for k in ticks.tolist()
    ]
    cases = []
    for title, (config, mode, states) in servo_cases().items():
        single_config = {
            f.name: getattr(config, f.name)
            for f in fields(config)
            if f.name not in ("watch", "passivity", "plate", "motor_sign")
        }
        single_config = {
            name: single(v) if isinstance(v, float) else v for name, v in single_config.items()
        }
        servo = ReferenceServo(ServoConfig(**single_config), reference)
        servo.engage(mode)
        rows = [(k, us, single(o), single(a)) for k, us, o, a in states]
        answers = [servo.step(*row) for row in rows]
        cases.append(
            {
                "title": title,
                "mode": mode,
                "config": single_config,
                **_columns(("sequence", "device_us", "opening", "advance"), rows),
                **_columns(("torque", "force", "opening_rate", "advance_rate"), answers),
            }
        )
    return {
        "format": "scissorcal-golden-servo/1",
        "tolerance": 1e-3,
        "reference": _columns(("opening", "opening_rate", "advance"), reference),
        "cases": cases,
    }


def _columns(names: tuple[str, ...], rows: list[Any]) -> dict[str, list[Any]]:
    return {name: [row[i] for row in rows] for i, name in enumerate(names)}


VECTORS = {
    "wire.json": wire_vectors,
    "tables.json": table_vectors,
    "model.json": model_vectors,
    "servo.json": servo_vectors,
}


def write() -> None:
    """Write all golden vectors."""
    for name, make in VECTORS.items():
        text = json.dumps(make(), allow_nan=False, separators=(",", ":"))
        # a line for each case keeps changes reviewable
        text = text.replace('{"title"', '\n{"title"') + "\n"
        (FOLDER / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write()
