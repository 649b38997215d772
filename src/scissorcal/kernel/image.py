"""A model and how it is driven as one flat block of numbers, which a device renders from in place.

The layout is that of ``firmware/core/fw_image.h``: a header of 37 numbers, then the tables' rows,
all little-endian and 4 bytes long.
"""

import struct

import numpy as np

from scissorcal.kernel._kernel import ffi
from scissorcal.kernel.servo import ServoConfig
from scissorcal.kernel.tables import TABLE_NAMES, ModelTables, model_struct

IMAGE_FORMAT = 1
_MAGIC = int.from_bytes(b"SCMI", "little")
_WHOLE = ("moving_blades", "closure", "render_friction", "release_falls")
_REAL = (
    *("upper_face", "fracture_energy", "kappa", "rate_damping", "friction_rate_eps"),
    *("handle_radius", "tip_station", "opening_min", "opening_max", "contact_min", "contact_max"),
)
_LIMITS = ("torque_limit", "torque_slew", "force_limit", "force_slew", "ramp_s", "rate_cutoff_Hz")
_OBSERVED = (
    *("friction_width", "is_measured", "rig_damping", "rig_coulomb"),
    *("margin_J", "most_damping"),
)


def model_image(tables: ModelTables, config: ServoConfig) -> bytes:
    """The image of a model within the limits of ``config``, with the floats that a kernel steps.

    Of the configuration it holds limits, slews, ramp, the cutoff of the rate, the motor's sign, and
    what watches the energy; a device knows nothing of a plate's pose.

    >>> from scissorcal.kernel import ServoConfig
    >>> model_image(tables, ServoConfig(...))[:4]  # doctest: +SKIP
    b'SCMI'
    """
    model, _keep = model_struct(tables)
    rows = []
    for name in TABLE_NAMES:
        table = getattr(model, name)
        parts = (table.x, table.y, table.slope, *((table.area,) if name == "response" else ()))
        rows += [bytes(ffi.buffer(part, 4 * table.size)) for part in parts]
    sizes = [getattr(model, name).size for name in TABLE_NAMES]
    numbers = [getattr(model, name) for name in _REAL]
    numbers += [getattr(config, name) for name in _LIMITS]
    numbers += [float(getattr(config.passivity, name)) for name in _OBSERVED]
    numbers += [float(config.motor_sign)]
    whole = struct.pack("<9I", *sizes, *(int(getattr(model, name)) for name in _WHOLE))
    rest = whole + np.array(numbers, dtype="<f4").tobytes() + _little_endian(b"".join(rows))
    return struct.pack("<3If", _MAGIC, IMAGE_FORMAT, 16 + len(rest), 1.0) + rest


def _little_endian(floats: bytes) -> bytes:
    return np.frombuffer(floats, dtype=np.float32).astype("<f4").tobytes()
