"""Read a TOML file into a checked model, or say in whole sentences what is wrong with it."""

import sys
import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from scissorcal.errors import InputError, warn_of_old_word
from scissorcal.foreign import read_foreign_text
from scissorcal.foreign.formats import RECIPE, Format
from scissorcal.recipe.explain import Mistakes, broken_statement, explain
from scissorcal.recipe.friction import OLD_LAW_KEY
from scissorcal.recipe.schema import Recipe
from scissorcal.recipe.unlikely import Unlikely, unlikely_numbers

Model = TypeVar("Model", bound=BaseModel)


def load_recipe(path: Path | str) -> Recipe:
    """Read and check a recipe file.

    Raises InputError naming file, line, key, what is allowed and a suggestion, for the first 20
    mistakes; and InputError where the file cannot be read. A number that is unlikely in its unit
    (:mod:`scissorcal.recipe.unlikely`) is a mistake unless the recipe's ``unusual`` names its key.

    >>> from scissorcal.recipe.library import recipe_path
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
    unlikely = unlikely_numbers(document) if judged else []
    recipe = _checked(document, unlikely, text, Recipe, source)
    if judged:
        for table in ("friction", "friction_advance"):
            if OLD_LAW_KEY in document.get("fit", {}).get(table, {}):
                key = f"fit.{table}"
                warn_of_old_word(f"{key}.{OLD_LAW_KEY}", f"{key}.law", source)
    return recipe


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
    raise InputError(_message(source, explain(error, unlikely, document, text, model)))


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


def _message(source: str, mistakes: Mistakes) -> str:
    if mistakes.count == 1:
        return f"{source}, {mistakes.sentences[0]}"
    lines = "".join(f"\n  {sentence}" for sentence in mistakes.sentences)
    shown = len(mistakes.sentences)
    of_them = f"; {shown} of them" if shown < mistakes.count else ""
    return f"{source} has {mistakes.count} mistakes{of_them}:{lines}"
