"""What an admission says: what is needed and allowed, what is taken back, what it costs."""

import math
from collections.abc import Sequence

from scissorcal.render.admission_rule import LoopFacts
from scissorcal.render.derating import LEAST_FACTOR, Needs


def need_sentences(
    needs: Needs, facts: LoopFacts, allowed: tuple[float, float], *, is_drawn: bool
) -> tuple[str, ...]:
    """What the package needs, and what the rig renders alone and in a hand."""
    place = f"{math.degrees(needs.opening):.0f} deg, contact {needs.contact * 1e3:.0f} mm"
    known = f"at {place}"
    if is_drawn:
        known += f"; a bound over the scene's openings, {needs.found:.3g} are found in strokes"
    return (
        f"The package needs up to {needs.stiffness:.3g} N m/rad ({known}); this rig renders "
        f"{allowed[0]:.2g} N m/rad stably alone and {allowed[1]:.2g} N m/rad in a hand, at "
        f"{facts.delay_s * 1e3:.2g} ms of delay.",
    )


def cost_sentences(
    needs: Needs, left: float, felt: Sequence[float], *, is_drawn: bool
) -> tuple[str, ...]:
    """What derating costs; nothing where all is rendered.

    ``felt`` are the changes of felt torque, of what is cut first and of the uniform sheet last.
    """
    if left == needs.stiffness:
        return ()
    begun = f"The steepest elastic slope is rendered at {left / needs.stiffness:.0%}, which changes"
    kept = "the fracture energy is unchanged."
    if not is_drawn:
        said = f"the felt torque of strokes through the uniform sheet by {felt[0]:.1%}"
        return (f"{begun} {said}; {kept}",)
    return (
        f"{begun} the felt torque of strokes through the drawn plate by {felt[0]:.1%}, of those "
        f"through a uniform sheet by {felt[-1]:.1%}: ends of pieces and of stretches of another "
        f"toughness are felt at smaller openings; {kept}",
    )


def damping_sentences(needs: Needs, share: float) -> tuple[str, ...]:
    """How much of the material's damping is rendered; nothing where all is."""
    if share == 1.0:
        return ()
    return (
        f"The material's damping of up to {needs.damper * 1e3:.2g} mN m s/rad is rendered at "
        f"{share:.0%}, as the rate is known too late for more.",
    )


def too_stiff(needs: Needs, held: float, cures: Sequence[str]) -> str:
    """The refusal of what even the softest response does not make stable."""
    return (
        f"This rig cannot render the package stably: {needs.stiffness:.3g} N m/rad are needed "
        f"and {held:.2g} N m/rad allowed in a hand, which would leave less than "
        f"{LEAST_FACTOR:.0%} of the elastic slope. What would cure it: {' '.join(cures)}"
    )


def nothing_allowed(facts: LoopFacts, cures: Sequence[str]) -> str:
    """The refusal where no dry friction is known for sure."""
    known = f"known to be at least {facts.coulomb_Nm * 1e3:.2g} mN m"
    again = "Capture friction again, for longer, so that its lower end is above 0. "
    return (
        f"This rig cannot render the package stably: its dry friction is {known}, and without any "
        "the blades find no rest between two counts of the encoder, however soft the material. "
        f"What would cure it: {again}{' '.join(cures)}"
    ).rstrip()
