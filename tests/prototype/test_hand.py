"""Hands that the page makes: how fast, how long, and where they end."""

import json
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from tests.browser import bundled
from tests.prototype.design_bed import scene

HARNESS = """
import { madeHand, oneStroke } from "./src/hand";
const DT = 1e-3;
/** Openings tick by tick, to the end of a hand. */
(window as any).played = (which, scene, from) => {
  const script = which === "one" ? oneStroke(scene, from) : madeHand(scene, 2);
  const found = [];
  for (let i = 0, at; i < 1e5 && (at = script(i * DT)); i++) found.push([at.opening, at.advance]);
  return found;
};
"""
TICK_s = 1e-3


@pytest.fixture(scope="module")
def page(browser: Browser) -> Page:
    found = browser.new_page()
    found.set_content(f"<script>{bundled(HARNESS)}</script>")
    return found


def played(page: Page, which: str, told: dict[str, Any], opening: float = 0.0) -> Any:
    given = f"'{which}', {json.dumps(told)}, {{ opening: {opening}, advance: 0.01 }}"
    return np.array(page.evaluate(f"() => played({given})"))


@pytest.mark.parametrize(("fastest", "peak"), [(1.0, 0.6), (0.25, 0.25)])
@pytest.mark.parametrize("which", ["one", "strokes"])
def test_a_hand_is_at_its_fastest_as_fast_as_it_may_be(
    page: Page, which: str, fastest: float, peak: float
) -> None:
    told = scene() | {"opening_rate_rad_per_s": [0.05, fastest]}
    closed, opened = told["opening_rad"]
    found = played(page, which, told, opened)
    rate = np.abs(np.diff(found[:, 0])) / TICK_s
    assert rate.max() == pytest.approx(peak, rel=1e-3)
    assert found[:, 0].min() == pytest.approx(closed, abs=1e-3)
    assert found[-1, 0] == pytest.approx(opened, abs=1e-3)


def test_a_stroke_takes_as_long_as_its_speed_says(page: Page) -> None:
    """An eased turn has 2 / pi of its greatest speed on average."""
    told = scene()
    closed, opened = told["opening_rad"]
    half = opened - 0.5 * (opened - closed)
    for opening in (opened, half, closed - 0.1):
        found = played(page, "one", told, opening)
        way = max(opening - closed, 0.0) + opened - closed
        assert TICK_s * len(found) == pytest.approx(way / (0.6 * 2.0 / np.pi), abs=2.0 * TICK_s)
        assert np.all(found[:, 1] == 0.01)
