"""The shortest list of strokes that is expected to reach a scene's tolerance: greedy choice."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

from scissorcal.calibration.design.band import Band, TorqueKnowledge, expected_band
from scissorcal.calibration.design.information import Information
from scissorcal.recipe.fields import MOST_SPEEDS

WORTH = 1e-9
"""Least gain, in e-folds of the excess per minute, that counts as one."""
MOST_STEPS = 60
"""Strokes added after the first list until the search gives up."""
FEWEST_SPEEDS = 3
"""Speeds of empty sweeps that a first capture has at least: two show viscous friction, and one more
whether the level changes at slow speeds. Laws are compared by the fit, so the list must not rest on
the law that was expected."""
MOST_OF_ONE = 2
"""How many times as often a speed may be swept as each of the first ones. Sweeps at one speed
repeat what the law lacks there: with 65 of 77 pairs at 0.3 and 0.4 rad/s, which narrow the expected
band the most, a coarse encoder's fit found 1.3 to 2.7 times the inertia."""
FEWEST_PIECES, FEWEST_STROKES = 2, 2
"""Pieces that a first capture has at least (one does not show how sheets differ), and strokes
through each."""
SPARE = 0.1
"""Share by which a list's expected band is narrower than the tolerance asks for: a fit's band comes
out about so much wider or narrower than expected."""
Capture = Literal["friction", "cut"]


@dataclass(frozen=True)
class Offer:
    """What one stroke tells, and the seconds it takes."""

    information: Information
    seconds: float


@dataclass(frozen=True)
class Stock:
    """Strokes that a capture may have.

    ``sweeps`` are pairs of empty strokes, closing and opening, by speed; ``excitation`` is one of
    ``excitation_s``. ``strokes`` through material are by speed and place in the sheet (from 0).
    ``piece_s`` is what a fresh piece takes besides its strokes, ``begin_s`` what any capture takes
    before and after, both with a person's part. ``rotates``: presses take every speed of
    the list at each place in turn, so that no speed is chosen for a single one.
    """

    sweeps: Mapping[float, Offer]
    excitation: Offer
    excitation_s: float
    strokes: Mapping[tuple[float, int], Offer]
    piece_s: float
    begin_s: float
    rotates: bool = False

    @property
    def places(self) -> int:
        """Strokes that a piece has room for."""
        return 1 + max(place for _, place in self.strokes)

    @property
    def cut_speeds(self) -> tuple[float, ...]:
        """Speeds of strokes through material, ascending."""
        return tuple(sorted({speed for speed, _ in self.strokes}))


@dataclass(frozen=True)
class CaptureList:
    """Strokes to capture: empty sweeps at ``speeds`` (rad/s), and pieces with a speed by stroke.

    Every piece has equally many strokes. An empty tuple stands for no capture of that kind.
    """

    speeds: tuple[float, ...] = ()
    pieces: tuple[tuple[float, ...], ...] = ()

    @property
    def fits_a_recipe(self) -> bool:
        """Whether a recipe's lists of speeds hold it: a band that no data narrow asks for more."""
        strokes = sum(len(piece) for piece in self.pieces)
        return len(self.speeds) <= MOST_SPEEDS and strokes <= MOST_SPEEDS

    def information(
        self, stock: Stock, parameters: tuple[int, int]
    ) -> tuple[Information, Information]:
        """What friction's and the cut's strokes of the list tell together."""
        friction, cut = (Information.none(count) for count in parameters)
        for speed in self.speeds:
            friction = friction + stock.sweeps[speed].information
        if self.speeds:
            friction = friction + stock.excitation.information
        for piece in self.pieces:
            for place, speed in enumerate(piece):
                cut = cut + stock.strokes[speed, place].information
        return friction, cut

    def seconds(self, stock: Stock) -> float:
        """Seconds at the rig, a person's part included."""
        total = 0.0
        if self.speeds:
            total += stock.begin_s + stock.excitation.seconds
            total += sum(stock.sweeps[speed].seconds for speed in self.speeds)
        if self.pieces:
            total += stock.begin_s + stock.piece_s * len(self.pieces)
        for piece in self.pieces:
            total += sum(stock.strokes[speed, place].seconds for place, speed in enumerate(piece))
        return total


@dataclass(frozen=True)
class Step:
    """One addition to the list, with the band expected before and after it.

    ``gain`` is the fall of the excess per minute of both bands widened by :data:`SPARE`;
    ``minutes`` are those of this step, negative where something is left out: ``gain`` is then what
    the excess rises by per minute spared. ``total_minutes`` are those of the list so far.
    """

    capture: Capture
    what: str
    minutes: float
    total_minutes: float
    before: Band
    after: Band
    gain: float


@dataclass(frozen=True)
class Design:
    """The list, step by step, and the band that it is expected to end in."""

    captures: CaptureList
    steps: tuple[Step, ...]
    now: Band
    expected: Band
    minutes: float

    @property
    def sentence(self) -> str:
        """What the list is expected to reach."""
        tolerance = f"{100 * self.now.tolerance:g} %"
        if self.now.reached:
            return (
                f"Nothing more to capture: the torque's band is within {tolerance} at "
                f"{100 * self.now.within:.0f} % of the places that can be felt."
            )
        if self.captures == CaptureList():
            return (
                "No stroke on offer is expected to narrow the torque's band, which is within "
                f"{tolerance} at {100 * self.now.within:.0f} % of the places that can be felt."
            )
        best = "" if self.expected.reached else "is the best found: it "
        return (
            f"The list of {self.minutes:.1f} min {best}is expected to bring the torque's band "
            f"within {tolerance} at {100 * self.expected.within:.0f} % of the places that can be "
            f"felt (now {100 * self.now.within:.0f} %)."
        )


def choose_captures(known: TorqueKnowledge, stock: Stock) -> Design:
    """Add strokes until the scene's tolerance is expected to be reached, each the best per minute.

    What is captured for the first time begins with the least that identifies every parameter
    (:data:`FEWEST_SPEEDS` speeds both ways, :data:`FEWEST_PIECES` pieces), so that the list does
    not rest on the parameters assumed. Then that is added which lowers the band's excess over the
    tolerance (with :data:`SPARE`) the most per minute: a pair of empty sweeps, one more stroke on
    every piece, or one more piece. Where knowledge exists already the strokes make a new recording.
    At last, what the tolerance is reached without is left out again.

    Greedy choice is within 1 - 1/e of the best list where gains diminish (Nemhauser, Wolsey and
    Fisher 1978, doi:10.1007/BF01588971); the excess only nearly has that property.
    """
    now = expected_band(known)
    captures, steps = CaptureList(), []
    band = now
    for _ in range(MOST_STEPS):
        complete = _begun(known, captures)
        if complete and _enough(band, captures):
            break
        options = [entry for entry in _options(known, stock, captures) if entry[2].fits_a_recipe]
        judged = [(_judged(known, stock, captures, band, option), option) for option in options]
        if complete:
            judged = [entry for entry in judged if entry[0].gain > WORTH]
        if not judged:
            break
        best, (_, _, captures) = max(judged, key=lambda entry: entry[0].gain)
        steps.append(best)
        band = best.after
    while captures != CaptureList() and _enough(band, captures):
        spared = [
            (_judged(known, stock, captures, band, option), option)
            for option in _shorter(stock, captures)
        ]
        kept = [entry for entry in spared if _enough(entry[0].after, entry[1][2])]
        if not kept:
            break
        best, (_, _, captures) = min(kept, key=lambda entry: entry[0].minutes)
        steps.append(best)
        band = best.after
    return Design(captures, tuple(steps), now, band, captures.seconds(stock) / 60.0)


def first_captures(stock: Stock) -> CaptureList:
    """The least that a first capture of both kinds has."""
    return _first_pieces(stock, _first_sweeps(stock, CaptureList())[2])[2]


def knowledge_after(known: TorqueKnowledge, stock: Stock, captures: CaptureList) -> TorqueKnowledge:
    """What will be known after a list; each kind of its strokes is a new recording."""
    sizes = len(known.friction.point), len(known.cut.point)
    friction, cut = captures.information(stock, sizes)
    return known.plus(
        friction if captures.speeds else None,
        cut if captures.pieces else None,
        new_recording=True,
    )


def _enough(band: Band, captures: CaptureList) -> bool:
    """Whether the tolerance is reached: with some to spare where strokes are to be captured."""
    return band.reached if captures == CaptureList() else band.wider(SPARE).reached


_Option = tuple[Capture, str, CaptureList]


def _begun(known: TorqueKnowledge, captures: CaptureList) -> bool:
    """Whether every kind of capture has data or is on the list."""
    return bool(
        (known.friction.recordings or captures.speeds) and (known.cut.recordings or captures.pieces)
    )


def _options(known: TorqueKnowledge, stock: Stock, captures: CaptureList) -> Iterator[_Option]:
    """Lists that are one addition longer; what must be captured first comes alone."""
    if not known.friction.recordings and not captures.speeds:
        yield _first_sweeps(stock, captures)
        return
    if not known.cut.recordings and not captures.pieces:
        yield _first_pieces(stock, captures)
        return
    if not captures.speeds:
        yield _first_sweeps(stock, captures)
    for speed in stock.sweeps if captures.speeds else ():
        longer = replace(captures, speeds=(*captures.speeds, speed))
        if not _balanced(stock, longer):
            continue
        yield "friction", f"sweep at {speed:.3g} rad/s, both ways", longer
    if not captures.pieces:
        yield _first_pieces(stock, captures)
        return
    count = len(captures.pieces[0])
    if stock.rotates:
        rounds = len(captures.pieces)
        if count < stock.places:
            longer = replace(captures, pieces=_rotated(stock, rounds, count + 1))
            yield "cut", f"presses at one more place, {rounds} times", longer
        longer = replace(captures, pieces=_rotated(stock, rounds + 1, count))
        yield "cut", f"{count} presses once more", longer
        return
    for speed in stock.cut_speeds:
        at = f"at {speed:.3g} rad/s"
        if count < stock.places:
            longer = replace(captures, pieces=tuple((*p, speed) for p in captures.pieces))
            yield "cut", f"one more stroke on every piece, {at}", longer
        piece = (speed,) * count
        longer = replace(captures, pieces=(*captures.pieces, piece))
        yield "cut", f"one more piece with {count} strokes {at}", longer


def _shorter(stock: Stock, captures: CaptureList) -> list[_Option]:
    """Lists that lack one addition; what a first capture needs stays."""
    shorter_lists: list[_Option] = []
    speeds, pieces = captures.speeds, captures.pieces
    needed = set(_first_sweeps(stock, captures)[2].speeds)
    for speed in sorted(set(speeds)):
        if speeds.count(speed) > (speed in needed):
            rest = list(speeds)
            rest.remove(speed)
            what = f"without a sweep at {speed:.3g} rad/s"
            fewer = replace(captures, speeds=tuple(rest))
            if _balanced(stock, fewer):
                shorter_lists.append(("friction", what, fewer))
    if len(pieces) > FEWEST_PIECES:
        one_less = replace(captures, pieces=pieces[:-1])
        shorter_lists.append(("cut", "without the last piece", one_less))
    if pieces and len(pieces[0]) > min(FEWEST_STROKES, stock.places):
        count = len(pieces[0]) - 1
        shorter = (
            _rotated(stock, len(pieces), count)
            if stock.rotates
            else tuple(piece[:-1] for piece in pieces)
        )
        shorter_lists.append(
            ("cut", "without the last stroke on every piece", replace(captures, pieces=shorter))
        )
    return shorter_lists


def _balanced(stock: Stock, captures: CaptureList) -> bool:
    """Whether no speed is swept more than MOST_OF_ONE times as often as each of the first ones."""
    counts = [captures.speeds.count(speed) for speed in stock.sweeps]
    rarest = min(captures.speeds.count(speed) for speed in _first_speeds(stock))
    return max(counts) <= MOST_OF_ONE * max(rarest, 1)


def _first_sweeps(stock: Stock, captures: CaptureList) -> _Option:
    """Sweeps at the first speeds, each both ways, and the excitation."""
    chosen = _first_speeds(stock)
    words = ", ".join(f"{speed:.3g}" for speed in chosen)
    what = f"sweeps at {words} rad/s both ways, and {stock.excitation_s:g} s of excitation"
    return "friction", what, replace(captures, speeds=chosen)


def _first_speeds(stock: Stock) -> tuple[float, ...]:
    """Speeds spread over those on offer, the slowest and the fastest among them."""
    speeds = sorted(stock.sweeps)
    last = len(speeds) - 1
    count = min(FEWEST_SPEEDS, len(speeds))
    return tuple(
        speeds[k] for k in sorted({round(k * last / max(count - 1, 1)) for k in range(count)})
    )


def _first_pieces(stock: Stock, captures: CaptureList) -> _Option:
    """Pieces with the slowest and the fastest strokes, in the other order on every second one."""
    speeds = stock.cut_speeds
    ends = (speeds[0], speeds[-1])
    count = min(FEWEST_STROKES, stock.places)
    if stock.rotates:
        what = f"presses at {count} places, {FEWEST_PIECES} times"
        return "cut", what, replace(captures, pieces=_rotated(stock, FEWEST_PIECES, count))
    pieces = tuple(
        tuple(ends[(place + piece) % 2] for place in range(count)) for piece in range(FEWEST_PIECES)
    )
    what = (
        f"{len(pieces)} pieces with {count} strokes each, at {ends[0]:.3g} and {ends[1]:.3g} rad/s"
    )
    return "cut", what, replace(captures, pieces=pieces)


def _rotated(stock: Stock, rounds: int, places: int) -> tuple[tuple[float, ...], ...]:
    """Presses as a plan takes them: the speeds in turn, a step further in every round."""
    speeds = stock.cut_speeds
    return tuple(
        tuple(speeds[(place + number) % len(speeds)] for place in range(places))
        for number in range(rounds)
    )


def _judged(
    known: TorqueKnowledge, stock: Stock, captures: CaptureList, band: Band, option: _Option
) -> Step:
    capture, what, longer = option
    after = expected_band(knowledge_after(known, stock, longer))
    minutes = (longer.seconds(stock) - captures.seconds(stock)) / 60.0
    gain = (band.wider(SPARE).excess - after.wider(SPARE).excess) / minutes
    return Step(capture, what, minutes, longer.seconds(stock) / 60.0, band, after, gain)
