"""What a cluster's worker answers, as JSON text: values and errors, never pickles of ours."""

import json
from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

from scissorcal import errors
from scissorcal.errors import ScissorcalError
from scissorcal.foreign import parse_json

T = TypeVar("T")

REMEDY = "Check that its workers have this version of scissorcal, and who may reach it."

_ERRORS = {
    kind.__name__: kind
    for kind in (
        ScissorcalError,
        errors.InputError,
        errors.VerdictError,
        errors.DeviceError,
        errors.MissingError,
    )
}


def answering(job: Callable[[T], Any]) -> "Callable[[T], str]":
    """``job`` such that it answers with JSON text, whether it ends or raises."""
    return partial(_answer, job)


def read_answer(answer: object, kind: Any) -> Any:
    """The value of type ``kind`` in an answer; its type is checked as that of a foreign file.

    Raises the error that the answer tells of, ModuleNotFoundError where a worker lacks a module,
    and ScissorcalError where it is no answer.

    >>> read_answer(answering(abs)(-2), int)
    2
    """
    from pydantic import TypeAdapter, ValidationError

    if not isinstance(answer, str):
        raise ScissorcalError(f"The cluster sent no answer but {type(answer).__name__}. {REMEDY}")
    message = parse_json(answer, "The cluster's answer", REMEDY)
    if isinstance(message, dict) and "error" in message:
        raise _error(str(message["error"]), str(message.get("sentence", "")))
    try:
        return TypeAdapter(kind).validate_python(message["value"])
    except (ValidationError, KeyError, TypeError) as error:
        raise ScissorcalError(
            f"The cluster's answer is not of the kind that was asked for. {REMEDY}"
        ) from error


def _answer(job: Callable[[T], Any], item: T) -> str:
    from pydantic_core import to_jsonable_python

    try:
        return json.dumps({"value": to_jsonable_python(job(item))})
    except ModuleNotFoundError as error:
        return json.dumps({"error": "ModuleNotFoundError", "sentence": error.name or str(error)})
    except Exception as error:  # noqa: BLE001 - told to who asked, as text
        return json.dumps({"error": type(error).__name__, "sentence": str(error)})


def _error(name: str, sentence: str) -> Exception:
    if name == "ModuleNotFoundError":
        return ModuleNotFoundError(f"No module named {sentence!r}", name=sentence)
    if name in _ERRORS:
        return _ERRORS[name](sentence)
    return ScissorcalError(f"A worker of the cluster failed: {name}: {sentence}")
