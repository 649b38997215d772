"""Poles and decay of the sampled loop of pressing, with one choice of gains."""

import numpy as np
from numpy.typing import NDArray

from scissorcal.control import ContactGains, ContactLoop, contact_decays
from scissorcal.control.contact_loop import _matrices


def contact_poles(
    loop: ContactLoop, gains: ContactGains, normal_kp: float = 0.0
) -> NDArray[np.complex128]:
    """Poles at the stated stiffness and mass; the loop settles where all are in the unit circle."""
    return np.asarray(np.linalg.eigvals(_matrices(loop, loop.corners[0], [gains], normal_kp)[0]))


def contact_decay(loop: ContactLoop, gains: ContactGains, normal_kp: float = 0.0) -> float:
    """`contact_decays` with one choice of gains."""
    return float(contact_decays(loop, [gains], normal_kp)[0])
