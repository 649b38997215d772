"""The figures of docs/build, written between their marks in its pages."""

import math
from collections.abc import Callable, Collection
from pathlib import Path

from .faults import FIRST, faults_of
from .parts import BUILDS, GIMBAL, NOT_WORKING, Build
from .rig import Said, Wrong, probe_of

PAGES = Path(__file__).parents[2] / "docs" / "build"
SEEDS = (101, 102, 103, 104, 105)
"""Of the probes in the pages: each draws another inertia and friction."""
FAULT_SEED = 101
LINES = ("encoder jitter", "torque noise", "lag", "watchdog", "blades direction", "encoder step",
         "measured torque", "inertia", "clipping")  # fmt: skip
"""Of the probe's sentences, those that a build's page shows."""


def figures(build: Build) -> str:
    """The table of what follows from the parts."""
    step = 2.0 * math.pi / build.blades_counts
    single = f"{1e3 * build.single_reading_noise:.3g} mN m"
    rows = {
        "torque at the blades for an ampere": f"{build.blades_torque_per_ampere:.3g} N m/A",
        f"largest torque, {build.peak_A:g} A": f"{build.torque_limit:.3g} N m",
        f"continuous torque, {build.continuous_A:g} A": f"{build.continuous_torque:.3g} N m",
        "range of the current sensor": f"{build.sensor_range_A:.3g} A, "
        f"{build.sensor_range_A / build.peak_A:.2g} times the largest current",
        "noise of motor_torque, one reading": single,
        f"noise of motor_torque, {build.readings} averaged": f"{1e3 * build.torque_noise:.2g} mN m",
        "counts at the blades": f"{build.blades_counts:,} a turn, {1e3 * step:.2g} mrad each",
        "noise of the opening": f"{1e3 * build.jitter_counts * step:.2g} mrad",
        "inertia at the blades": f"{1e6 * build.inertia:.3g} kg mm^2, of it the rotor's "
        f"{1e6 * build.rotor_inertia * build.ratio**2:.3g}",
        "tick": f"{1e-3 * build.tick_us:g} ms",
    }
    return _table(("what", "figure"), rows.items())


def compared() -> str:
    """The builds beside one another."""
    head = ("", *BUILDS)
    builds = BUILDS.values()
    rows = [
        ("torque for an ampere", *(f"{b.blades_torque_per_ampere:.2g} N m/A" for b in builds)),
        ("largest torque", *(f"{b.torque_limit:.2g} N m" for b in builds)),
        ("continuous torque", *(f"{b.continuous_torque:.2g} N m" for b in builds)),
        ("noise of motor_torque", *(f"{1e3 * b.torque_noise:.2g} mN m" for b in builds)),
        ("counts at the blades", *(f"{b.blades_counts:,}" for b in builds)),
        ("tick", *(f"{1e-3 * b.tick_us:g} ms" for b in builds)),
    ]
    return _table(head, rows)


def probed(build: Build) -> str:
    """What the probe says of a right one, over the seeds."""
    found = [probe_of(build, seed) for seed in SEEDS]
    right = [said for said in found if said.result is not None]
    values = [probed_values(said) for said in right]
    rows = [
        (name, *(f"{pick(value[name] for value in values):.3g}" for pick in (min, max)))
        for name in values[0]
    ]
    lines = [
        f"{len(right)} of {len(found)} were accepted. Lowest and highest of what it found:",
        "",
    ]
    lines += [_table(("what", "lowest", "highest"), rows), ""]
    lines += ["What it says of the first one:", "", *_sentences(right[0])]
    return "\n".join(lines)


def probed_values(said: Said) -> dict[str, float]:
    """What a probe found of a right build, by the words of the page."""
    inertia = _mean(said, "inertia_kg_m2")
    dry = 0.5 * (said.rig.coulomb_opening + said.rig.coulomb_closing)
    return {
        "inertia over the true one": inertia / said.rig.inertia,
        "sd that it states of the inertia, %": 100.0 * _sd(said, "inertia_kg_m2") / inertia,
        "dry friction over the true one": _mean(said, "coulomb_Nm") / dry,
        "delay, ms": 1e3 * _mean(said, "delay_s"),
        "measured over commanded torque": _mean(said, "torque_gain"),
        "noise of motor_torque, mN m": 1e3 * _fact(said, "torque_noise_Nm"),
        "noise of the opening, mrad": 1e3 * _fact(said, "encoder_jitter_rad"),
        "largest torque that it used, mN m": 1e3 * _fact(said, "largest_torque_Nm"),
        "largest rate at the blades, rad/s": said.largest_rate,
        "time, s": said.seconds,
    }


def said_of(build: Build, faults: dict[str, Wrong]) -> str:
    """What the probe says of the build with each fault, and the largest rate meanwhile."""
    rows = []
    for name, wrong in faults.items():
        said = probe_of(build, FAULT_SEED, wrong)
        words = said.refusal
        if not words:
            share = _mean(said, "inertia_kg_m2") / said.rig.inertia
            words = f"accepted; inertia {share:.2f} of the true one"
        rows.append((name, words, f"{said.largest_rate:.1f}"))
    return _table(("what", "what the probe says", "rad/s"), rows)


def tried() -> str:
    """What the probe says of builds with a part that does not serve."""
    rows = []
    for name, build in NOT_WORKING.items():
        said = probe_of(build, FAULT_SEED)
        words = said.refusal
        if said.result is not None:
            over, sd = _mean(said, "inertia_kg_m2") / said.rig.inertia, _sd(said, "inertia_kg_m2")
            share = 100.0 * sd / _mean(said, "inertia_kg_m2")
            delay = 1e3 * _mean(said, "delay_s")
            words = f"accepted; inertia {over:.2f} of the true one, sd {share:.0f} %; "
            words += f"delay {delay:.1f} ms"
        rows.append((name, f"{1e3 * build.torque_noise:.2g}", words))
    return _table(("build", "noise, mN m", "what the probe says"), rows)


Blocks = dict[str, Callable[[], str]]


def blocks(build: Build) -> Blocks:
    """How each block of a build's page is made, by its mark."""
    made: Blocks = {
        "FIGURES": lambda: figures(build),
        "PROBE": lambda: probed(build),
        "FAULTS": lambda: said_of(build, faults_of(build)),
    }
    if build is not GIMBAL:
        made["FIRST"] = lambda: said_of(build, FIRST)
    return made


def block_of(page: Path, mark: str) -> str:
    """What stands between a page's marks."""
    text = page.read_text(encoding="utf-8")
    return text.partition(f"<!-- {mark} -->\n")[2].partition(f"\n<!-- end of {mark} -->")[0]


def write(marks: Collection[str] = ()) -> None:
    """Write the blocks with these marks, or all, into the pages."""
    _replace(PAGES / "index.md", {"COMPARED": compared}, marks)
    for build in BUILDS.values():
        _replace(PAGES / f"{build.name}.md", blocks(build), marks)
    _replace(PAGES / "not-working.md", {**blocks(GIMBAL), "TRIED": tried}, marks)


def _replace(page: Path, made: Blocks, marks: Collection[str]) -> None:
    asked = {mark: make() for mark, make in made.items() if not marks or mark in marks}
    text = page.read_text(encoding="utf-8")
    for mark, block in asked.items():
        before, begin, rest = text.partition(f"<!-- {mark} -->\n")
        _, end, after = rest.partition(f"<!-- end of {mark} -->")
        assert all((begin, end)), (page, mark)
        text = f"{before}{begin}{block}\n{end}{after}"
    page.write_text(text, encoding="utf-8")


def _sentences(said: Said) -> list[str]:
    assert said.result is not None
    return [f"    {v.check}: {v.why}" for v in said.result.verdicts if v.check in LINES]


def _mean(said: Said, name: str) -> float:
    return float(getattr(said.result, name).mean)


def _sd(said: Said, name: str) -> float:
    return float(getattr(said.result, name).sd)


def _fact(said: Said, name: str) -> float:
    assert said.result is not None
    return float(said.result.facts[name])


def _table(head, rows) -> str:  # type: ignore[no-untyped-def]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])
