"""The package file: one reproducible zip, checked before use.

Nothing in a package is executed, unpickled or unpacked to disk. What its manifest does not name,
or names with another content, is refused before use.
"""

import io
import math
import stat
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import InputError, MissingError, OtherKindError
from scissorcal.files import replacing
from scissorcal.foreign import open_foreign, parse_json, reading
from scissorcal.foreign.formats import PACKAGE
from scissorcal.foreign.kinds import UNKNOWN, is_unknown
from scissorcal.identity import bytes_digest
from scissorcal.kernel import Row16, Table, Table16
from scissorcal.package.manifest import (
    FORMAT,
    LARGEST_MEMBER,
    Manifest,
    Member,
    canonical,
    content_hash,
)
from scissorcal.package.records import StoredRow
from scissorcal.package.tables import Rows

MANIFEST_FILE = "manifest.json"
LARGEST_MANIFEST = 1_000_000
MOST_MEMBERS = 32
LARGEST_HEADER = 1_000

REMEDY = PACKAGE.remedy

Arrays = Mapping[str, NDArray[Any]]


def write_archive(path: Path, manifest: Manifest, arrays: Arrays) -> None:
    """Write a package, complete or not at all. Equal manifest and arrays give equal bytes.

    Raises InputError where the file cannot be written; what was there before is kept.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part:
            part.write_bytes(_archive_bytes(manifest, arrays))
    except OSError as error:
        raise InputError(
            f"{path} cannot be written ({error.strerror}): make room, move away a file that stands "
            "in its place, or choose another place."
        ) from error


def _archive_bytes(manifest: Manifest, arrays: Arrays) -> bytes:
    """The bytes of the package file: stored, in the manifest's order, without a date."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        _add(archive, MANIFEST_FILE, manifest.model_dump_json(indent=2).encode("utf-8"))
        for member in manifest.members:
            stored = _stored(arrays[member.file], member.rows)
            _add(archive, member.file, array_bytes(stored))
    return buffer.getvalue()


def read_archive(path: Path) -> tuple[Manifest, dict[str, NDArray[Any]]]:
    """Read and check a package: its manifest, and its arrays by file name.

    Tables in 16-bit numbers are given as the float32 that a kernel decodes from them.
    Raises MissingError where there is no file, and InputError naming file, member and remedy where
    it is no package, or anything in it is not as its manifest states.
    """
    with _opened(path) as archive:
        infos = _entries(path, archive)
        manifest = _read_manifest(path, archive, infos)
        _check_members(path, manifest, infos)
        arrays = {
            member.file: _read_member(path, archive, infos[member.file], member)
            for member in manifest.members
        }
    return manifest, arrays


def read_manifest(path: Path | str) -> Manifest:
    """Read and check a package's manifest alone, which is quick; its arrays are not looked at.

    Raises as `read_archive` does.
    """
    path = Path(path)
    with _opened(path) as archive:
        return _read_manifest(path, archive, _entries(path, archive))


def array_bytes(array: NDArray[Any]) -> bytes:
    """An array as .npy bytes, never pickled."""
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.ascontiguousarray(array), (1, 0), allow_pickle=False)
    return buffer.getvalue()


def member_of(file: str, array: NDArray[Any], rows: Rows | None = None) -> Member:
    """The manifest's entry of one array; ``rows`` say how a table goes into 16-bit numbers.

    ValueError where the array holds what such numbers cannot.
    """
    stored_rows = None
    if rows is not None:
        first, second, third = (StoredRow(offset=row.offset, scale=row.scale) for row in rows)
        stored_rows = (first, second, third)
    stored = _stored(array, stored_rows)
    data = array_bytes(stored)
    return Member(
        file=file,
        dtype=_DTYPES[stored.dtype.newbyteorder("<").str],
        shape=(array.shape[0], array.shape[1]),
        bytes=len(data),
        sha256=bytes_digest(data),
        rows=stored_rows,
    )


_DTYPES: dict[str, Literal["<f4", "<f8", "<i2"]] = {"<f4": "<f4", "<f8": "<f8", "<i2": "<i2"}


def _stored(array: NDArray[Any], rows: tuple[StoredRow, ...] | None) -> NDArray[Any]:
    """An array as the file holds it."""
    return array if rows is None else Table16.of(Table(*array), _rows16(rows)).numbers


def _rows16(rows: tuple[StoredRow, ...]) -> Rows:
    first, second, third = (Row16(row.offset, row.scale) for row in rows)
    return first, second, third


def _add(archive: zipfile.ZipFile, name: str, data: bytes) -> None:
    info = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
    info.create_system = 3
    info.external_attr = (stat.S_IFREG | 0o644) << 16
    archive.writestr(info, data, zipfile.ZIP_STORED)


@contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open the zip; what the standard library says of a damaged one becomes an InputError."""
    if not path.exists():
        raise MissingError(
            f"{path} does not exist: build a package first with 'scissorcal package build'."
        )
    with (
        reading(path, PACKAGE),
        open_foreign(path, PACKAGE) as file,
    ):
        if is_unknown(file.read()):
            raise OtherKindError(path, UNKNOWN, PACKAGE.name)
        with zipfile.ZipFile(file) as archive:
            yield archive


def _entries(path: Path, archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    infos = archive.infolist()
    if len(infos) > MOST_MEMBERS:
        raise InputError(f"{path} holds {len(infos)} files, too many for a package. {REMEDY}")
    found: dict[str, zipfile.ZipInfo] = {}
    for info in infos:
        name, shown = info.filename, info.filename[:80]
        where = f"{path}, member {shown!r}"
        if _leaves_archive(info.orig_filename) or _leaves_archive(name):
            raise InputError(f"{where}: its path leaves the archive. {REMEDY}")
        if stat.S_ISLNK(info.external_attr >> 16):
            raise InputError(f"{where} is a symbolic link, which no package has. {REMEDY}")
        if name in found:
            raise InputError(f"{where} is there twice. {REMEDY}")
        if info.flag_bits & 1:
            raise InputError(f"{where} is encrypted, which no package is. {REMEDY}")
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise InputError(f"{where} is compressed by a method that no package uses. {REMEDY}")
        found[name] = info
    return found


def _leaves_archive(name: str) -> bool:
    pure = PurePosixPath(name)
    odd = any(character in name for character in "\\:\0")
    return odd or pure.is_absolute() or ".." in pure.parts or name.startswith("~")


def _read_manifest(
    path: Path, archive: zipfile.ZipFile, infos: dict[str, zipfile.ZipInfo]
) -> Manifest:
    from pydantic import ValidationError

    where = f"{path}, member {MANIFEST_FILE!r}"
    if MANIFEST_FILE not in infos:
        raise OtherKindError(path, f"a zip archive without {MANIFEST_FILE}", PACKAGE.name)
    data = _read_bounded(where, archive, infos[MANIFEST_FILE], LARGEST_MANIFEST)
    facts = parse_json(data, where, REMEDY)
    try:
        plain = canonical(facts)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{where} is not JSON ({error}). {REMEDY}") from None
    stated = facts.get("format") if isinstance(facts, dict) else None
    if stated != FORMAT:
        raise InputError(
            f"{where}: the format is {stated!r}, and this version of scissorcal reads {FORMAT!r}. "
            "Build the package again with this version, or install the one that wrote it."
        )
    try:
        manifest = Manifest.model_validate_json(plain)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "its content"
        raise InputError(f"{where}: {place} is not valid: {first['msg']}. {REMEDY}") from None
    if content_hash(facts) != manifest.content_hash:
        raise InputError(f"{where} was changed: it does not have the hash it states. {REMEDY}")
    return manifest


def _check_members(path: Path, manifest: Manifest, infos: dict[str, zipfile.ZipInfo]) -> None:
    stated = {member.file for member in manifest.members} | {MANIFEST_FILE}
    for name in sorted(set(infos) - stated):
        raise InputError(f"{path}, member {name[:80]!r} is not in the manifest. {REMEDY}")
    for name in sorted(stated - set(infos)):
        raise InputError(f"{path}: member {name!r} is missing. {REMEDY}")


def _read_member(
    path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo, member: Member
) -> NDArray[Any]:
    where = f"{path}, member {member.file!r}"
    if info.file_size != member.bytes:
        raise InputError(
            f"{where} claims {info.file_size} bytes, and the manifest states {member.bytes}. "
            f"{REMEDY}"
        )
    data = _read_bounded(where, archive, info, member.bytes)
    if len(data) != member.bytes or bytes_digest(data) != member.sha256:
        raise InputError(f"{where} was changed: it does not have the hash that is stated. {REMEDY}")
    try:
        array = _parse_array(data, member)
        if member.rows is not None:
            table = Table16(array, _rows16(member.rows)).decoded()
            array = np.stack([table.x, table.y, table.slope])
    except Exception as error:
        why = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(
            f"{where} is not an array as the manifest states: {why.rstrip('.')}. {REMEDY}"
        ) from error
    if not np.isfinite(array).all():
        raise InputError(f"{where} holds a number that is not finite. {REMEDY}")
    return array


def _read_bounded(where: str, archive: zipfile.ZipFile, info: zipfile.ZipInfo, most: int) -> bytes:
    """Read one member, but never unpack more than ``most`` bytes and one."""
    with archive.open(info) as stream:
        data = stream.read(min(most, LARGEST_MEMBER) + 1)
    if len(data) > most:
        raise InputError(f"{where} unpacks to more than the {most} bytes it may have. {REMEDY}")
    return data


def _parse_array(data: bytes, member: Member) -> NDArray[Any]:
    """Give the array in .npy bytes, if its header says just what the manifest does."""
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    if version != (1, 0):
        raise ValueError(f"its .npy version is {version}, not (1, 0)")
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(
        stream, max_header_size=LARGEST_HEADER
    )
    if dtype.str != member.dtype or shape != member.shape or fortran:
        raise ValueError(f"it has shape {shape} and type {dtype.str}")
    body = data[stream.tell() :]
    if len(body) != math.prod(shape) * dtype.itemsize:
        raise ValueError(f"it has {len(body)} bytes of numbers for shape {shape}")
    return np.frombuffer(body, dtype=dtype).reshape(shape)
