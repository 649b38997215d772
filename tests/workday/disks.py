"""Every command that writes, on a disk that is full or nearly so, and on one that is read-only.

    python -m tests.workday.disks

mounts small file systems in memory, for which it has to be root.
"""

import contextlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.workday.faults import run
from tests.workday.interrupted import (
    commands_that_write,
    faults_of,
    finished_day,
    left_behind,
    said_rightly,
)

SIZE_MB = 24
NAMED = ("summary.html", "sheets", "comparison", "table.csv", "band.csv", "and the disk has")
"""What the commands write where they stand, and are given by these names; a capture's disk."""
LEFT_BYTES = (0, 4096, 65536)
"""Space that is left: for nothing, for a small file, for part of a large one."""


@dataclass(frozen=True)
class OnDisk:
    """How a command ended on a disk, and what was wrong then."""

    name: str
    disk: str
    code: int
    sentence: str
    wrong: tuple[str, ...]


def can_mount() -> bool:
    return Path("/bin/mount").exists() and os.geteuid() == 0


@contextlib.contextmanager
def disk(folder: Path) -> Iterator[Path]:
    """A file system in memory at ``folder``."""
    folder.mkdir(exist_ok=True)
    size = f"size={SIZE_MB}m"
    subprocess.run(["mount", "-t", "tmpfs", "-o", size, "tmpfs", str(folder)], check=True)
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def on_disks(
    day: Path, mounted: Path, name: str, words: Sequence[str], disks: Sequence[str]
) -> Iterator[OnDisk]:
    """Run one command on each kind of disk: "read-only", or a number of bytes that are left."""
    for kind in disks:
        with disk(mounted):
            folder = mounted / "work"
            shutil.copytree(day, folder)
            if kind == "read-only":
                subprocess.run(["mount", "-o", "remount,ro", str(mounted)], check=True)
            else:
                _fill(mounted, int(kind))
            done = run(words, folder)
            wrong = [said_rightly(done, str(mounted), *NAMED)] if done.code else []
            if kind != "read-only":
                (mounted / "filling").unlink()
            wrong += faults_of(folder, day)
            wrong += [f"leaves {part}" for part in left_behind(folder)]
            told = done.err.strip().splitlines()
            sentence = next((line for line in told if line.startswith("Error: ")), "")
            yield OnDisk(name, kind, done.code, sentence, tuple(one for one in wrong if one))


def every_command(day: Path, scratch: Path) -> dict[str, tuple[str, ...]]:
    """The commands that write, with options as they need them here."""
    from scissorcal.workday.workspace import Workspace

    workspace = Workspace(day)
    log = scratch / "log.csv"
    rows = [f"{0.01 * i:.2f},{20 + 10 * (i % 200 > 100)},{i % 7}" for i in range(4000)]
    log.write_text("t_s,angle_deg,force_g\n" + "\n".join(rows) + "\n", encoding="utf-8")
    columns = ("-c", "time=t_s", "-c", "opening=angle_deg", "-c", "handle_force=force_g")
    recording = str(workspace.recordings("friction")[0].relative_to(day))
    return commands_that_write(workspace) | {
        "init": ("init", "new", "--recipe", "paper-80gsm"),
        "import": ("import", str(log), *columns),
        "export": ("export", recording, "table.csv"),
        "predict": ("predict", "friction", recording, "--table", "band.csv"),
        "summarise": ("summarise", recording),
        "target": ("target", "blade", "--output", "sheets"),
        "report compare": ("report", "compare", "fits/cut.nc", "fits/cut.nc"),
        "verify": ("verify", "friction", "--fits", "2", "--checks", "halves", "--workers", "1"),
    }


def _fill(mounted: Path, left: int) -> None:
    free = shutil.disk_usage(mounted).free
    with (mounted / "filling").open("wb") as file:
        os.posix_fallocate(file.fileno(), 0, max(free - left, 1))


def main() -> None:
    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch)
        day = finished_day(root / "day").root
        for name, words in every_command(day, root).items():
            disks = ("read-only", *(str(left) for left in LEFT_BYTES))
            for one in on_disks(day, root / "disk", name, words, disks):
                wrong = "; ".join(one.wrong) or "right"
                print(f"{one.name}, {one.disk}: exit {one.code}, {wrong} | {one.sentence[:200]}")


if __name__ == "__main__":
    main()
