"""What a capture until the scene's tolerance writes into its recording, stroke by stroke."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

UNTIL_MARK = "until tolerance"
"""Name of the mark; the last one of a recording says how its capture ended."""

REACHED = "tolerance"


@dataclass(frozen=True)
class UntilMark:
    """How far a capture was from the scene's tolerance after so many strokes.

    ``ended`` is "tolerance" (it is reached), "time" (the minutes allowed are used up), "out of
    reach" (further strokes are not expected to reach it), "no fit" (the last strokes cannot be
    fitted, and no stroke is expected to help), or empty: the capture went on, or was interrupted.
    ``minutes`` are those planned so far, not measured: of motion, of the least pauses for the fit,
    and of what the recipe gives a person; ``minutes_left`` those expected still, None where nothing
    is known. ``within`` is the share of the places that can be felt whose
    band is within ``tolerance`` at ``confidence``, ``needed`` the share that counts as reached;
    ``typical`` is half of the band at the median place as a share of the torque. Both are None
    before the first fit. ``friction_alone``: the band is of friction only, which may take half of
    the tolerance. ``why`` says what bounds the band where the tolerance was not reached.
    """

    ended: str
    strokes: int
    pieces: int
    minutes: float
    minutes_left: float | None
    within: float | None
    typical: float | None
    tolerance: float
    confidence: float
    needed: float = 0.95
    friction_alone: bool = False
    why: str = ""

    @property
    def reached(self) -> bool:
        """Whether the capture ended because the tolerance was reached."""
        return self.ended == REACHED

    @property
    def sentence(self) -> str:
        """How far it is, in one line.

        >>> UntilMark("", 5, 2, 1.6, 0.8, 0.83, 0.041, 0.07, 0.95).sentence.partition(" (")[0]
        '5 strokes, 1.6 planned min: band within 7 % at 83 % of felt places'
        """
        band = "no fit yet"
        if self.within is not None and self.typical is not None:
            whose = "friction alone, counted twice, " if self.friction_alone else "band "
            band = (
                f"{whose}within {100 * self.tolerance:g} % at {100 * self.within:.0f} % of felt "
                f"places (median {100 * self.typical:.1f} %)"
            )
        head = f"{self.strokes} strokes, {self.minutes:.1f} planned min: {band}"
        if self.reached:
            return f"{head}; tolerance reached at {100 * self.confidence:g} % confidence"
        if self.ended:
            return f"{head}; tolerance not reached. {self.why}"
        if self.minutes_left is None:
            return head
        return f"{head}; about {self.minutes_left:.1f} min left"

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)

    def as_text(self) -> str:
        """As a mark holds it."""
        return json.dumps(self.as_dict())

    @classmethod
    def last_of(cls, marks: Sequence[tuple[str, str]]) -> "UntilMark | None":
        """The last one among a recording's marks; None where the capture followed a list."""
        texts = [value for name, value in marks if name == UNTIL_MARK]
        if not texts:
            return None
        return cls.of(json.loads(texts[-1]))

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> "UntilMark":
        """From plain values; names that this version does not know are passed over."""
        known = {field.name for field in fields(cls)}
        return cls(**{name: value for name, value in plain.items() if name in known})
