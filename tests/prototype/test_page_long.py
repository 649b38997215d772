"""A page that is open for long: hidden and shown again, and strokes for ten minutes."""

from typing import Any

import pytest

from tests.prototype.test_page_hand import Open, file, opened, package, scene

pytestmark = pytest.mark.slow

__all__ = ["file", "opened", "package", "scene"]

MINUTE = """() => {
  const { rig } = scissorcal, end = rig.time + 60;
  const again = [...document.querySelectorAll("button")]
    .find((one) => one.textContent === "Strokes");
  while (rig.time < end) {
    if (!rig.plays) again.click();
    rig.pass(0.1);
  }
}"""
MOST_GROWTH_bytes = 1_000_000
FOLLOWED_WHILE_HIDDEN = """() => {
  const { rig, scene } = scissorcal, [low, high] = scene.opening_rad;
  const follow = (from, to) => {
    const time_s = Array.from({ length: to - from }, (_, i) => (from + i) * 0.004);
    rig.follow({ recording: "one", time_s, advance_m: time_s.map(() => -scene.contact_m[0]),
      opening_rad: time_s.map((t) => high - (high - low) * Math.sin((Math.PI * t) / 1.6) ** 2) });
    return rig.energy.hand;
  };
  const first = follow(0, 100);
  rig.pass(3600);
  return { first, isFollowing: rig.isFollowing, second: follow(100, 200) };
}"""


def test_a_page_that_was_hidden_goes_on_where_it_was(opened: Open) -> None:
    opened.page.get_by_role("button", name="Strokes").click()
    opened.settle(0.5)
    before = opened.run("() => { scissorcal.before -= 3.6e6; return scissorcal.rig.time; }")
    opened.settle(0.3)
    assert opened.run("() => scissorcal.rig.time") < before + 60.0
    assert opened.run("() => scissorcal.rig.plays")


def test_a_hidden_page_keeps_the_books_of_the_rig_that_it_follows(opened: Open) -> None:
    found = opened.run(FOLLOWED_WHILE_HIDDEN)
    assert found["isFollowing"]
    assert found["second"] > found["first"] > 0.0
    opened.settle(0.3)
    assert not opened.run("() => scissorcal.rig.isFollowing")


@pytest.mark.slow
def test_ten_minutes_of_strokes_take_no_memory(opened: Open) -> None:
    chrome = opened.page.context.new_cdp_session(opened.page)

    def heap_bytes() -> Any:
        opened.page.wait_for_timeout(300)  # charts are drawn meanwhile
        chrome.send("HeapProfiler.collectGarbage")
        return chrome.send("Runtime.getHeapUsage")["usedSize"]

    found = []
    for _ in range(11):
        opened.run(MINUTE)
        found.append(heap_bytes())
    assert opened.run("() => scissorcal.rig.time") > 600.0
    assert min(found[-3:]) < min(found[:3]) + MOST_GROWTH_bytes, found
