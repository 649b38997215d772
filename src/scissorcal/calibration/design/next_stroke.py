"""The stroke that is worth most now, how long it will go on, and what bounds a band in the end."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.design.band import Band, TorqueKnowledge, expected_band, quadratic_form
from scissorcal.calibration.design.choice import (
    FEWEST_PIECES,
    FEWEST_STROKES,
    MOST_STEPS,
    WORTH,
    Capture,
    Stock,
)
from scissorcal.calibration.design.information import Information, Knowledge

Judge = Callable[[TorqueKnowledge], Band]

FRICTION_SHARE = 0.5
"""Share of the tolerance that friction's uncertainty may take where the material was not captured
yet. Variances add, so that 87 % of the tolerance are left to the material."""
EXACT = 1e8
"""Precision, in prior standard deviations, of what is taken as known exactly."""


@dataclass(frozen=True)
class Taken:
    """Strokes of the capture so far: (speed in rad/s, place in its piece from 0), in order.

    Empty sweeps have place 0.
    """

    strokes: tuple[tuple[float, int], ...] = ()

    def plus(self, speed: float, place: int) -> "Taken":
        """With one stroke more."""
        return Taken((*self.strokes, (speed, place)))

    @property
    def pieces(self) -> int:
        """Pieces that were begun."""
        return sum(place == 0 for _, place in self.strokes)

    @property
    def next_place(self) -> int:
        """The next place in the piece that lies there; 0 where none does."""
        return self.strokes[-1][1] + 1 if self.strokes else 0


@dataclass(frozen=True)
class NextStroke:
    """One stroke to come: its speed (rad/s), place in its piece, seconds, and the band after it.

    ``gain`` is the fall of the band's excess per minute.
    """

    speed: float
    place: int
    seconds: float
    gain: float
    known: TorqueKnowledge
    after: Band


@dataclass(frozen=True)
class Outlook:
    """The next stroke, and whether the tolerance is expected to be reached after ``seconds``.

    ``strokes`` counts those to come, ``last`` is the band that they are expected to end in.
    """

    following: NextStroke | None
    reaches: bool
    seconds: float
    strokes: int
    last: Band


def outlook(
    known: TorqueKnowledge,
    stock: Stock,
    capture: Capture,
    taken: Taken,
    judge: Judge,
    least: int = 0,
) -> Outlook:
    """Choose the stroke that lowers the band's excess the most per minute, and look ahead.

    As :func:`~scissorcal.calibration.design.choice.choose_captures` chooses, but one stroke at a
    time and in the recording that goes on. A capture of cuts begins with ``FEWEST_PIECES`` pieces
    of ``FEWEST_STROKES`` strokes at different speeds, so that differences between pieces and speeds
    are among its data. The same choice, repeated with the bands expected, says how long it goes on:
    ``least`` strokes in any case.
    """
    chosen: list[NextStroke] = []
    band, now = judge(known), taken
    while len(chosen) < MOST_STEPS:
        needed = len(chosen) < least or not begun(stock, capture, now)
        if band.reached and not needed:
            break
        options = [
            _judged(known, band, capture, offer, judge) for offer in _offers(stock, capture, now)
        ]
        if not options:
            break
        best = max(options, key=lambda option: option.gain)
        if best.gain <= WORTH and not needed:
            break
        chosen.append(best)
        known, band, now = best.known, best.after, now.plus(best.speed, best.place)
    return Outlook(
        chosen[0] if chosen else None,
        band.reached,
        sum(stroke.seconds for stroke in chosen),
        len(chosen),
        band,
    )


def begun(stock: Stock, capture: Capture, taken: Taken) -> bool:
    """Whether a capture has what it needs in any case."""
    if capture == "friction":
        return bool(taken.strokes)
    if stock.rotates:
        return len(taken.strokes) >= FEWEST_PIECES * min(FEWEST_STROKES, stock.places)
    places = [place for _, place in taken.strokes]
    return sum(place == min(FEWEST_STROKES, stock.places) - 1 for place in places) >= FEWEST_PIECES


def friction_alone(known: TorqueKnowledge) -> Band:
    """The band that friction's uncertainty alone makes, as if the material were known.

    It is twice as wide as its part of the torque's, so that friction counts as reached where it
    takes ``FRICTION_SHARE`` of the tolerance. Where friction is not rendered, it enters the torque
    by the cut's offsets: the material's torque is what was measured less friction, so that an
    error of friction counts as one of the torque, as if the cut told nothing of its offsets.
    """
    scene, sharing = known.scene, known.sharing
    if scene.by_friction.any():
        material = np.zeros_like(scene.by_cut)
        share = expected_band(replace(known, scene=replace(scene, by_cut=material))).share
    else:
        variance = quadratic_form(sharing.slopes, known.friction.covariance).max()
        share = scene.reach * np.sqrt(variance) / np.abs(scene.torque)
    return Band(share / FRICTION_SHARE, scene.tolerance)


def bounds(known: TorqueKnowledge) -> dict[str, Band]:
    """The band without one of its causes: friction, the edge, the stated error of the law.

    What falls the most is what bounds the band where further strokes lower it no more.
    """
    sharing = replace(known.sharing, floor_sd=0.0)
    exact = np.ones(len(known.friction.point), dtype=bool)
    edge = np.array([name.startswith("edge") for name in known.cut.layout.names])
    without = {
        "friction": replace(known, friction=_exact(known.friction, exact), sharing=sharing),
        "law": replace(known, cut=replace(known.cut, error_shares={})),
    }
    if edge.any():
        without["edge"] = replace(known, cut=_exact(known.cut, edge))
    return {name: expected_band(knowledge) for name, knowledge in without.items()}


_Offer = tuple[float, int, Information, float]


def _offers(stock: Stock, capture: Capture, taken: Taken) -> Iterator[_Offer]:
    """Speed, place, information and seconds of each stroke that could come next."""
    if capture == "friction":
        for speed, offer in stock.sweeps.items():
            yield speed, 0, offer.information, offer.seconds
        return
    if stock.rotates:
        free = [key for key in stock.strokes if key not in taken.strokes]
        for speed, place in free or stock.strokes:
            offer = stock.strokes[speed, place]
            yield speed, place, offer.information, offer.seconds
        return
    here = taken.next_place
    wanted = min(FEWEST_STROKES, stock.places)
    begins = 0 < here < wanted and taken.pieces <= FEWEST_PIECES
    other = begins and len(stock.cut_speeds) > 1
    enough = here >= wanted and taken.pieces < FEWEST_PIECES
    last = taken.strokes[-1][0] if taken.strokes else float("nan")
    for speed in stock.cut_speeds:
        if 0 < here < stock.places and not enough and not (other and speed == last):
            offer = stock.strokes[speed, here]
            yield speed, here, offer.information, offer.seconds
        if not begins:
            offer = stock.strokes[speed, 0]
            yield speed, 0, offer.information, offer.seconds + stock.piece_s


def _judged(
    known: TorqueKnowledge, band: Band, capture: Capture, offer: _Offer, judge: Judge
) -> NextStroke:
    speed, place, information, seconds = offer
    after = (
        known.plus(friction=information) if capture == "friction" else known.plus(cut=information)
    )
    after_band = judge(after)
    gain = 60.0 * (band.excess - after_band.excess) / seconds
    return NextStroke(speed, place, seconds, gain, after, after_band)


def _exact(known: Knowledge, which: NDArray[np.bool_]) -> Knowledge:
    """Some parameters as if they were known exactly."""
    return replace(known, prior=known.prior + np.diag(which * EXACT / known.layout.sd**2))
