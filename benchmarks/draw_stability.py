"""Draw the stability map of docs/decisions/120: simulated onset of oscillation against the rule.

    python -m benchmarks.draw_stability [--out docs/pictures]

Loops of `benchmarks/stability.py`: stiffness x delay x encoder x loop rate, for a rig alone
and in a hand. Filled markers are the smallest stiffness at which the simulation oscillates or
chatters; lines are what the rule admits. The same code gives the same file; it takes two minutes.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.stability import COUNTS, Loops, simulate

from scissorcal.aliases import Array

RATES = (250, 500, 1000, 2000, 4000)
LATE_S = np.array([0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0]) * 1e-3
FINE = np.geomspace(0.4, 12.0, 36)
"""Multiples of the rule at which a loop is simulated."""
COLOURS = ("#D55E00", "#E69F00", "#009E73", "#0072B2", "#CC79A7")
HOLDERS = {"alone": 0.002, "in a hand": 0.022}
"""Viscous damping in N m s/rad: of the virtual rig for paper, and with a hand's 0.02."""
STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "scissorcal",
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
}


def grid(rate_Hz: float, damping: float, counts: int) -> Loops:
    """Loops of one rate over all delays; half of a delay is the motor's lag, at most 1 ms."""
    size = len(LATE_S)
    lag = np.minimum(0.5 * LATE_S, 1e-3)
    return Loops(
        tick_s=np.full(size, 1.0 / rate_Hz),
        wire_s=LATE_S - lag,
        lag_s=lag,
        inertia=np.full(size, 2.1e-4),
        damping=np.full(size, damping),
        coulomb=np.full(size, 0.0128),
        encoder=np.full(size, 2.0 * np.pi / counts),
        press=np.zeros(size),
    )


def first_unstable(loops: Loops) -> tuple[Array, Array]:
    """The rule's stiffness and the smallest simulated one that does not come to rest, N m/rad."""
    many = loops.repeated(len(FINE))
    stiffness = np.tile(FINE, len(LATE_S)) * many.rule()
    swings = simulate(many, stiffness, seconds=4.0, one_sided=False)
    bad = (swings.oscillating(many.encoder) | swings.chattering()).reshape(-1, len(FINE))
    by_loop = stiffness.reshape(bad.shape)
    first = by_loop[np.arange(len(bad)), np.argmax(bad, axis=1)]
    return loops.rule(), np.where(bad.any(axis=1), first, np.nan)


def main() -> None:
    """Write stability.svg to the folder."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(2, 2, figsize=(8.0, 6.4), sharex=True, sharey="row")
        for row, (holder, damping) in enumerate(HOLDERS.items()):
            for column, counts in enumerate(COUNTS):
                panel = axes[row, column]
                for rate, colour in zip(RATES, COLOURS, strict=True):
                    rule, first = first_unstable(grid(rate, damping, counts))
                    panel.plot(LATE_S * 1e3, rule, color=colour, label=f"{rate} Hz")
                    panel.plot(LATE_S * 1e3, first, "o", color=colour, markersize=4)
                panel.set_yscale("log")
                panel.set_title(f"{counts:,} counts a turn, {holder}", fontsize=9)
        for panel in axes[1]:
            panel.set_xlabel("late by (ms), sample to torque, without the half tick")
        for panel in axes[:, 0]:
            panel.set_ylabel("stiffness (N m/rad)")
        axes[0, 1].legend(frameon=False, title="line: admitted\ndot: oscillates", fontsize=8)
        figure.tight_layout()
        figure.savefig(arguments.out / "stability.svg", metadata={"Date": None})


if __name__ == "__main__":
    main()
