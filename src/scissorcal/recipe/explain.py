"""Say what is wrong with a recipe: line, key, what is allowed, and what was probably meant."""

import difflib
import json
import math
import tomllib
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError

from scissorcal.recipe.units import conversion, converted, split_unit
from scissorcal.recipe.unlikely import Unlikely

_LINES_SEARCHED = 2000
_CHARACTERS_PARSED = 3_000_000
"""In all; a recipe of 400 lines of 30 characters takes 2.4 million, in about a second."""


Path = tuple[str | int, ...]

_COMPARISONS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}
_EXPECTED = {
    "float_type": "a number such as 0.1",
    "int_type": "a whole number such as 3",
    "bool_type": "true or false",
    "string_type": 'text in quotes, such as "paper"',
    "tuple_type": "a list such as [0.1, 0.5]",
    "list_type": "a list such as [0.1, 0.5]",
    "model_type": "a table, [name] with keys below it",
    "dict_type": "a table, [name] with keys below it",
}


MOST_MISTAKES = 20
"""As many as one reads before one corrects them and tries again."""

LONGEST_KEY = 100
"""Characters of a key, with its tables, that are shown; the schema's longest has 57."""

_MOST_COMPARED = 500
"""Unknown keys whose likely meaning is looked for; a recipe has fewer keys."""


@dataclass(frozen=True)
class Mistakes:
    """Sentences in the order of the file, at most ``MOST_MISTAKES``, and how many there are."""

    sentences: tuple[str, ...]
    count: int


def explain(
    error: ValidationError | None,
    unlikely: Sequence[Unlikely],
    document: Mapping[str, Any],
    text: str,
    model: type[BaseModel],
) -> Mistakes:
    """Turn what pydantic found, and ``unlikely`` numbers, into sentences, each with its line.

    A key that was written under another name (a wrong unit, a typo) is one mistake, not two: the
    name that stands there is reported, the name that is therefore missing is not. An unlikely
    number that breaks a rule is one mistake, too: the rule, with the likely slip.
    """
    details = error.errors(include_url=False) if error is not None else []
    unknown = [_path(item) for item in details if item["type"] == "extra_forbidden"]
    meant = {path: _suggest(path, model, document) for path in unknown[:_MOST_COMPARED]}
    excused = {(*path[:-1], key) for path, key in meant.items() if key is not None}
    details = [
        detail for detail in details if detail["type"] != "missing" or _path(detail) not in excused
    ]
    mistakes = [_mistake(item, meant, model) for item in details[:MOST_MISTAKES]]
    slips = {detail.path: detail.slip for detail in unlikely}
    mistakes = [(path, f"{words} {slips.get(path, '')}".rstrip()) for path, words in mistakes]
    wrong = {path[:depth] for path, _ in mistakes for depth in range(1, len(path) + 1)}
    alone = [detail for detail in unlikely if detail.path not in wrong]
    count = len(details) + len(alone)
    mistakes = [*((detail.path, detail.full_sentence) for detail in alone), *mistakes][
        :MOST_MISTAKES
    ]
    lines = key_lines(text, [_given(document, path) for path, _ in mistakes])
    ordered = sorted(zip(lines, mistakes, strict=True), key=lambda pair: pair[0] or 0)
    return Mistakes(
        tuple(
            f"line {line}, {sentence}" if path and line else sentence
            for line, (path, sentence) in ordered
        ),
        count,
    )


def _mistake(
    item: Any, meant: Mapping[Path, str | None], model: type[BaseModel]
) -> tuple[Path, str]:
    """Where one of pydantic's findings is reported, and its sentence."""
    path = _path(item)
    if item["type"] == "missing":
        return path[:-1], _missing(path)
    if item["type"] == "extra_forbidden":
        return path, _unknown(path, meant.get(path), item["input"], model)
    if item["type"] == "value_error":
        return _broken_rule(path, item)
    return path, f"{dotted(path)}: {_wrong_value(item, _fields(model, path))}"


def dotted(path: Path) -> str:
    """Write a path as people do: ``scene.contact_mm[1]``."""
    words = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)
    return _short(words.lstrip("."))


def _path(item: Any) -> Path:
    return tuple(item["loc"])


def _given(document: Any, path: Path) -> Path:
    """Cut a path down to the part that the document really has (a scalar has no items)."""
    for depth, key in enumerate(path):
        try:
            document = document[key]
        except (KeyError, IndexError, TypeError):
            return path[:depth]
    return path


def _missing(path: Path) -> str:
    table = dotted(path[:-1])
    if isinstance(path[-1], int):
        return f"{table}: the list is too short; it needs {path[-1] + 1} numbers or more."
    where = f"in [{table}]" if table else "at the top of the file"
    return f"{dotted(path)} is missing: add {path[-1]} {where}."


def _broken_rule(path: Path, item: Any) -> tuple[Path, str]:
    """Place a rule between keys at the first key that its sentence names and the table has."""
    reason = str(item["ctx"]["error"])
    for word in reason.split():
        inner = tuple(word.strip("(),:;").split("."))
        if (path or len(inner) > 1) and _given(item["input"], inner) == inner:
            place = (*path, *inner)
            spoken = reason if word.startswith(dotted(place)) else f"{dotted(place)}: {reason}"
            return place, f"{spoken}."
    return path, f"{dotted(path)}: {reason}." if path else f"{reason}."


def _wrong_value(item: Any, fields: Sequence[str]) -> str:
    kind, given, context = item["type"], _show(item["input"]), item.get("ctx", {})
    if kind == "finite_number":
        return f"{given} is not a finite number; write the value, or leave the key out."
    if kind in _COMPARISONS:
        name, words = _COMPARISONS[kind]
        return f"{given} must be {words} {context[name]:g}."
    if kind == "literal_error":
        return _choices(item["input"], context["expected"])
    if kind == "string_pattern_mismatch":
        return (
            f"{given} has characters that a name must not have: use letters, digits, '.', '_' "
            "and '-', at most 64, beginning with a letter or digit."
        )
    if kind in {"too_long", "too_short"}:
        bound = context.get("max_length", context.get("min_length"))
        words = "at most" if kind == "too_long" else "at least"
        return f"{given} has {context['actual_length']} items, but {words} {bound} are allowed."
    if kind == "tuple_type" and isinstance(item["input"], str):
        return f"{given} is text, but this must be a list: [{given}]."
    expected = _EXPECTED.get(kind)
    if kind == "model_type" and fields:
        expected = f"a table with the keys {', '.join(fields)}"
    if expected is None:
        return f"{given}: {item['msg']}."
    return f"{given} is {_kind_of(item['input'])}, but this must be {expected}.{_unquote(item)}"


def _unquote(item: Any) -> str:
    if item["type"] not in {"float_type", "int_type"} or not isinstance(item["input"], str):
        return ""
    try:
        number = float(item["input"])
    except ValueError:
        return ""
    return f" Write {item['input'].strip()} without quotes." if math.isfinite(number) else ""


def _choices(given: Any, expected: str) -> str:
    allowed = [choice.strip("'") for choice in expected.replace(" or ", ", ").split(", ")]
    close = difflib.get_close_matches(str(given), allowed, 1, 0.5)
    listed = ", ".join(f'"{choice}"' for choice in allowed)
    hint = f' Did you mean "{close[0]}"?' if close else ""
    return f"{_show(given)} is not allowed here; allowed: {listed}.{hint}"


def _unknown(path: Path, meant: str | None, value: Any, model: type[BaseModel]) -> str:
    key, place = str(path[-1]), dotted(path)
    if meant is None:
        fields = _fields(model, path[:-1])
        allowed = ", ".join(fields) if fields else "nothing"
        table = _elsewhere(key, path, model)
        return f"{place}: unknown key.{table} Allowed here: {allowed}."
    hint = _conversion_hint(key, meant, value)
    return f"{place}: unknown key. Did you mean {meant}?{hint}"


def _elsewhere(key: str, path: Path, model: type[BaseModel]) -> str:
    homes = [table for table in _tables(model) if key in _fields(model, table)]
    homes = [table for table in homes if table != path[:-1]]
    if len(homes) != 1:
        return ""
    return f" It belongs {'in [' + dotted(homes[0]) + ']' if homes[0] else 'at the top'}."


def _suggest(path: Path, model: type[BaseModel], document: Any) -> str | None:
    """Return the key that was probably meant: same stem in another unit, else a near spelling."""
    key = str(path[-1])
    if len(key) > LONGEST_KEY:
        return None
    present = document
    for part in path[:-1]:
        present = present[part]
    fields = [name for name in _fields(model, path[:-1]) if name not in present]
    stem, unit = split_unit(key)
    for name in fields:
        field_stem, field_unit = split_unit(name)
        if field_unit is None or field_stem.lower() != stem.lower():
            continue
        if unit is None or conversion(unit, field_unit) is not None:
            return name
    stems = {split_unit(name)[0]: name for name in reversed(fields)}
    close = difflib.get_close_matches(key, fields, 1, 0.75)
    if not close and not any(name == key for name in fields):
        close = [stems[match] for match in difflib.get_close_matches(stem, list(stems), 1, 0.75)]
    return close[0] if close else None


def _conversion_hint(key: str, meant: str, value: Any) -> str:
    stem, source = split_unit(key)
    meant_stem, target = split_unit(meant)
    if target is None or stem.lower() != meant_stem.lower():
        return ""
    if source is None:
        return f" The unit stands in the name: {target.label}."
    factor = conversion(source, target)
    if factor is None or factor == 1.0:
        return ""
    hint = f" 1 {source.label} = {factor:.6g} {target.label}"
    number = converted(value, factor)
    return hint + (f", so write {meant} = {number}." if number else ".")


def _fields(model: type[BaseModel], table: Path) -> list[str]:
    inner = _table_model(model, table)
    return list(inner.model_fields) if inner is not None else []


def _table_model(model: type[BaseModel], table: Path) -> type[BaseModel] | None:
    for key in table:
        if isinstance(key, int):
            continue  # the item of a list of tables: its model is that of the list
        if key not in model.model_fields:
            return None
        annotation = model.model_fields[key].annotation
        inner = table_model(annotation)
        if inner is None:
            return None
        model = inner
    return model


def table_model(annotation: Any) -> type[BaseModel] | None:
    """The model of a table, or of a list of tables; None for the type of a value."""
    return _model_within(annotation) or _model_listed(annotation)


def _model_within(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    if isinstance(annotation, types.UnionType) or typing.get_origin(annotation) is typing.Union:
        for member in typing.get_args(annotation):
            inner = _model_within(member)
            if inner is not None:
                return inner
    return None


def _model_listed(annotation: Any) -> type[BaseModel] | None:
    """The model of a list of tables."""
    if typing.get_origin(annotation) is not tuple:
        return None
    return _model_within(typing.get_args(annotation)[0])


def _tables(model: type[BaseModel], prefix: Path = ()) -> list[Path]:
    tables: list[Path] = [prefix]
    for name, field in model.model_fields.items():
        inner = _model_within(field.annotation)
        if inner is not None:
            tables += _tables(inner, (*prefix, name))
    return tables


def _show(value: Any) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    try:
        text = json.dumps(value, ensure_ascii=False)
    except (TypeError, ValueError):
        text = str(value)
    except RecursionError:
        text = "what is nested too deeply"
    return text if len(text) <= 60 else text[:57] + "..."


def _short(key: str) -> str:
    return key if len(key) <= LONGEST_KEY else key[: LONGEST_KEY - 3] + "..."


def _kind_of(value: Any) -> str:
    if isinstance(value, bool):
        return "true or false"
    if isinstance(value, (int, float)):
        return "a number"
    if isinstance(value, str):
        return "text"
    if isinstance(value, Sequence):
        return "a list"
    return "a table" if isinstance(value, Mapping) else "a date or time"


def key_lines(text: str, paths: Sequence[Sequence[str | int]]) -> list[int | None]:
    """Return the line (from 1) on which each path is first given; None where it is not found.

    A path is a sequence of keys and list indices, as in ``("scene", "contact_mm", 1)``. The TOML
    parser itself does the reading: a statement ends at the first line where the text up to there
    parses again, so the statement that first brings the key begins right after the one before.
    """
    lines: list[int | None] = [None] * len(paths)
    for start, _, document in _statements(text):
        for index, path in enumerate(paths):
            if lines[index] is None and _has(document, path):
                lines[index] = start
        if None not in lines:
            break
    return lines


def broken_statement(text: str) -> int:
    """Return the line (from 1) on which the statement begins that first breaks a TOML text."""
    return max((end + 1 for _, end, _ in _statements(text)), default=1)


def _statements(text: str) -> Iterator[tuple[int, int, Any]]:
    """Yield first line, last line and the document so far, for every statement that parses."""
    lines = text.splitlines(keepends=True)[:_LINES_SEARCHED]
    start = 1
    read = prefix = 0
    for end in range(1, len(lines) + 1):
        prefix += len(lines[end - 1])
        read += prefix
        if read > _CHARACTERS_PARSED:
            return
        try:
            document = tomllib.loads("".join(lines[:end]))
        except (ValueError, RecursionError):
            continue
        yield start, end, document
        start = end + 1


def _has(document: Any, path: Sequence[str | int]) -> bool:
    for key in path:
        if isinstance(key, int):
            if not isinstance(document, list) or key >= len(document):
                return False
        elif not isinstance(document, dict) or key not in document:
            return False
        document = document[key]
    return True
