"""Made-up fits with realistic content, from laws of their own: nothing here is fitted."""

from dataclasses import replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration import FitResult, FitSeries, FittedParameter, StrokeError
from scissorcal.recording import Stroke, StrokeKind
from scissorcal.report import RecordingSummary
from scissorcal.verdicts import Verdict

FRICTION_SOURCE = "captures/friction-20250131T140500Z.mcap"
CUT_SOURCE = "captures/cut-20250131T143000Z.mcap"
LINEAR_SOURCE = "captures/friction-linear.mcap"
HASHES = {
    FRICTION_SOURCE: "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08",
    CUT_SOURCE: "60303ae22b998861bce3b28f33eec1be758a213c86c93c076dbe9f558c11c752",
    LINEAR_SOURCE: "fd61a03af4f77d870fc21e05e7e80678095c92d808cfb3b5c279ee04c74aca13",
}
RATE_HZ = 100.0


def friction_recording() -> RecordingSummary:
    """The empty strokes that :func:`friction_fit` is about."""
    return _recording(FRICTION_SOURCE, "friction", "rotary", _friction_strokes())


def cut_recording() -> RecordingSummary:
    """The cutting strokes that :func:`cut_fit` is about."""
    return _recording(CUT_SOURCE, "cut", "rotary", _cut_strokes())


def linear_recording() -> RecordingSummary:
    """A sliding joint moved back and forth, without planned strokes."""
    return _recording(LINEAR_SOURCE, "friction", "linear", ())


def friction_fit(seed: int = 1) -> FitResult:
    """A rotary Stribeck friction fit that passed its checks."""
    rng = np.random.default_rng(seed)
    pieces = []
    for stroke in _friction_strokes():
        time, opening, rate = _movement(stroke)
        level = 0.021 + 0.009 * np.exp(-((rate / 0.12) ** 2)) + 0.006 * np.abs(rate)
        bend = 1.0 + 0.4 * (opening - 0.54)
        mean = np.sign(rate) * level * bend - 0.0012
        pieces.append(_piece(rng, stroke, time, opening, rate, mean, 0.0011, 0.0002))
    parameters = (
        _parameter("inertia", "kg m^2", 3.412e-4, 4.1e-6, 0.01, "moving mass about the pivot"),
        _parameter("offset", "N m", -0.00121, 9e-5, 0.02, "torque read at rest"),
        _parameter("coulomb", "N m", 0.02103, 1.9e-4, 0.01, "dry friction"),
        _parameter("viscous", "N m s/rad", 0.00604, 2.2e-4, 0.04, "grows with the rate"),
        _parameter("stribeck", "N m", 0.0091, 0.0011, 0.22, "static above dry friction"),
        _parameter("stribeck_rate", "rad/s", 0.121, 0.022, 0.45, "where it has faded to 37 %"),
        _parameter("angle_slope", "1/rad", 0.39, 0.31, 0.91, "change over the opening"),
    )
    candidates = (
        _candidate("coulomb, symmetric", -48211.4, 0.00214),
        _candidate("coulomb + viscous, symmetric", -49876.2, 0.00161),
        _candidate("stribeck, symmetric", -51902.8, 0.00119, chosen=True),
        _candidate("stribeck, asymmetric", -51888.1, 0.00119),
        _candidate("stribeck + angle, symmetric", -51901.9, 0.00118),
    )
    verdicts = (
        Verdict(
            "fit.friction",
            "k-hat",
            "pass",
            0.21,
            0.7,
            "Importance weights are well behaved.",
            "at most",
        ),
        Verdict(
            "fit.friction",
            "whiteness",
            "pass",
            0.19,
            0.01,
            "Residuals look like white noise.",
            "at least",
        ),
        Verdict(
            "fit.friction", "hold-out", "pass", 0.048, 0.07, "New strokes are predicted.", "at most"
        ),
        Verdict("fit.friction", "trust check", "not_evaluated", None, None, "Each speed ran once."),
    )
    return _fit("friction", "stribeck, symmetric", parameters, pieces, candidates, verdicts, rng)


def cut_fit(seed: int = 2) -> FitResult:
    """A rippled cut whose residuals fail the whiteness check."""
    rng = np.random.default_rng(seed)
    pieces = []
    for stroke in _cut_strokes():
        time, opening, rate = _movement(stroke)
        contact = 0.008 / np.tan(opening / 2 + 0.035) + 0.001
        mean = 0.55 * contact / np.sin(opening)
        mean = mean * (1.0 - np.exp(-((opening[0] - opening) / 0.06)))
        wave = 0.012 * mean / 0.1 * (np.mod(opening / 0.021, 1.0) - 0.5)
        piece = _piece(rng, stroke, time, opening, rate, mean, 0.0025, 0.0018, wave)
        pieces.append(piece)
    parameters = (
        _parameter("response_force", "N", 2.31, 0.74, 0.47, "force at the reference indentation"),
        _parameter("response_exponent", "1", 1.62, 0.66, 0.93, "how the response stiffens"),
        _parameter("fracture_energy", "N", 0.5511, 0.0062, 0.01, "toughness times thickness"),
        _parameter("kappa", "1", 0.61, 0.05, 0.19, "share of the energy at which a crack stops"),
        _parameter("torque_offset", "N m", 0.0003, 0.0002, 0.05, "torque read at rest"),
    )
    candidates = (
        _candidate("power, smooth", -20110.0, 0.00611),
        _candidate("power, rippled", -20431.5, 0.00598, chosen=True),
        _candidate("exponential, rippled", -20429.9, float("nan")),
    )
    verdicts = (
        Verdict(
            "fit.cut", "k-hat", "pass", 0.44, 0.7, "Importance weights are well behaved.", "at most"
        ),
        Verdict(
            "fit.cut",
            "whiteness",
            "fail",
            2e-9,
            0.01,
            "Residuals repeat over 0.02 rad: the ripple's phase is not modelled.",
            "at least",
        ),
        Verdict(
            "fit.cut", "hold-out", "pass", 0.066, 0.07, "New strokes are predicted.", "at most"
        ),
    )
    return _fit(
        "cut", "power, rippled, work closure", parameters, pieces, candidates, verdicts, rng
    )


def linear_fit(seed: int = 3) -> FitResult:
    """A sliding joint: newtons, metres and kilograms."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 24.0, 1 / RATE_HZ)
    position = 0.12 + 0.1 * np.sin(0.9 * time) + 0.01 * np.sin(7.1 * time)
    rate = 0.09 * np.cos(0.9 * time) + 0.071 * np.cos(7.1 * time)
    acceleration = np.gradient(rate, time)
    mean = 95.1 * acceleration + 203.0 * rate + 20.4 * np.sign(rate) - 3.2
    stroke = Stroke(-1, "excitation")
    pieces = [_piece(rng, stroke, time, position, rate, mean, 2.5, 0.4)]
    parameters = (
        _parameter("inertia", "kg", 95.11, 0.24, 0.002, "moving mass"),
        _parameter("offset", "N", -3.17, 0.28, 0.02, "force read at rest"),
        _parameter("coulomb_pos", "N", 20.4, 0.5, 0.03, "dry friction, positive rate"),
        _parameter("coulomb_neg", "N", 19.1, 0.5, 0.03, "dry friction, negative rate"),
        _parameter("viscous", "N s/m", 203.5, 2.7, 0.01, "grows with the rate"),
    )
    verdicts = (
        Verdict("fit.friction", "k-hat", "pass", 0.1, 0.7, "Weights are well behaved.", "at most"),
    )
    fit = _fit("friction", "coulomb + viscous, asymmetric", parameters, pieces, (), verdicts, rng)
    return replace(
        fit,
        effort_unit="N",
        position_unit="m",
        notes=("Imported from a table.",),
        sources=(f"{LINEAR_SOURCE} sha256:{HASHES[LINEAR_SOURCE]}",),
        structure={**fit.structure, "joint": "linear", "angle_center": 0.12},
    )


def without_numbers(fit: FitResult) -> FitResult:
    """The same fit with every number lost: NaN and infinities throughout."""
    nan, inf = float("nan"), float("inf")
    lost = tuple(
        FittedParameter(p.name, p.unit, nan, inf, -inf, nan, inf, nan, p.meaning)
        for p in fit.parameters
    )
    holes = {
        name: np.full(len(fit.series.stroke), nan)
        for name in FitSeries.__dataclass_fields__
        if name not in {"recording", "stroke"}
    }
    return replace(
        fit,
        parameters=lost,
        series=replace(fit.series, **holes),
        draws=np.full_like(fit.draws, nan),
        held_out=tuple(
            replace(error, speed=nan, rms=inf, relative_rms=nan) for error in fit.held_out
        ),
        candidates=tuple(
            {**candidate, "bic": nan, "held_out_rms": inf} for candidate in fit.candidates
        ),
        diagnostics={"k_hat": np.float64(nan), "ess": inf, "inflation": (nan, 2.0)},
        verdicts=(Verdict(f"fit.{fit.what}", "k-hat", "not_evaluated", nan, inf, "No weights."),),
    )


def _recording(source: str, kind: str, joint: str, strokes: tuple[Stroke, ...]) -> RecordingSummary:
    return RecordingSummary(
        source=source,
        content_hash=HASHES[source],
        kind=kind,
        joint=joint,
        samples=61234,
        duration_s=61.233,
        strokes=strokes,
        device={"name": "virtual rig", "serial": "VR-0001", "tick_us": 1000},
        recipe_toml="",
        notes=("3 garbled frames were thrown away.",),
    )


def _friction_strokes() -> tuple[Stroke, ...]:
    ways: tuple[StrokeKind, ...] = ("closing", "opening", "closing", "opening")
    strokes: list[Stroke] = []
    for speed in (0.05, 0.12, 0.3, 0.7, 1.5):
        strokes += [Stroke(len(strokes) + place, kind, speed) for place, kind in enumerate(ways)]
    return (*strokes, Stroke(len(strokes), "excitation"))


def _cut_strokes() -> tuple[Stroke, ...]:
    return tuple(
        Stroke(index, "closing", (0.1, 0.25, 0.6)[index // 4], index // 4) for index in range(12)
    )


def _movement(stroke: Stroke) -> tuple[Array, Array, Array]:
    if stroke.kind == "excitation":
        time = np.arange(0.0, 10.0, 1 / RATE_HZ)
        opening = 0.54 + 0.2 * np.sin(2.0 * time) + 0.05 * np.sin(11.0 * time)
        return time, opening, 0.4 * np.cos(2.0 * time) + 0.55 * np.cos(11.0 * time)
    way = -1.0 if stroke.kind == "closing" else 1.0
    time = np.arange(0.0, 0.66 / stroke.speed, 1 / RATE_HZ)
    start = 0.87 if way < 0 else 0.21
    return time, start + way * stroke.speed * time, np.full(time.shape, way * stroke.speed)


def _piece(
    rng: np.random.Generator,
    stroke: Stroke,
    time: Array,
    opening: Array,
    rate: Array,
    mean: Array,
    noise: float,
    half_band: float,
    extra: Array | float = 0.0,
) -> dict[str, Array]:
    white = rng.normal(size=len(time))
    coloured = np.empty_like(white)
    last = 0.0
    for place, value in enumerate(white):
        last = 0.5 * last + value
        coloured[place] = last
    start = 20.0 * max(stroke.index, 0)
    return {
        "time_s": start + time,
        "stroke": np.full(len(time), stroke.index),
        "opening": opening,
        "opening_rate": rate + 0.01 * rng.normal(size=len(time)),
        "contact": 0.008 / np.tan(opening / 2 + 0.035),
        "measured": mean + extra + noise * coloured,
        "predicted": mean,
        "band_low": mean - half_band,
        "band_high": mean + half_band,
    }


def _parameter(
    name: str, unit: str, mean: float, sd: float, ratio: float, meaning: str
) -> FittedParameter:
    reach = 1.645 * sd
    return FittedParameter(
        name, unit, mean, sd, mean - reach, mean - 0.02 * sd, mean + reach, ratio, meaning
    )


def _candidate(name: str, bic: float, error: float, *, chosen: bool = False) -> dict[str, object]:
    return {
        "name": name,
        "parameters": 4 + len(name.split("+")),
        "bic": bic,
        "held_out_rms": error,
        "held_out_score": -0.5 * bic,
        "chosen": chosen,
    }


def _fit(
    what: str,
    candidate: str,
    parameters: tuple[FittedParameter, ...],
    pieces: list[dict[str, Array]],
    candidates: tuple[dict[str, object], ...],
    verdicts: tuple[Verdict, ...],
    rng: np.random.Generator,
) -> FitResult:
    joined = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    whole = joined.pop("stroke").astype(np.int64)
    series = FitSeries(recording=np.zeros(len(whole), np.int64), stroke=whole, **joined)
    source = FRICTION_SOURCE if what == "friction" else CUT_SOURCE
    planned = _friction_strokes() if what == "friction" else _cut_strokes()
    held_out = tuple(
        StrokeError(s.index, source, s.kind, s.speed, error, error / 0.03)
        for s in planned[:12]
        for error in [float(abs(rng.normal(0.0012, 0.0004)))]
    )
    mean = np.array([parameter.mean for parameter in parameters])
    sd = np.array([parameter.sd for parameter in parameters])
    return FitResult(
        what="friction" if what == "friction" else "cut",
        effort="standard",
        candidate=candidate,
        structure={"law": candidate, "joint": "rotary", "angle_center": 0.54},
        parameters=parameters,
        draws=mean + sd * rng.normal(size=(200, len(mean))),
        map_point=mean,
        series=series,
        held_out=held_out,
        candidates=candidates,
        diagnostics={
            "k_hat": 0.21,
            "effective_samples": 1804.2,
            "evaluations": 3120,
            "whiteness_p": 0.19,
            "residual_rms": 0.00127,
            "search": "The search settled.",
        },
        verdicts=verdicts,
        effort_unit="N m",
        position_unit="rad",
        inputs_hash="a8fdc205a9f19cc1c7507a60c4f01b13d11d7fd0",
        sources=(f"{source} sha256:{HASHES[source]}",),
        notes=("Samples slower than 0.01 rad/s were left out: the sign of their rate is noise.",),
    )
