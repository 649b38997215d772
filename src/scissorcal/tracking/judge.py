"""How a track went: rows by outcome, consistency, clocks, delay; and its verdicts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.model.surface import Surface
from scissorcal.tracking.clocks import DRIFT_LIMIT_PPM, ClockWatch
from scissorcal.tracking.follow import PoseFollower
from scissorcal.tracking.rows import CameraPose, TipContact
from scissorcal.tracking.settings import TrackingSettings
from scissorcal.tracking.tracker import Outcome, PoseTracker
from scissorcal.verdicts import Check, Verdict

REACH_S = 0.09
STEP_S = 0.03
KNOWN_S = 0.01
"""A delay counts as measured with at most this standard deviation."""
FEWEST = 20
"""Rows of a source from which on its delay, shares and means are judged."""
MOST_CONTACTS = 2000

_FINE_S = 8e-3
_SETTLED_S = 1.0
# The filter's model of motion is not quite the plate's: on 14 simulated plates errors were 1.23
# times what the curvature alone says (rms).
_WIDER = 1.3


@dataclass(frozen=True)
class DelayFit:
    """By how much pictures are later than was assumed (s), with standard deviation.

    ``known`` says whether the motion showed it; ``sentence`` says it for people.
    """

    later_s: float
    sd_s: float
    known: bool
    sentence: str


def measure_delay(
    surface: Surface,
    settings: TrackingSettings,
    pictures: Sequence[CameraPose],
    contacts: Sequence[TipContact],
) -> DelayFit:
    """Find the shift of the pictures' times at which pictures and contacts agree best.

    ``pictures`` and ``contacts`` are those that a `PoseFollower` was given, at the times that it
    took them for. Costs some seventeen replays of the last `MOST_CONTACTS` contacts, and of the
    pictures from the first to the last of them.
    """
    pictures, contacts = _last(pictures, contacts)
    if len(pictures) < FEWEST or len(contacts) < FEWEST:
        why = f"there were {len(pictures)} pictures and {len(contacts)} contacts"
        return _unknown(math.nan, math.inf, f"{why}, and {FEWEST} of each are needed")

    def cost(later: float) -> float:
        return _replay_cost(surface, settings, pictures, contacts, later)

    steps = np.arange(-REACH_S, REACH_S + 1e-9, STEP_S)
    coarse = [cost(step) for step in steps.tolist()]
    middle, bend = float(steps[int(np.argmin(coarse))]), 0.0
    for _ in range(2):
        at = middle + _FINE_S * np.arange(-2.0, 3.0)
        square, slope, _ = np.polyfit(at - middle, [cost(later) for later in at.tolist()], 2)
        bend = 2.0 * float(square)
        if not bend > 0.0:
            break
        middle += float(np.clip(-slope / bend, -STEP_S, STEP_S))
    sd = _WIDER * math.sqrt(2.0 / bend) if bend > 0.0 else math.inf
    if not sd <= KNOWN_S:
        known = f" (standard deviation {1e3 * sd:.0f} ms)" if math.isfinite(sd) else ""
        why = f"the plate hardly moved along the normal of a contact{known}"
        return _unknown(middle, sd, why)
    if abs(middle) > REACH_S:
        return _unknown(middle, sd, f"it is off by more than {1e3 * REACH_S:.0f} ms")
    way = "later" if middle >= 0.0 else "earlier"
    sentence = (
        f"Pictures were exposed {1e3 * abs(middle):.1f} +- {1e3 * sd:.1f} ms {way} than "
        "camera_delay_ms says, by what contacts show of the plate's motion."
    )
    return DelayFit(middle, sd, True, sentence)


def _replay_cost(
    surface: Surface,
    settings: TrackingSettings,
    pictures: Sequence[CameraPose],
    contacts: Sequence[TipContact],
    later_s: float = 0.0,
) -> float:
    """Sum of NIS over all rows in the order of their times, the pictures' shifted by ``later_s``.

    A refused row counts as one at the gate. The first second does not count, so that each shift
    has the same rows.
    """
    tracker = PoseTracker(surface, settings)
    rows: list[tuple[float, CameraPose | TipContact]] = [
        *(
            (picture.time_s + later_s, replace(picture, time_s=picture.time_s + later_s))
            for picture in pictures
        ),
        *((contact.time_s, contact) for contact in contacts),
    ]
    total, settled = 0.0, pictures[0].time_s + _SETTLED_S
    for _, row in sorted(rows, key=lambda row: row[0]):
        if isinstance(row, CameraPose):
            (outcome, nis), gate = tracker.picture(row), settings.camera.gate
        else:
            outcome, nis = tracker.contact(
                row.time_s, row.point_m, row.force_N, hidden_N=row.hidden_N
            )
            gate = settings.contact.gate
        time = row.time_s - (later_s if isinstance(row, CameraPose) else 0.0)
        if outcome in (Outcome.USED, Outcome.REFUSED) and time > settled:
            total += min(nis, gate)
    return total


def _last(
    pictures: Sequence[CameraPose], contacts: Sequence[TipContact]
) -> tuple[Sequence[CameraPose], Sequence[TipContact]]:
    """The newest contacts, and pictures from a second before the first of them to the last."""
    if not contacts:
        return pictures, contacts
    contacts = contacts[-MOST_CONTACTS:]
    since, until = contacts[0].time_s - _SETTLED_S, contacts[-1].time_s + REACH_S
    return [picture for picture in pictures if since <= picture.time_s <= until], contacts


def _unknown(later_s: float, sd_s: float, why: str) -> DelayFit:
    return DelayFit(later_s, sd_s, False, f"The camera's delay was not measured: {why}.")


NIS_RATIO = 2.0
"""Mean NIS over its degrees of freedom: above, errors are larger than they are said to be."""

_FREEDOM = {"picture": 6, "contact": 1}
TRACK = "the tracked pose and its stated uncertainty"
CLOCK_JUMPS = Check(
    "track clock jumps", f"{TRACK}: how often a clock of camera or rig jumped", at_most=0.0
)
REFUSED_PICTURES = Check(
    "track refused pictures", f"{TRACK}: share of pictures beyond the gate", at_most=0.1
)
REFUSED_CONTACTS = Check(
    "track refused contacts", f"{TRACK}: share of contacts beyond the gate", at_most=0.2
)
PICTURE_CONSISTENCY = Check(
    "track picture consistency", f"{TRACK}: mean NIS of pictures over its 6", at_most=NIS_RATIO
)
CONTACT_CONSISTENCY = Check(
    "track contact consistency", f"{TRACK}: mean NIS of contacts over its 1", at_most=NIS_RATIO
)


@dataclass(frozen=True)
class RowCounts:
    """Rows of one source: used (restarts among them), refused, too late, without a pose to start
    from; ``mean_nis`` over used and refused ones, of ``freedom`` degrees of freedom."""

    used: int
    refused: int
    late: int
    waiting: int
    mean_nis: float
    freedom: int

    @property
    def refused_share(self) -> float:
        """Of those that were judged."""
        judged = self.used + self.refused
        return self.refused / judged if judged else math.nan


@dataclass(frozen=True)
class ClockFigures:
    """A clock against the host's: drift with its standard deviation, how well times are known."""

    drift_ppm: float
    drift_sd_ppm: float
    sd_ms: float
    jumps: int
    sentence: str


@dataclass(frozen=True)
class TrackFigures:
    """A whole track in numbers. ``away_mm`` is by how much the last refused contact was outside of
    where the pressed surface was expected, ``away_sd_mm`` what was expected (NaN without one)."""

    pictures: RowCounts
    contacts: RowCounts
    restarts: int
    camera: ClockFigures | None
    rig: ClockFigures | None
    delay: DelayFit | None
    away_mm: float
    away_sd_mm: float


def track_figures(follower: PoseFollower, delay: DelayFit | None = None) -> TrackFigures:
    """Sum up what a follower was given and did."""
    away, sd = follower.away or (math.nan, math.nan)
    restarts = follower.tracker.estimate().counts.restarts if follower.tracker.started else 0
    return TrackFigures(
        pictures=_counts(follower, "picture"),
        contacts=_counts(follower, "contact"),
        restarts=restarts,
        camera=_clock(follower.camera),
        rig=_clock(follower.rig),
        delay=delay,
        away_mm=1e3 * away,
        away_sd_mm=1e3 * sd,
    )


def track_verdicts(figures: TrackFigures) -> tuple[Verdict, ...]:
    """Judge a track: clocks, refused pictures and contacts, consistency."""
    return (
        _judge_clocks(figures),
        _judge_pictures(figures.pictures),
        _judge_contacts(figures),
        _judge_nis(PICTURE_CONSISTENCY, figures.pictures, "plate.tracking's speeds and bias"),
        _judge_nis(CONTACT_CONSISTENCY, figures.contacts, "plate.tracking's contact errors"),
    )


def _judge_clocks(figures: TrackFigures) -> Verdict:
    clocks = [clock for clock in (figures.camera, figures.rig) if clock is not None]
    if not clocks:
        return CLOCK_JUMPS.not_evaluated("No clock was compared.")
    jumps = sum(clock.jumps for clock in clocks)
    said = " ".join(clock.sentence for clock in clocks)
    return CLOCK_JUMPS.judge(jumps, f"{said} {DRIFT_LIMIT_PPM:g} ppm are the limit.", said)


def _judge_pictures(counts: RowCounts) -> Verdict:
    if counts.used + counts.refused < FEWEST:
        why = f"{counts.used + counts.refused} pictures are too few to judge ({FEWEST})."
        return REFUSED_PICTURES.not_evaluated(why)
    why = f"{100 * counts.refused_share:.1f} % of the pictures were refused."
    remedy = (
        " Either the plate moves faster than plate.tracking says (speed_mm_per_s, "
        "turn_deg_per_s), or pictures show its mirrored pose: tilt it more, or move closer."
    )
    value = counts.refused_share
    return REFUSED_PICTURES.judge(value, why, why + remedy)


def _judge_contacts(figures: TrackFigures) -> Verdict:
    counts = figures.contacts
    if counts.used + counts.refused < FEWEST:
        why = f"{counts.used + counts.refused} contacts are too few to judge ({FEWEST})."
        return REFUSED_CONTACTS.not_evaluated(why)
    why = f"{100 * counts.refused_share:.1f} % of the contacts were refused"
    where = "."
    if math.isfinite(figures.away_mm):
        side = "outside of" if figures.away_mm > 0.0 else "inside of"
        where = (
            f": the last was {abs(figures.away_mm):.2g} mm {side} the surface, where "
            f"{figures.away_sd_mm:.2g} mm (sd) were expected."
        )
    remedy = (
        " Check plate.surface, the blade's length and edge, the fit of friction, and that it is "
        "the tip that touches."
    )
    value = counts.refused_share
    return REFUSED_CONTACTS.judge(value, why + where, why + where + remedy)


def _judge_nis(check: Check, counts: RowCounts, settings: str) -> Verdict:
    if counts.used + counts.refused < FEWEST:
        return check.not_evaluated(f"Fewer than {FEWEST} rows were judged.")
    ratio = counts.mean_nis / counts.freedom
    why = f"The mean NIS is {counts.mean_nis:.2g}, where {counts.freedom} are expected."
    remedy = f" The errors are larger than they are stated to be: widen {settings}."
    return check.judge(ratio, why, why + remedy)


def _counts(follower: PoseFollower, source: str) -> RowCounts:
    def count(*outcomes: Outcome) -> int:
        return sum(follower.outcomes[source, outcome] for outcome in outcomes)

    nis = follower.nis[source]
    return RowCounts(
        used=count(Outcome.USED, Outcome.RESTARTED),
        refused=count(Outcome.REFUSED),
        late=count(Outcome.TOO_LATE),
        waiting=count(Outcome.WAITING),
        mean_nis=float(np.mean(nis)) if nis else math.nan,
        freedom=_FREEDOM[source],
    )


def _clock(watch: ClockWatch | None) -> ClockFigures | None:
    if watch is None or not watch.known:
        return None
    fit = watch.fit
    newest = fit.own_s + 0.5 * fit.span_s
    return ClockFigures(
        drift_ppm=fit.drift_ppm,
        drift_sd_ppm=fit.drift_sd_ppm,
        sd_ms=1e3 * fit.sd_s(newest),
        jumps=len(watch.jumps),
        sentence=watch.sentence,
    )
