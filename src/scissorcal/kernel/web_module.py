"""The WebAssembly of the model's step, and a model in the order in which the module takes it."""

import math
from pathlib import Path

import numpy as np

from scissorcal.kernel.browser_file import browser_file
from scissorcal.kernel.tables import ModelTables

MODEL_NUMBERS = (
    *("moving_blades", "closure", "render_friction", "upper_face", "fracture_energy", "kappa"),
    *("rate_damping", "friction_rate_eps", "handle_radius", "tip_station", "opening_min"),
    *("opening_max", "contact_min", "contact_max"),
)
"""Arguments of the module's ``sc_web_make``, by the names of :class:`ModelTables`."""

CLOSURES = ("work", "eq4")


def web_module() -> bytes:
    """The module's bytes: a reactor without imports, see ``web/sc_web.c``.

    Raises MissingError where it was not built and cannot be, see `browser_file`.
    """
    return browser_file(Path(__file__).parent / "web" / "sc_web.wasm")


def web_numbers(tables: ModelTables) -> tuple[float, ...]:
    """A model's numbers in the order of :data:`MODEL_NUMBERS`, each exact in float32.

    An infinite length of the blade becomes float32's largest number, which JSON can hold.
    """
    return tuple(_number(tables, name) for name in MODEL_NUMBERS)


def _number(tables: ModelTables, name: str) -> float:
    value = getattr(tables, name)
    if name == "closure":
        return CLOSURES.index(value)
    if isinstance(value, (bool, int)):
        return int(value)
    return float(np.float32(value)) if math.isfinite(value) else float(np.finfo(np.float32).max)
