"""The boards of firmware/boards: they compile, fit their part, and keep to the form of a board."""

import re
from pathlib import Path

import pytest

from tests.firmware.builds import FIRMWARE, SHARED
from tests.firmware.elf import read_elf

LINES = 150
FLASH_BYTES = 24 << 10
BARE_METAL = ("stm32f405", "b_g431b_esc1")
BOARDS = (*BARE_METAL, "teensy41")
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)


@pytest.mark.parametrize("board", BARE_METAL)
def test_an_image_fits(board: str, arm_folder: Path) -> None:
    image = read_elf(arm_folder / f"{board}.elf")
    assert image.flash_bytes <= FLASH_BYTES
    assert image.ram_bytes <= 20 << 10  # most of it for a package's image
    flat = (arm_folder / f"{board}.bin").read_bytes()
    assert flat == b"".join(data for _, data in image.flash)


@pytest.mark.parametrize("cpu", ["m0", "m3", "m4f", "m7"])
def test_the_core_compiles_for_each_processor(cpu: str, arm_folder: Path) -> None:
    sources = {path.stem for path in (FIRMWARE / "core").glob("*.c")}
    sources |= {f"sc_{part}" for part in SHARED}
    assert sources <= {path.stem for path in (arm_folder / cpu).glob("*.o")}


@pytest.mark.parametrize("board", BOARDS)
def test_a_board_is_short_and_states_that_it_never_ran(board: str) -> None:
    text = (FIRMWARE / "boards" / f"{board}.c").read_text(encoding="utf-8")
    assert "Not yet run on hardware." in text
    code = [line for line in COMMENT.sub("", text).splitlines() if line.strip()]
    assert len(code) <= LINES
    readme = (FIRMWARE / "arm" / "README.md").read_text(encoding="utf-8")
    (row,) = re.findall(rf"^\| `{board}`.*$", readme, re.MULTILINE)
    assert "*not yet run on hardware*" in row


@pytest.mark.parametrize("board", BOARDS)
def test_a_board_starts_a_watchdog_and_feeds_it_in_each_tick(board: str) -> None:
    text = COMMENT.sub("", (FIRMWARE / "boards" / f"{board}.c").read_text(encoding="utf-8"))
    for function in ("board_start_watchdog", "board_wait"):
        (body,) = re.findall(rf"^void {function}\(void\)\n{{\n(.*?)^}}", text, re.M | re.S)
        assert re.search(r"REG\((IWDG|WDOG3) \+ 0x0[04]u\) = ", body), function
