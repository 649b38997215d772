"""Everything that a page shows of a package: tables, sliders, draws, band, strokes."""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.result import FitResult
from scissorcal.kernel.tables import TABLE_NAMES
from scissorcal.kernel.web_module import web_numbers
from scissorcal.package.average import energy_levels
from scissorcal.package.compile import table_file
from scissorcal.package.manifest import Parameter
from scissorcal.package.model_package import ModelPackage
from scissorcal.package.variations import Variations, central_values, variations
from scissorcal.prototype.arrays import Numbers, Part
from scissorcal.report.numbers import shown_unit

Array = NDArray[np.float64]

FORMAT = "scissorcal-prototype/1"

NODES = 17
"""Places of a slider at which the law was evaluated; between them its tables change linearly."""
WIDE = 2.0
"""A slider reaches from half to twice the fitted value, or as far as the posterior does."""
POSTERIOR_SDS = 8.0
MOST_DRAWS = 200

OPENINGS, CONTACTS = 61, 13
"""Grid of the band over the scene's openings and contacts."""
MOST_POINTS = 400
"""Of a measured stroke on a page."""
MOST_STROKES = 24
ABOVE_ZERO = 1e-3
"""A slider of a parameter that is above 0 stays above this share of its fitted value."""
AT_MOST_1 = ("kappa",)
LEAST_EXPONENT = 1.0
"""A softer law has an infinite stiffness at the first touch, which no table holds."""


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

    ``nodes`` are its values at which ``rows`` were evaluated, the others as fitted.
    """

    name: str
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

    ``rate`` is the opening rate in rad/s at which it was evaluated, below 0 where closing.
    """

    rate: float
    opening: Numbers
    contact: Numbers
    low: Numbers
    high: Numbers


class Stroke(Part):
    """A measured stroke (n,): opening in rad, contact in m, torque in N m."""

    recording: str
    kind: str
    opening: Numbers
    contact: Numbers
    torque: Numbers


class Hand(Part):
    """A recorded hand to replay (n,): time in s from 0, opening in rad, advance in m."""

    name: str
    time: Numbers
    opening: Numbers
    advance: Numbers


class Scene(Part):
    """A package as a page shows it.

    ``tables`` (3, knots) and ``numbers`` are what the kernel evaluates, in the orders of
    TABLE_NAMES and MODEL_NUMBERS. ``mean_energy`` (3, knots) and ``levels`` are those of the
    average torque; without a ripple there are none. ``cut`` and ``friction`` are as fitted on the
    knots, from which sliders and draws differ.
    """

    format: Literal["scissorcal-prototype/1"] = FORMAT
    name: str
    made_utc: str
    version: str
    warnings: tuple[str, ...]
    bound_Nm: float
    torque_limit_Nm: float
    opening_rad: tuple[float, float]
    opening_rate_rad_per_s: tuple[float, float]
    contact_m: tuple[float, float]
    loop_rate_Hz: float
    handle_radius_m: float
    blade_length_m: float
    upper_face_m: float
    moving_blades: int
    tables: dict[str, Numbers]
    numbers: tuple[float, ...]
    mean_energy: Numbers | None
    levels: tuple[float, ...]
    centre: Rows
    sliders: tuple[Slider, ...]
    draws: Draws | None
    bands: tuple[Band, ...]
    strokes: tuple[Stroke, ...] = ()
    hands: tuple[Hand, ...] = ()


def scene_of(
    package: ModelPackage,
    *,
    made_utc: str,
    version: str,
    fits: Sequence[FitResult] = (),
    hands: Sequence[Hand] = (),
) -> Scene:
    """What a page shows of a package; ``fits`` add measured strokes and meanings.

    A fit that the package was not built from adds nothing: its inputs hash is another.
    """
    manifest = package.manifest
    own = set(manifest.fit_hashes.values())
    fits = [fit for fit in fits if fit.inputs_hash in own]
    meanings = {p.name: p.meaning for fit in fits for p in fit.parameters}
    mean = package.arrays.get(table_file("mean_energy"))
    ranges, mechanics = manifest.ranges, manifest.mechanics
    return Scene(
        name=manifest.name,
        made_utc=made_utc,
        version=version,
        warnings=package.warnings,
        bound_Nm=manifest.bound.stated_Nm,
        torque_limit_Nm=manifest.limits.torque_Nm,
        opening_rad=ranges.opening_rad,
        opening_rate_rad_per_s=ranges.opening_rate_rad_per_s,
        contact_m=ranges.contact_m,
        loop_rate_Hz=mechanics.loop_rate_Hz,
        handle_radius_m=mechanics.handle_radius_m,
        blade_length_m=mechanics.tip_station_m,
        upper_face_m=mechanics.upper_face_m,
        moving_blades=mechanics.moving_blades,
        tables={name: _table(package, name) for name in TABLE_NAMES},
        numbers=web_numbers(package.tables),
        mean_energy=None if mean is None else Numbers.of(mean),
        levels=() if mean is None else tuple(float(one) for one in energy_levels(mean[1])),
        centre=_centre(package),
        sliders=tuple(_sliders(package, meanings)),
        draws=_draws(package),
        bands=tuple(_bands(package)),
        strokes=tuple(stroke for fit in fits if fit.what == "cut" for stroke in _strokes(fit)),
        hands=tuple(hands),
    )


def slider_nodes(name: str, value: float, sd: float) -> Array:
    """The values of a slider's nodes (NODES,), the fitted one among them.

    It reaches over the posterior, and from half to twice the value, with the value's sign where
    the posterior leaves no doubt about that.

    >>> slider_nodes("fracture_energy", 0.4, 0.01)[[0, 8, 16]]
    array([0.2, 0.4, 0.8])
    """
    ends = [value / WIDE, value * WIDE, value - POSTERIOR_SDS * sd, value + POSTERIOR_SDS * sd]
    low, high = min(ends), max(ends)
    if value > 2.0 * sd:
        low = max(low, ABOVE_ZERO * value)
    if value < -2.0 * sd:
        high = min(high, ABOVE_ZERO * value)
    if name in AT_MOST_1:
        high = min(high, 1.0)
    if name.endswith("exponent"):
        low = max(low, min(LEAST_EXPONENT, value))
    half = NODES // 2 + 1
    return np.append(np.linspace(low, value, half)[:-1], np.linspace(value, high, half))


def _table(package: ModelPackage, name: str) -> Numbers:
    table = getattr(package.tables, name)
    return Numbers.of(np.stack([table.x, table.y, table.slope]))


def _centre(package: ModelPackage) -> Rows:
    cut, friction = central_values(package)
    both = variations(package, cut[None], None if friction is None else friction[None])
    return _rows(both)


def _sliders(package: ModelPackage, meanings: Mapping[str, str]) -> "list[Slider]":
    record = package.manifest.provenance
    cut, friction = central_values(package)
    found = []
    for index, parameter in enumerate(record.cut.parameters):
        nodes = slider_nodes(parameter.name, parameter.value, parameter.sd)
        varied = np.tile(cut, (NODES, 1))
        varied[:, index] = nodes
        same = None if friction is None else np.tile(friction, (NODES, 1))
        found.append(_slider(parameter, nodes, variations(package, varied, same), meanings))
    for index, parameter in enumerate(record.friction.parameters if record.friction else ()):
        assert friction is not None
        nodes = slider_nodes(parameter.name, parameter.value, parameter.sd)
        varied = np.tile(friction, (NODES, 1))
        varied[:, index] = nodes
        law = variations(package, np.tile(cut, (NODES, 1)), varied)
        found.append(_slider(parameter, nodes, law, meanings))
    return [slider for slider in found if slider is not None]


def _slider(
    parameter: Parameter, nodes: Array, law: Variations, meanings: Mapping[str, str]
) -> Slider | None:
    """None for a parameter that the rendered law does not depend on, such as the rig's inertia."""
    rows = _rows(law, only_changed=True)
    numbers = (law.fracture_energy, law.kappa, law.rate_damping)
    if not rows.tables and all(np.ptp(one) == 0.0 for one in numbers):
        return None
    scale, unit = shown_unit(parameter.unit)
    return Slider(
        name=parameter.name,
        meaning=meanings.get(parameter.name, ""),
        unit=unit,
        scale=scale,
        value=parameter.value,
        sd=parameter.sd,
        q05=parameter.q05,
        q95=parameter.q95,
        nodes=Numbers.of(nodes),
        rows=rows,
    )


def _draws(package: ModelPackage) -> Draws | None:
    record = package.manifest.provenance
    cut = package.arrays["draws/cut.npy"][:MOST_DRAWS]
    friction = package.arrays["draws/friction.npy"][: len(cut)] if record.friction else None
    columns = cut if friction is None else np.hstack([cut, friction])
    return Draws(values=Numbers.of(columns), rows=_rows(variations(package, cut, friction)))


def _rows(law: Variations, *, only_changed: bool = False) -> Rows:
    tables = {
        name: Numbers.of(rows)
        for name, rows in law.rows.items()
        if not only_changed or np.any(np.ptp(rows, axis=0))
    }
    return Rows(
        tables=tables,
        fracture_energy=Numbers.of(law.fracture_energy),
        kappa=Numbers.of(law.kappa),
        rate_damping=Numbers.of(law.rate_damping),
    )


def _bands(package: ModelPackage) -> "list[Band]":
    """Both directions at the middle (geometric) of the scene's rates."""
    ranges = package.manifest.ranges
    opening = np.linspace(*ranges.opening_rad, OPENINGS)
    contact = np.linspace(*ranges.contact_m, CONTACTS)
    slow, fast = ranges.opening_rate_rad_per_s
    rate = float(np.sqrt(max(slow, 0.05 * fast) * fast))
    found = []
    for signed in (-rate, rate):
        low, high = package.band(opening[:, None], signed, contact[None, :])
        found.append(
            Band(
                rate=signed,
                opening=Numbers.of(opening),
                contact=Numbers.of(contact),
                low=Numbers.of(low),
                high=Numbers.of(high),
            )
        )
    return found


def _strokes(fit: FitResult) -> "list[Stroke]":
    series, found = fit.series, []
    for number in np.unique(series.stroke)[:MOST_STROKES]:
        own = np.flatnonzero(
            (series.stroke == number) & np.isfinite(series.measured) & np.isfinite(series.contact)
        )
        own = own[:: max(1, -(-len(own) // MOST_POINTS))]
        if len(own) < 2:
            continue
        closes = series.opening[own[-1]] < series.opening[own[0]]
        found.append(
            Stroke(
                recording=fit.sources[int(series.recording[own[0]])].rpartition("/")[2],
                kind="closing" if closes else "opening",
                opening=Numbers.of(series.opening[own]),
                contact=Numbers.of(series.contact[own]),
                torque=Numbers.of(series.measured[own]),
            )
        )
    return found
