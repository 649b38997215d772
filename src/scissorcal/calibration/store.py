"""One store for every result of a fit: a netCDF file that ArviZ, xarray and h5py read.

A file is derived from the result's dataclass. Arrays become variables with named dimensions
(:class:`~scissorcal.calibration.result.Stored` says where); all else is JSON in the root attribute
``scissorcal``, in which ``{"variable": path}`` stands for an array. The file ends with its SHA-256,
after the netCDF data, so that damage is found before anything is read. Equal results give equal
bytes. A result without arrays may be kept as plain JSON, in a file that ends in ``.json``.
"""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, fields, is_dataclass, replace
from functools import cache
from io import BytesIO
from operator import attrgetter
from pathlib import Path
from types import NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Literal,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.result import FitResult, Header, Result, Stored
from scissorcal.errors import InputError, OtherKindError, ScissorcalError
from scissorcal.files import replacing
from scissorcal.foreign import Format, parse_isolated, read_foreign, read_json
from scissorcal.foreign.formats import FIT
from scissorcal.foreign.kinds import FIT_SEAL, OF_SCISSORCAL, UNKNOWN, fit_name, is_unknown
from scissorcal.identity import bytes_digest
from scissorcal.recipe.requirements import command_words

if TYPE_CHECKING:
    import h5netcdf

R = TypeVar("R", bound=Result)
_Variable = tuple[tuple[str, ...], NDArray[Any], Mapping[str, str]]
"""Dimensions, values and attributes."""
_Variables = Mapping[str, NDArray[Any]]

FORMAT = "scissorcal-result/1"
EARLIER = ("scissorcal-fit/1", "scissorcal-fit/2")
"""Formats of earlier versions, which are refused: the fit is made again."""
EARLIER_FIELDS = {
    "rung": "candidate",
    "rungs": "candidates",
    "belief": "edge_posterior",
    "believed": "measured_prior",
}
"""What fields are called now that files may have under an old name."""
COMPRESSED_BYTES = 4096
"""Size from which an array is compressed."""
FITS = ("friction", "friction-advance", "cut", "camera", "blade", "plate")
"""Names of the files that fits have in a workspace, without ".nc"."""
_LOAD = "scissorcal.calibration.store_contents:load_contents"
_SEAL_SIZE = len(FIT_SEAL) + 64 + 1


def save(result: Result, path: Path) -> None:
    """Write a result to ``path``, complete or not at all."""
    writer = _Writer()
    tree = writer.tree(result, "", None)
    if path.suffix == ".json":
        text = json.dumps(tree, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
        content = text.encode() + b"\n"
    else:
        data = _netcdf(result, tree, writer.variables)
        content = data + _seal(data)
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        part.write_bytes(content)


def load(path: Path, kind: type[R]) -> R:
    """Read a result of type ``kind`` that :func:`save` wrote.

    Raises InputError where the file is missing, damaged, of another kind or another version.
    """
    with _reported(path, kind):
        if path.suffix == ".json":
            return cast(R, _built(kind, read_json(path, _format_of(path, kind)), None))
        texts, variables = _opened(path, kind)
        if texts["kind"] != kind.__name__:
            raise OtherKindError(path, fit_name(_header(texts).what), f"a {kind.title}")
        return cast(R, _built(kind, json.loads(texts["scissorcal"]), variables))


def load_fit(path: Path) -> FitResult:
    """Read a fit of friction or of a cut; see :func:`load`."""
    return load(path, FitResult)


def read_header(path: Path) -> Header:
    """Read what a stored result is of; raises InputError as :func:`load` does."""
    with _reported(path, Result):
        return _header(_opened(path, Result, with_variables=False)[0])


def _header(texts: Mapping[str, str]) -> Header:
    return cast(Header, _built(Header, json.loads(texts["header"]), None))


@contextmanager
def _reported(path: Path, kind: type[Result]) -> Iterator[None]:
    """Turn what goes wrong within into an InputError that names the file and the remedy."""
    try:
        yield
    except ScissorcalError:
        raise
    except Exception as error:
        why = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            f"{path} is not a {kind.title} of scissorcal, or it is damaged ({why}): "
            f"{_again(path, kind)}."
        ) from error


def _again(path: Path, kind: type[Result]) -> str:
    """How to make a result again; a fit's file in a workspace has the name of its command."""
    if kind.command != Result.command or path.suffix != ".nc" or path.stem not in FITS:
        return f"remove it and run '{kind.command}' again"
    return f"run '{kind.command} {command_words(path.stem)} --force'"


def _format_of(path: Path, kind: type[Result]) -> Format:
    again = _again(path, kind)
    return replace(
        FIT,
        name=f"a {kind.title} of scissorcal",
        remedy=f"{again[0].upper()}{again[1:]}.",
        holds=("verify", "json", "text")
        if kind.command.startswith("scissorcal verify")
        else FIT.holds,
    )


def _opened(
    path: Path, kind: type[Result], *, with_variables: bool = True
) -> tuple[Mapping[str, str], _Variables]:
    """The root's texts of a file whose hash and version are right, and its variables by path."""
    if not path.exists():
        raise FileNotFoundError("No such file")
    form = _format_of(path, kind)
    content = read_foreign(path, form)
    data, seal = content[:-_SEAL_SIZE], content[-_SEAL_SIZE:]
    if seal != _seal(data):
        for version in EARLIER:
            if version.encode() in content:
                raise InputError(
                    f"{path} was written by an earlier version of scissorcal ({version}), which "
                    f"this version does not read: remove it and run '{kind.command}' again."
                )
        if is_unknown(content):
            raise OtherKindError(path, UNKNOWN, form.name)
        damaged = ValueError("its SHA-256 does not match its content")
        if OF_SCISSORCAL in content:
            raise damaged
        try:
            parse_isolated(_LOAD, content, path, form, with_variables=False)
        except InputError:  # as of a file that was cut off
            raise damaged from None
        raise OtherKindError(path, "an HDF5 file of another program", form.name)
    contents = parse_isolated(_LOAD, data, path, form, with_variables=with_variables)
    texts: Mapping[str, str] = contents["attributes"]
    if texts["format"] != FORMAT:
        raise ValueError(f"its format is {texts['format']}, and this reads {FORMAT}")
    return texts, contents["variables"]


def _seal(data: bytes) -> bytes:
    return FIT_SEAL + bytes_digest(data).encode() + b"\n"


def _netcdf(result: Result, tree: Any, variables: Mapping[str, _Variable]) -> bytes:
    import h5netcdf

    header = Header(
        what=result.what,
        effort=str(getattr(result, "effort", "")),
        model=result.model,
        inputs_hash=result.inputs_hash,
        failed=tuple(verdict.check for verdict in result.rejected),
        origin=str(getattr(result, "origin", "fitted")),
    )
    stream = BytesIO()
    with h5netcdf.File(stream, "w") as file:
        for at, variable in variables.items():
            _write(file, at, *variable)
        file.attrs.update(
            format=FORMAT,
            kind=type(result).__name__,
            header=json.dumps(asdict(header)),
            scissorcal=json.dumps(tree),
            inference_library="scissorcal",
        )
    return stream.getvalue()


def _write(
    file: "h5netcdf.File",
    at: str,
    dims: tuple[str, ...],
    values: NDArray[Any],
    attributes: Mapping[str, str],
) -> None:
    """Write a variable; a dimension is taken from the nearest group that has it in this size."""
    path, _, name = at.rpartition("/")
    group: h5netcdf.Group = file
    for part in filter(None, path.split("/")):
        group = group.groups[part] if part in group.groups else group.create_group(part)
    for dimension, size in zip(dims, values.shape, strict=True):
        known = group.dimensions.get(dimension)
        if known is None or known.size != size:
            group.dimensions[dimension] = size
            if dimension == "draw":
                _write(file, f"{path}/chain", ("chain",), np.zeros(1, int), {})
                _write(file, f"{path}/draw", ("draw",), np.arange(size), {})
    packed = values.nbytes >= COMPRESSED_BYTES
    options: dict[str, Any] = {"compression": "gzip", "shuffle": True} if packed else {}
    written = group.create_variable(name, dims, data=values, **options)
    written.attrs.update(attributes)


class _Writer:
    """Turns a result into a JSON tree and the variables that its arrays become."""

    def __init__(self) -> None:
        self.variables: dict[str, _Variable] = {}

    def tree(self, value: Any, path: str, stored: Stored | None) -> Any:
        """The JSON of a value at ``path`` below the root."""
        if is_dataclass(value):
            return self._object(value, path, stored)
        if isinstance(value, np.generic):
            return value.item()
        if isinstance(value, tuple | list):
            return [self.tree(item, f"{path}/{i}", stored) for i, item in enumerate(value)]
        if isinstance(value, Mapping):
            return {key: self.tree(item, f"{path}/{key}", stored) for key, item in value.items()}
        if isinstance(value, np.ndarray):
            return self._array(value, path, stored, None)
        return value

    def _object(self, value: Any, path: str, stored: Stored | None) -> dict[str, Any]:
        tree, kind = {}, cast(Any, type(value))
        for name, (_, annotation) in _fields(kind).items():
            item, here = getattr(value, name), annotation or stored
            if isinstance(item, np.ndarray):
                tree[name] = self._array(item, f"{path}/{name}", here, value)
            else:
                tree[name] = self.tree(item, f"{path}/{name}", here)
        for name in getattr(kind, "also_written", ()):
            tree[name] = self.tree(getattr(value, name), f"{path}/{name}", stored)
        return tree

    def _array(
        self, values: NDArray[Any], path: str, stored: Stored | None, owner: Any
    ) -> dict[str, Any]:
        if values.size == 0:
            return {"empty": list(values.shape)}
        group, _, name = path.rpartition("/")
        if stored is None:
            dims = tuple(f"{name}_{axis}" for axis in range(values.ndim))
            return {"variable": self._add(path, dims, values, {})}
        group = stored.group if stored.group[:1] == "/" else f"{group}/{stored.group}".rstrip("/")
        if stored.dims[:1] == ("chain",):
            values = values[None]
        if not stored.columns:
            at = f"{group}/{stored.name or name}"
            return {"variable": self._add(at, stored.dims, values, {})}
        columns = attrgetter(stored.columns)(owner)
        paths = [
            self._add(
                f"{group}/{getattr(column, 'name', column)}",
                stored.dims,
                values[..., index],
                {"unit": column.unit, "long_name": column.meaning}
                if hasattr(column, "unit")
                else {},
            )
            for index, column in enumerate(columns)
        ]
        return {"variables": paths}

    def _add(
        self, at: str, dims: tuple[str, ...], values: NDArray[Any], attributes: Mapping[str, str]
    ) -> str:
        if values.dtype == np.bool_:
            values = values.astype(np.int8)
        self.variables[at] = (dims, values, attributes)
        return at


@cache
def _fields(kind: Any) -> Mapping[str, tuple[Any, Stored | None]]:
    """Type and storage of each field that a dataclass is made of."""
    hints = get_type_hints(kind, include_extras=True)
    storage = {}
    for field in fields(kind):
        if field.init:
            hint, stored = hints[field.name], None
            if get_origin(hint) is Annotated:
                hint, *extras = get_args(hint)
                stored = next((extra for extra in extras if isinstance(extra, Stored)), None)
            storage[field.name] = (hint, stored)
    return storage


def _built(hint: Any, value: Any, file: _Variables | None, stored: Stored | None = None) -> Any:
    """A value of type ``hint`` from its JSON. Raises ValueError where it is of another type."""
    origin, arguments = get_origin(hint), get_args(hint)
    if hint is Any:
        return value
    if origin in (Union, UnionType):
        if value is None and NoneType in arguments:
            return None
        return _first_that_fits(arguments, value, file, stored)
    if origin is Literal:
        return value if value in arguments else _refuse(hint, value)
    if origin is np.ndarray:
        return _array_of(get_args(arguments[1])[0], value, file, stored)
    if origin is tuple and isinstance(value, list):
        kinds = [arguments[0]] * len(value) if arguments[-1] is Ellipsis else arguments
        pairs = zip(kinds, value, strict=True)
        return tuple(_built(kind, item, file, stored) for kind, item in pairs)
    if is_dataclass(hint) and isinstance(value, dict):
        return _object_of(hint, value, file, stored)
    if hint is float and type(value) in (int, float):
        return float(value)
    wanted = dict if issubclass(origin or hint, Mapping) else origin or hint
    return value if type(value) is wanted else _refuse(hint, value)


def _first_that_fits(
    kinds: tuple[Any, ...], value: Any, file: _Variables | None, stored: Stored | None
) -> Any:
    for kind in kinds:
        if kind is not NoneType:
            try:
                return _built(kind, value, file, stored)
            except (ValueError, TypeError, KeyError) as error:
                reason = error
    raise reason


def _object_of(
    kind: Any, value: dict[str, Any], file: _Variables | None, stored: Stored | None
) -> Any:
    known = _fields(kind)
    value = {EARLIER_FIELDS.get(name, name): item for name, item in value.items()}
    names = {field.name for field in fields(kind)} | set(getattr(kind, "also_written", ()))
    if unknown := value.keys() - names:
        raise ValueError(f"{kind.__name__} has the unknown {', '.join(sorted(unknown))}")
    given = {
        name: _built(hint, value[name], file, annotation or stored)
        for name, (hint, annotation) in known.items()
        if name in value
    }
    return kind(**given)


def _array_of(
    dtype: Any, value: Any, file: _Variables | None, stored: Stored | None
) -> NDArray[Any]:
    if not isinstance(value, dict) or len(value) != 1:
        _refuse(np.ndarray, value)
    if "empty" in value:
        return np.zeros(value["empty"], dtype)
    assert file is not None
    if "variable" in value:
        values = file[value["variable"].strip("/")]
    else:
        values = np.stack([file[at.strip("/")] for at in value["variables"]], axis=-1)
    chained = stored is not None and stored.dims[:1] == ("chain",)
    return np.asarray(values[0] if chained else values, dtype=dtype)


def _refuse(hint: Any, value: Any) -> Any:
    raise ValueError(f"{str(value)[:40]!r} is not of type {getattr(hint, '__name__', hint)}")
