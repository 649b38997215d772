"""Read a TOML file into a checked model, or say in whole sentences what is wrong with it."""

import difflib
import json
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel, ValidationError

from scissorcal.errors import InputError, MissingError, warn_of_old_word
from scissorcal.foreign import read_foreign_text
from scissorcal.foreign.formats import RECIPE, Format
from scissorcal.recipe.explain import broken_statement, explain, key_lines
from scissorcal.recipe.friction import OLD_LAW_KEY
from scissorcal.recipe.priors import AnyPrior
from scissorcal.recipe.schema import Recipe
from scissorcal.recipe.unlikely import Unlikely, unlikely_numbers

Model = TypeVar("Model", bound=BaseModel)


def load_recipe(path: Path | str) -> Recipe:
    """Read and check a recipe file.

    Raises InputError naming file, line, key, what is allowed and a suggestion, for the first 20
    mistakes; and InputError where the file cannot be read. A number that is unlikely in its unit
    (:mod:`scissorcal.recipe.unlikely`) is a mistake unless the recipe's ``unusual`` names its key.

    >>> from scissorcal.recipe.load import recipe_path
    >>> load_recipe(recipe_path("paper-80gsm")).material.thickness_mm
    0.1
    """
    return parse_recipe(read_foreign_text(Path(path), RECIPE), str(path))


def parse_recipe(text: str, source: str = "recipe", *, judged: bool = True) -> Recipe:
    """Check a recipe given as text; ``source`` names it in messages.

    ``judged`` is false for a text that a capture wrote or a recording holds: its numbers were
    judged where a person wrote them, and what was captured by them stays readable.
    """
    document = _parse(text, source)
    old_keys = _old_keys(document, source)
    unlikely = unlikely_numbers(document) if judged else []
    recipe = _checked(document, unlikely, text, Recipe, source)
    if judged:
        for table in old_keys:
            warn_of_old_word(f"{table}.{OLD_LAW_KEY}", f"{table}.law", source)
    return recipe


def checked_recipe(document: dict[str, Any], source: str) -> Recipe:
    """Check a recipe given as tables; ``source`` names them in messages. Raises InputError."""
    return _checked(document, unlikely_numbers(document), "", Recipe, source)


def _old_keys(document: dict[str, Any], source: str) -> list[str]:
    """Tables that name their law by its old key; InputError where one has both."""
    fits = document.get("fit")
    tables = fits if isinstance(fits, dict) else {}
    named = []
    for name in ("friction", "friction_advance"):
        table = tables.get(name)
        if isinstance(table, dict) and OLD_LAW_KEY in table:
            if "law" in table:
                raise InputError(
                    f"{source}: fit.{name} has both law and {OLD_LAW_KEY}, its old name: remove "
                    f"{OLD_LAW_KEY}."
                )
            named.append(f"fit.{name}")
    return named


def load_toml(path: Path, model: type[Model], kind: Format = RECIPE) -> Model:
    """Read a TOML file into ``model``; mistakes raise InputError as in `load_recipe`.

    A file of another known kind than ``kind`` is refused by its name.
    """
    text = read_foreign_text(path, kind)
    return _checked(_parse(text, str(path)), [], text, model, str(path))


def _checked(
    document: dict[str, Any],
    unlikely: list[Unlikely],
    text: str,
    model: type[Model],
    source: str,
) -> Model:
    error = None
    try:
        checked = model.model_validate(document)
        if not unlikely:
            return checked
    except ValidationError as raised:
        error = raised
    raise InputError(_message(source, *explain(error, unlikely, document, text, model)))


def read_text(path: Path) -> str:
    """Read a UTF-8 text file of a sane size, else raise InputError."""
    return read_foreign_text(path, RECIPE)


def _parse(text: str, source: str) -> dict[str, Any]:
    try:
        return _bounded(tomllib.loads(text))
    except ValueError as error:  # TOML's own, and a number of more digits than Python converts
        reason = str(error)
    except RecursionError:
        reason = "tables or arrays are nested too deeply"
    where, line = "", None
    if "(at line " in reason:
        reason, _, place = reason.partition(" (at line ")
        number, _, column = place.rstrip(")").partition(", column ")
        line = int(number)
        where = f", line {number}, column {column}"
    elif reason.endswith(" (at end of document)"):
        reason = reason.removesuffix(" (at end of document)")
        line = broken_statement(text)
        where = f", in what begins on line {line}"
    shown = text.splitlines()[line - 1].strip() if line and line <= len(text.splitlines()) else ""
    reads = f' It reads: "{shown[:80]}".' if shown else ""
    hint = _syntax_hint(shown, reason)
    raise InputError(f"{source}{where}: this is not valid TOML: {reason}.{reads}{hint}")


def _bounded(document: dict[str, Any]) -> dict[str, Any]:
    """The document; ValueError where a whole number is larger than any float."""
    waiting: list[Any] = [document]
    while waiting:
        item = waiting.pop()
        if isinstance(item, dict | list):
            waiting += item.values() if isinstance(item, dict) else item
        elif isinstance(item, int) and abs(item) > sys.float_info.max:
            raise ValueError("a whole number has more than 308 digits")
    return document


def _syntax_hint(line: str, reason: str) -> str:
    if "overwrite" in reason or "twice" in reason:
        return " It was given before; keep one of the two."
    key, equals, value = line.partition("=")
    if not equals and ":" in line:
        return ' Write "key = value", with an equals sign.'
    word = value.strip()
    if word and word.split()[0] in {"True", "False"}:
        return " Write true or false in lower case."
    if word and not key.strip().startswith("[") and (word[0].isalpha() or "," in word):
        return ' Text stands in quotes, numbers have a decimal point: name = "paper", x = 0.1.'
    return ""


def _message(source: str, sentences: tuple[str, ...], count: int) -> str:
    if count == 1:
        return f"{source}, {sentences[0]}"
    lines = "".join(f"\n  {sentence}" for sentence in sentences)
    shown = len(sentences)
    of_them = f"; {shown} of them" if shown < count else ""
    return f"{source} has {count} mistakes{of_them}:{lines}"


_PACKAGE = Path(__file__).resolve().parents[1]


def recipes_dir() -> Path:
    """Return the folder of the recipes that come with scissorcal."""
    return _data_folder("recipes")


def schemas_dir() -> Path:
    """Return the folder of the JSON schemas that come with scissorcal."""
    return _data_folder("data_schemas")


def specimens_dir() -> Path:
    """Return the folder of the specimens: what the virtual rig can put between its blades."""
    return recipes_dir() / "specimens"


def recipe_names() -> tuple[str, ...]:
    """Return the names of the recipes that come with scissorcal, sorted.

    >>> recipe_names()
    ('cotton-cloth', 'paper-80gsm', 'paper-photographed', 'paper-with-hole', 'press-only')
    """
    return _names(recipes_dir())


def recipe_path(name: str) -> Path:
    """Return the file of the recipe called ``name``; InputError naming the others if none is."""
    return _named(recipes_dir(), name, "recipe")


def recipe_file(given: str) -> Path:
    """The file of a recipe that a person named: a built-in one, or a file of any name.

    Raises InputError where it is neither.
    """
    path = Path(given)
    if given in recipe_names() or not (path.suffix == ".toml" or path.exists()):
        return recipe_path(given)
    if path.is_dir():
        raise InputError(f"{path} is a folder, not a recipe. Name the recipe.toml in it.")
    return path


def specimen_path(name: str) -> Path:
    """Return the file of the specimen called ``name``; InputError naming the others if none is."""
    return _named(specimens_dir(), name, "specimen")


def builtin_recipe(name: str) -> Recipe:
    """Load one of the recipes that come with scissorcal."""
    return load_recipe(recipe_path(name))


def _data_folder(name: str) -> Path:
    places = (_PACKAGE / name, _PACKAGE.parents[1] / name)
    for place in places:
        if place.is_dir():
            return place
    raise MissingError(
        f"The folder {name} that belongs to scissorcal is in neither {places[0]} nor {places[1]}: "
        "install scissorcal again."
    )


def _names(folder: Path) -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in folder.glob("*.toml")))


def _named(folder: Path, name: str, what: str) -> Path:
    names = _names(folder)
    if name in names:
        return folder / f"{name}.toml"
    close = difflib.get_close_matches(name, names, 1)
    hint = f' Did you mean "{close[0]}"?' if close else ""
    raise InputError(f'There is no {what} called "{name}"; there are: {", ".join(names)}.{hint}')


class Setting(NamedTuple):
    """One key of a recipe.

    ``table`` are the names of the tables that it stands in, ``value`` is plain (a prior is a
    mapping), None where nothing is set. ``line`` is the line of the file that gives it, None for a
    default; ``origin`` says where the value is from.
    """

    table: tuple[str, ...]
    name: str
    value: Any
    line: int | None
    origin: str

    @property
    def key(self) -> str:
        """The key with its tables, as messages name it."""
        return ".".join((*self.table, self.name))


def recipe_settings(recipe: Recipe, text: str, *, defaults: bool = True) -> tuple[Setting, ...]:
    """Settings of ``recipe``, which was read from ``text``, in the order of the schema.

    ``defaults`` lists those too that the file does not give.
    """
    keys = list(_walk(recipe, ()))
    lines = key_lines(text, [(*table, name) for table, name, _, _, _ in keys])
    former = key_lines(text, [(*table, OLD_LAW_KEY) for table, _, _, _, _ in keys])
    lines = [
        old if key[1] == "law" and line is None else line
        for key, line, old in zip(keys, lines, former, strict=True)
    ]
    settings = []
    for (table, name, value, given, why), line in zip(keys, lines, strict=True):
        if given:
            settings.append(Setting(table, name, value, line, f"recipe, line {line}"))
        elif defaults:
            settings.append(
                Setting(table, name, value, None, f"default: {why}" if why else "default")
            )
    return tuple(settings)


def as_toml(settings: tuple[Setting, ...]) -> str:
    """The settings as a recipe with the same meaning; comments say where each value is from."""
    lines: list[str] = []
    table: tuple[str, ...] = ()
    for setting in settings:
        if setting.table != table:
            table = setting.table
            lines += ["", f"[{'.'.join(table)}]"]
        # what sets nothing is a comment
        value, name = setting.value, setting.name
        statement = f"# {name}" if value is None else f"{name} = {_toml(value)}"
        lines.append(f"{statement}  # {setting.origin}")
    return "\n".join(lines) + "\n"


def with_designed_captures(recipe: Recipe, text: str) -> str:
    """``recipe``, which was read from ``text`` and got a designed list of captures, as TOML.

    Comments say on which line of ``text`` a value stands, or that it was designed.
    """
    plan = recipe.capture.model_copy(update={"plan": "designed"})
    planned = recipe.model_copy(update={"capture": plan})
    settings = recipe_settings(planned, text, defaults=False)
    return as_toml(
        tuple(
            setting._replace(origin="designed") if setting.table[:1] == ("capture",) else setting
            for setting in settings
        )
    )


def _walk(
    model: BaseModel, table: tuple[str, ...], given: bool = True
) -> Iterator[tuple[tuple[str, ...], str, Any, bool, str]]:
    """Table, name, value, whether it was given, and why the default: keys first, then tables."""
    inner = []
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        stated = given and name in model.model_fields_set
        # a prior is written in one line, as one setting
        if isinstance(value, BaseModel) and not isinstance(value, AnyPrior):
            inner.append((name, value, stated))
            continue
        plain = value.model_dump() if isinstance(value, BaseModel) else value
        if isinstance(value, tuple) and value and isinstance(value[0], BaseModel):
            plain = [item.model_dump(exclude_none=True, exclude_unset=True) for item in value]
        yield table, name, plain, stated, field.description or ""
    for name, value, stated in inner:
        yield from _walk(value, (*table, name), stated)


def _toml(value: Any) -> str:
    """A value of a recipe as TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)
