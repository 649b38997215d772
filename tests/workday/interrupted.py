"""What must hold in a workspace after a command that a kill or the disk ended, wherever."""

import argparse
import json
import shutil
import tempfile
import time
import zipfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scissorcal.errors import ScissorcalError
from scissorcal.recording import read_recording
from scissorcal.workday.workspace import Workspace
from tests.workday.faults import Fault, Outcome, run
from tests.workday.made import quick_workspace, record_cut, record_friction

SIGN = ("report", "sign", "--name", "A. Reviewer", "--decision", "accept")
BESIDE = "picture"
"""Stands beside each fit of friction, and tells of which it is."""
WHOLE_DAY = (("fit",), ("report",), SIGN, ("package", "build"))


@dataclass(frozen=True)
class Ended:
    """One interrupted run: how it ended, and all that was wrong then or after doing it again."""

    words: Sequence[str]
    fault: str
    code: int
    wrong: tuple[str, ...]


def finished_day(folder: Path) -> Workspace:
    """A workspace with recordings, fits, a signed report and a package."""
    workspace = quick_workspace(folder)
    record_friction(workspace)
    record_cut(workspace)
    beside = workspace.root / "fits" / "friction" / BESIDE
    done = run(("fit", "friction", "--seed", "8"), workspace.root)
    assert done.code == 0, done.err
    beside.parent.mkdir(exist_ok=True)
    beside.write_text("of the earlier fit", encoding="utf-8")
    for words in (("fit", "friction", "--force"), *WHOLE_DAY):
        done = run(words, workspace.root)
        assert done.code == 0, done.err
    beside.parent.mkdir(exist_ok=True)
    beside.write_text("of the fit in use", encoding="utf-8")
    return workspace


def commands_that_write(day: Workspace) -> dict[str, tuple[str, ...]]:
    cut = day.recordings("cut")[0].name
    sim = ("--device", "sim", "--yes")
    elsewhere = str(day.root.parent / "elsewhere")
    (earlier,) = [path.name for path in (day.root / "fits" / "history").glob("friction-2*")]
    return {
        "capture": ("capture", "cut", *sim),
        "device probe": ("device", "probe", *sim),
        "recording exclude": ("recording", "exclude", cut, "--why", "torn"),
        "fit": ("fit", "friction", "--force", "--seed", "4", "--save-to", elsewhere),
        "fit restore": ("fit", "restore", earlier),
        "report": ("report", "--anew"),
        "report sign": SIGN,
        "package build": ("package", "build", "--force"),
        "render": ("render", "--strokes", "1", *sim),
    }


def at_events(
    day: Path, folder: Path, words: Sequence[str], kinds: Sequence[str], most: int | None = None
) -> Iterator[Ended]:
    """Interrupt a command at each of its events, or at ``most`` of them, by each kind of fault."""
    events = run(words, copied(day, folder)).events
    rng = np.random.default_rng(7)
    chosen = range(events)
    if most is not None and most < events:
        chosen = sorted(rng.choice(events, most, replace=False).tolist())
    for kind in kinds:
        for at in chosen:
            copied(day, folder)
            done = run(words, folder, Fault(kind, at))
            wrong = []
            if kind == "kill" and done.code != -9:
                wrong.append(f"was not killed: {done.code}")
            if kind != "kill" and done.code and (said := said_rightly(done, str(folder))):
                wrong.append(said)
            yield Ended(words, f"{kind} at {at}", done.code, (*wrong, *_after(day, folder, words)))


def at_moments(day: Path, folder: Path, words: Sequence[str], count: int) -> Iterator[Ended]:
    """Kill a command at random moments of the time that it takes."""
    begins_s = time.monotonic()
    run(words, copied(day, folder))
    takes_s = time.monotonic() - begins_s
    rng = np.random.default_rng(11)
    for _ in range(count):
        copied(day, folder)
        after_s = float(rng.uniform(0.0, takes_s))
        done = run(words, folder, kill_after_s=after_s)
        yield Ended(words, f"kill after {after_s:.2f} s", done.code, _after(day, folder, words))


def _after(day: Path, folder: Path, words: Sequence[str]) -> tuple[str, ...]:
    wrong = faults_of(folder, day)
    if said := again(words, folder):
        wrong.append(said)
    return (*wrong, *(f"leaves {name}" for name in left_behind(folder)))


def copied(day: Path, folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(day, folder, symlinks=True)
    return folder


def faults_of(folder: Path, before: Path) -> list[str]:
    """What is wrong in a workspace: damaged files under final names, results lost without a copy.

    ``before`` is the workspace as it was before the command that was interrupted.
    """
    found = [
        f"{path.relative_to(folder)}: {why}"
        for path in sorted(folder.rglob("*"))
        if path.is_file() and (why := _damage(path))
    ]
    for kind in ("*.nc", f"friction/{BESIDE}"):
        there = {path.read_bytes() for path in folder.rglob(kind)}
        found += [
            f"{path.relative_to(before)} is lost"
            for path in before.rglob(kind)
            if path.read_bytes() not in there
        ]
    found += [
        f"{beside.relative_to(folder)} stands beside another fit"
        for beside in folder.rglob(f"friction/{BESIDE}")
        if beside.read_bytes() not in _beside(before, beside.parent.with_suffix(".nc"))
    ]
    for name in ("fits/friction.nc", "fits/cut.nc", "report/report.html", "recipe.toml"):
        if (before / name).exists() and not (folder / name).exists():
            found.append(f"{name} is gone")
    recordings = {path.name: path.read_bytes() for path in (before / "captures").glob("*.mcap")}
    found += [
        f"{name} was changed"
        for name, data in recordings.items()
        if not (folder / "captures" / name).exists()
        or (folder / "captures" / name).read_bytes() != data
    ]
    plan = run(("plan", "--json"), folder)
    if plan.code != 0:
        found.append(f"plan ends with {plan.code}: {plan.err}")
    else:
        states = json.loads(plan.out)["result"]["steps"]
        found += [f"{one['name']} is damaged" for one in states if one["state"] == "damaged"]
    return found


def _beside(before: Path, fit: Path) -> set[bytes]:
    """What may stand beside a fit: what stood beside one of its content."""
    return {
        (path.with_suffix("") / BESIDE).read_bytes()
        for path in before.rglob("friction.nc")
        if fit.exists() and path.read_bytes() == fit.read_bytes()
    }


def left_behind(folder: Path) -> list[str]:
    """Parts of files, of a process that runs no more."""
    return [str(path.relative_to(folder)) for path in folder.rglob("*.part")]


def said_rightly(done: Outcome, *places: str) -> str:
    """What is wrong with how a refused command ended, which is to name one of ``places``."""
    if done.code != 2:
        return f"ended with {done.code}, not 2: {done.err[-300:]}"
    if "Error: " not in done.err or not any(place in done.err for place in places):
        return f"does not name the place: {done.err[-300:]}"
    if "fault of scissorcal" in done.err:
        return f"calls itself faulty: {done.err[-300:]}"
    return ""


def again(words: Sequence[str], folder: Path) -> str:
    """Run a command once more, without a fault; what is wrong then, empty where it ends well."""
    done = run(words, folder)
    if not done.code or "is the version in use" in done.err:
        return ""
    return f"cannot be done again ({done.code}): {done.err[-300:]}"


def _damage(path: Path) -> str:
    try:
        if path.suffix == ".mcap":
            read_recording(path)
        elif path.suffix == ".zip":
            if zipfile.ZipFile(path).testzip() is not None:
                return "its checksum is wrong"
        elif path.suffix == ".json":
            json.loads(path.read_bytes())
    except (ScissorcalError, zipfile.BadZipFile, ValueError) as error:
        return str(error)
    return ""


def main() -> None:
    """Interrupt each command that writes: at every event, and killed at random moments."""
    asked = argparse.ArgumentParser(description=main.__doc__)
    asked.add_argument("--count", type=int, default=50, help="kills at random moments, of each")
    asked.add_argument("--only", nargs="*", default=[], help="names of commands")
    given = asked.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        day = finished_day(Path(scratch) / "day")
        folder = Path(scratch) / "work"
        for name, words in commands_that_write(day).items():
            if given.only and name not in given.only:
                continue
            ways = {
                "every event": at_events(day.root, folder, words, ("kill", "full", "read-only")),
                "random moments": at_moments(day.root, folder, words, given.count),
            }
            for way, runs in ways.items():
                ended = list(runs)
                codes = dict(Counter(one.code for one in ended))
                bad = [one for one in ended if one.wrong]
                print(f"{name}, {way}: {len(ended)} runs, exits {codes}, {len(bad)} wrong")
                for one in bad:
                    print(f"  {one.fault}: {'; '.join(one.wrong)}", flush=True)


if __name__ == "__main__":
    main()
