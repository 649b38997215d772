"""Less data than was recorded: whole movements leave, what stays is unchanged."""

import numpy as np

from scissorcal.bench.trade.knobs.capture import kept, movements, shortened
from scissorcal.recording import SAMPLE_DTYPE, UNLOADED_MARK, Recording, Stroke

KINDS = ("closing", "opening", "closing", "opening", "closing", "opening", "excitation")
SPEEDS = (0.1, 0.1, 0.5, 0.5, 0.1, 0.1, float("nan"))
EACH, REST = 10, 4


def made(sheets: tuple[int, ...] = (-1,) * 7) -> Recording:
    """Strokes of ten samples with a rest of four after each."""
    strokes = tuple(
        Stroke(index, kind, speed, sheet)  # type: ignore[arg-type]
        for index, (kind, speed, sheet) in enumerate(zip(KINDS, SPEEDS, sheets, strict=True))
    )
    samples = np.zeros(len(strokes) * (EACH + REST), dtype=SAMPLE_DTYPE)
    samples["device_time_us"] = 1000 * np.arange(len(samples))
    labels = [[index] * EACH + [-1] * REST for index in range(len(strokes))]
    samples["stroke"] = np.concatenate(labels)
    return Recording("friction", samples, strokes, marks=((UNLOADED_MARK, "4"),))


def test_a_movement_is_a_stroke_with_the_opening_after_it() -> None:
    found = movements(made())
    assert [one.strokes for one in found] == [(0, 1), (2, 3), (4, 5), (6,)]
    assert [one.number for one in found] == [0, 0, 1, 0]


def test_movements_are_counted_by_sheet_where_there_are_sheets() -> None:
    found = movements(made((0, 0, 0, 0, 1, 1, -1)))
    assert [(one.sheet, one.number) for one in found[:3]] == [(0, 0), (0, 1), (1, 0)]


def test_what_stays_is_unchanged_and_numbered_anew() -> None:
    whole = made()
    part = kept(whole, lambda one: one.number > 0 or one.kind == "excitation")
    assert [stroke.kind for stroke in part.strokes] == ["closing", "opening", "excitation"]
    assert [stroke.index for stroke in part.strokes] == [0, 1, 2]
    first = 4 * (EACH + REST)
    assert np.array_equal(part.samples["device_time_us"], whole.samples["device_time_us"][first:])
    assert sorted(set(part.samples["stroke"].tolist())) == [-1, 0, 1, 2]
    assert part.unloaded == {0}
    assert kept(whole, lambda one: one.strokes[0] < 4).unloaded == set()


def test_keeping_everything_changes_nothing() -> None:
    whole = made()
    part = kept(whole, lambda one: True)
    assert np.array_equal(part.samples, whole.samples)
    assert part.strokes == whole.strokes
    assert part.marks == whole.marks


def test_a_share_of_a_stroke_is_its_beginning() -> None:
    whole = made()
    part = shortened(whole, "excitation", 0.5)
    assert len(whole.samples) - len(part.samples) == (EACH + REST) // 2
    assert np.array_equal(part.samples, whole.samples[: len(part.samples)])
