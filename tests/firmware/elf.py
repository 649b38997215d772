"""Reads the executables of firmware/arm: segments, symbols, sections of a 32-bit ELF file."""

import struct
from dataclasses import dataclass
from pathlib import Path

LOADED = 1
"""Type of a segment that is loaded (PT_LOAD)."""
WRITABLE, ALLOCATED = 1, 2
NO_BITS = 8


@dataclass(frozen=True)
class Image:
    """What a debugger would write to flash, and where its symbols are.

    ``flash`` pairs load addresses with bytes. ``symbols`` has address and size in bytes of each
    name; a Thumb function's address is odd. ``flash_bytes`` and ``ram_bytes`` are what sections
    take, the stack not counted.
    """

    entry: int
    flash: tuple[tuple[int, bytes], ...]
    symbols: dict[str, tuple[int, int]]
    flash_bytes: int
    ram_bytes: int

    def address(self, name: str) -> int:
        return self.symbols[name][0]


def read_elf(path: Path) -> Image:
    """Read an executable; ValueError if it is not a 32-bit little-endian one for ARM."""
    data = path.read_bytes()
    if data[:6] != b"\x7fELF\x01\x01" or struct.unpack_from("<H", data, 18) != (40,):
        raise ValueError(f"{path.name} is no 32-bit little-endian ELF file for ARM.")
    entry, segments_at, sections_at = struct.unpack_from("<3I", data, 24)
    segment_size, segment_count, section_size, section_count = struct.unpack_from("<4H", data, 42)
    flash = []
    for index in range(segment_count):
        fields = struct.unpack_from("<8I", data, segments_at + index * segment_size)
        kind, offset, _, load_address, size = fields[:5]
        if kind == LOADED and size:
            flash.append((load_address, data[offset : offset + size]))
    sections = [
        struct.unpack_from("<10I", data, sections_at + index * section_size)
        for index in range(section_count)
    ]
    loaded = [section for section in sections if section[2] & ALLOCATED]
    return Image(
        entry=entry,
        flash=tuple(flash),
        symbols=_symbols(data, sections),
        flash_bytes=sum(section[5] for section in loaded if section[1] != NO_BITS),
        ram_bytes=sum(section[5] for section in loaded if section[2] & WRITABLE),
    )


def _symbols(data: bytes, sections: list[tuple[int, ...]]) -> dict[str, tuple[int, int]]:
    table = next(section for section in sections if section[1] == 2)  # SHT_SYMTAB
    names_at = sections[table[6]][4]
    symbols = {}
    for offset in range(table[4], table[4] + table[5], 16):
        name, value, size = struct.unpack_from("<3I", data, offset)
        start = names_at + name
        symbols[data[start : data.index(b"\0", start)].decode()] = (value, size)
    symbols.pop("", None)
    return symbols
