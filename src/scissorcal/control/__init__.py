"""Pressing on a surface and moving along it: gains of the hybrid law from its sampled loop."""

from scissorcal.control.contact_loop import (
    ContactGains,
    ContactLoop,
    contact_decays,
)
from scissorcal.control.gains import (
    HybridGains,
    approach_speed,
    choose_gains,
    contact_gains,
    friction_rates,
)

__all__ = [
    "ContactGains",
    "ContactLoop",
    "HybridGains",
    "approach_speed",
    "choose_gains",
    "contact_decays",
    "contact_gains",
    "friction_rates",
]
