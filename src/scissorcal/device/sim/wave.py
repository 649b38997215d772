"""A smooth curve through points: by how much a simulated edge departs from its straight line."""

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from operator import itemgetter


class Wave:
    """The natural cubic spline through points (station, value), straight on beyond both ends.

    It has two continuous derivatives everywhere. ``least`` and ``largest`` are its extreme slopes,
    each (station, slope): none is beyond.

    >>> wave = Wave([(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)])
    >>> wave.at(1.0), wave.at(3.0)
    ((1.0, 0.0), (-1.5, -1.5))
    """

    __slots__ = ("_pieces", "_stations", "largest", "least")

    def __init__(self, points: Sequence[tuple[float, float]]) -> None:
        stations = [station for station, _ in points]
        values = [value for _, value in points]
        bends = _natural_bends(stations, values)
        pieces = [(values[0], _first_slope(stations, values, bends), 0.0, 0.0)]
        for k, (start, end) in enumerate(pairwise(stations)):
            width = end - start
            rise = (values[k + 1] - values[k]) / width
            slope = rise - width * (2.0 * bends[k] + bends[k + 1]) / 6.0
            pieces.append((values[k], slope, 0.5 * bends[k], (bends[k + 1] - bends[k]) / width / 6))
        width = stations[-1] - stations[-2]
        _, slope, half, sixth = pieces[-1]
        last = slope + width * (2.0 * half + 3.0 * sixth * width)
        pieces.append((values[-1], last, 0.0, 0.0))
        self._stations = stations
        self._pieces = pieces
        slopes = [(at, self.at(at)[1]) for at in stations]
        for (start, end), (_, slope, half, sixth) in zip(
            pairwise(stations), pieces[1:-1], strict=True
        ):
            top = -half / (3.0 * sixth) if sixth else -1.0
            if 0.0 < top < end - start:
                slopes.append((start + top, slope + top * (2.0 * half + 3.0 * sixth * top)))
        self.least = min(slopes, key=itemgetter(1))
        self.largest = max(slopes, key=itemgetter(1))

    @property
    def stations(self) -> tuple[float, ...]:
        return tuple(self._stations)

    def at(self, station: float) -> tuple[float, float]:
        """Value and slope at a station."""
        piece = bisect_right(self._stations, station)
        value, slope, half, sixth = self._pieces[piece]
        along = station - self._stations[piece - 1 if piece else 0]
        return (
            value + along * (slope + along * (half + along * sixth)),
            slope + along * (2.0 * half + 3.0 * along * sixth),
        )


def _first_slope(
    stations: Sequence[float], values: Sequence[float], bends: Sequence[float]
) -> float:
    width = stations[1] - stations[0]
    return (values[1] - values[0]) / width - width * (2.0 * bends[0] + bends[1]) / 6.0


def _natural_bends(stations: Sequence[float], values: Sequence[float]) -> list[float]:
    """Second derivatives at the points, 0 at both ends: a tridiagonal system, by elimination."""
    widths = [end - start for start, end in pairwise(stations)]
    rises = [(high - low) / w for (low, high), w in zip(pairwise(values), widths, strict=True)]
    upper, right = [0.0], [0.0]
    for k in range(1, len(stations) - 1):
        pivot = 2.0 * (widths[k - 1] + widths[k]) - widths[k - 1] * upper[-1]
        upper.append(widths[k] / pivot)
        right.append((6.0 * (rises[k] - rises[k - 1]) - widths[k - 1] * right[-1]) / pivot)
    bends = [0.0] * len(stations)
    for k in range(len(stations) - 2, 0, -1):
        bends[k] = right[k] - upper[k] * bends[k + 1]
    return bends
