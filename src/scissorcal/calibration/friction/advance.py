"""Fit mass and friction of the carriage to empty motion along the cut, driven by commands.

No sensor measures the force along the cut, so the drive of the carriage is what was commanded. The
equation of motion wants the means of the acting force over two ticks, as a second difference of
places is the acceleration's (decision 047): these follow exactly from the commands, once the delay
and the lag are known, and those from the motion itself.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from scissorcal.aliases import Array, Integers, Mask
from scissorcal.calibration.fit_model import FrictionRun
from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.calibration.friction.refusals import FEWEST_BINS
from scissorcal.calibration.result import Effort, FitResult, Proposal
from scissorcal.calibration.signals.filtering import spline
from scissorcal.calibration.signals.segments import bridge
from scissorcal.calibration.signals.weak_form import HELD, Windows, weigh
from scissorcal.errors import InputError
from scissorcal.kernel import presliding_path
from scissorcal.recipe.friction import AdvanceSettings
from scissorcal.recording.recording import Joint, Recording, StrokeKind
from scissorcal.verdicts import Verdict

NO_SENSOR = ("sensor zeros", "zero drift")
"""Checks of sensors that the force along the cut has none of."""


def fit_friction_advance(
    recordings: tuple[Recording, ...],
    settings: AdvanceSettings,
    *,
    effort: Effort,
    rng: np.random.Generator,
    run: FrictionRun = FrictionRun(),
) -> FitResult:
    """Identify mass, friction and offset of the carriage from empty motion of it.

    As :func:`~.fit.fit_friction`, with the commanded force for the drive, which no sensor measures:
    how late it acts is found first (:func:`find_actuation`). Newtons are those of the
    command: a motor that gives p percent less makes mass and levels p percent too large.
    """
    if not any(np.any(driven(recording)) for recording in recordings):
        names = ", ".join(recording.source or "the recording" for recording in recordings)
        raise InputError(
            f"{names or 'Nothing'}: no sample has the motors on, so no force moved the carriage: "
            "run 'scissorcal capture friction --axis advance' again."
        )
    try:
        actuation = find_actuation(recordings, settings.cutoff_Hz)
        sliding = sliding_joints(recordings, actuation, settings.lack_of_fit)
        fit = fit_friction(sliding, settings, effort=effort, rng=rng, run=run)
    except InputError as error:
        raise InputError(_renamed(str(error))) from error
    return _of_advance(fit, recordings, actuation)


def sliding_joints(
    recordings: tuple[Recording, ...], actuation: "Actuation", lack_of_fit: float
) -> tuple[Recording, ...]:
    """Recordings of the carriage as those of a sliding joint that the acting force drives.

    White noise of the share ``lack_of_fit`` of the force is added, the same one each time: without
    noise a likelihood has widths that no search and no sampler can follow, far below what the law
    can be trusted to (the nugget of a deterministic experiment, Gramacy and Lee 2012,
    doi:10.1007/s11222-010-9224-x).
    """
    return tuple(
        _with_noise(as_sliding_joint(recording, actuation), lack_of_fit, number)
        for number, recording in enumerate(recordings)
    )


def actuation_of(fit: FitResult) -> "Actuation":
    """How the commands acted, as a finished fit found it."""
    return Actuation(float(fit.structure["delay_ticks"]), float(fit.structure["lag_ticks"]))


def _of_advance(
    fit: FitResult, recordings: tuple[Recording, ...], actuation: "Actuation"
) -> FitResult:
    """The fit of a sliding joint as one of the carriage: its name, keys, and samples used."""
    tick_ms = 1e3 * _tick_s(recordings[0])
    late = (
        f"A commanded force acts {tick_ms * actuation.late_ticks:.2f} ms late (a delay of "
        f"{tick_ms * actuation.delay_ticks:.2f} ms and a lag of "
        f"{tick_ms * actuation.lag_ticks:.2f} ms; only their sum is certain), beside being held "
        "from tick to tick; the fit corrects for it."
    )
    scale = (
        "No sensor measures the force along the cut: mass and friction rest on the commanded "
        "force, and a motor that gives 1 % less makes all of them 1 % too large."
    )
    kept = [note for note in fit.notes if not note.startswith("The torque is measured ")]
    return replace(
        fit,
        what="friction-advance",
        structure={
            **fit.structure,
            "delay_ticks": actuation.delay_ticks,
            "lag_ticks": actuation.lag_ticks,
        },
        verdicts=tuple(
            _scoped(verdict) for verdict in fit.verdicts if verdict.check not in NO_SENSOR
        ),
        notes=(*(_renamed(note) for note in kept), late, scale),
        diagnostics={n: v for n, v in fit.diagnostics.items() if not n.startswith("zero_")},
        critic=tuple(_adopted(proposal) for proposal in fit.critic),
        used=tuple(
            _spans(recording, spans) for recording, spans in zip(recordings, fit.used, strict=True)
        ),
    )


def _with_noise(recording: Recording, share: float, number: int) -> Recording:
    samples = recording.samples.copy()
    force = np.asarray(samples["motor_torque"], dtype=np.float64)
    moving = force[np.asarray(samples["stroke"]) >= 0]
    size = share * float(np.sqrt(np.mean(moving**2))) if len(moving) else 0.0
    samples["motor_torque"] += size * np.random.default_rng(number).standard_normal(len(samples))
    return replace(recording, samples=samples)


def _scoped(verdict: Verdict) -> Verdict:
    return replace(verdict.of("fit.friction-advance"), why=_renamed(verdict.why))


def _adopted(proposal: Proposal) -> Proposal:
    words: dict[str, Any] = {
        name: _renamed(getattr(proposal, name)) for name in ("adopted_by", "sentence")
    }
    return replace(proposal, **words)


def _renamed(text: str) -> str:
    """A sentence of a friction fit, with the keys of the carriage's table in the recipe."""
    return text.replace("fit.friction.", "fit.friction_advance.")


def _spans(recording: Recording, spans: Integers) -> Integers:
    """Spans of the samples with motors on as spans of all samples; none reaches over a gap."""
    places = np.flatnonzero(driven(recording))
    if len(spans) == 0:
        return spans
    return np.stack([places[spans[:, 0]], places[spans[:, 1] - 1] + 1], axis=1)


def _tick_s(recording: Recording) -> float:
    return float(np.median(np.diff(recording.device_time_s)))


WAYS: dict[StrokeKind, StrokeKind] = {"forward": "opening", "backward": "closing"}
"""Kinds of strokes of a sliding joint: its place grows as an opening does."""

MOTOR_ENABLED = 1
"""Flag of a device's state frame (docs/protocol.md)."""

DELAYS = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
LAGS = (0.0, 0.5, 1.0, 2.0, 4.0)
"""Delays and lags in ticks from the best of which the search begins."""

BUILD_UP_M = (1e-5, 6e-5, 4e-4)
STRIBECK_M_PER_S = (2e-3, 1e-2, 5e-2)
"""Lengths and speeds of friction that is allowed for while delay and lag are searched for: the law
is not chosen yet, and what a law lacks after a reversal looks like a delay."""


@dataclass(frozen=True)
class Actuation:
    """How a command acts: after ``delay_ticks``, behind a first-order lag of ``lag_ticks``."""

    delay_ticks: float = 0.0
    lag_ticks: float = 1.0

    @property
    def late_ticks(self) -> float:
        """Ticks by which the acting force is late in all, without that it is held for a tick."""
        return self.delay_ticks + self.lag_ticks


def force_samples(command: Array, actuation: "Actuation") -> Array:
    """Samples (n,) of a force that is straight between them, for the acting force of commands (n,).

    Their means over two ticks are those of the acting force, exactly; the samples themselves may
    lie a little beside it.
    """
    from scipy.linalg import solve_banded

    bands = np.full((3, len(command)), HELD)
    bands[1] = 1.0 - 2.0 * HELD
    return np.asarray(solve_banded((1, 1), bands, two_tick_means(command, actuation)))


def two_tick_means(command: Array, actuation: "Actuation") -> Array:
    """Means (n,) of the acting force over the two ticks around each sample, weighed as a triangle.

    A command holds from its own sample to the next. A tick has two parts: until the part of a tick
    that the delay takes is over, the command before acts. In each the force goes to the command as
    exp(-t / lag).

    >>> two_tick_means(np.ones(5), Actuation(delay_ticks=1.0, lag_ticks=0.0))
    array([0. , 0.5, 1. , 1. , 1. ])
    """
    from scipy.signal import lfilter

    whole = int(np.floor(actuation.delay_ticks))
    part, lag = actuation.delay_ticks - whole, actuation.lag_ticks
    before, after = _late(command, whole + 1), _late(command, whole)
    first, second = _keeps(part, lag), _keeps(1.0 - part, lag)
    reached = before * (1.0 - first) * second + after * (1.0 - second)
    ends = lfilter([1.0], [1.0, -first * second], reached)
    begins = np.concatenate([[0.0], ends[:-1]])
    middle = before + (begins - before) * first
    early = _integrals(before, begins, 0.0, part, lag)
    late = _integrals(after, middle, part, 1.0 - part, lag)
    mean, rising = early[0] + late[0], early[1] + late[1]
    falling = mean - rising
    return np.asarray(falling + np.concatenate([[0.0], rising[:-1]]))


def as_sliding_joint(recording: Recording, actuation: "Actuation") -> Recording:
    """The recording as one of a sliding joint: the advance its place, the acting force its effort.

    Only samples with the motors on are kept (see :func:`driven`): braking motors give a force that
    no command tells.
    """
    samples = recording.samples.copy()
    command = np.asarray(samples["force_command"], dtype=np.float64)
    samples["motor_torque"] = force_samples(command, actuation)
    samples["torque_command"] = command
    samples["opening"] = samples["advance"]
    samples["advance"] = samples["handle_force"] = 0.0
    return replace(
        recording,
        samples=samples[driven(recording)],
        strokes=tuple(replace(s, kind=WAYS.get(s.kind, s.kind)) for s in recording.strokes),
        joint=Joint("linear"),
        handle_radius_m=float("nan"),
    )


def driven(recording: Recording) -> Mask:
    """Samples (m,) during which the motors followed their commands."""
    flags = np.asarray(recording.samples["flags"], dtype=np.int64)
    return np.asarray((flags & MOTOR_ENABLED) != 0)


def find_actuation(recordings: tuple[Recording, ...], cutoff_Hz: float) -> Actuation:
    """The delay and the lag with which the commanded forces explain the motion best.

    Least squares of mass, offset and a general friction at each, over windows that pass half at
    ``cutoff_Hz``. The default where too little moves to tell.
    """
    from scipy.optimize import minimize

    sliding = tuple(as_sliding_joint(recording, Actuation()) for recording in recordings)
    windows = weigh(sliding, cutoff_Hz)
    windows = windows.where(windows.bins.moving)
    if len(windows.first) < FEWEST_BINS:
        return Actuation()
    columns = _columns(windows)
    weights = np.pad(spline(len(windows.weights) // 3), 1)
    commands = [np.asarray(one.samples["force_command"], dtype=np.float64) for one in recordings]
    kept = [driven(one) for one in recordings]
    filled = [bridge(one, np.ones(len(one.samples), dtype=bool)) for one in sliding]

    def badness(point: Array) -> float:
        actuation = Actuation(*np.abs(point).tolist())
        force = np.concatenate(
            [
                two_tick_means(command, actuation)[mask][one.source][low:high]
                for command, mask, one in zip(commands, kept, filled, strict=True)
                for low, high in one.pieces
            ]
        )
        drive = sliding_window_view(force, len(weights))[windows.first] @ weights
        left = drive - columns @ (columns.T @ drive)
        return float(np.log(max(float(left @ left), 1e-300)))

    starts = [np.array([delay, lag]) for delay in DELAYS for lag in LAGS]
    best = min(starts, key=badness)
    fitted = minimize(badness, best, method="Nelder-Mead", options={"xatol": 1e-3, "fatol": 1e-6})
    return Actuation(*np.abs(fitted.x).tolist())


def _columns(windows: Windows) -> Array:
    """Orthonormal columns (n, k) of what the drive may hold beside the force's lateness."""
    sign, ends = np.sign(windows.rate), [*windows.starts[1:].tolist(), len(windows.rate)]
    made = [windows.bins.acceleration, np.ones(len(windows.first))]
    made += [windows.average(sign), windows.average(windows.rate)]
    for length in BUILD_UP_M:
        state = [
            presliding_path(windows.opening[low:high], length)
            for low, high in zip(windows.starts.tolist(), ends, strict=True)
        ]
        made.append(windows.average(np.concatenate(state) - sign))
    for speed in STRIBECK_M_PER_S:
        made.append(windows.average(sign * np.exp(-((windows.rate / speed) ** 2))))
    columns = np.stack(made, axis=1)
    size = np.sqrt(np.mean(columns**2, axis=0))
    return np.asarray(np.linalg.qr(columns[:, size > 0.0] / size[size > 0.0])[0])


def _late(command: Array, ticks: int) -> Array:
    """Commands so many ticks before, 0 before the first."""
    kept = max(len(command) - ticks, 0)
    return np.concatenate([np.zeros(len(command) - kept), command[:kept]])


def _keeps(span: float, lag: float) -> float:
    """Share of its distance from the command that a force still has after a span of ticks."""
    return float(np.exp(-span / lag)) if lag > 0.0 else float(span == 0.0)


def _integrals(
    level: Array, begin: Array, since: float, span: float, lag: float
) -> tuple[Array, Array]:
    """Integrals over a part of a tick of the force, and of the force times the time in the tick."""
    gone, away = lag * (1.0 - _keeps(span, lag)), begin - level
    end = since + span
    plain = level * span + away * gone
    rising = 0.5 * level * (end * end - since * since)
    kept = span * _keeps(span, lag) * lag
    return plain, rising + away * (since * gone + lag * gone - kept)
