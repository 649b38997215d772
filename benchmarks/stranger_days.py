"""Whole days on a rig that is not part of this project, in real time, through the command line.

    python -m benchmarks.stranger_days --count 12 [--first 1] [--rig PROGRAM] [--keep FOLDER]

The rig is a program that serves a device on a pseudo-terminal and takes orders on a socket; where
it is absent, this says so and ends. Each day has other parameters: the encoder's counts, the share
of the load in friction, zeros of the sensors, paper or cotton. A person is played who moves the
blades by hand when asked, puts in a fresh piece, and presses Enter. A day is what a newcomer types:
`device probe`, `capture friction`, `fit friction`, `capture cut`, `fit cut`, `package build`;
nothing is overridden. It ends in a package, or at the first command that refuses; a failed check
(exit code 3) is kept, and the day goes on, as the command's own next step says.

The package's torque is compared with the rig's own average torque minus its friction over closing
strokes in the scene: root mean square as a share of the largest, and the share of places in the
package's 90 % band. The rig's sheets are all uneven in the same way, so that their mean toughness
differs from the nominal one by a few tenths of a percent, which no number of them shows; the band
is also compared with the torque at the toughness of what was cut.
"""

import importlib.util
import json
import math
import os
import pty
import re
import select
import socket
import subprocess
import sys
import tempfile
import time
import warnings
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.days import day_options

from scissorcal.package.model_package import open_package
from scissorcal.recipe.load import recipe_path

RIG = Path(__file__).resolve().parents[1] / "../shared/rig/rig.py"
COUNTS = (8192, 16384, 20000, 65536, 131072, 1_000_000)
COTTON = {
    "thickness": 0.3e-3,
    "response_force": 2.2,
    "response_exponent": 1.3,
    "toughness": 7000.0,
    "kappa": 0.62,
}
NO_ZEROS = {"torque_offset": 0.0, "force_offset": 0.0}
COMMANDS = (
    ("device", "probe"),
    ("capture", "friction"),
    ("fit", "friction"),
    ("capture", "cut"),
    ("fit", "cut"),
    ("package", "build"),
)
LONGEST_S = 1800.0
CHECKS_FAILED = 3
RATES_rad_per_s = (0.1, 0.3, 0.6)
OPENINGS, CONTACTS = 12, 8
EDGE_SD_mm, TAPER_SD_deg = 0.02, 0.02
"""A blade measured to 0.02 mm at pivot and tip."""
POINTS_mm = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0)


@dataclass(frozen=True)
class Row:
    """One day: what it was, where it ended, and how near its package is to the truth."""

    seed: int
    counts: int
    load_share: float
    zeros: bool
    material: str
    ended: str
    code: int
    said: str
    failed_checks: tuple[str, ...]
    minutes: float
    slips: int
    rms_share: float | None
    in_band: float | None
    in_band_of_sheets: float | None


def parameters(seed: int) -> dict[str, float]:
    """The rig of a day: counts, load share, zeros and material in turn, the joint drawn."""
    rng = np.random.default_rng(seed)
    joint = {
        "inertia": 3.1e-4 * rng.uniform(0.7, 1.4),
        "coulomb_pos": 0.0165 * rng.uniform(0.7, 1.4),
        "coulomb_neg": 0.0190 * rng.uniform(0.7, 1.4),
        "stribeck": 0.0045 * rng.uniform(0.5, 1.5),
        "toughness": 4600.0 * rng.uniform(0.8, 1.25),
    }
    index = seed - 1
    return {
        **joint,
        "opening_counts_per_turn": COUNTS[index % len(COUNTS)],
        "load_share": (0.10, 0.0)[index // 2 % 2],
        **({} if (index + index // len(COUNTS)) % 2 else NO_ZEROS),
        **(COTTON if index // len(COUNTS) % 2 else {}),
        "seed": seed,
    }


class Stranger:
    """The rig's process, its control socket and its last answer to an order."""

    def __init__(self, program: Path, folder: Path, changed: dict[str, float]) -> None:
        self.port = folder / "pty"
        self._address = str(folder / "ctl")
        words = [part for name, value in changed.items() for part in ("-p", f"{name}={value}")]
        self._process = subprocess.Popen(
            [
                sys.executable,
                str(program),
                "--link",
                str(self.port),
                "--control",
                self._address,
                *words,
            ],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        self._lines = self._process.stdout
        self._lines.readline()
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)

    def order(self, words: str) -> dict[str, Any]:
        """Send one order; what the rig says it is doing."""
        self._socket.sendto(words.encode(), self._address)
        found: dict[str, Any] = json.loads(self._lines.readline())
        return found

    def follow(self, request: str) -> None:
        """Do what a sentence asks of a person."""
        if "fresh piece" in request or "Put in the" in request:
            self.order("sheet 1")
            return
        self.order("sheet 0")
        if "close the blades by hand" in request:
            self._hold(
                {"hand_closed": -0.05, "hand_open": 1.25, "hand_rest": 2.0}, lambda at: at < 0.05
            )
        elif "open the blades by hand" in request:
            self._until(lambda at: at > 1.08)
        elif "half open" in request:
            time.sleep(4.5)
            self._hold(
                {"hand_closed": 0.5, "hand_open": 0.55, "hand_rest": 0.2}, lambda at: at > 0.45
            )
            time.sleep(2.5)
            self.order("hand 0 0")

    def _hold(self, path: dict[str, float], reached: Any) -> None:
        for name, value in path.items():
            self.order(f"set {name} {value}")
        self.order("hand 0.8 1")
        self._until(reached)

    def _until(self, reached: Any) -> None:
        end = time.monotonic() + 15.0
        while time.monotonic() < end and not reached(self.order("state")["theta"]):
            time.sleep(0.05)

    def close(self) -> int:
        """Stop the rig; how often the computer held it up."""
        self._process.terminate()
        rest, _ = self._process.communicate(timeout=30)
        return int(json.loads(rest.splitlines()[-1])["slips"])


def typed(words: tuple[str, ...], folder: Path, rig: Stranger) -> tuple[int, str]:
    """Run a command at a terminal, with the person who answers it; exit code and what it said."""
    child, terminal = pty.fork()
    if child == 0:
        os.chdir(folder)
        os.environ.update(COLUMNS="200", TERM="dumb")
        os.execv(sys.executable, [sys.executable, "-m", "scissorcal", *words])
    said, asked, end = "", 0, time.monotonic() + LONGEST_S
    while time.monotonic() < end:
        if not select.select([terminal], [], [], 1.0)[0]:
            continue
        try:
            piece = os.read(terminal, 65536)
        except OSError:
            break
        if not piece:
            break
        said += piece.decode(errors="replace")
        if "Press Enter" in said[asked:]:
            rig.follow(said[asked:])
            asked = len(said)
            os.write(terminal, b"\n")
    else:
        os.kill(child, 9)
    os.close(terminal)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), said


def workspace(folder: Path, truth: Any, material: str) -> None:
    """A built-in recipe with this rig's handle and edge and this material's thickness."""
    p = truth.p
    rng = np.random.default_rng(p["seed"] + 1000)
    off, turn = rng.normal(0.0, EDGE_SD_mm), rng.normal(0.0, math.radians(TAPER_SD_deg))
    points = [
        [s, round(1e3 * truth.edge(1e-3 * s)[0] + off + s * math.tan(turn), 4)] for s in POINTS_mm
    ]
    text = recipe_path(material).read_text(encoding="utf-8")
    edge = (
        f'[rig.edge]\nfamily = "points"\npoints_mm = {points}\n'
        f"offset_sd_mm = {EDGE_SD_mm}\ntaper_sd_deg = {TAPER_SD_deg}\n\n"
    )
    text = re.sub(r"\[rig\.edge\].*?\n\n", lambda _: edge, text, count=1, flags=re.S)
    changed = {"handle_radius_mm": 1e3 * p["handle_radius"], "thickness_mm": 1e3 * p["thickness"]}
    for key, value in changed.items():
        text, found = re.subn(rf"(?m)^{key} = \S+", f"{key} = {value:.6g}", text)
        assert found == 1, key
    (folder / "recipe.toml").write_text(text, encoding="utf-8")


def one_day(program: Path, module: Any, seed: int, keep: Path | None) -> Row:
    """Serve the rig, type the day's commands, and judge the package."""
    changed = parameters(seed)
    truth = module.Rig(**changed)
    cotton = "thickness" in changed
    material = "cotton-cloth" if cotton else "paper-80gsm"
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as made:
        folder = keep / f"day-{seed}" if keep else Path(made)
        (folder / "day").mkdir(parents=True)
        workspace(folder / "day", truth, material)
        rig = Stranger(program, folder, changed)
        code, ended, said, cut_m = 0, "a package", "", 0.0
        failed: list[str] = []
        try:
            for words in COMMANDS:
                port = () if words[0] in ("fit", "package") else ("--device", str(rig.port))
                code, said = typed((*words, *port), folder / "day", rig)
                if words == ("capture", "cut"):
                    cut_m = float(rig.order("state")["crack"])
                (folder / f"{'-'.join(words)}.txt").write_text(said, encoding="utf-8")
                failed += re.findall(r"(?m)^FAIL  (\S+  \S+(?: \S+)*)", said)
                if code not in (0, CHECKS_FAILED):
                    ended = " ".join(words)
                    break
        finally:
            slips = rig.close()
        packed = any((folder / "day" / "package").glob("*.zip"))
        ended = ended if packed or ended != "a package" else "package build"
        rms, inside, of_sheets = None, None, None
        if packed:
            rms, inside = against_truth(folder / "day", truth)
            cells = truth.uneven[: round(cut_m / truth.p["variation_length"])]
            toughness = truth.p["toughness"] * float(np.mean(cells or [1.0]))
            cut = module.Rig(**changed | {"toughness": toughness})
            _, of_sheets = against_truth(folder / "day", cut)
    return Row(
        seed,
        int(changed["opening_counts_per_turn"]),
        changed["load_share"],
        "torque_offset" not in changed,
        material,
        ended,
        code,
        "" if packed else " ".join(said.split())[-400:],
        tuple(failed),
        (time.monotonic() - began) / 60.0,
        slips,
        rms,
        inside,
        of_sheets,
    )


def against_truth(folder: Path, truth: Any) -> tuple[float, float]:
    """Rms of the package's torque minus the truth over the largest; share of places in the band."""
    (path,) = folder.glob("package/*.zip")
    package = open_package(path, warn=False)
    ranges = package.manifest.ranges
    opening, contact, rate = (
        axis.ravel()
        for axis in np.meshgrid(
            np.linspace(*ranges.opening_rad, OPENINGS),
            np.linspace(*ranges.contact_m, CONTACTS),
            [-one for one in RATES_rad_per_s],
        )
    )
    true = []
    for theta, x, omega in zip(opening, contact, rate, strict=True):
        load = truth.average_torque(theta, x)
        true.append(load - truth.friction(theta, omega, load))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = package.torque(opening, rate, contact)
        low, high = package.band(opening, rate, contact, 0.9)
    wanted = np.array(true)
    felt = np.isfinite(found) & (np.abs(wanted) < package.manifest.limits.torque_Nm)
    off = (found - wanted)[felt]
    inside = (low <= wanted) & (wanted <= high)
    largest = float(np.abs(wanted[felt]).max())
    return float(np.sqrt(np.mean(off**2))) / largest, float(np.mean(inside[felt]))


def main() -> int:
    """Run the days one after another and print one line each, then what they show together."""
    parser = day_options(__doc__, first=1, count=12)
    parser.add_argument("--rig", type=Path, default=RIG)
    parser.add_argument("--keep", type=Path, default=None, help="folder that keeps the days")
    asked = parser.parse_args()
    if not asked.rig.exists():
        print(f"There is no rig program at {asked.rig}, so no day was run: give one with --rig.")
        return 0
    about = importlib.util.spec_from_file_location("stranger", asked.rig)
    assert about is not None
    assert about.loader is not None
    module = importlib.util.module_from_spec(about)
    about.loader.exec_module(module)
    rows = []
    for seed in range(asked.first, asked.first + asked.count):
        rows.append(one_day(asked.rig, module, seed, asked.keep))
        print(json.dumps(asdict(rows[-1])), flush=True)
    done = [row for row in rows if row.rms_share is not None]
    found = {
        "days": len(rows),
        "that end in a package": len(done),
        "rms of the torque, % of the largest": [round(100 * (r.rms_share or 0), 2) for r in done],
        "places in the 90 % band, %": [round(100 * (r.in_band or 0)) for r in done],
        "of the sheets' torque, %": [round(100 * (r.in_band_of_sheets or 0)) for r in done],
    }
    print(json.dumps(found, indent=1))
    if asked.json:
        text = json.dumps({"rows": [asdict(row) for row in rows], "summary": found}, indent=1)
        asked.json.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
