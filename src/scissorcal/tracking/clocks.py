"""Clocks of camera and rig against the host's: offset and drift, measured from times of arrival.

What a device sends at its own time arrives on the host later by a delay that is never negative, so
arrivals lie above a line over own times, arrival = offset + own / (1 + drift) + delay. The line is
the highest one that no arrival lies below and that is nearest to all of them: an edge of the lower
convex hull (Zhang, Liu and Xia 2002, doi:10.1109/INFCOM.2002.1019257; the linear program is that of
Moon, Skelly and Towsley 1999, doi:10.1109/INFCOM.1999.749287). Late arrivals, however many, change
nothing. The shortest delay itself looks like an offset and cannot be seen: see
`scissorcal.tracking.judge`.
"""

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.errors import DeviceError

DRIFT_LIMIT_PPM = 1000.0
"""A quartz keeps 100 ppm, a poor oscillator on a chip 500; beyond is a wrong unit or a fault."""
JUMP_S = 5e-3
STANDS_S = 1.0
REORDERED_S = 0.5
"""What was sent so much sooner may still arrive later, and no clock jumped."""
USUAL_DRIFT = 2e-4
"""Drifts are taken as 0 until they are known better than this."""

_WINDOW_S = 30.0
_THIN_S = 0.03
_REFIT_S = 0.5
_RECENT_S = 1.0
_FEWEST_RECENT = 8
_JUDGED_FROM_S = 5.0
_SETTLES_S = 5.0
_LATE_S = 1.0
_SMALLEST = 12
_CLOSEST_S = 1e-6
_USUAL_DELAY_S = 0.1
# Standard deviations of level and slope times the density, of 1,500 simulated lines each with
# exponential, uniform and gamma delays (0.8 to 1.2 of these); tails are heavier than a normal's.
_LEVEL, _SLOPE = 2.4, 8.0
_JUMP_SDS = 5.0
_OFTEN, _OFTEN_S = 4, 10.0
_BEYOND_DOUBT = 10.0


@dataclass(frozen=True)
class ClockFit:
    """One clock's line: it showed ``own_s`` when the host's showed ``host_s``.

    It runs faster than the host's by the share ``drift``. The standard deviations are those of the
    host's time at ``own_s`` and of the drift; ``density`` is how many arrivals a second of delay
    holds next to the line, ``pairs`` how many there were over ``span_s``.
    """

    own_s: float
    host_s: float
    drift: float
    host_sd_s: float
    drift_sd: float
    density: float
    pairs: int
    span_s: float

    def host(self, own_s: float) -> float:
        """The host's time (s) at a time of this clock."""
        return self.host_s + (own_s - self.own_s) / (1.0 + self.drift)

    def own(self, host_s: float) -> float:
        """This clock's time (s) at a time of the host's."""
        return self.own_s + (host_s - self.host_s) * (1.0 + self.drift)

    def sd_s(self, own_s: float) -> float:
        """Standard deviation (s) of the host's time at a time of this clock."""
        return math.hypot(self.host_sd_s, (own_s - self.own_s) * self.drift_sd)

    @property
    def drift_ppm(self) -> float:
        """Drift in millionths; positive where this clock is the faster one."""
        return 1e6 * self.drift

    @property
    def drift_sd_ppm(self) -> float:
        """Standard deviation of the drift in millionths."""
        return 1e6 * self.drift_sd


class Jump(NamedTuple):
    """At ``host_s`` the clock jumped ahead by ``by_s`` (back, if negative)."""

    host_s: float
    by_s: float


def fit_clock(own_s: ArrayLike, host_s: ArrayLike) -> ClockFit:
    """The line under pairs of a clock's own time and the host's time of arrival, (n,) each, in s.

    Own times ascend. A drift that is neither known better than `USUAL_DRIFT` nor beyond doubt is 0
    with that standard deviation, and the line passes through the earliest arrival. ValueError
    without a pair.

    >>> own = np.arange(0.0, 20.0, 0.03)
    >>> delays = 0.06 + 0.04 * np.modf(0.618 * np.arange(own.size))[0]
    >>> found = fit_clock(own, 100.0 + own / (1.0 + 50e-6) + delays)
    >>> round(found.drift_ppm), round(found.host(10.0), 3)
    (50, 110.06)
    """
    own, host = np.asarray(own_s, dtype=np.float64), np.asarray(host_s, dtype=np.float64)
    if not own.size or own.shape != host.shape:
        raise ValueError("a clock is fitted to at least one pair of times")
    middle = float(own.mean())
    after, late = own - middle, host - own
    base = float(late.min())
    late = late - base
    span = float(own[-1] - own[0])
    level, slope = _under(after, late)
    density = _density(late - level - slope * after)
    if math.isfinite(slope) and span > 0.0:
        slope_sd = _SLOPE / (density * span)
        if slope_sd <= USUAL_DRIFT or abs(slope) > _BEYOND_DOUBT * slope_sd:
            rate = 1.0 / max(1.0 + slope, 1e-6)
            at, sd = middle + base + level, _LEVEL / density
            drift_sd = slope_sd * rate * rate
            return ClockFit(middle, at, rate - 1.0, sd, drift_sd, density, own.size, span)
    density = _density(late)
    sd = math.hypot(_LEVEL / density, USUAL_DRIFT * span)
    return ClockFit(middle, middle + base, 0.0, sd, USUAL_DRIFT, density, own.size, span)


class ClockWatch:
    """Follows one clock over the last ``window_s`` of arrivals, and says what is wrong with it.

    ``name`` begins its sentences ("The camera's clock"), ``remedy`` ends them. After a jump the
    line begins anew; ``jumps`` has them all.

    >>> watch = ClockWatch("The rig's clock", "Restart the rig.")
    >>> watch.add([1.000, 1.001], [7.0003, 7.0012])
    >>> round(watch.fit.host(1.5), 4)
    7.5002
    """

    def __init__(self, name: str, remedy: str, window_s: float = _WINDOW_S) -> None:
        self.name = name
        self.jumps: list[Jump] = []
        self._remedy = remedy
        self._window_s = window_s
        self._own: list[float] = []
        self._host: list[float] = []
        self._fit: ClockFit | None = None
        self._fitted_s = -math.inf
        self._newest = (-math.inf, -math.inf)
        self._slot = -math.inf
        self._begun_anew: list[float] = []

    @property
    def known(self) -> bool:
        """Whether there is a line."""
        return self._fit is not None

    @property
    def begun_anew(self) -> int:
        """How often the line began anew, after jumps and what looked like them."""
        return len(self._begun_anew)

    @property
    def fit(self) -> ClockFit:
        """The newest line. DeviceError before the first pair."""
        if self._fit is None:
            raise DeviceError(f"{self.name} has sent no time yet. {self._remedy}")
        return self._fit

    def add(self, own_s: ArrayLike, host_s: ArrayLike) -> None:
        """Take pairs (n,) in the order of arrival.

        Raises DeviceError where the clock stands, or drifts by more than `DRIFT_LIMIT_PPM`.
        """
        pairs = zip(
            np.atleast_1d(own_s).astype(float).tolist(),
            np.atleast_1d(host_s).astype(float).tolist(),
            strict=True,
        )
        for own, host in pairs:
            self._take(own, host)
        if self._host and (self._fit is None or self._host[-1] - self._fitted_s >= _REFIT_S):
            self._refit()

    @property
    def sentence(self) -> str:
        """Drift with its standard deviation, how well times are known, and the jumps."""
        if self._fit is None:
            return f"{self.name} has sent no time."
        fit = self._fit
        runs = "has not shown its drift yet"
        if fit.drift_sd < USUAL_DRIFT:
            way = "faster" if fit.drift >= 0.0 else "slower"
            runs = (
                f"runs {abs(fit.drift_ppm):.1f} +- {fit.drift_sd_ppm:.1f} ppm {way} than this "
                "computer's"
            )
        said = f"{self.name} {runs}; its times are known to {1e3 * fit.sd_s(self._own[-1]):.2g} ms."
        return " ".join([said, *(self._said(jump) for jump in self.jumps[-3:])])

    def _take(self, own: float, host: float) -> None:
        """Keep a pair, or of neighbours the one that came soonest."""
        newest, moved = self._newest
        if own < newest - REORDERED_S:
            self._jump(host, own - (self._fit.own(host) if self._fit else newest))
        elif own == newest and host - moved > STANDS_S:
            raise DeviceError(
                f"{self.name} stands: it has shown {own:.3f} s for {host - moved:.1f} s. "
                f"{self._remedy}"
            )
        if self._fit is not None:
            early = self._fit.host(own) - host
            if early > JUMP_S + _JUMP_SDS * self._fit.sd_s(own):
                self._jump(host, early)
        if own > self._newest[0]:
            self._newest = (own, host)
        if self._own and own - self._slot < _THIN_S:
            if host - own < self._host[-1] - self._own[-1]:
                self._own[-1], self._host[-1] = own, host
            return
        self._slot = own
        self._own.append(own)
        self._host.append(host)

    def _refit(self) -> None:
        newest = self._host[-1]
        old = int(np.searchsorted(self._host, newest - self._window_s))
        del self._own[:old], self._host[:old]
        self._look_for_delay()
        order = np.argsort(self._own)
        self._fit = fit = fit_clock(np.array(self._own)[order], np.array(self._host)[order])
        self._fitted_s = newest
        beyond = abs(fit.drift_ppm) - 3.0 * fit.drift_sd_ppm > DRIFT_LIMIT_PPM
        if beyond and newest - self._host[0] >= _JUDGED_FROM_S:
            raise DeviceError(
                f"{self.name} runs {fit.drift_ppm:+.0f} +- {fit.drift_sd_ppm:.0f} ppm against this "
                f"computer's over {fit.span_s:.0f} s; {DRIFT_LIMIT_PPM:g} ppm are the limit. "
                f"{self._remedy}"
            )

    def _look_for_delay(self) -> None:
        """A clock that jumped back makes all that follows seem late: begin anew where it did."""
        fit = self._fit
        if fit is None:
            return
        first = int(np.searchsorted(self._host, self._host[-1] - _RECENT_S))
        recent = len(self._own) - first
        if first == 0 or recent < _FEWEST_RECENT:
            return
        pairs = zip(self._own[first:], self._host[first:], strict=True)
        least = min(host - fit.host(own) for own, host in pairs)
        usual = fit.pairs / (fit.density * recent)
        if least > JUMP_S + _JUMP_SDS * (usual + fit.sd_s(self._own[-1])):
            # some of the first of these may have come before the jump, and late
            half = first + recent // 2
            kept = self._own[half:], self._host[half:]
            self._jump(self._host[first], -least)
            self._own, self._host = kept
            self._newest = (self._own[-1], self._host[-1])

    def _jump(self, host: float, by_s: float) -> None:
        """Note a jump, and forget what came before it.

        What comes sooner than all did in the first seconds is no jump: what waited when the line
        was opened came late.
        """
        young = not self._host or host - self._host[0] < _SETTLES_S
        if not (young and 0.0 < by_s < _SETTLES_S):
            self.jumps.append(Jump(host, by_s))
        self._begun_anew.append(host)
        self._own, self._host, self._fit = [], [], None
        self._newest = (-math.inf, host)
        often = [begun for begun in self._begun_anew if begun > host - _OFTEN_S]
        if len(often) >= _OFTEN:
            raise DeviceError(
                f"{self.name} jumped {len(often)} times within {_OFTEN_S:g} s, last by "
                f"{1e3 * by_s:+.0f} ms: it keeps no time, or another unit. {self._remedy}"
            )

    def _said(self, jump: Jump) -> str:
        way = "ahead" if jump.by_s > 0.0 else "back"
        or_late = ""
        if abs(jump.by_s) < _LATE_S:
            when = "since" if jump.by_s < 0.0 else "until then"
            or_late = f" (or what it sent came so much later {when})"
        by = (
            f"{abs(jump.by_s):.3g} s" if abs(jump.by_s) >= 1.0 else f"{1e3 * abs(jump.by_s):.3g} ms"
        )
        return f"It jumped {way} by {by}{or_late}. {self._remedy}"


def _under(x: Array, y: Array) -> tuple[float, float]:
    """Height over x = 0 and slope of the line under all points that is nearest to them.

    The mean of x is 0, so the sum of the heights above a line is least where its height there is
    most: on the edge of the lower hull that spans it. NaN slope where all x are equal.
    """
    hull: list[tuple[float, float]] = []
    for a, b in zip(x.tolist(), y.tolist(), strict=True):
        while len(hull) > 1:
            (x0, y0), (x1, y1) = hull[-2], hull[-1]
            if (x1 - x0) * (b - y0) > (a - x0) * (y1 - y0):
                break
            hull.pop()
        if hull and hull[-1][0] == a:
            hull[-1] = (a, min(b, hull[-1][1]))
        else:
            hull.append((a, b))
    for (x0, y0), (x1, y1) in itertools.pairwise(hull):
        if x0 <= 0.0 <= x1:
            slope = (y1 - y0) / (x1 - x0)
            return y0 - slope * x0, slope
    return float(y.min()), math.nan


def _density(above: Array) -> float:
    """How many points a second of height holds next to the line, from the lowest ones."""
    if len(above) < _SMALLEST:
        return len(above) / _USUAL_DELAY_S
    return (_SMALLEST - 2) / max(float(np.sort(above)[_SMALLEST - 1]), _CLOSEST_S)
