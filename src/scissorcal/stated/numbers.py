"""What a person may state in place of fits: a material, blades, friction."""

from dataclasses import dataclass
from typing import Any

from scissorcal.errors import InputError
from scissorcal.model import ResponseLaw, as_pair, as_share, law_parameters

Number = float | tuple[float, float]
"""A number, or a number and its standard deviation."""


@dataclass(frozen=True)
class Material:
    """A plate that is cut, or pressed where ``toughness_J_per_m2`` is None.

    The force at the edge is ``force_N`` at ``reference_mm`` of indentation and grows with the power
    ``exponent``; or it is that of a ``law`` of one's own over the indentations ``depths_mm``.
    ``kappa`` is the share of the fracture energy at which a running crack stops; without it cracks
    run evenly. Each number may be a pair of value and standard deviation: a package's band holds
    what is stated, and no more.

    >>> Material(force_N=(2.0, 0.1), exponent=1.4, toughness_J_per_m2=4000.0).stated
    {'force_N': (2.0, 0.1), 'exponent': (1.4, 0.0)}
    """

    force_N: Number | None = None
    exponent: Number | None = None
    toughness_J_per_m2: Number | None = None
    kappa: Number | None = None
    thickness_mm: float = 0.1
    reference_mm: float = 0.15
    law: ResponseLaw | None = None
    depths_mm: tuple[float, float] = (0.005, 1.0)
    name: str = "stated material"

    def __post_init__(self) -> None:
        """Refuse what is neither a power law nor a law of one's own."""
        power = (self.force_N is not None, self.exponent is not None)
        if self.law is None and not all(power):
            raise InputError("A Material needs force_N and exponent, or a law: give them.")
        if self.law is not None and any(power):
            raise InputError("A Material with a law takes its force from it: leave out force_N.")
        low, high = self.depths_mm
        if not 0.0 < low < high:
            raise InputError(f"Material.depths_mm = {self.depths_mm} must be (low, high) above 0.")
        if self.toughness_J_per_m2 is not None:
            as_pair("Material.toughness_J_per_m2", self.toughness_J_per_m2)
        if self.kappa is not None:
            self._check_kappa(self.kappa)
        _ = self.stated

    def _check_kappa(self, kappa: Number) -> None:
        if self.toughness_J_per_m2 is None:
            raise InputError("Material.kappa needs toughness_J_per_m2: nothing cracks without it.")
        if as_pair("Material.kappa", kappa)[0] == 1.0:
            raise InputError("Material.kappa = 1 is a crack without jumps: leave kappa out for it.")
        as_share("Material.kappa", kappa)

    @property
    def stated(self) -> dict[str, tuple[float, float]]:
        """Parameters of the force: value and standard deviation by name."""
        if self.law is not None:
            return law_parameters(self.law)
        given = {"force_N": self.force_N, "exponent": self.exponent}
        return {name: as_pair(f"Material.{name}", value) for name, value in given.items()}  # type: ignore[arg-type]


@dataclass(frozen=True)
class Blades:
    """Two equal blades with straight edges, or arcs with ``curvature_per_m``.

    The edge of a blade lies ``offset_mm`` beside the line from the pivot to the tip at the pivot,
    turned by ``taper_deg`` against it. ``moving`` is "both" or "upper".
    """

    length_mm: float = 75.0
    offset_mm: float = -8.0
    taper_deg: float = 2.0
    curvature_per_m: float = 0.0
    moving: str = "both"
    handle_radius_mm: float = 60.0

    @property
    def rig(self) -> dict[str, Any]:
        """The table ``rig`` of a recipe."""
        edge: dict[str, Any] = {
            "family": "arc" if self.curvature_per_m else "line",
            "offset_mm": float(self.offset_mm),
            "taper_deg": float(self.taper_deg),
            "length_mm": float(self.length_mm),
        }
        if self.curvature_per_m:
            edge["curvature_per_m"] = float(self.curvature_per_m)
        return {
            "moving": self.moving,
            "handle_radius_mm": float(self.handle_radius_mm),
            "edge": edge,
        }


@dataclass(frozen=True)
class Friction:
    """Friction of the pivot: Coulomb, viscous, and what static friction has above Coulomb.

    Static friction falls towards Coulomb's over the speed ``stribeck_rad_per_s``.

    >>> Friction(coulomb_Nm=(0.02, 0.002)).stated
    {'coulomb': (0.02, 0.002)}
    """

    coulomb_Nm: Number
    viscous_Nm_s_per_rad: Number | None = None
    stribeck_Nm: Number | None = None
    stribeck_rad_per_s: Number = 0.1

    def __post_init__(self) -> None:
        """Refuse numbers that are none."""
        _ = self.stated

    @property
    def stated(self) -> dict[str, tuple[float, float]]:
        """Parameters of the law by the model's names: value and standard deviation."""
        given = {
            "coulomb": ("coulomb_Nm", self.coulomb_Nm),
            "viscous": ("viscous_Nm_s_per_rad", self.viscous_Nm_s_per_rad),
            "stribeck": ("stribeck_Nm", self.stribeck_Nm),
        }
        if self.stribeck_Nm is not None:
            given["stribeck_rate"] = ("stribeck_rad_per_s", self.stribeck_rad_per_s)
        return {
            name: as_pair(f"Friction.{key}", value)
            for name, (key, value) in given.items()
            if value is not None
        }
