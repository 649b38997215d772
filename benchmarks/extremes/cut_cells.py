"""Cells of the cut fit: cuts of a known material, damaged, scaled, cut short, copied."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from benchmarks.extremes.cells import Cell, Found, judged
from benchmarks.extremes.friction_cells import LAW
from benchmarks.extremes.made_cut import MadeCut, cut_motion, record_cut
from benchmarks.extremes.made_friction import MadeFriction, changed, record, sweeps

from scissorcal.calibration import FitResult, fit_cut, fit_friction
from scissorcal.recipe.load import builtin_recipe
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import Recording

Damage = Callable[[Recording], Recording | tuple[Recording, ...]]

TRUTH = MadeCut()
FRICTION = MadeFriction(step=2e-6)
"""An encoder fine enough that a sample moves by many of its steps."""
FAR = 5.0
STATED = "force, exponent and fracture energy within 5 of their sds, or rejected, or refused"


def cells() -> tuple[Cell, ...]:
    """The cells of the cut fit; all but the refusals take seconds and are slow."""
    rows: tuple[tuple[str, str, Damage, bool], ...] = (
        ("everyday cut", "nothing", lambda made: made, True),
        ("no cut", "no recording", lambda made: (), False),
        ("0 samples of a cut", "0 samples", lambda made: replace(
            made, samples=made.samples[:0]), False),
        ("a cut with a torque of NaN", "a sample is NaN", lambda made: _one(made, np.nan), False),
        ("a cut with a torque 1e6 sd off", "an outlier of 1e6 sd",
         lambda made: _one(made, 1e3), True),
        ("a cut twice", "the same recording twice", lambda made: (made, made), False),
        ("a cut whose torque is constant", "constant torque", lambda made: changed(
            made, motor_torque=np.full(len(made.samples), 0.01)), True),
        ("a cut whose opening is constant", "constant opening", lambda made: changed(
            made, opening=np.full(len(made.samples), 0.5)), True),
        ("a cut of one stroke", "one closing stroke", lambda made: replace(
            made, samples=made.samples[made.samples["stroke"] < 1],
            strokes=made.strokes[:1]), True),
        ("a cut of two strokes", "one closing and one opening stroke", lambda made: replace(
            made, samples=made.samples[made.samples["stroke"] < 2],
            strokes=made.strokes[:2]), True),
        ("a cut in mN m", "torques times 1e3", lambda made: changed(
            made, motor_torque=1e3 * made.samples["motor_torque"]), True),
        ("a cut in units of 1e12", "torques times 1e12", lambda made: changed(
            made, motor_torque=1e12 * made.samples["motor_torque"]), True),
        ("a cut in units of 1e-12", "torques times 1e-12", lambda made: changed(
            made, motor_torque=1e-12 * made.samples["motor_torque"]), True),
        ("a cut with a saturated sensor", "torques below -25 mN m read -25 mN m",
         lambda made: changed(made, motor_torque=np.maximum(
             made.samples["motor_torque"], -0.025)), True),
    )  # fmt: skip
    return tuple(
        Cell(name, "signals", extreme, STATED, "closed forms of a straight edge", _run(damage),
             slow=slow)
        for name, extreme, damage, slow in rows
    )  # fmt: skip


def _run(damage: Damage) -> Callable[[np.random.Generator], Found]:
    def run(rng: np.random.Generator) -> Found:
        made = damage(record_cut(cut_motion(), TRUTH, FRICTION, rng))
        recordings = made if isinstance(made, tuple) else (made,)
        fit = fit_cut(recordings, _recipe(), _friction(), effort="standard", rng=rng)
        return _judge(fit)

    return run


def _judge(fit: FitResult) -> Found:
    true = {
        "response_force": TRUTH.force,
        "response_exponent": TRUTH.exponent,
        "fracture_energy": TRUTH.fracture_energy,
    }
    away = {
        name: abs(fit.parameter(name).mean - value) / fit.parameter(name).sd
        for name, value in true.items()
    }
    worst = max(away, key=lambda name: away[name])
    if fit.rejected:
        why = "; ".join(f"{verdict.check}: {verdict.why}" for verdict in fit.rejected)
        return Found("flagged", why, away[worst], FAR)
    return judged(away[worst], FAR, f"{worst}, in its sds")


@cache
def _recipe() -> Recipe:
    """Paper with smooth fracture and friction that does not grow with the load, as it was made."""
    recipe = builtin_recipe("paper-80gsm")
    cut = recipe.fit.cut.model_copy(
        update={"critic": False, "load_share": "none", "fracture": "smooth"}
    )
    return recipe.model_copy(update={"fit": recipe.fit.model_copy(update={"cut": cut})})


@cache
def _friction() -> FitResult:
    rng = np.random.default_rng(1)
    return fit_friction((record(sweeps(), FRICTION, rng),), LAW, effort="draft", rng=rng)


def _one(made: Recording, value: float) -> Recording:
    torque = np.array(made.samples["motor_torque"], dtype=np.float64)
    torque[3000] = value
    return changed(made, motor_torque=torque)
