"""Books, observer and controller of a rendering in plain Python: what the C must give."""

from dataclasses import dataclass, field

from scissorcal.kernel import EnergyLedger, PassivityConfig, StepOutput

MEMORY_S = 0.5


@dataclass
class ReferencePort:
    """One tick at a time; ``limit`` clips the torque, the force is off."""

    config: PassivityConfig
    limit: float
    books: dict[str, float] = field(
        default_factory=lambda: dict.fromkeys(EnergyLedger.__dataclass_fields__, 0.0)
    )
    observed: float = 0.0
    last: tuple[float, float, StepOutput, float] | None = None  # share, clipped, step, injected

    def step(
        self, turned: float, delivered: float, dt: float, rate: float, share: float, out: StepOutput
    ) -> float:
        """Book a tick and return the torque that is added; ``out`` is the model's answer now."""
        books, clipped = self.books, max(min(share * out.torque, self.limit), -self.limit)
        books["delivered_J"] += delivered
        if self.last is None:
            books["engaged_J"] += share * (out.stored_J + out.fracture_J + out.arrest_J)
            self.last = (share, 0.0, out._replace(friction_torque=0.0), 0.0)
            kept_before = 0.0
        else:
            kept_before = self.last[1] - self.last[0] * self.last[2].torque
        old_share, old_clipped, old, old_added = self.last
        mean_share, mean_level = 0.5 * (old_share + share), 0.5 * (old.stored_J + out.stored_J)
        books["stored_J"] = share * out.stored_J
        books["engaged_J"] += mean_level * (share - old_share)
        books["fracture_J"] += mean_share * out.fracture_J
        books["arrest_J"] += mean_share * out.arrest_J
        friction = 0.5 * (old_share * old.friction_torque + share * out.friction_torque)
        books["friction_J"] -= friction * turned
        kept = clipped - share * out.torque
        books["limited_J"] += 0.5 * (kept_before + kept) * turned
        late = delivered - 0.5 * (old_clipped + clipped) * turned
        taken = self.config.rig_coulomb * abs(turned)
        taken += self.config.rig_damping * turned**2 / dt if dt > 0 else 0.0
        self.observed = max((1.0 - min(dt / MEMORY_S, 1.0)) * self.observed + late - taken, 0.0)
        added = 0.0
        excess = self.observed - self.config.margin_J
        if excess > 0 and dt > 0:
            wanted = excess / (dt * max(rate**2, 1e-6))
            added = -min(self.config.most_damping, wanted) * rate
        injected = 0.5 * (old_added + added) * turned
        books["injected_J"] += injected
        books["late_J"] += late - injected
        self.last = (share, clipped, out, added)
        return added

    @property
    def ledger(self) -> EnergyLedger:
        return EnergyLedger(**self.books)
