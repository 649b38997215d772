"""The charts of the page: axes at rest and under load, and names."""

from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from scissorcal.prototype.document import page_of
from scissorcal.prototype.scene import Scene
from tests.prototype.test_page_hand import (
    Open,
    file,
    opened,
    package,
    scene,
)

__all__ = ["file", "opened", "package", "scene"]

AXES = """() => { const { y, N } = scissorcal.time.chart.scales;
  return [[y.min, y.max], [N.min, N.max]]; }"""
CURVES = """scissorcal.time.chart.data.slice(1, 3)
  .map((row) => row.filter((one) => one !== null))"""
LEGEND = """() => [...document.querySelectorAll(".time .u-legend .u-label")]
  .map((one) => one.textContent)"""


def zero(axis: list[float]) -> float:
    """Where 0 stands on an axis, as a share of its height."""
    low, high = axis
    return -low / (high - low)


def test_at_rest_the_axes_of_the_last_seconds_reach_no_farther_than_the_package(
    opened: Open, scene: Scene
) -> None:
    opened.settle()
    largest = opened.run("() => scissorcal.largestTorque")
    torque, force = opened.run(AXES)
    assert 0.05 * largest < torque[1] < largest
    assert 0.05 * largest < scene.handle_radius_m * force[1] < largest
    assert zero(torque) == pytest.approx(zero(force))


def test_under_load_both_axes_hold_their_curves_and_share_one_zero(opened: Open) -> None:
    opened.page.get_by_role("button", name="One stroke").click()
    opened.settle(1.5)
    (torque, force), drawn = opened.run(f"() => [({AXES})(), {CURVES}]")
    for axis, values in zip((torque, force), drawn, strict=True):
        assert axis[0] <= min(values) < max(values) <= axis[1]
    assert zero(torque) == pytest.approx(zero(force))
    assert max(drawn[0]) > 0.9 * torque[1], "the curve fills the chart"


def test_one_force_has_one_name_and_a_rig_is_named_where_it_can_be_followed(
    browser: Browser, opened: Open, scene: Scene, tmp_path: Path
) -> None:
    names = ["time", "torque", "force along the cut"]
    assert opened.run(LEGEND) == names
    expect(opened.page.locator('[data-number="force along the cut"]')).to_have_count(1)
    served = tmp_path / "served.html"
    text = page_of(scene).replace('id="server">null', 'id="server">{"socket": "/rig"}')
    served.write_text(text, encoding="utf-8")
    page = browser.new_context(offline=True).new_page()
    page.goto(served.as_uri())
    page.locator("[data-number=torque]").wait_for()
    assert page.evaluate(LEGEND) == [*names, "torque of the rig"]
    page.context.close()


COUNTS = """async (milliseconds) => {
  const a = scissorcal, before = { ...a.frames };
  await new Promise((done) => setTimeout(done, milliseconds));
  const since = Object.keys(before).map((name) => [name, a.frames[name] - before[name]]);
  return Object.fromEntries(since);
}"""


def test_at_rest_four_pictures_a_second_at_most_and_a_key_is_answered_at_once(opened: Open) -> None:
    opened.settle()
    counted = opened.page.evaluate(COUNTS, 1500)
    assert counted["count"] <= 4 * counted["seconds"] + 1
    opened.settle(0.1)  # and some there are: its time goes by
    waited = opened.run(
        """async () => {
          const { rig } = scissorcal, frame = () => new Promise(requestAnimationFrame);
          await new Promise((done) => setTimeout(done, 400));
          document.querySelector("canvas.plain").dispatchEvent(
            new KeyboardEvent("keydown", { key: "ArrowDown", bubbles: true, cancelable: true }));
          let frames = 0;
          while (rig.rate === 0 && frames < 60) { await frame(); frames += 1; }
          return frames;
        }"""
    )
    assert waited <= 5


def test_charts_are_drawn_ten_times_a_second_at_most_and_pictures_once_a_frame(
    opened: Open,
) -> None:
    opened.page.get_by_role("button", name="Strokes", exact=True).click()
    for _ in range(3):  # what stirs resting blades starts no second row of pictures
        opened.page.keyboard.press("Shift")
    own = f"""async () => {{
      let asked = 0, going = true;
      const count = () => {{ asked += 1; if (going) requestAnimationFrame(count); }};
      requestAnimationFrame(count);
      const counted = await ({COUNTS})(1500);
      going = false;
      return {{ ...counted, asked }};
    }}"""
    counted = opened.run(own)
    assert counted["charts"] <= 10 * counted["seconds"] + 1
    assert counted["count"] <= counted["asked"] + 2


def test_the_torque_over_the_opening_is_drawn_where_something_changed(opened: Open) -> None:
    opened.settle()
    opened.run("""() => {
      window.drawn = 0;
      const { chart } = scissorcal.torque, own = chart.setData;
      chart.setData = function (...data) { drawn += 1; return own.apply(this, data); }; }""")
    opened.page.wait_for_timeout(800)
    assert opened.run("() => drawn") == 0
    opened.page.get_by_role("button", name="One stroke").click()
    opened.page.wait_for_function("() => drawn > 2")
