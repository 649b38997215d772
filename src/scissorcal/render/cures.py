"""What would let a rig render a package as stiff as it is: encoder, delay, damping."""

import math
from dataclasses import replace

from scissorcal.render.admission_rule import (
    MARGIN,
    LoopFacts,
    allowed_stiffness,
    delayed_stiffness,
    dissipation,
)

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
