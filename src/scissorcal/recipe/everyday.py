"""The everyday range of each quantity: what rigs, materials and hands of this kind usually have.

The one home of these ranges. A recipe's numbers are held against them
(:mod:`scissorcal.recipe.unlikely`), and ``benchmarks/extremes`` calls a state everyday by them. All
are in SI units and radians; a share is a number between 0 and 1.
"""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Everyday:
    """One range, from ``low`` to ``high``, and ``why``: what has such values.

    ``least`` is the smallest magnitude that is usual, where the range reaches or crosses 0.
    """

    low: float
    high: float
    why: str
    least: float = 0.0

    @property
    def ends(self) -> tuple[float, float]:
        """Both ends, as they were stated."""
        return self.low, self.high

    @property
    def magnitudes(self) -> tuple[float, float]:
        """Smallest and largest usual magnitude; the first is 0 where none is stated.

        >>> EVERYDAY["edge_offset"].magnitudes
        (0.001, 0.01)
        """
        return self.least or max(self.low, 0.0), max(-self.low, self.high)


EVERYDAY: Mapping[str, Everyday] = {
    "opening": Everyday(0.2, 0.9, "scissors cut at 12 to 50 deg between the blades"),
    "opening_rate": Everyday(-2.0, 2.0, "a hand closes scissors in 0.5 to 2 s", 0.5),
    "contact": Everyday(0.2, 0.8, "shares of the blade's length"),
    "contact_place": Everyday(0.01, 0.096, "0.2 to 0.8 of blades of 50 to 120 mm"),
    "indentation": Everyday(1e-6, 5e-4, "an edge sinks in by less than the plate's thickness"),
    "reference_indentation": Everyday(
        5e-5, 1e-3, "within what an edge reaches before it cuts, or presses"
    ),
    "thickness": Everyday(5e-5, 2e-3, "paper, cloth, film, board, leather"),
    "force": Everyday(0.5, 20.0, "sheets at an indentation of 0.3 mm"),
    "exponent": Everyday(1.0, 2.5, "1 is a spring, 1.5 a round contact, 2 a wedge"),
    "toughness": Everyday(1e3, 2e4, "paper, cloth, plastic films"),
    "kappa": Everyday(0.5, 1.0, "1 is smooth, cracks that jump stop at half or more"),
    "edge_offset": Everyday(-0.01, 0.0, "edges lie beside the pivot by millimetres", 1e-3),
    "taper": Everyday(-0.05, 0.1, "blades taper by a few degrees"),
    "curvature": Everyday(-2.0, 2.0, "arcs of a radius of 0.5 m and more"),
    "nick": Everyday(0.0, 1e-5, "a worn edge"),
    "rate_damping": Everyday(0.0, 10.0, "stiffer by a tenth or two at 20 mm/s", 0.1),
    "blade_length": Everyday(0.05, 0.12, "office, household and cloth scissors"),
    "handle_radius": Everyday(0.03, 0.12, "from the pivot to the fingers"),
    "hand_damping": Everyday(1.0, 20.0, "an arm showed 6.5 N s/m, doi:10.1038/srep18004"),
    "sheet_length": Everyday(0.05, 1.0, "from a card to a roll's end"),
    "plate_place": Everyday(0.005, 0.15, "a pattern lies on its plate"),
    "touch_stiffness": Everyday(500.0, 5e4, "a soft plate to a blade's own bending"),
    "time_step": Everyday(2.5e-4, 2e-3, "loops of 500 to 4000 Hz"),
    "loop_rate": Everyday(500.0, 4000.0, "loops of haptic devices"),
    "tolerance": Everyday(0.02, 0.15, "people just notice about 7 % of a force"),
    "cutoff": Everyday(10.0, 500.0, "above a hand's motion, below the loop's rate"),
    "between_recordings": Everyday(0.005, 0.1, "two recordings of one rig differ by 2 %"),
    "torque_limit": Everyday(0.1, 5.0, "small motors"),
    "torque_slew": Everyday(10.0, 2000.0, "the limit of torque within 5 to 10 ms"),
    "force_limit": Everyday(3.0, 100.0, "what fingers hold"),
    "force_slew": Everyday(500.0, 5e4, "the limit of force within 5 to 10 ms"),
    "engagement_ramp": Everyday(0.05, 5.0, "a force that comes on as one expects it"),
    "held_at_limit": Everyday(0.2, 20.0, "longer than a stroke's peak"),
    "sliding_speed": Everyday(0.01, 0.3, "a sledge moves by its travel in a second or more"),
    "travel": Everyday(0.01, 0.3, "the stops of a sledge"),
    "probe_angle": Everyday(0.0175, 0.26, "1 to 15 deg, so that nothing is hit"),
    "toughness_length": Everyday(3e-4, 0.01, "fibres and threads"),
    "inertia": Everyday(1e-5, 1e-3, "blades and handles about the pivot"),
    "table_size": Everyday(33, 128, "knots"),
    "rotation": Everyday(0.0, 1.0, "a plate before a camera"),
    "tilt": Everyday(0.3, 1.0, "a plate seen from the side by 17 to 57 deg"),
    "samples": Everyday(1e3, 1e6, "seconds to minutes at 1 kHz"),
    "scale": Everyday(1e-3, 1e3, "units with the prefixes milli to kilo"),
    "outlier": Everyday(0.0, 5.0, "normal noise"),
}
