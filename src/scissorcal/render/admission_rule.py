"""The stiffest spring that a sampled loop renders stably, from what is known of rig and loop.

    K <= 1/2 (b + B + 4 f_c / (pi v)) / (T / 2 + t_late),    K <= 2 f_c / q

b: viscous damping of the rig, B: of the hand, f_c: dry friction, T: tick, t_late: from the device's
sample to the torque that answers it, q: step of the encoder. Without friction the first line, less
its factor 1/2, is the linear boundary of Hulin, Albu-Schaeffer and Hirzinger
(doi:10.1109/TCST.2013.2283372): a held, late spring does the work K (T/2 + t_late) omega^2 on the
blades each second, and damping takes b omega^2. Dry friction takes, over an oscillation whose rate
has the amplitude v, what a damper of 4 f_c / (pi v) takes. The second line keeps a blade at rest
between two counts of the encoder (Diolaiti et al., doi:10.1109/TRO.2005.862487). The factor 1/2 is
the margin; `benchmarks/stability.py` simulates such loops and counts where the rule fails.
"""

import math
from dataclasses import dataclass

MARGIN = 0.5
RATE_CUTOFF_HZ = 100.0
"""Low-pass of the rate by which damping is rendered."""
COUNTS_NEAR_REST = 4
"""Rendered friction builds up over at least so many counts: one count moves it by a quarter."""
OSCILLATION_RATE = 1.5
"""rad/s: amplitude of the rate up to which friction must stop an oscillation; a scene with faster
motion raises it."""


@dataclass(frozen=True)
class LoopFacts:
    """What of rig and loop decides about stability, in SI units and radians.

    ``late_s``: device's sample to the middle of the motor's answer, without the half tick by which
    a held torque is late. ``coulomb_Nm``: dry friction that surely acts, the lower of the two
    directions. ``sources`` say, by field, where a value comes from.
    """

    tick_s: float
    late_s: float
    inertia_kg_m2: float
    damping_Nm_s_per_rad: float
    coulomb_Nm: float
    encoder_step_rad: float

    @property
    def delay_s(self) -> float:
        """By how much the torque lags the blades on average, s."""
        return 0.5 * self.tick_s + self.late_s


def dissipation(facts: LoopFacts, hand: float = 0.0, rate: float = OSCILLATION_RATE) -> float:
    """Damping that acts on an oscillation of amplitude ``rate`` (rad/s), in N m s/rad."""
    return facts.damping_Nm_s_per_rad + hand + 4.0 * facts.coulomb_Nm / (math.pi * rate)


def allowed_stiffness(facts: LoopFacts, hand: float = 0.0, rate: float = OSCILLATION_RATE) -> float:
    """Largest stiffness in N m/rad that is rendered without oscillation.

    ``hand`` is the damping that a hand adds (N m s/rad), ``rate`` the amplitude of the blades' rate
    (rad/s) up to which oscillations must die.

    >>> facts = LoopFacts(1e-3, 1.5e-3, 2.1e-4, 0.002, 0.013, 6.28 / 131072)
    >>> round(allowed_stiffness(facts), 2), round(allowed_stiffness(facts, hand=0.02), 2)
    (3.26, 8.26)
    """
    resting = 2.0 * facts.coulomb_Nm / facts.encoder_step_rad
    return min(delayed_stiffness(facts, hand, rate), resting)


def delayed_stiffness(facts: LoopFacts, hand: float = 0.0, rate: float = OSCILLATION_RATE) -> float:
    """The delay's part of the rule alone, N m/rad: as with an encoder of infinite resolution."""
    return MARGIN * dissipation(facts, hand, rate) / facts.delay_s


def allowed_damper(facts: LoopFacts) -> float:
    """Largest damping in N m s/rad that is rendered from the estimated rate.

    With inertia I alone, damping that is late by t oscillates from B t / I = pi / 2 on; t is the
    loop's delay and the estimator's 1 / (2 pi f). Allowed is MARGIN I / t, a third of that.
    """
    late = facts.delay_s + 1.0 / (2.0 * math.pi * RATE_CUTOFF_HZ)
    return MARGIN * facts.inertia_kg_m2 / late


def damping_share(damper: float, facts: LoopFacts) -> float:
    """How much of a material's damping (N m s/rad) is rendered."""
    return min(1.0, allowed_damper(facts) / damper) if damper > 0.0 else 1.0


def friction_width(level: float, facts: LoopFacts, allowed: float) -> float:
    """Opening (rad) over which rendered friction of a level (N m) builds up after a reversal.

    Some counts of the encoder, and no stiffer than ``allowed`` (N m/rad).
    """
    return max(COUNTS_NEAR_REST * facts.encoder_step_rad, level / allowed) if level > 0.0 else 0.0
