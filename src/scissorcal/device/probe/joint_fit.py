"""One physical model of the pushes: inertia, friction, load and delay with their uncertainty.

The whole record of pushes is simulated (`scissorcal.kernel.joint.follow_joints`), so that what
friction has built up in one push is there in the next, and compared with the encoder. What a linear
fit has to leave out is in the model: presliding over two lengths (Dahl 1968), friction that falls
with the rate, a torque that carries the blades and its slope, a delay that need not be whole ticks,
and the lag of the motor. Errors of samples are those of the encoder (step^2 / 12 and its jitter)
and a share of the way that no such law follows; they are correlated within a push, so intervals are
the larger of the sandwich estimate by pushes (White 1982, doi:10.2307/1912526) and the normal one
inflated by the misfit and by how long residuals stay alike.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.device.probe.joint_posterior import JointFit
from scissorcal.device.probe.joint_problem import STEP_S, Problem
from scissorcal.device.probe.joint_values import Prior, Push, joint_of, perturbed, starts_of
from scissorcal.kernel.joint import follow_joint
from scissorcal.recording.probe import Swing

COAST_S, TRAVEL_STEP_S = 0.15, 1e-3
LONGEST = 6
"""Swings whose own fit begins the search of all: three pairs that go to the aim tell inertia and
lag apart (`swings.LEAST_PAIRS`)."""


def fit_joint(
    pushes: Sequence[Push],
    prior: Prior,
    noise_rad: float,
    *,
    start: Array | None = None,
    modes: bool = True,
) -> JointFit:
    """Fit all pushes together, from ``start`` or from what the longest swings tell.

    ``noise_rad`` is the sd of the encoder: step and jitter. The best mode is returned. ``modes``:
    others are sought around it and from the longest swings, and one that explains the pushes as
    well widens its interval; a fit that only plans the next push does without, at a fifth of the
    time.
    """
    problem = Problem(pushes, prior, noise_rad)
    found = []
    if start is not None:
        around = perturbed(start, prior.stop) if modes else []
        found += problem.best_of([start, *around])
    if start is None or modes:
        found += [problem.solved(x) for x in _of_longest(pushes, prior, noise_rad)]
    best = min(found, key=lambda one: one[1])
    if problem.rescale(best[0]):
        found = [problem.solved(best[0])]
        if modes:
            found += problem.best_of(perturbed(found[0][0], prior.stop))
    best = min(found, key=lambda one: one[1])
    problem.vary(best[0])
    fit = problem.posterior(best[0])
    others = [x for x, cost in found if cost < best[1] + 3.0 * problem.repeated]
    spread = np.array([x - fit.values for x in others])
    widened = fit.covariance + spread.T @ spread / max(len(others), 1)
    return replace(fit, covariance=widened)


def _of_longest(pushes: Sequence[Push], prior: Prior, noise_rad: float) -> list[Array]:
    """Modes of the longest swings alone, which slide most of their way.

    Pushes near breakaway stand or go by the value of their friction: their residuals jump, and a
    search of all pushes ends where it jumps, with a lag in place of the inertia for example.
    """
    ways = sorted((push.way for push in pushes if push.rested), reverse=True)
    longest = [push for push in pushes if push.rested and push.way >= ways[:LONGEST][-1]]
    problem = Problem(longest, prior, noise_rad)
    return [x for x, _ in problem.best_of(starts_of(pushes, prior))]


def swings_of(
    pushes: Sequence[Push], prior: Prior, noise_rad: float, values: Array, most: int
) -> tuple[Swing, ...]:
    """The strongest ``most`` pushes in their order, thinned, beside the joint of ``values``."""
    problem = Problem(pushes, prior, noise_rad)
    parts = problem.parts(values)
    ranked = sorted(range(len(parts)), key=lambda place: -abs(parts[place].torque_Nm))
    return tuple(parts[place] for place in sorted(ranked[:most]))


def travel_of(
    values: Array, effort: float, seconds: float, hold: float = 0.0, stop: int = 0
) -> tuple[float, float]:
    """Largest way (rad) and rate (rad/s) of a push of ``hold + effort`` for ``seconds`` from rest.

    ``hold`` acts before and after, as in `push`.
    """
    joint = joint_of(values, stop)
    joint = replace(joint, carrying=joint.carrying + hold)
    times = np.arange(0.0, seconds + COAST_S, TRAVEL_STEP_S)
    rests = np.full(len(times), np.nan)
    rests[0] = 0.0
    switches = np.array([0.0, seconds])
    places = follow_joint(joint, times, rests, switches, np.array([effort, 0.0]), STEP_S)
    rates = np.diff(places) / TRAVEL_STEP_S
    return float(np.abs(places).max()), float(np.abs(rates).max())
