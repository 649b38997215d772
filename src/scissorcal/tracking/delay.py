"""The delay of a camera, from exposure to soonest arrival, by what contacts say of the motion.

Times of arrival cannot show it (`scissorcal.tracking.clocks`), and pictures alone cannot either: a
filter that is fed late pictures only is late by as much and consistent all the same. Contacts are
on time. Where the plate moves along the normal of a contact, pictures that are put at wrong times
disagree with them by velocity times delay, so the delay at which they agree best is the camera's:
the least sum of NIS over replays of the rows, which is twice a negative log-likelihood. A plate at
rest shows no delay, nor does one that moves along its own surface only.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.model.surface import Surface
from scissorcal.tracking.contacts import TipContact
from scissorcal.tracking.rows import CameraPose
from scissorcal.tracking.settings import TrackingSettings
from scissorcal.tracking.tracker import Outcome, PoseTracker

REACH_S = 0.09
STEP_S = 0.03
KNOWN_S = 0.01
"""A delay counts as measured with at most this standard deviation."""
FEWEST = 20
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
        return replay_cost(surface, settings, pictures, contacts, later)

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


def replay_cost(
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
