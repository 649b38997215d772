"""Changes of what checksums and hashes protect, which are made right again afterwards."""

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Callable

from scissorcal.identity import bytes_digest
from scissorcal.package import content_hash

Change = Callable[[bytes], bytes]
Seal = Callable[[bytes, Change], bytes]


def sealed_fit(data: bytes, change: Change) -> bytes:
    body = change(data[: -len(b"\nscissorcal sha256 ") - 65])
    return body + b"\nscissorcal sha256 " + bytes_digest(body).encode() + b"\n"


def sealed_png(data: bytes, change: Change) -> bytes:
    """A changed picture with right checksums for the chunks that can be found."""
    data = change(data)
    parts, at = [data[:8]], 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        body = data[at + 4 : at + 8 + length]
        if at + 12 + length > len(data):
            break
        parts.append(data[at : at + 4] + body + struct.pack(">I", zlib.crc32(body)))
        at += 12 + length
    return b"".join(parts) + data[at:]


def changed_member(data: bytes, change: Change) -> bytes:
    """A zip of which one member is changed, with right checksums."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    names = sorted(content)
    name = names[zlib.crc32(change(bytes(range(256)))) % len(names)]
    content[name] = change(content[name])
    return _packed(content)


def _packed(content: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, body in content.items():
            archive.writestr(name, body)
    return stream.getvalue()


def sealed_package(data: bytes, change: Change) -> bytes:
    """A package of which a member is changed, with right hashes in a manifest that can be read."""
    changed = changed_member(data, change)
    with zipfile.ZipFile(io.BytesIO(changed)) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    try:
        facts = json.loads(content["manifest.json"])
        for member in facts["members"]:
            body = content[member["file"]]
            member["bytes"], member["sha256"] = len(body), bytes_digest(body)
        facts["content_hash"] = content_hash(facts)
        content["manifest.json"] = json.dumps(facts).encode()
    except (ValueError, KeyError, TypeError, RecursionError):  # no manifest any more
        return changed
    return _packed(content)


def sealed_recording(data: bytes, change: Change) -> bytes:
    """A recording of which the unpacked bytes of every chunk are changed, with right checksums."""
    import zstandard

    parts, at = [data[:8]], 8
    while at + 9 <= len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, at)
        body = data[at + 9 : at + 9 + length]
        if opcode == 6:
            plain = change(zstandard.decompress(body[44:]))
            packed = zstandard.compress(plain)
            head = struct.pack("<QI", len(plain), zlib.crc32(plain))
            body = body[:16] + head + body[28:36] + struct.pack("<Q", len(packed)) + packed
        parts.append(struct.pack("<BQ", opcode, len(body)) + body)
        at += 9 + length
    return b"".join(parts) + data[at:]
