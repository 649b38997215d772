"""The tutorials' commands run, and what their pictures show is what the product shows now."""

import json
import re
from pathlib import Path

import pytest

from tests.browser import open_browser

pytest.importorskip("playwright", reason="playwright is not installed (the extra 'dev')")
from docs.tools.pictures import (
    DECISION,
    ROOT,
    TAKEN,
    TUTORIALS,
    opened,
    run_tutorial,
    steps,
    terminal,
    words_of,
)

WITH_REPORT = ("virtual-rig", "photographs")
PICTURES = ROOT / "docs" / "pictures"
NUMBER = re.compile(r"[-−+]?\d[\d,]*\.?\d*")
DIGEST = re.compile(r"[0-9a-f]{16}")
FEW_PERCENT = 0.05
"""Numbers are those of other library versions' rounding, too: adaptive searches end elsewhere."""


@pytest.mark.parametrize("tutorial", TUTORIALS)
def test_every_step_of_a_tutorial_has_a_picture(tutorial: str) -> None:
    for step in steps(tutorial):
        assert step.pictures, step.commands
        for name in step.pictures:
            assert (PICTURES / name).is_file(), name


def test_a_printed_text_becomes_a_picture_of_its_words() -> None:
    text = terminal("scissorcal plan", "a <b> 2026-11-29T06:01:29+00:00\n" + "word " * 60)
    assert "$ scissorcal plan" in text
    assert "a &lt;b&gt; 2026-01-01<" in text
    assert "29T06" not in text
    assert len(re.findall("<text", text)) > 3


def differences(shown: list[str], now: list[str]) -> list[str]:
    """Words that differ, and numbers that differ by more than a few percent."""
    if len(shown) != len(now):
        return [f"{len(shown)} words, now {len(now)}"]
    return [f"{old} -> {new}" for old, new in zip(shown, now, strict=True) if not _alike(old, new)]


def _alike(old: str, new: str) -> bool:
    numbers = [[_number(n) for n in NUMBER.findall(word)] for word in (old, new)]
    if DIGEST.search(old) and DIGEST.search(new):
        return True
    if NUMBER.sub("#", old) != NUMBER.sub("#", new) or len(numbers[0]) != len(numbers[1]):
        return False
    return all(abs(a - b) <= FEW_PERCENT * abs(a) + 0.15 for a, b in zip(*numbers, strict=True))


def _number(text: str) -> float:
    return float(text.replace("−", "-").replace(",", "").rstrip("."))


def test_a_changed_word_and_a_changed_number_are_differences() -> None:
    assert not differences(["felt", "0.92", "%"], ["felt", "0.95", "%"])
    assert differences(["passed", "5"], ["failed", "5"]) == ["passed -> failed"]
    assert differences(["passed", "5"], ["passed", "6"]) == ["5 -> 6"]
    assert differences(["a"], ["a", "b"]) == ["1 words, now 2"]


@pytest.mark.slow
@pytest.mark.parametrize("tutorial", TUTORIALS)
def test_a_tutorial_runs_and_its_decision_page_is_still_true(tutorial: str, tmp_path: Path) -> None:
    compared = 0
    with open_browser() as chromium:
        for step, done in run_tutorial(tutorial, tmp_path):
            for name in step.pictures:
                if name not in TAKEN:
                    assert done.printed.strip(), name
                kept = (PICTURES / name).with_suffix(".json")
                if kept.is_file():
                    report = done.folder / "report" / "report.html"
                    with opened(chromium, report, 1400, 1000) as page:
                        now = words_of(page.locator(DECISION).inner_text())
                    shown = json.loads(kept.read_text(encoding="utf-8"))
                    assert not differences(shown, now), f"{name}: run 'make pictures'"
                    compared += 1
    assert compared == (tutorial in WITH_REPORT)
