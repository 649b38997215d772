"""What would bring the felt torque of a rendering within its scene's tolerance."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from scissorcal.kernel import ModelTables, Piece
from scissorcal.render.admission_rule import (
    COUNTS_NEAR_REST,
    MARGIN,
    OSCILLATION_RATE,
    RATE_CUTOFF_HZ,
    LoopFacts,
    allowed_stiffness,
    damping_share,
    delayed_stiffness,
    dissipation,
    friction_width,
)
from scissorcal.render.derating import Needs, derate, limited, needs_of, stiffness_on
from scissorcal.render.felt_cost import FeltTorque, felt_rates

DIGITS = 2
NEARLY = 1.0 - 1e-9


def stated_cures(facts: LoopFacts, hand: float, rate: float, wanted: float) -> tuple[str, ...]:
    """Sentences of which each cures by itself: with it, ``wanted`` N m/rad are stable in a hand.

    What does so only together with another is joined with it. Figures are rounded to the safe side.
    """
    resting = _for_rest(facts, wanted)
    if not resting:
        return tuple(f"{words}." for words in _for_delay(facts, hand, rate, wanted))
    cures = []
    for words, better in resting:
        if allowed_stiffness(better, hand, rate) >= NEARLY * wanted:
            cures.append(f"{words}.")
            continue
        others = _for_delay(better, hand, rate, wanted)
        cures += [f"{words}, and together with it {_lowered(other)}." for other in others]
    return tuple(cures)


def _for_rest(facts: LoopFacts, wanted: float) -> list[tuple[str, LoopFacts]]:
    """What holds blades at rest between two counts; empty where they hold."""
    if 2.0 * facts.coulomb_Nm / facts.encoder_step_rad >= wanted:
        return []
    dry = _rounded(0.5 * wanted * facts.encoder_step_rad, up=True)
    found = [
        (
            f"Dry friction of {dry * 1e3:.{DIGITS}g} mN m (now {facts.coulomb_Nm * 1e3:.2g}), for "
            "this encoder",
            replace(facts, coulomb_Nm=dry),
        )
    ]
    step = _rounded(2.0 * facts.coulomb_Nm / wanted, up=False)
    if step > 0.0:
        now = facts.encoder_step_rad
        words = f"An encoder step of {step:.{DIGITS}g} rad (now {now:.{DIGITS}g})"
        found.append((words, replace(facts, encoder_step_rad=step)))
    return found


def _for_delay(facts: LoopFacts, hand: float, rate: float, wanted: float) -> list[str]:
    """What keeps a late spring from oscillating; empty where it does not."""
    if delayed_stiffness(facts, hand, rate) >= NEARLY * wanted:
        return []
    taken = dissipation(facts, hand, rate)
    delay = _rounded(MARGIN * taken / wanted, up=False)
    more = _rounded(wanted * facts.delay_s / MARGIN - taken, up=True)
    found = []
    if delay > 0.0:
        tick = "" if 2.0 * delay > facts.tick_s else f", with a tick below {2e3 * delay:.2g} ms"
        found.append(
            f"A delay of {delay * 1e3:.{DIGITS}g} ms, half a tick included (now "
            f"{facts.delay_s * 1e3:.2g} ms){tick}"
        )
    found.append(f"{more * 1e3:.{DIGITS}g} mN m s/rad more damping, of the rig or of the hand")
    return found


def _rounded(value: float, up: bool) -> float:
    """The nearest number of two digits that is not below (``up``) or not above ``value``.

    >>> _rounded(0.01234, up=True), _rounded(0.01234, up=False)
    (0.013, 0.012)
    """
    if not value > 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(value)) + 1 - DIGITS)
    count = value / unit
    return float(f"{unit * (math.ceil(count) if up else math.floor(count)):.{DIGITS}g}")


def _lowered(words: str) -> str:
    return words[0].lower() + words[1:]


HALVINGS = 5
"""Of a range in which a cure is sought: to 3 % of it, and what is found is enough."""

SHARES = (0.1, 0.2, 0.3, 0.4, 0.5)
"""Of a scene's openings or contacts, without which it is tried."""


@dataclass(frozen=True)
class Asked:
    """What a scene asks of a rendering.

    ``limit_Nm`` is the torque limit, ``slowest`` and ``fastest`` the scene's rates (rad/s),
    ``tolerance`` that of its torque, as a share, ``hand_damping`` what a hand adds (N m s/rad).
    """

    limit_Nm: float
    slowest: float
    fastest: float
    tolerance: float
    hand_damping: float


def felt_cures(
    tables: ModelTables,
    facts: LoopFacts,
    asked: Asked,
    needs: Needs,
    pieces: Sequence[Piece] = (),
) -> tuple[str, ...]:
    """Sentences of which each by itself would bring the felt torque within the tolerance.

    Encoder, delay and damping by the least stiffness that has to be allowed; a softer scene, of a
    uniform sheet, by trying narrower ones.
    """
    sought = _Sought(tables, facts, asked, needs, pieces)
    scenes = () if pieces else _softer_scenes(tables, facts, asked)
    return (*sought.by_response(), *scenes)


class _Sought:
    """What has to be allowed for a felt torque within the tolerance."""

    def __init__(
        self,
        tables: ModelTables,
        facts: LoopFacts,
        asked: Asked,
        needs: Needs,
        pieces: Sequence[Piece],
    ) -> None:
        self.tables, self.facts, self.asked, self.needs = tables, facts, asked, needs
        self.pieces = pieces
        self.share = damping_share(needs.damper, facts)
        rates = felt_rates(tables, asked.slowest, asked.fastest)
        self._torque = FeltTorque(tables, asked.limit_Nm, rates, pieces)

    def by_response(self) -> tuple[str, ...]:
        """The softest response that is enough; else what friction near rest and damping need."""
        width = friction_width(self.needs.friction_Nm, self.facts, self.needs.stiffness)
        if self._is_enough(None, width):
            steepest = float(self.tables.response.slope.max())
            return self._allowing(self._stiffness(_least(self._by_slope, steepest)))
        if self._is_enough(None, 0.0):
            return self._by_width(width)
        if self.share < 1.0:
            whole = self._allowing(self.needs.stiffness)
            words = _damper_cure(self.facts, self.needs)
            both = [f"{cure.removesuffix('.')}, and with it {words}." for cure in whole]
            return tuple(both) or (f"{words[0].upper()}{words[1:]}.",)
        return ()

    def _by_slope(self, slope: float) -> bool:
        """Whether a response limited to a slope is enough, where its stiffness is allowed."""
        if not slope > 0.0:
            return False
        allowed = self._stiffness(slope)
        return self._is_enough(slope, friction_width(self.needs.friction_Nm, self.facts, allowed))

    def _by_width(self, most: float) -> tuple[str, ...]:
        """Friction near rest has to build up over less than the whole response asks for."""
        narrow = most - _least(lambda less: self._is_enough(None, most - less), most)
        if not narrow > 0.0:
            return ()
        finest = narrow / COUNTS_NEAR_REST
        wanted = max(self.needs.stiffness, self.needs.friction_Nm / narrow)
        if self.facts.encoder_step_rad <= finest:
            return self._allowing(wanted)
        finer = f"An encoder step of {finest:.2g} rad (now {self.facts.encoder_step_rad:.2g})"
        facts = replace(self.facts, encoder_step_rad=finest)
        others = self._allowing(wanted, facts)
        joined = tuple(f"{finer}, and with it {cure[0].lower()}{cure[1:]}" for cure in others)
        return joined or (f"{finer}.",)

    def _is_enough(self, steepest: float | None, width: float) -> bool:
        rendered = limited(self.tables, steepest, self.share)
        return self._torque.change(rendered, width) <= self.asked.tolerance

    def _stiffness(self, steepest: float) -> float:
        soft = limited(self.tables, steepest)
        return stiffness_on(soft, self.asked.limit_Nm, self.pieces)

    def _allowing(self, wanted: float, facts: LoopFacts | None = None) -> tuple[str, ...]:
        rate = max(self.asked.fastest, OSCILLATION_RATE)
        return stated_cures(facts or self.facts, self.asked.hand_damping, rate, wanted)


def _damper_cure(facts: LoopFacts, needs: Needs) -> str:
    """What lets the material's damping be rendered in full."""
    late = MARGIN * facts.inertia_kg_m2 / needs.damper - 1.0 / (2.0 * math.pi * RATE_CUTOFF_HZ)
    if late > 0.0:
        return f"a delay of {late * 1e3:.2g} ms for the material's damping"
    return "a material whose force grows less with the rate"


def _least(is_enough: Callable[[float], bool], most: float) -> float:
    """About the least number up to ``most`` that is enough, as ``most`` is."""
    low, high = 0.0, most
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if is_enough(middle) else (middle, high)
    return high


def _softer_scenes(tables: ModelTables, facts: LoopFacts, asked: Asked) -> tuple[str, ...]:
    """Narrower scenes that are within the tolerance: from a wider opening on, up to a contact."""
    found = []
    low, far = tables.opening_min, tables.contact_max
    span, reach = tables.opening_max - low, far - tables.contact_min

    def opened(share: float) -> bool:
        return _is_within(replace(tables, opening_min=low + share * span), facts, asked)

    def nearer(share: float) -> bool:
        return _is_within(replace(tables, contact_max=far - share * reach), facts, asked)

    share = _first(opened)
    if share is not None:
        from_deg = math.ceil(math.degrees(low + share * span))
        found.append(
            f"A softer scene: openings from {from_deg} deg on (scene.opening_deg, now "
            f"{math.degrees(low):.0f})."
        )
    share = _first(nearer)
    if share is not None:
        to_mm = math.floor(1e3 * (far - share * reach))
        found.append(
            f"A softer scene: contacts up to {to_mm} mm (scene.contact_mm, now {far * 1e3:.0f})."
        )
    return tuple(found)


def _first(is_enough: Callable[[float], bool]) -> float | None:
    """About the least share of a scene without which it is soft enough; None up to half of it."""
    found = next((share for share in SHARES if is_enough(share)), None)
    if found is None:
        return None
    before = found - SHARES[0]
    return before + _least(lambda more: is_enough(before + more), SHARES[0])


def _is_within(tables: ModelTables, facts: LoopFacts, asked: Asked) -> bool:
    """Whether a uniform sheet in this scene is felt within the tolerance on the rig."""
    rate = max(asked.fastest, OSCILLATION_RATE)
    held = allowed_stiffness(facts, asked.hand_damping, rate)
    needs = needs_of(tables, asked.limit_Nm)
    derated = derate(tables, needs.stiffness, held, asked.limit_Nm)
    if derated.is_refused(needs.stiffness, held):
        return False
    share = damping_share(needs.damper, facts)
    rendered = limited(tables, derated.steepest_N_per_m, share)
    width = friction_width(needs.friction_Nm, facts, held)
    rates = felt_rates(tables, asked.slowest, asked.fastest)
    return FeltTorque(tables, asked.limit_Nm, rates).change(rendered, width) <= asked.tolerance
