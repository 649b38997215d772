"""Parts of what a page is told: rows of tables, sliders, draws, bands, strokes, hands, pieces."""

from scissorcal.prototype.arrays import Numbers, Part


class Rows(Part):
    """Tables at n sets of parameters: by table (n, 2, knots), values and slopes; numbers (n,).

    ``tables`` of "mean_energy" are (n, 1, knots). A table that none of the sets changes is left
    out.
    """

    tables: dict[str, Numbers]
    fracture_energy: Numbers
    kappa: Numbers
    rate_damping: Numbers


class Slider(Part):
    """One parameter: SI values; times ``scale`` they are in ``unit``.

    ``nodes`` are its values at which ``rows`` were evaluated, the others as fitted; ``column`` is
    its place among the values of a draw.
    """

    name: str
    column: int
    meaning: str
    unit: str
    scale: float
    value: float
    sd: float
    q05: float
    q95: float
    nodes: Numbers
    rows: Rows


class Draws(Part):
    """Draws of the posterior: values (draws, sliders) in SI, and the law at each."""

    values: Numbers
    rows: Rows


class Band(Part):
    """The 90 % interval of the torque (N m) on a grid (openings, contacts), for one direction.

    ``rate`` is the opening rate in rad/s at which it was evaluated, below 0 where closing. Without
    ``friction`` it is of the material alone, as a measured stroke is.
    """

    rate: float
    friction: bool
    opening: Numbers
    contact: Numbers
    low: Numbers
    high: Numbers


class Stroke(Part):
    """A measured stroke (n,): opening in rad, contact in m, torque of the material in N m.

    The fit has taken the rig's friction off, and has averaged over pieces of the path.
    """

    recording: str
    kind: str
    opening: Numbers
    contact: Numbers
    torque: Numbers


class StripPart(Part):
    """Material of a piece that is bonded to the one before it, up to an end along the cut."""

    end_m: float
    fracture_energy_J_per_m: float


class PiecePart(Part):
    """A stretch of material without a gap, see :mod:`scissorcal.kernel.pieces`."""

    begin_m: float
    upper_face_m: float
    scale: float
    strips: tuple[StripPart, ...]


class PlatePose(Part):
    """Where the plate stands, in the rig's frame."""

    position_m: tuple[float, float, float]
    rotation_vector_rad: tuple[float, float, float]


class Hand(Part):
    """A recorded hand to replay (n,): time in s from 0, opening in rad, advance in m."""

    name: str
    time: Numbers
    opening: Numbers
    advance: Numbers
