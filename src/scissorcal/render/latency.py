"""Exact percentiles of the loop's latency, from its samples."""

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.device.motion import Latency


def latency_of(latency_ns: ArrayLike) -> Latency | None:
    """Percentiles in microseconds of the times from a frame's arrival to the command's departure.

    ``latency_ns`` is a recording's column: 0 where no command was sent, which does not count.
    Each percentile is a latency that occurred: the smallest that the share of frames does not
    exceed. None where no command has a latency, as in virtual time.

    >>> latency_of([0, 20_000, 30_000, 40_000, 1_000_000])
    Latency(p50=30.0, p99=1000.0, p999=1000.0, worst=1000.0)
    """
    sent = np.asarray(latency_ns, dtype=np.int64)
    sent = sent[sent > 0]
    if sent.size == 0:
        return None
    shares = (0.5, 0.99, 0.999, 1.0)
    quantiles = np.quantile(sent, shares, method="inverted_cdf") / 1000
    return Latency(*(float(value) for value in quantiles))
