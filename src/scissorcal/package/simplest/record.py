"""What a package states about the laws that were left out as the scene does not need them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from scissorcal.package.records import NonNegative, Section

Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
Name = Annotated[str, Field(max_length=100)]
AspectName = Literal["friction", "fracture", "edge", "damping", "response", "closure"]
Verdict = Literal["enough", "not enough", "not cheaper"]


class Cost(Section):
    """How far the torque of a simpler law is from that of the fit, over the scene.

    ``worst_share`` is the largest difference as a share of the local torque where it can be felt,
    ``rms_share`` its root mean square, ``worst_Nm`` the largest in N m: each is not exceeded with
    the scene's confidence over the posterior draws, or stands for the MAP point alone where
    ``probability``, the share of the draws that are within the tolerance, is null.
    """

    worst_share: NonNegative
    rms_share: NonNegative
    worst_Nm: NonNegative
    probability: Share | None

    @property
    def words(self) -> str:
        """The cost in a few words, with its number first.

        >>> Cost(worst_share=0.021, rms_share=0.004, worst_Nm=1.3e-3, probability=0.99).words
        '2.1 % worst, 0.4 % rms (1.3 mN m)'
        """
        worst, rms, torque = (
            _two_digits(value)
            for value in (100 * self.worst_share, 100 * self.rms_share, 1e3 * self.worst_Nm)
        )
        return f"{worst} % worst, {rms} % rms ({torque} mN m)"


def _two_digits(value: float) -> str:
    return f"{value:.0f}" if value >= 99.5 else f"{value:.2g}"


class TriedCandidate(Section):
    """A candidate as it was judged, together with what was left out before it."""

    name: Name
    verdict: Verdict
    cost: Cost


class AspectRecord(Section):
    """One aspect of the law: what the data support, what the scene needs, and what was tried.

    ``fitted`` is the candidate of the fit, ``used`` that of the package. Where they differ,
    ``alone`` is the cost of this omission by itself and ``saved_bytes`` what it saves in the
    package's tables and draws.
    """

    aspect: AspectName
    fitted: Name
    used: Name
    tried: Annotated[tuple[TriedCandidate, ...], Field(max_length=32)] = ()
    alone: Cost | None = None
    saved_bytes: int = 0

    @property
    def omitted(self) -> bool:
        """Whether the package has a simpler candidate than the fit."""
        return self.used != self.fitted


class RigFriction(Section):
    """Friction of the rig itself, as fitted: the check before a rendering needs it.

    ``levels`` are the 5 % quantiles of the friction fit's Coulomb and viscous parameters by name,
    ``inertia_kg_m2`` the median of its inertia, ``least_factor`` the least factor of friction over
    the scene's openings. A package that renders a simpler friction, or none, still runs on a rig
    that has this one.
    """

    levels: dict[str, NonNegative]
    inertia_kg_m2: NonNegative
    least_factor: NonNegative


class Simplification(Section):
    """The walk from the cheapest candidate of each aspect to the one that the scene needs.

    ``asked`` is ``scene.simplify``; without it nothing is tried. The scene's ``tolerance`` is
    shared: ``allowed_share`` for everything that is left out together, ``tables_share`` for the
    tables, the rest for the posterior. ``joint`` is the cost of all omissions together.
    ``within_before`` and ``within_after`` are the shares of the places that can be felt at which
    band, tables and omissions add up to no more than the tolerance. ``bytes_before`` and
    ``bytes_after`` are those of tables and draws as a package of the fitted law would store them,
    and as this one does.
    """

    asked: bool
    tolerance: Share
    confidence: Share
    allowed_share: NonNegative
    tables_share: NonNegative
    draws: Annotated[int, Field(ge=0)]
    places: Annotated[int, Field(ge=0)]
    aspects: Annotated[tuple[AspectRecord, ...], Field(max_length=8)]
    joint: Cost | None = None
    within_before: Share | None = None
    within_after: Share | None = None
    bytes_before: Annotated[int, Field(ge=0)]
    bytes_after: Annotated[int, Field(ge=0)]
    rig_friction: RigFriction | None = None

    @property
    def omissions(self) -> tuple[AspectRecord, ...]:
        """The aspects in which the package is simpler than the fit."""
        return tuple(row for row in self.aspects if row.omitted)

    @property
    def sentence(self) -> str:
        """What the scene needs, in one sentence."""
        if not self.asked:
            return "Every law is rendered as it was fitted (scene.simplify = false)."
        limit = f"{100 * self.allowed_share:.2g} % of the local torque"
        if not self.omissions or self.joint is None:
            return f"The scene needs every law as it was fitted: no simpler one keeps {limit}."
        left_out = "; ".join(f"{row.aspect}: {row.used} for {row.fitted}" for row in self.omissions)
        return (
            f"Simpler laws are enough for the scene ({left_out}). Together they cost "
            f"{self.joint.words}, with {100 * self.confidence:.3g} % confidence; {limit} is "
            "allowed."
        )
