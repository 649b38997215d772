"""What would keep a drawing out of a recipe is offered to be changed before one draws."""

from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.prototype.design_bed import Bed
from tests.prototype.test_design_files import SHEET_RECIPE, load, saved

ESTIMATED = '[scene]\nplate_pose = "estimated"  # by the camera\n'
INLINE = (
    '[plate]\nlayers = [{ name = "a", thickness_mm = 0.1, toughness_ratio = 1, '
    "outline_mm = [[0, -9], [50, -9], [50, 9], [0, 9]] }]\n"
)


@pytest.mark.parametrize(
    ("added", "offer", "kept"),
    [(ESTIMATED, "Set plate_pose", True), (INLINE, "Save a new recipe", False)],
    ids=["estimated pose", "tables on one line"],
)
def test_an_obstacle_is_changed_before_one_draws(
    bed: Bed, tmp_path: Path, added: str, offer: str, kept: bool
) -> None:
    notice = bed.page.locator(".design-obstacle")
    expect(notice).to_be_hidden()
    load(bed, tmp_path, SHEET_RECIPE + added)
    expect(notice).to_be_visible()
    was_cut = bed.page.get_by_label("cut this drawing").is_checked()
    notice.get_by_role("button", name=offer).click()
    expect(notice).to_be_hidden()
    assert bed.page.get_by_label("cut this drawing").is_checked() == was_cut
    bed.page.get_by_label("The next shape is").select_option("hole")
    bed.page.get_by_role("button", name="Rectangle").click()
    bed.page.locator(".design-drawing").press("Enter")
    text = saved(bed, tmp_path)
    assert "holes_mm" in text
    assert ('plate_pose = "known"  # by the camera' in text) == kept
    assert text.startswith("# as the lab wrote it") == kept
    bed.page.get_by_role("button", name="Undo").click()
    bed.page.get_by_role("button", name="Undo").click()
    expect(notice).to_be_visible()
