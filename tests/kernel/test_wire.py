"""Messages, what they refuse, and the schema that describes them."""

import binascii
import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from scissorcal.kernel import (
    EARLIER_SCHEMAS,
    PROTOCOL_VERSION,
    SAMPLE_DTYPE,
    SCHEMA_HASH,
    Command,
    Config,
    Hello,
    Identity,
    LoadChunk,
    State,
    c_sources,
    crc16,
    decode,
    encode,
    encode_frame,
    write_wire,
)
from scissorcal.kernel._kernel import lib
from scissorcal.recording import recording
from tests.kernel.golden import FOLDER
from tests.kernel.reference_wire import LAYOUTS, frame_of, unstuffed

ROOT = Path(__file__).parent.parent.parent
WIRE = json.loads((ROOT / "data_schemas" / "wire.json").read_text(encoding="utf-8"))
SIZES = {"u8": 1, "u16": 2, "u32": 4, "u64": 8, "f32": 4, "char16": 16, "char192": 192}
LETTERS = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "f32": "f"}
LETTERS |= {"char16": "16s", "char192": "192s"}


def test_what_restates_the_layout_is_generated_from_the_schema() -> None:
    page = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
    for name, text in write_wire.files(WIRE, page).items():
        assert (ROOT / name).read_text(encoding="utf-8") == text, (
            f"{name} differs from data_schemas/wire.json: run 'python "
            "src/scissorcal/kernel/write_wire.py', and where wire.json changed, write the golden "
            "vectors anew"
        )


def test_the_compiled_core_is_that_of_the_schema() -> None:
    assert lib.sc_schema_hash() == write_wire.schema_hash(WIRE) == SCHEMA_HASH
    assert lib.SC_PROTOCOL_VERSION == PROTOCOL_VERSION


@pytest.mark.parametrize("name", LAYOUTS)
def test_schema_agrees_with_the_layouts(name: str) -> None:
    message = WIRE["messages"][name]
    offset = 0
    for field in message["fields"]:
        assert field["offset"] == offset
        offset += SIZES[field["type"]]
    assert message["size"] == offset
    letters = "<" + "".join(LETTERS[field["type"]] for field in message["fields"])
    layout = re.sub(r"(?<!\d)(\d)f", lambda m: "f" * int(m.group(1)), LAYOUTS[name][1])
    assert (message["type"], letters) == (LAYOUTS[name][0], layout)


def test_samples_have_the_layout_of_recordings() -> None:
    assert dict(SAMPLE_DTYPE.fields or {}) == dict(recording.SAMPLE_DTYPE.fields or {})
    assert SAMPLE_DTYPE.itemsize == recording.SAMPLE_DTYPE.itemsize == 80


def test_crc_is_the_one_of_the_standard_library() -> None:
    data = np.random.default_rng(3).integers(0, 256, 4000, dtype=np.uint8).tobytes()
    for n in (0, 1, 2, 255, 4000):
        assert crc16(data[:n]) == binascii.crc_hqx(data[:n], 0xFFFF)


@pytest.mark.parametrize("size", [0, 251, 1000])
def test_payloads_that_do_not_fit_are_refused(size: int) -> None:
    with pytest.raises(ValueError, match="does not fit a frame"):
        encode_frame(bytes(size))


def identity(**changes: object) -> Identity:
    fields: dict[str, object] = {
        "nonce_echo": 1,
        "name": "rig",
        "serial": "1",
        "capabilities": 1,
        "firmware_version": 1,
        "tick_us": 1000,
        **dict.fromkeys(("torque_limit", "force_limit", "opening_min", "opening_max"), 1.0),
        **dict.fromkeys(("advance_min", "advance_max", "handle_radius"), 1.0),
        **dict.fromkeys(("opening_resolution", "advance_resolution"), 1e-5),
    }
    return Identity(**(fields | changes))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "message",
    [
        State(0, 2**32, 0, 0.0, 0.0, 0.0, 0.0),
        State(-1, 0, 0, 0.0, 0.0, 0.0, 0.0),
        Command(2**16, 0, 0.0, 0.0),
        Command(0, 0, "strong", 0.0),  # type: ignore[arg-type]
        Hello(-1),
        Config(1 << 16, 0, 0.0),
        identity(name="a name far too long for it"),
        identity(serial="München"),
        LoadChunk(count=193, nonce=1, offset=0, bytes=b"x" * 193),
    ],
)
def test_numbers_and_texts_that_do_not_fit_are_refused(message: State) -> None:
    with pytest.raises(ValueError, match="does not fit its frame"):
        encode(message)


def test_unknown_and_misshapen_payloads_are_refused() -> None:
    with pytest.raises(ValueError, match="another protocol"):
        decode(b"")
    with pytest.raises(ValueError, match="another protocol"):
        decode(b"\x77abc")
    with pytest.raises(ValueError, match="A STATE does not have 27 bytes"):
        decode(bytes([1]) + bytes(26))


def test_identity_keeps_its_texts() -> None:
    message = identity(name="sixteen letters!", serial="")
    decoded = decode(unstuffed(encode(message)[:-1])[:-2])
    assert isinstance(decoded, Identity)
    assert (decoded.name, decoded.serial) == ("sixteen letters!", "")
    assert decoded.schema_hash == SCHEMA_HASH


def test_a_piece_of_an_image_keeps_its_bytes() -> None:
    sent = LoadChunk(count=4, nonce=7, offset=192, bytes=b"\0a\0\xff")
    piece = decode(unstuffed(encode(sent)[:-1])[:-2])
    assert piece == sent._replace(bytes=sent.bytes.ljust(192, b"\0"))


def test_version_1_devices_are_known_by_their_schema() -> None:
    assert EARLIER_SCHEMAS == {1: 0xB09FB42A7F073F64}


def hex_blocks(text: str) -> list[bytes]:
    """Every fenced block of the protocol page that is marked as a frame."""
    blocks = re.findall(r"```frame\n(.*?)```", text, re.DOTALL)
    return [bytes.fromhex(re.sub(r"#.*", "", block)) for block in blocks]


def test_frames_worked_out_in_the_protocol_page_are_golden() -> None:
    page = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
    vectors = json.loads((FOLDER / "wire.json").read_text(encoding="utf-8"))
    golden = {case["frame"] for case in vectors["messages"]}
    frames = hex_blocks(page)
    assert len(frames) >= 5
    for frame in frames:
        assert frame.hex() in golden
        assert frame_of(unstuffed(frame[:-1])[:-2]) == frame
    assert f"0x{SCHEMA_HASH:016X}" in page
    for name, message in WIRE["messages"].items():
        assert f"`{name}`" in page
        for field in message["fields"]:
            assert field["name"] in page, f"{name}.{field['name']}"
    for name in (
        *WIRE["state_flags"],
        *WIRE["config_keys"],
        *WIRE["capabilities"],
        *WIRE["fault_causes"],
        *WIRE["load_status"],
    ):
        assert name in page


def test_headers_say_where_the_sources_are() -> None:
    folder = c_sources()
    names = {path.name for path in folder.iterdir() if path.suffix in {".c", ".h"}}
    assert {"sc_wire.c", "sc_model.c", "sc_servo.c", "sc_loop.c", "sc_model.h"} <= names
    for path in folder.glob("sc_*.[ch]"):
        assert len(path.read_text(encoding="utf-8").splitlines()) < 400, path.name


def compiler() -> str | None:
    """The C compiler's name, None where there is none."""
    try:
        subprocess.run(["cc", "--version"], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return "cc"


@pytest.mark.skipif(compiler() is None, reason="no C compiler here")
def test_the_portable_core_needs_no_more_than_newlib_and_keeps_no_state(tmp_path: Path) -> None:
    """No allocation, no I/O, no writable globals: only a few functions of string.h and math.h.

    Shared memory, the loop's thread and what fits and simulations work out in doubles belong to the
    host.
    """
    host = {"sc_block", "sc_loop", "sc_rights", "sc_cut_fit", "sc_cut_response", "sc_presliding"}
    host |= {"sc_crack", "sc_control_block", "sc_joint"}
    portable = [p for p in sorted(c_sources().glob("*.c")) if p.stem not in host]
    objects = []
    for source in portable:
        objects.append(tmp_path / (source.stem + ".o"))
        subprocess.run(
            ["cc", "-std=c99", "-O0", "-c", str(source), "-o", str(objects[-1])], check=True
        )
    listing = subprocess.run(
        ["nm", *map(str, objects)], check=True, capture_output=True, text=True
    ).stdout
    symbols = [line.split()[-2:] for line in listing.splitlines() if len(line.split()) >= 2]
    needed = {name.lstrip("_") for kind, name in symbols if kind == "U"}
    allowed = {"memcpy", "memset", "sinf", "cosf", "sqrtf", "fabsf", "fminf", "fmaxf", "ceilf"}
    outside = {n for n in needed if not n.startswith("sc_")} - allowed
    assert outside - {"stack_chk_fail", "GLOBAL_OFFSET_TABLE_", "isfinitef"} == set()
    assert [name for kind, name in symbols if kind in "bBdDC"] == []
