"""Bursts become an even stream, in order, with one delay; what is too much is counted."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.prototype.rig_feed import MOST_AT_ONCE, MOST_WAITING, LAG_s, MOST_A_s, Playout

TICK_s = 0.025


def rows(first_s: float, last_s: float, rate_Hz: float = 1000.0) -> "np.ndarray[tuple[int, int]]":
    time_s = np.arange(round(first_s * rate_Hz), round(last_s * rate_Hz)) / rate_Hz
    return np.stack([time_s, 7.0 * time_s], axis=1)


def test_chunks_are_given_out_evenly_with_one_delay() -> None:
    playout, given_out, counts = Playout(), [], []
    for tick in range(400):
        now_s = tick * TICK_s
        if tick % 6 == 0 and tick:
            playout.add(rows(now_s - 0.15, now_s), now_s)
        taken = playout.take(now_s)
        counts.append(len(taken))
        given_out += [(now_s - row[0], row[0], row[1]) for row in taken]
    delays, times, values = np.array(given_out).T
    assert playout.lost == 0
    assert np.allclose(np.diff(times), 1.0 / MOST_A_s)
    assert np.allclose(values, 7.0 * times)
    late = delays[times > 0.2]
    assert LAG_s - 0.002 <= late.min()
    assert late.max() <= LAG_s + TICK_s + 0.002
    steady = counts[40:]
    assert min(steady) >= 5
    assert max(steady) <= 8


def test_a_rig_in_virtual_time_is_shown_as_fast_as_it_goes() -> None:
    playout, times = Playout(), []
    for tick in range(40):
        now_s = tick * TICK_s
        playout.add(rows(10.0 * now_s, 10.0 * (now_s + TICK_s)), now_s)
        times += [row[0] for row in playout.take(now_s)]
    assert times[-1] == pytest.approx(10.0 - LAG_s, abs=0.05)
    assert playout.lost == 0


def test_a_rig_that_stands_still_and_goes_on_is_shown_at_once() -> None:
    playout = Playout()
    playout.add(rows(0.0, 1.0), 1.0)
    assert len(playout.take(1.5)) == MOST_A_s
    playout.add(rows(1.0, 1.1), 9.0)
    assert len(playout.take(9.0 + LAG_s)) == 0.1 * MOST_A_s


@pytest.mark.slow
@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 2.0)), max_size=6))
def test_no_sample_is_given_twice_or_in_disorder_and_all_are_counted(
    bursts: list[tuple[float, float]],
) -> None:
    playout, now_s, rig_s, taken = Playout(), 0.0, 0.0, []
    added = 0
    for pause_s, span_s in bursts:
        now_s += pause_s
        block = rows(rig_s, rig_s + span_s)
        rig_s += span_s
        added += len({int(t * MOST_A_s + 1e-6) for t in block[:, 0]})
        playout.add(block, now_s)
        found = playout.take(now_s)
        assert len(found) <= MOST_AT_ONCE
        taken += [row[0] for row in found]
    while playout.waits:
        now_s += 1.0
        taken += [row[0] for row in playout.take(now_s)]
    assert np.all(np.diff(taken) > 0.0)
    # Rounded spans may share a slot between two blocks, which counts it once here.
    assert added - len(bursts) <= len(taken) + playout.lost <= added


def test_what_waits_is_bounded() -> None:
    playout = Playout()
    playout.add(rows(0.0, 100.0), 0.0)
    assert playout.lost == 100 * MOST_A_s - MOST_WAITING
    assert len(playout.take(1000.0)) == MOST_AT_ONCE
    assert playout.lost == 100 * MOST_A_s - MOST_AT_ONCE
