"""Everything that a page shows of a package: tables, sliders, draws, band, strokes."""

import math
from collections.abc import Mapping, Sequence
from typing import Final, Literal

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.result import FitResult
from scissorcal.kernel.tables import TABLE_NAMES
from scissorcal.kernel.web_module import web_numbers
from scissorcal.package.average import energy_levels
from scissorcal.package.compile import table_file
from scissorcal.package.exact import exact_model, torque_quantiles
from scissorcal.package.layer_pieces import PieceRecord
from scissorcal.package.manifest import PoseRecord
from scissorcal.package.model_package import ModelPackage, record_draws
from scissorcal.package.records import Parameter
from scissorcal.package.variations import Variations, central_values, variations
from scissorcal.prototype.page_parts import (
    Band,
    Draws,
    Hand,
    LayersPart,
    Numbers,
    Part,
    PosePart,
    Rows,
    Slider,
    State,
    Stroke,
)
from scissorcal.report.numbers import shown_unit

FORMAT: Final = "scissorcal-prototype/1"

NODES = 17
"""Places of a slider at which the law was evaluated; between them its tables change linearly."""
WIDE = 2.0
"""A slider reaches from half to twice the fitted value, or as far as the posterior does."""
POSTERIOR_SDS = 8.0
MOST_DRAWS = 100

OPENINGS, CONTACTS = 61, 13
"""Grid of the band over the scene's openings and contacts."""
MOST_POINTS = 400
"""Of a measured stroke on a page."""
MOST_STROKES = 24
ABOVE_ZERO = 1e-3
"""A slider of a parameter that is above 0 stays above this share of its fitted value."""
AT_MOST_1 = ("kappa",)
_UNITS = {"m": (1e3, "mm"), "N m": (1e3, "mN m"), "N m s/rad": (1e3, "mN m s/rad")}
"""Units in which all of the page shows lengths, torques, and torques over a rate."""
LEAST_EXPONENT = 1.0
"""A softer law has an infinite stiffness at the first touch, which no table holds."""


class Scene(Part):
    """A package as a page shows it.

    ``tables`` (3, knots) and ``numbers`` are what the kernel evaluates, in the orders of
    TABLE_NAMES and MODEL_NUMBERS. ``mean_energy`` (3, knots) and ``levels`` are those of the
    average torque; without a ripple there are none. ``cut`` and ``friction`` are as fitted on the
    knots, from which sliders and draws differ. ``pieces`` are the plate along the cut, None for a
    uniform sheet; ``recipe`` is the text that a drawn plate is written into; ``drawn_plate`` is the
    plate whose outlines stand in files beside that recipe.
    """

    format: Literal["scissorcal-prototype/1"] = FORMAT
    name: str
    made_utc: str
    version: str
    states: tuple[State, ...]
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
    pieces: tuple[PieceRecord, ...] | None = None
    recipe: str | None = None
    drawn_plate: LayersPart | None = None
    plate_pose: PosePart | None = None
    next_step: str = ""


def scene_of(
    package: ModelPackage,
    *,
    made_utc: str,
    version: str,
    fits: Sequence[FitResult] = (),
    hands: Sequence[Hand] = (),
    states: Sequence[State] = (),
) -> Scene:
    """What a page shows of a package; ``fits`` add measured strokes and meanings.

    A fit that the package was not built from adds nothing: its inputs hash is another.
    ``states`` stand before those of the package. What a workspace adds to it, ``recipe``,
    ``drawn_plate`` and ``next_step``, is put in by ``model_copy``.
    """
    manifest = package.manifest
    fit_hashes = set(manifest.fit_hashes.values())
    fits = [fit for fit in fits if fit.inputs_hash in fit_hashes]
    meanings = {p.name: p.meaning for fit in fits for p in fit.parameters}
    mean = package.arrays.get(table_file("mean_energy"))
    ranges, mechanics = manifest.ranges, manifest.mechanics
    return Scene(
        name=manifest.name,
        made_utc=made_utc,
        version=version,
        states=(*states, *package_states(package)),
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
        levels=() if mean is None else tuple(float(level) for level in energy_levels(mean[1])),
        centre=_centre(package),
        sliders=tuple(_sliders(package, meanings)),
        draws=_draws(package),
        bands=tuple(_bands(package)),
        strokes=tuple(stroke for fit in fits if fit.what == "cut" for stroke in _strokes(fit)),
        hands=tuple(hands),
        pieces=manifest.pieces,
        plate_pose=_pose_part(manifest.plate),
    )


def package_states(package: ModelPackage) -> tuple[State, ...]:
    """The warnings of a package, each under a label of its kind."""
    named = [("unsigned", package.review_warnings), ("failed checks", package.fit_warnings)]
    known = {sentence for _, sentences in named for sentence in sentences}
    rest = tuple(sentence for sentence in package.warnings if sentence not in known)
    return tuple(
        State(label=label, sentence=sentence)
        for label, sentences in (*named, ("limits", rest))
        for sentence in sentences
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


def _sliders(package: ModelPackage, meanings: Mapping[str, str]) -> list[Slider]:
    record = package.manifest.provenance
    cut, friction = central_values(package)
    sliders = []
    for index, parameter in enumerate(record.cut.parameters):
        nodes = slider_nodes(parameter.name, parameter.value, parameter.sd)
        varied = np.tile(cut, (NODES, 1))
        varied[:, index] = nodes
        same = None if friction is None else np.tile(friction, (NODES, 1))
        law = variations(package, varied, same)
        sliders.append(_slider(parameter, index, nodes, law, meanings))
    for index, parameter in enumerate(record.friction.parameters if record.friction else ()):
        assert friction is not None
        nodes = slider_nodes(parameter.name, parameter.value, parameter.sd)
        varied = np.tile(friction, (NODES, 1))
        varied[:, index] = nodes
        law = variations(package, np.tile(cut, (NODES, 1)), varied)
        sliders.append(_slider(parameter, len(cut) + index, nodes, law, meanings))
    return [slider for slider in sliders if slider is not None]


def _slider(
    parameter: Parameter, column: int, nodes: Array, law: Variations, meanings: Mapping[str, str]
) -> Slider | None:
    """None for a parameter that the rendered law does not depend on, such as the rig's inertia."""
    rows = _rows(law, only_changed=True)
    numbers = (law.fracture_energy, law.kappa, law.rate_damping)
    if not rows.tables and all(np.ptp(one) == 0.0 for one in numbers):
        return None
    scale, unit = _UNITS.get(parameter.unit) or shown_unit(parameter.unit)
    return Slider(
        name=parameter.name,
        column=column,
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


def _bands(package: ModelPackage) -> list[Band]:
    """Both directions at the middle (geometric) of the scene's rates, with and without friction."""
    manifest = package.manifest
    opening = np.linspace(*manifest.ranges.opening_rad, OPENINGS)
    contact = np.linspace(*manifest.ranges.contact_m, CONTACTS)
    slow, fast = manifest.ranges.opening_rate_rad_per_s
    rate = float(np.sqrt(max(slow, 0.05 * fast) * fast))
    place = opening[:, None], -rate, contact[None, :]
    limit = manifest.limits.torque_Nm
    drawn = exact_model(
        record_draws(package.manifest.provenance.cut, package.arrays["draws/cut.npy"]), None
    )
    alone = np.clip(torque_quantiles(drawn, *place, (0.05, 0.95)), -limit, limit)
    bands = [(-rate, False, alone)]
    if manifest.provenance.friction:
        closing, opens = package.band(*place), package.band(place[0], rate, place[2])
        bands += [(-rate, True, np.stack(closing)), (rate, True, np.stack(opens))]
    return [
        Band(
            rate=signed,
            friction=with_friction,
            opening=Numbers.of(opening),
            contact=Numbers.of(contact),
            low=Numbers.of(low),
            high=Numbers.of(high),
        )
        for signed, with_friction, (low, high) in bands
    ]


def _pose_part(plate: PoseRecord | None) -> PosePart | None:
    """None where the plate was seen from the camera alone: where the rig is, is not known then."""
    if plate is None or plate.frame != "rig":
        return None
    w, *axis = plate.quaternion
    sine = math.hypot(*axis)
    turn = 2.0 * math.atan2(sine, w) / sine if sine else 2.0
    x, y, z = (turn * part for part in axis)
    return PosePart(position_m=plate.translation_m, rotation_vector_rad=(x, y, z))


def _strokes(fit: FitResult) -> list[Stroke]:
    series, strokes = fit.series, []
    for number in np.unique(series.stroke)[:MOST_STROKES]:
        points = np.flatnonzero(
            (series.stroke == number) & np.isfinite(series.measured) & np.isfinite(series.contact)
        )
        points = points[:: max(1, -(-len(points) // MOST_POINTS))]
        if len(points) < 2:
            continue
        closes = series.opening[points[-1]] < series.opening[points[0]]
        strokes.append(
            Stroke(
                recording=_file_of(fit.sources[int(series.recording[points[0]])]),
                kind="closing" if closes else "opening",
                opening=Numbers.of(series.opening[points]),
                contact=Numbers.of(series.contact[points]),
                torque=Numbers.of(series.measured[points]),
            )
        )
    return strokes


def _file_of(source: str) -> str:
    """The file's name in what a fit says of a source: path and hash."""
    return source.partition(" sha256:")[0].rpartition("/")[2]
