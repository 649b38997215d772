"""Open a file of others, and turn what its parser raises into one sentence that names it.

JSON, YAML and XML are read here, by Python alone: no tag is obeyed, nothing expanded, and what
nests too deeply is refused.
"""

import contextlib
import json
import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from scissorcal.errors import InputError, ScissorcalError, file_error
from scissorcal.foreign.formats import Format
from scissorcal.foreign.kinds import refuse_other_kind

if TYPE_CHECKING:
    import yaml

LONGEST_NUMBER = 300
"""Digits of a whole number in JSON; more would not be a float of any size."""

_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a named pipe (fifo)",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}
_OPEN_FLAGS = (
    os.O_RDONLY
    | getattr(os, "O_NONBLOCK", 0)
    | getattr(os, "O_NOCTTY", 0)
    | getattr(os, "O_CLOEXEC", 0)
    | getattr(os, "O_BINARY", 0)
)


@contextlib.contextmanager
def open_foreign(path: Path, kind: Format) -> Iterator[IO[bytes]]:
    """Open a regular file of at most the format's size; it is closed at the end of the block.

    A pipe, device, socket or folder is refused without being opened, and again by what the open
    file is, so that none can take the place of a file in between. A file of another known kind is
    refused by its name (OtherKindError). Raises InputError, in one sentence, also where there is no
    such file or it may not be read.
    """
    file = _opened(path)
    try:
        facts = os.fstat(file.fileno())
        _refuse_irregular(path, facts)
        refuse_other_kind(file, path, kind.name, kind.holds)
        if facts.st_size > kind.most_bytes:
            raise InputError(_too_large(path, kind))
        yield file
    finally:
        file.close()


def read_foreign(path: Path, kind: Format) -> bytes:
    """All bytes of a regular file that is not empty; raises InputError as `open_foreign` does."""
    with reading(path, kind), open_foreign(path, kind) as file:
        data = file.read(os.fstat(file.fileno()).st_size)  # what is asked for is reserved at once
    if not data:
        raise InputError(f"{path} is empty (0 bytes). {kind.remedy}")
    return data


def read_foreign_text(path: Path, kind: Format) -> str:
    """The text of a UTF-8 file, without a byte order mark; raises InputError as `read_foreign`."""
    return decode_text(read_foreign(path, kind), path)


def decode_text(data: bytes, path: Path) -> str:
    """Bytes as UTF-8 text; InputError with the place of the first byte that is none."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}, byte {error.start}: this is not UTF-8 text; save the file as UTF-8."
        ) from None


def read_json(path: Path, kind: Format) -> Any:
    """The content of a JSON file; raises InputError as `read_foreign` and `parse_json` do."""
    return parse_json(read_foreign(path, kind), str(path), kind.remedy)


def parse_json(data: bytes | str, where: str, remedy: str) -> Any:
    """Parse JSON of bounded levels and digits; InputError that begins with ``where``.

    >>> parse_json('{"a": [1.5]}', "a.json", "Write it again.")
    {'a': [1.5]}
    """
    try:
        text = data if isinstance(data, str) else data.decode("utf-8-sig")
        return json.loads(text, parse_int=_whole_number)
    except ValueError as error:
        raise InputError(f"{where} is not valid JSON ({first_line(error)}). {remedy}") from None
    except RecursionError:
        raise InputError(f"{where} is nested too deeply for JSON. {remedy}") from None


@contextlib.contextmanager
def reading(path: Path | str, kind: Format, remedy: str = "") -> Iterator[None]:
    """Turn whatever is raised while a file is parsed into an InputError that names it.

    For code that parses and nothing else: an error in it is one of the file. The original error is
    kept as the cause. Errors of scissorcal pass through.
    """
    try:
        yield
    except ScissorcalError:
        raise
    except Exception as error:
        raise _foreign_error(error, path, kind, remedy) from error


def _foreign_error(
    error: Exception, path: Path | str, kind: Format, remedy: str = ""
) -> ScissorcalError:
    """The sentence on what a parser raised."""
    remedy = remedy or kind.remedy
    if isinstance(error, OSError) and error.errno is not None:
        known = file_error(error, Path(path))
        return known or InputError(f"{path} cannot be read: {error.strerror}. {remedy}")
    if isinstance(error, MemoryError):
        return InputError(f"{path} needs more memory than there is. {remedy}")
    if isinstance(error, RecursionError):
        return InputError(f"{path} is nested too deeply for {kind.name}. {remedy}")
    return InputError(
        f"{path} is not {kind.name}, or it is damaged ({first_line(error)}). {remedy}"
    )


def refuse_unless_regular(path: Path, kind: Format) -> None:
    """Raise InputError as `open_foreign` does, for a library that opens the file by its name."""
    with open_foreign(path, kind):
        return


def _too_large(path: Path | str, kind: Format) -> str:
    """The sentence on a file of more bytes than its format has."""
    return (
        f"{path} has more than {kind.most_bytes / 1e6:g} MB, too much for {kind.name}: is it "
        "another file?"
    )


def _opened(path: Path) -> IO[bytes]:
    try:
        _refuse_irregular(path, path.stat())
        return os.fdopen(os.open(path, _OPEN_FLAGS), "rb")
    except FileNotFoundError:
        raise InputError(f"{path} does not exist. Check the name and the folder.") from None
    except OSError as error:
        raise InputError(
            f"{path} cannot be read: {error.strerror}. Name a file that you may read."
        ) from None
    except ValueError:
        raise InputError(f"{str(path)!r} cannot be the name of a file. Check it.") from None


def _refuse_irregular(path: Path, facts: os.stat_result) -> None:
    if not stat.S_ISREG(facts.st_mode):
        what = _KINDS.get(stat.S_IFMT(facts.st_mode), "no regular file")
        raise InputError(f"{path} cannot be read: it is {what}, not a file. Name a file.")


def _whole_number(digits: str) -> int:
    if len(digits) > LONGEST_NUMBER:
        raise ValueError(f"a number of {len(digits)} digits")
    return int(digits)


def first_line(error: Exception) -> str:
    """The first line of what an error says, at most 200 characters; its type where it is empty."""
    lines = str(error).strip().splitlines()
    return lines[0][:200] if lines else type(error).__name__


DEEPEST = 32
"""Levels of a text; camera files have four."""

TYPE_KEY = "type_id"
"""Key under which a mapping has the type that its tag or attribute states."""

Tree = str | list[Any] | dict[str, Any]


def parse_yaml(text: str) -> list[Tree]:
    """The documents of YAML or JSON; ValueError with the reason where it is neither.

    A type such as ``!!opencv-matrix`` is the mapping's ``type_id``, as it is in JSON and XML. The
    directive ``%YAML:1.0`` of OpenCV is passed over, and so are comments of JSON that begin a line.

    >>> parse_yaml("rows: 3\\ndata: [1., .Nan]")
    [{'rows': '3', 'data': ['1.', '.Nan']}]
    """
    import yaml

    plain = re.sub(r"\A\s*%YAML:?[^\n]*\n", "", text.lstrip("\ufeff"))
    plain = re.sub(r"(?m)^\s*//[^\n]*$", "", plain).replace("\t", " ")
    try:
        return [_tree(node, 0) for node in yaml.compose_all(plain, Loader=_loader())]
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())[:120]) from None
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def parse_xml(text: str) -> dict[str, Tree]:
    """An XML document as what is within its root; ValueError with the reason where it is none.

    An element with elements is a dict; one without is its text. Of elements called ``_``, which
    are a list of OpenCV, the last is kept; any other name stands once.
    """
    from xml.parsers import expat

    open_elements: list[tuple[str, dict[str, Any], list[str]]] = [("", {}, [])]

    def begin(name: str, attributes: dict[str, str]) -> None:
        if len(open_elements) > DEEPEST:
            raise ValueError("it is nested too deeply")
        stated = {TYPE_KEY: attributes[TYPE_KEY]} if TYPE_KEY in attributes else {}
        open_elements.append((name, stated, []))

    def end(_: str) -> None:
        name, inner, words = open_elements.pop()
        if name in open_elements[-1][1] and name != "_":
            raise ValueError(f"{name[:40]} stands there twice")
        open_elements[-1][1][name] = inner if set(inner) - {TYPE_KEY} else "".join(words)

    def refuse(*_: Any) -> None:
        raise ValueError("it has a document type, which no camera file needs")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.CharacterDataHandler = lambda words: open_elements[-1][2].append(words)
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(text.lstrip("\ufeff \t\r\n").encode(), True)
    except (expat.ExpatError, UnicodeError) as error:
        raise ValueError(str(error)) from None
    root = next(iter(open_elements[0][1].values()))
    return root if isinstance(root, dict) else {}


def _loader() -> "type[yaml.Loader]":
    import yaml

    class Plain(yaml.SafeLoader):
        """Composes nodes; refuses what would expand, or nest too deeply."""

        depth = 0

        def compose_node(self, parent: Any, index: Any) -> Any:
            event: Any = self.peek_event()  # type: ignore[no-untyped-call]
            if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
                raise yaml.YAMLError("anchors and aliases (&, *) are not read: write values out")
            self.depth += 1
            if self.depth > DEEPEST:
                raise yaml.YAMLError("it is nested too deeply")
            node = super().compose_node(parent, index)
            self.depth -= 1
            return node

    return Plain  # type: ignore[return-value]


def _tree(node: Any, level: int) -> Tree:
    import yaml

    if isinstance(node, yaml.ScalarNode):
        return str(node.value)
    if isinstance(node, yaml.SequenceNode):
        return [_tree(item, level + 1) for item in node.value]
    mapping: dict[str, Any] = {}
    tag = str(node.tag).rpartition(":")[2]
    if tag != "map":
        mapping[TYPE_KEY] = tag
    for key, value in node.value:
        if not isinstance(key, yaml.ScalarNode):
            raise yaml.YAMLError("a key that is not text")
        if str(key.value) in mapping:
            raise yaml.YAMLError(f"{str(key.value)[:40]} stands there twice")
        mapping[str(key.value)] = _tree(value, level + 1)
    return mapping
