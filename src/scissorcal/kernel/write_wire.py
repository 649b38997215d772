"""Writes all that restates the wire layout, from its one statement, ``data_schemas/wire.json``.

    python src/scissorcal/kernel/write_wire.py            # write what has changed
    python src/scissorcal/kernel/write_wire.py --check    # exit code 1 where a file differs

Generated are the C structs with their packing (``c/sc_messages.h`` and ``.c``), the Python
messages (``messages.py``), and the tables of the messages in ``docs/protocol.md``.
"""

import json
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from scissorcal.identity import digest

ROOT = Path(__file__).parents[3]
KERNEL = "src/scissorcal/kernel"
C_TYPES = {"u8": "uint8_t", "u16": "uint16_t", "u32": "uint32_t", "u64": "uint64_t", "f32": "float"}
ENUMS = {
    "state_flags": ("StateFlag", "IntFlag", "What a device says about itself in every STATE."),
    "fault_causes": ("FaultCause", "IntEnum", "What latched the fault that stands."),
    "command_flags": ("CommandFlag", "IntFlag", "What a host asks for in every COMMAND."),
    "capabilities": ("Capability", "IntFlag", "What a device has."),
    "config_status": ("ConfigStatus", "IntEnum", "How a device answered a CONFIG."),
    "load_status": ("LoadStatus", "IntEnum", "How a device answered a LOAD message."),
    "config_keys": (
        "ConfigKey",
        "IntEnum",
        "Values that CONFIG sets; those from 0x8000 on exist in the simulator only.",
    ),
}
C_ENUMS = {
    "state_flags": "STATE",
    "fault_causes": "CAUSE",
    "command_flags": "COMMAND",
    "capabilities": "CAPABILITY",
    "config_status": "CONFIG",
    "load_status": "LOAD",
    "config_keys": "KEY",
}
TEXT = "char16"
"""Type of the fields that hold text; another ``char`` type holds bytes."""
GENERATED = "Generated from data_schemas/wire.json by write_wire.py: do not edit."


def files(wire: Mapping[str, Any], page: str) -> dict[str, str]:
    """Give the text of every generated file by its path; ``page`` is docs/protocol.md as it is."""
    return {
        f"{KERNEL}/c/sc_messages.h": "".join(_header(wire)),
        f"{KERNEL}/c/sc_messages.c": "".join(_source(wire)),
        f"{KERNEL}/messages.py": "".join(_module(wire)),
        "docs/protocol.md": _page(wire, page),
    }


def schema_hash(wire: Mapping[str, Any]) -> int:
    """First 8 bytes, little-endian, of SHA-256 over the canonical form of wire.json."""
    return int.from_bytes(bytes.fromhex(digest(wire))[:8], "little")


def _own(message: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The fields of a message that carry something: not its type, nothing reserved."""
    return [
        field
        for field in message["fields"]
        if field["name"] != "type" and not field["name"].startswith("reserved")
    ]


def _members(entries: Mapping[str, Any]) -> Iterator[tuple[str, int]]:
    """Names and values of an enum; a key of CONFIG has its value under ``key``."""
    for name, entry in entries.items():
        yield name, entry["key"] if isinstance(entry, dict) else entry


def _header(wire: Mapping[str, Any]) -> Iterator[str]:
    messages = wire["messages"]
    yield f"/* The messages of the wire. {GENERATED} */\n"
    yield "#ifndef SC_MESSAGES_H\n#define SC_MESSAGES_H\n\n#include <stddef.h>\n"
    yield "#include <stdint.h>\n"
    yield _c_enum(
        {
            "SC_PROTOCOL_VERSION": wire["protocol_version"],
            "SC_PAYLOAD_MAX": wire["frame"]["largest_payload"],
            "SC_FRAME_MAX": wire["frame"]["largest_frame"],
        }
    )
    yield _c_enum({f"SC_TYPE_{name}": message["type"] for name, message in messages.items()})
    yield _c_enum({f"SC_SIZE_{name}": message["size"] for name, message in messages.items()})
    for key, prefix in C_ENUMS.items():
        yield _c_enum({f"SC_{prefix}_{name}": value for name, value in _members(wire[key])})
    for name, message in messages.items():
        yield f"\n/* {message['meaning']} */\ntypedef struct {{\n"
        for field in _own(message):
            text = re.fullmatch(r"char(\d+)", field["type"])
            declared = f"uint8_t {field['name']}[{text[1]}]" if text else None
            yield f"    {declared or C_TYPES[field['type']] + ' ' + field['name']};\n"
        yield f"}} sc_{name.lower()};\n"
    yield "\n/* First 8 bytes, little-endian, of SHA-256 over the canonical form of wire.json. */\n"
    yield "uint64_t sc_schema_hash(void);\n"
    yield "\n/* pack: write the payload (SC_SIZE_... bytes) and return its size.\n"
    yield " * unpack: 1 if type and size are right, else 0 and nothing is written. */\n"
    for name in map(str.lower, messages):
        yield f"size_t sc_pack_{name}(const sc_{name} *message, uint8_t *payload);\n"
        yield f"int sc_unpack_{name}(const uint8_t *payload, size_t size, sc_{name} *message);\n"
    yield "\n#endif\n"


def _c_enum(values: Mapping[str, int]) -> str:
    lines = ",\n".join(f"    {name} = {value}" for name, value in values.items())
    return f"\nenum {{\n{lines}\n}};\n"


def _source(wire: Mapping[str, Any]) -> Iterator[str]:
    yield "/* Packs messages byte by byte, so that padding and byte order do not matter.\n"
    yield f" * {GENERATED} */\n"
    yield '#include "sc_messages.h"\n\n#include "sc_bytes.h"\n\n'
    yield "uint64_t sc_schema_hash(void)\n{\n"
    yield f"    return UINT64_C(0x{schema_hash(wire):016X});\n}}\n"
    for name, message in wire["messages"].items():
        struct = f"sc_{name.lower()}"
        puts, gets = [], []
        for field in message["fields"]:
            at, kind = f"payload + {field['offset']}", field["type"]
            member = f"message->{field['name']}"
            if kind.startswith("char"):
                puts.append(f"memcpy({at}, {member}, sizeof {member})")
                gets.append(f"memcpy({member}, {at}, sizeof {member})")
            elif field in _own(message):
                puts.append(f"put_{kind}({at}, {member})")
                gets.append(f"{member} = get_{kind}({at})")
            else:
                value = f"SC_TYPE_{name}" if field["name"] == "type" else "0"
                puts.append(f"put_{kind}({at}, {value})")
        yield f"\nsize_t sc_pack_{name.lower()}(const {struct} *message, uint8_t *payload)\n{{\n"
        yield "".join(f"    {line};\n" for line in puts)
        yield f"    return SC_SIZE_{name};\n}}\n"
        yield f"\nint sc_unpack_{name.lower()}"
        yield f"(const uint8_t *payload, size_t size, {struct} *message)\n{{\n"
        yield f"    if (size != SC_SIZE_{name} || payload[0] != SC_TYPE_{name}) {{\n"
        yield "        return 0;\n    }\n"
        yield "".join(f"    {line};\n" for line in gets)
        yield "    return 1;\n}\n"


def _module(wire: Mapping[str, Any]) -> Iterator[str]:
    yield f'"""The messages of the wire. {GENERATED}"""\n\n'
    yield "from enum import IntEnum, IntFlag\nfrom typing import NamedTuple\n\n"
    yield f"PROTOCOL_VERSION = {wire['protocol_version']}\n"
    yield f"SCHEMA_HASH = 0x{schema_hash(wire):016X}\n"
    yield '"""First 8 bytes, little-endian, of SHA-256 over the canonical form of wire.json."""\n'
    yield "EARLIER_SCHEMAS: dict[int, int] = {\n"
    for version, earlier in wire["earlier_schemas"].items():
        yield f"    {version}: 0x{earlier},\n"
    yield '}\n"""Schema hash of each earlier protocol version whose devices are served."""\n'
    for key, (name, kind, meaning) in ENUMS.items():
        yield f'\n\nclass {name}({kind}):\n    """{meaning}"""\n\n'
        for member, number in _members(wire[key]):
            yield f"    {member} = {number}\n"
    defaults = {
        "protocol_version": "PROTOCOL_VERSION",
        "schema_hash": "SCHEMA_HASH",
        "cause": "0",  # of protocol version 1, which has neither
        "hold_ticks": "0",
    }
    for name, message in wire["messages"].items():
        yield f"\n\nclass {_class_name(name)}(NamedTuple):\n"
        yield f'    """{_sender(message)}: {_inline(message["meaning"])}\n\n'
        fields = sorted(_own(message), key=lambda field: field["name"] in defaults)
        for field in fields:
            yield f"    ``{field['name']}``: {_meaning(field)}.\n"
        yield '    """\n\n'
        for field in fields:
            value = f" = {defaults[field['name']]}" if field["name"] in defaults else ""
            if name == "STATE" and field["type"] == "f32":
                value = " = 0.0"  # what a device does not measure
            letter = "text" if field["type"] == TEXT else field["type"][0]
            hint = {"text": "str", "f": "float", "c": "bytes"}.get(letter, "int")
            clash = "  # type: ignore[assignment]" if hasattr(tuple, field["name"]) else ""
            yield f"    {field['name']}: {hint}{value}{clash}\n"
    classes = [_class_name(name) for name in wire["messages"]]
    union = "\n    | ".join(classes)
    yield f"\n\nMessage = (\n    {union}\n)\n\nTYPES: dict[int, type[Message]] = {{\n"
    for name, message in wire["messages"].items():
        yield f"    {message['type']}: {_class_name(name)},\n"
    yield '}\n"""Messages by the first byte of their payload."""\n'


def _class_name(name: str) -> str:
    return "".join(word.capitalize() for word in name.split("_"))


def _sender(message: Mapping[str, Any]) -> str:
    return {"device_to_host": "Device to host", "host_to_device": "Host to device"}[
        message["direction"]
    ]


def _inline(sentence: str) -> str:
    return sentence[0].lower() + sentence[1:]


def _meaning(field: Mapping[str, Any]) -> str:
    unit = f", {field['unit']}" if "unit" in field else ""
    return f"{field['meaning']}{unit}"


def _page(wire: Mapping[str, Any], page: str) -> str:
    """Replace the sentence and the table under the heading of each message."""
    for name, message in wire["messages"].items():
        rows = [
            f"### `{name}`, 0x{message['type']:02X}",
            "",
            f"{_sender(message)}, {message['size']} bytes. {message['meaning']}",
            "",
            "| offset | type | field | unit | meaning |",
            "|---|---|---|---|---|",
        ]
        for field in message["fields"]:
            cells = (field["offset"], field["type"], field["name"], field.get("unit", ""))
            rows.append("| " + " | ".join(map(str, (*cells, field["meaning"]))) + " |")
        table = "\n".join(rows).replace("|  |", "| |")
        old = re.search(rf"### `{name}`, [^\n]*\n\n[^\n]*\n\n(?:\|[^\n]*\n)+", page)
        if old is None:
            raise ValueError(f"docs/protocol.md has no heading '### `{name}`, ...' with a table.")
        page = f"{page[: old.start()]}{table}\n{page[old.end() :]}"
    return page


def main(check: bool) -> int:
    """Write or compare the generated files; returns the exit code."""
    wire = json.loads((ROOT / "data_schemas/wire.json").read_text(encoding="utf-8"))
    page = (ROOT / "docs/protocol.md").read_text(encoding="utf-8")
    behind = 0
    for name, text in files(wire, page).items():
        path = ROOT / name
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            behind += 1
            print(f"{name} {'differs from data_schemas/wire.json' if check else 'written'}")
            if not check:
                path.write_text(text, encoding="utf-8")
    return int(check and behind > 0)


if __name__ == "__main__":
    sys.exit(main("--check" in sys.argv[1:]))
