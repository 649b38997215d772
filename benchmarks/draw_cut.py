"""Draw the pictures of docs/model.md: a cut's segments, and its tooth line.

    python -m benchmarks.draw_cut [--out docs/pictures] [--seed 5]

Run it in the source tree: the captures come from the second virtual rig in `tests`. One sheet of
paper is cut in steps (kappa 0.75), one smoothly (kappa 1). scissorcal fits friction and segments.
The same seed gives the same files. It takes some minutes of processor time.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tests.second_rig import capture_cut, capture_friction, fine, paper, recipe_for, smooth

from scissorcal.aliases import Array
from scissorcal.calibration.cut import teeth
from scissorcal.calibration.cut.geometry import geometry_of_prior
from scissorcal.calibration.cut.known import CutBasis, KnownFriction
from scissorcal.calibration.cut.path_motion import find_runs, path_motion, split
from scissorcal.calibration.cut.path_work import mean_torque
from scissorcal.calibration.cut.scout import Scouted, scout, tooth_periods
from scissorcal.calibration.cut.structure import edge_of
from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.model import Response
from scissorcal.recipe.schema import Recipe

LOOKS = {
    "fresh": ("#009E73", "s"),
    "loading": ("#0072B2", "o"),
    "running": ("#D55E00", "."),
    "unloading": ("#CC79A7", "^"),
}
GREY = "#888888"
STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "scissorcal",
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
}
SHEET = 1
RUNS = 4
"""Two strokes: each closes and opens."""
STEP_RAD = 1.5e-3
FREQUENCIES = np.exp(np.arange(np.log(0.25), np.log(2.5), 0.01))


@dataclass(frozen=True)
class Cut:
    """A virtual cut: its segments, and the signals in which its tooth line is searched."""

    name: str
    colour: str
    scouted: Scouted
    signals: tuple[teeth.PhaseSignal, ...]


def main() -> None:
    """Capture, find segments, draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    parser.add_argument("--seed", type=int, default=5)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    draw(*virtual_cuts(arguments.seed), arguments.out)


def virtual_cuts(seed: int) -> tuple[Cut, Cut]:
    """One cut in steps and one smooth cut, on one rig with one fit of friction."""
    rng = np.random.default_rng(seed)
    rig = fine(paper())
    recipe = recipe_for(rig)
    empty, _ = capture_friction(rig, recipe, rng)
    known = KnownFriction.of(fit_friction((empty,), recipe.fit.friction, effort="draft", rng=rng))
    found = []
    for name, colour, one in (
        ("cut in steps, kappa = 0.75", "#0072B2", rig),
        ("cut smoothly, kappa = 1", "#E69F00", smooth(rig)),
    ):
        recording, _ = capture_cut(one, recipe, rng)
        motions = path_motion((recording,), known.inertia)
        scouted = scout(motions, CutBasis.of(recipe, known), "rippled")
        found.append(Cut(name, colour, scouted, signals_of(scouted, recipe)))
    return found[0], found[1]


def signals_of(scouted: Scouted, recipe: Recipe) -> tuple[teeth.PhaseSignal, ...]:
    """Phase and torque along each running stretch, by the fitted parameters."""
    geometry = geometry_of_prior(recipe, edge_of(recipe))
    values = scouted.values
    response = Response(
        "power", values["response_force"], values["response_exponent"], geometry.reference_m
    )
    periods, torques = [], []
    for stretch in scouted.segments.stretches:
        opening = scouted.segments.motions[stretch.motion].opening
        middle = 0.5 * (opening[stretch.ends[1:]] + opening[stretch.ends[:-1]])
        period, torque = tooth_periods(geometry, response, values, middle)
        periods.append(period)
        torques.append(torque)
    growth = 1.0 / values["response_exponent"]
    return teeth.phase_signals(
        scouted.segments, scouted.materials, geometry, periods, torques, growth
    )


def draw(stepped: Cut, even: Cut, out: Path) -> None:
    """Write both pictures as SVG."""
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        for name, figure in (
            ("segments", segments_figure(stepped.scouted)),
            ("spectrum", spectrum_figure((stepped, even))),
        ):
            metadata = dict.fromkeys(("Creator", "Date", "Format", "Type"))
            figure.savefig(out / f"{name}.svg", metadata=metadata)


def segments_figure(scouted: Scouted) -> Any:
    """Opening against time and mean torque over the opening, for two strokes of one sheet."""
    from matplotlib.figure import Figure

    segments = scouted.segments
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    runs = [run for run in find_runs(segments.motions) if run.sheet == SHEET][:RUNS]
    motion = segments.motions[runs[0].motion]
    low, high = runs[0].low, runs[-1].high
    begin = motion.time_s[low]
    left.plot(motion.time_s[low:high] - begin, motion.opening[low:high], color=GREY, lw=0.8)
    for run in runs:
        ends = split(motion.opening, run.low, run.high, STEP_RAD)
        torque, _ = mean_torque(motion, scouted.materials[run.motion].work, ends)
        right.plot(_middle(motion.opening, ends), 1e3 * torque, color=GREY, lw=0.6, alpha=0.7)
    parts = [(p.kind, p.motion, p.ends, p.torque) for p in segments.pieces]
    parts += [("running", s.motion, s.ends, s.torque) for s in segments.stretches]
    named: set[str] = set()
    for kind, index, ends, torque in parts:
        if index != runs[0].motion or not low <= ends[0] < high:
            continue
        colour, marker = LOOKS[kind]
        label = None if kind in named else kind
        named.add(kind)
        looks = {"color": colour, "marker": marker, "ms": 4, "lw": 0}
        left.plot(motion.time_s[ends] - begin, motion.opening[ends], label=label, **looks)
        right.plot(_middle(motion.opening, ends), 1e3 * torque, **looks)
    left.set(xlabel="time (s)", ylabel="opening (rad)")
    right.set(xlabel="opening (rad)", ylabel="mean torque of the material (mN m)")
    left.legend(frameon=False)
    return figure


def spectrum_figure(cuts: tuple[Cut, ...]) -> Any:
    """Coherent gain and coherent power against the frequency over the expected one."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 4.8), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    largest = max(teeth.coherent_power(cuts[0].signals, float(f)) for f in FREQUENCIES)
    for cut in cuts:
        looks = {"color": cut.colour, "lw": 1.2, "label": cut.name}
        gains = [teeth.coherent_gain(cut.signals, float(f)) for f in FREQUENCIES]
        above.semilogy(FREQUENCIES, gains, **looks)
        power = np.array([teeth.coherent_power(cut.signals, float(f)) for f in FREQUENCIES])
        below.plot(FREQUENCIES, power / largest, **looks)
    above.axhline(teeth.COHERENT, color=GREY, lw=0.8, ls="--")
    above.text(2.5, 1.25 * teeth.COHERENT, f"limit {teeth.COHERENT:.0f}", ha="right", color=GREY)
    above.set(ylabel="coherent gain", ylim=(0.05, 2e3))
    below.axhline(0.0, color=GREY, lw=0.8)
    below.set(
        xlabel="frequency over the one that the parameters give",
        ylabel="coherent power (largest: 1)",
    )
    below.legend(frameon=False)
    return figure


def _middle(opening: Array, ends: NDArray[np.int64]) -> Array:
    return 0.5 * (opening[ends[1:]] + opening[ends[:-1]])


if __name__ == "__main__":
    main()
