"""Answers of a cluster's workers: text that is checked, and errors that come through."""

import json
import math
from dataclasses import dataclass

import pytest

from scissorcal.errors import InputError, ScissorcalError
from scissorcal.workday.pool import answering, read_answer


@dataclass(frozen=True)
class Inner:
    value: float


@dataclass(frozen=True)
class Found:
    name: str
    parts: tuple[Inner, ...]
    seconds: float | None = None


def find(count: int) -> Found:
    return Found("a", tuple(Inner(0.1 * k) for k in range(count)), math.inf)


def fail(sentence: str) -> None:
    raise InputError(sentence)


def divide(by: int) -> float:
    return 1 / by


def lacking(name: str) -> None:
    raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def test_values_come_through_as_they_were() -> None:
    answer = answering(find)(3)
    assert isinstance(answer, str)
    assert read_answer(answer, Found) == find(3)
    assert math.isnan(read_answer('{"value": NaN}', float))
    assert read_answer(answering(dict)([("index", 1)]), dict[str, int]) == {"index": 1}


def test_errors_come_through() -> None:
    with pytest.raises(InputError, match="no such stroke"):
        read_answer(answering(fail)("no such stroke"), int)
    with pytest.raises(ScissorcalError, match="worker of the cluster failed: ZeroDivisionError"):
        read_answer(answering(divide)(0), float)
    with pytest.raises(ModuleNotFoundError) as raised:
        read_answer(answering(lacking)("nlopt"), float)
    assert raised.value.name == "nlopt"


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (object(), "no answer but object"),
        (b"\x80\x04N.", "no answer but bytes"),
        ("{", "not valid JSON"),
        ("3", "not of the kind"),
        ("{}", "not of the kind"),
        (json.dumps({"value": {"name": "a", "parts": "none"}}), "not of the kind"),
        (json.dumps({"error": "SystemExit", "sentence": "now"}), "failed: SystemExit: now"),
    ],
)
def test_what_is_no_answer_is_refused(answer: object, said: str) -> None:
    with pytest.raises(ScissorcalError, match=said):
        read_answer(answer, Found)
