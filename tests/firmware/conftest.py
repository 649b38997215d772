"""The images of the boards, built once for all tests here."""

from pathlib import Path

import pytest

from tests.firmware.builds import make
from tests.firmware.elf import Image, read_elf


@pytest.fixture(scope="session")
def arm_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where firmware/arm's Makefile built all images and the core for each processor."""
    pytest.importorskip("ziglang", reason="needs the compiler of the extra 'page'")
    folder = tmp_path_factory.mktemp("arm")
    make(folder, "all", "core")
    return folder


@pytest.fixture(scope="session")
def stm32f405(arm_folder: Path) -> Image:
    """The image that the emulator runs, as it gets flashed."""
    pytest.importorskip("unicorn", reason="needs the emulator of the extra 'dev'")
    return read_elf(arm_folder / "stm32f405.elf")
