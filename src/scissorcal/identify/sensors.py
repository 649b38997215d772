"""Declared sensors: a reading is gain times the quantity plus an offset, and late by a delay.

As sensors are declared in ``mujoco.sysid``. Each is a fixed number, or estimated where a log
determines it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.identify.columns import CHANNELS
from scissorcal.recording import Recording

SENSORS = ("position", "effort", "load")
MOST_DELAY_S = 0.05
"""Longest delay that is searched: later readings are of another stroke's motion."""


@dataclass(frozen=True)
class Sensors:
    """Known ``delay`` (s), ``gain`` and ``offset`` (SI) by channel; all others are 0, 1 and 0."""

    delay_s: Mapping[str, float] = field(default_factory=dict)
    gain: Mapping[str, float] = field(default_factory=dict)
    offset: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for what, values in (("delay", self.delay_s), ("gain", self.gain), ("offset", self.offset)):
            for name, value in values.items():
                if name not in SENSORS:
                    raise InputError(
                        f"--{what} {name}: there is no such sensor. Sensors are "
                        f"{', '.join(SENSORS)}."
                    )
                if not np.isfinite(value) or (what == "gain" and value == 0.0):
                    raise InputError(f"--{what} {name}={value} is no {what}: give a number.")
                if what == "delay" and abs(value) > 1.0:
                    raise InputError(
                        f"--delay {name}={value:g} is more than 1 s. Delays are in seconds."
                    )


@dataclass(frozen=True)
class Delay:
    """By how much the effort is read later than the position (s), with a 90 % interval."""

    value_s: float
    low_s: float
    high_s: float

    @property
    def sentence(self) -> str:
        """The estimate in words."""
        return (
            f"The effort is read {1e3 * self.value_s:.2f} ms later than the position (90 %: "
            f"{1e3 * self.low_s:.2f} to {1e3 * self.high_s:.2f} ms); this was taken off."
        )


def corrected(recording: Recording, sensors: Sensors) -> Recording:
    """The recording as sensors without gain, offset and delay would have read it.

    Readings between samples are interpolated; where a delay asks for readings before the first or
    after the last sample, those samples are left out.
    """
    if not (sensors.delay_s or sensors.gain or sensors.offset):
        return recording
    samples = recording.samples.copy()
    time = np.asarray(recording.device_time_s, dtype=np.float64)
    kept = np.ones(len(time), dtype=bool)
    for name in SENSORS:
        column = CHANNELS[name]
        gain, offset = sensors.gain.get(name, 1.0), sensors.offset.get(name, 0.0)
        values = (np.asarray(samples[column], dtype=np.float64) - offset) / gain
        late = sensors.delay_s.get(name, 0.0)
        if late:
            wanted = time + late
            values = np.interp(wanted, time, values)
            kept &= (wanted >= time[0]) & (wanted <= time[-1])
        samples[column] = values
    return replace(recording, samples=samples[kept])


def estimate_delay(squares: Callable[[float], float], independent: float, tick_s: float) -> Delay:
    """The delay that leaves the least squares, with its interval by the profile likelihood.

    ``squares`` gives the mean squared residual of a fit at a delay (s). The least is walked to by
    steps of four samples, then of one. Of n independent residuals twice the log-likelihood falls by
    n log(S / S_least): a parabola through the three lowest gives its top, and where it has fallen
    by 2.71 (90 %). Raises InputError where the top lies beyond the search, or the interval is
    wider than it: the log does not tell the delay.
    """
    known: dict[int, float] = {}

    def at(ticks: int) -> float:
        if ticks not in known:
            known[ticks] = squares(ticks * tick_s)
        return known[ticks]

    place = 0
    for step in (4, 1):
        while min(at(place - step), at(place + step)) < at(place):
            place += step if at(place + step) < at(place - step) else -step
            if abs(place * tick_s) > MOST_DELAY_S:
                raise InputError(
                    f"No delay of the effort up to {1e3 * MOST_DELAY_S:g} ms explains the log "
                    "best. Check that position and effort are of one joint, or state the delay: "
                    "--delay effort=SECONDS."
                )
    below, above = (independent * np.log(at(place + side) / at(place)) for side in (-1, 1))
    curvature = (below + above) / tick_s**2
    if curvature <= 0.0 or 2.71 / curvature > MOST_DELAY_S**2:
        raise InputError(_delay_unknown())
    value = place * tick_s - (above - below) / (2.0 * tick_s * curvature)
    reach = float(np.sqrt(2.71 / curvature))
    return Delay(value, value - reach, value + reach)


def _delay_unknown() -> str:
    return (
        "The log does not tell the delay of the effort: only motion whose effort changes quickly "
        "does. Record quick reversals or a chirp, or state it: --delay effort=SECONDS."
    )


def mean_square(values: Array) -> float:
    """Mean of the squares (n,)."""
    return float(np.mean(values**2))
