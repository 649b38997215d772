"""Cells of the friction fit: recordings with known friction, damaged, scaled, cut short, copied."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from benchmarks.extremes.cells import Cell, Found, judged
from benchmarks.extremes.made_friction import MadeFriction, Motion, changed, record, sweeps

from scissorcal.calibration import FitResult, fit_friction
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording import Recording

Damage = Callable[[Recording, np.random.Generator], Recording | tuple[Recording, ...]]

TRUTH = MadeFriction()
LAW = FitFriction(law="coulomb+viscous", symmetry="asymmetric", critic=False)
FAR = 5.0
"""Stated error of an estimate, in its own sds: five parameters leave this in one of 400,000 fits
whose intervals hold what they promise."""

STATED = "every parameter within 5 of its sds, or the fit is rejected, or refused in a sentence"
BY_MAKING = "by construction: the motion is prescribed and the law written out"


def cells() -> tuple[Cell, ...]:
    """The cells of the friction fit."""
    rows: tuple[tuple[str, str, Damage], ...] = (
        ("everyday sweeps", "nothing", lambda made, rng: made),
        ("no recording", "no recording", lambda made, rng: ()),
        ("0 samples of friction", "0 samples", lambda made, rng: _first(made, 0)),
        ("1 sample of friction", "1 sample", lambda made, rng: _first(made, 1)),
        ("10 samples of friction", "10 samples", lambda made, rng: _first(made, 10)),
        ("joint at rest", "constant opening",
         lambda made, rng: changed(made, opening=np.full(len(made.samples), 0.5))),
        ("torque constant", "constant torque",
         lambda made, rng: changed(made, motor_torque=np.full(len(made.samples), 0.01))),
        ("torque zero", "torque of 0",
         lambda made, rng: changed(made, motor_torque=np.zeros(len(made.samples)))),
        ("torque of noise alone", "torque without any friction in it",
         lambda made, rng: changed(made, motor_torque=1e-3 * rng.standard_normal(
             len(made.samples)))),
        ("one torque NaN", "a sample is NaN", lambda made, rng: _one(made, "motor_torque", np.nan)),
        ("all torques NaN", "all samples are NaN",
         lambda made, rng: changed(made, motor_torque=np.full(len(made.samples), np.nan))),
        ("one torque infinite", "a sample is infinite",
         lambda made, rng: _one(made, "motor_torque", np.inf)),
        ("one torque 1e300", "a sample of 1e300", lambda made, rng: _one(made, "motor_torque",
                                                                        1e300)),
        ("one opening NaN", "a sample is NaN", lambda made, rng: _one(made, "opening", np.nan)),
        ("one torque 1e3 sd off", "outlier of 1e3 sd", lambda made, rng: _one(made, "motor_torque",
                                                                              1.0)),
        ("one torque 1e6 sd off", "outlier of 1e6 sd", lambda made, rng: _one(made, "motor_torque",
                                                                              1e3)),
        ("one torque 1e9 sd off", "outlier of 1e9 sd", lambda made, rng: _one(made, "motor_torque",
                                                                              1e6)),
        ("torques 1e6 sd off every second", "an outlier of 1e6 sd in each 1,000 samples",
         lambda made, rng: changed(made, motor_torque=np.where(
             np.arange(len(made.samples)) % 1000 == 500, 1e3, made.samples["motor_torque"]))),
        ("one opening 1e6 steps off", "outlier of 1e6 encoder steps",
         lambda made, rng: _one(made, "opening", 50.0)),
        ("opening 1e6 from zero", "an offset of 1e6 rad",
         lambda made, rng: changed(made, opening=made.samples["opening"] + 1e6)),
        ("opening 1e12 from zero", "an offset of 1e12 rad: steps are rounded off",
         lambda made, rng: changed(made, opening=made.samples["opening"] + 1e12)),
        ("one time stamp repeated", "a time stamp twice", lambda made, rng: _clock(made, 15000, 0)),
        ("every time stamp repeated", "each time stamp twice",
         lambda made, rng: changed(made, device_time_us=made.samples["device_time_us"]
                                   // 2000 * 2000)),
        ("clock jumps back by 5 s", "time jumps back", lambda made, rng: _clock(made, 15000,
                                                                               -5_000_000)),
        ("gap of 1e6 s", "time jumps ahead", lambda made, rng: _clock(made, 15000, 10**12)),
        ("torque saturated in a third", "one direction is beyond the sensor's range",
         lambda made, rng: changed(made, motor_torque=np.maximum(
             made.samples["motor_torque"], -0.018))),
        ("torque saturated throughout", "all is beyond the sensor's range",
         lambda made, rng: changed(made, motor_torque=np.clip(
             made.samples["motor_torque"], -0.008, 0.008))),
        ("dead band in half", "torques below 14 mN m read 0",
         lambda made, rng: changed(made, motor_torque=np.where(
             np.abs(made.samples["motor_torque"]) < 0.014, 0.0, made.samples["motor_torque"]))),
        ("dead band throughout", "all torques read 0.0, or one step",
         lambda made, rng: changed(made, motor_torque=np.where(
             np.abs(made.samples["motor_torque"]) < 0.1, 0.0, 0.1))),
        ("torque noise of 1 N m", "noise 70 times the friction",
         lambda made, rng: record(sweeps(), replace(TRUTH, noise=1.0), rng)),
        ("encoder steps of 10 mrad", "65 steps in a sweep",
         lambda made, rng: record(sweeps(), replace(TRUTH, step=0.01), rng)),
        ("encoder steps of 1e-12 rad", "no steps",
         lambda made, rng: record(sweeps(), replace(TRUTH, step=1e-12), rng)),
        ("one stroke", "one closing stroke",
         lambda made, rng: record(_strokes(sweeps((0.3,), 1), 1), TRUTH, rng)),
        ("two strokes", "one closing and one opening stroke",
         lambda made, rng: record(_strokes(sweeps((0.3,), 1), 2), TRUTH, rng)),
        ("two identical strokes", "each stroke twice, to the last digit", _twice),
        ("a recording twice", "the same recording twice", lambda made, rng: (made, made)),
        ("two rigs in one fit", "friction of 13 mN m in one recording, 130 in the other",
         lambda made, rng: (made, record(sweeps(), replace(
             TRUTH, coulomb_pos=0.13, coulomb_neg=0.16), rng))),
    )  # fmt: skip
    damaged = tuple(
        Cell(name, "signals", extreme, STATED, BY_MAKING, _run(damage))
        for name, extreme, damage in rows
    )
    scaled = tuple(
        Cell(f"torque times {scale:g}", "signals", f"torques in units of {scale:g}", STATED,
             BY_MAKING, _run_scaled(scale))
        for scale in (1e-12, 1e-6, 1e6, 1e12)
    )  # fmt: skip
    return damaged + scaled


def _run(damage: Damage) -> Callable[[np.random.Generator], Found]:
    def run(rng: np.random.Generator) -> Found:
        made = damage(record(sweeps(), TRUTH, rng), rng)
        recordings = made if isinstance(made, tuple) else (made,)
        fit = fit_friction(recordings, LAW, effort="standard", rng=rng)
        return _judge(fit, 1.0, recordings)

    return run


def _run_scaled(scale: float) -> Callable[[np.random.Generator], Found]:
    def run(rng: np.random.Generator) -> Found:
        made = record(sweeps(), TRUTH, rng)
        made = changed(made, motor_torque=scale * made.samples["motor_torque"])
        fit = fit_friction((made,), LAW, effort="standard", rng=rng)
        return _judge(fit, scale, (made,))

    return run


def _judge(fit: FitResult, scale: float, recordings: Sequence[Recording]) -> Found:
    true = {
        "inertia": TRUTH.inertia,
        "coulomb_pos": TRUTH.coulomb_pos,
        "coulomb_neg": TRUTH.coulomb_neg,
        "viscous_pos": TRUTH.viscous,
        "viscous_neg": TRUTH.viscous,
    }
    away = {
        name: abs(fit.parameter(name).mean - scale * value) / fit.parameter(name).sd
        for name, value in true.items()
    }
    worst = max(away, key=lambda name: away[name])
    count = sum(len(recording.samples) for recording in recordings)
    if fit.rejected:
        why = "; ".join(f"{verdict.check}: {verdict.why}" for verdict in fit.rejected)
        return Found("flagged", why, away[worst], FAR, count)
    return judged(away[worst], FAR, f"{worst}, in its sds", count)


def _first(made: Recording, count: int) -> Recording:
    return replace(made, samples=made.samples[:count])


def _one(made: Recording, channel: str, value: float) -> Recording:
    """One sample in the middle of a stroke gets another value."""
    values = np.array(made.samples[channel], dtype=np.float64)
    values[15000] = value
    return changed(made, **{channel: values})


def _clock(made: Recording, sample: int, jump_us: int) -> Recording:
    """The clock jumps at a sample; a jump of 0 repeats the stamp before it."""
    time = np.array(made.samples["device_time_us"])
    if jump_us:
        time[sample:] += jump_us
    else:
        time[sample] = time[sample - 1]
    return changed(made, device_time_us=time)


def _strokes(motion: Motion, count: int) -> Motion:
    keep = motion.stroke < count
    return Motion(
        motion.opening[keep],
        motion.rate[keep],
        motion.acceleration[keep],
        motion.stroke[keep],
        motion.strokes[:count],
    )


def _twice(made: Recording, rng: np.random.Generator) -> Recording:
    """Half of the strokes, then the same samples again under the numbers of the others."""
    half = len(made.strokes) // 2
    first = made.samples[made.samples["stroke"] < half]
    both = np.concatenate([first, first])
    both["stroke"][len(first) :] += half
    both["device_time_us"] = 1000 * np.arange(len(both))
    return replace(made, samples=both)
