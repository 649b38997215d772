"""Scoped verdicts: what was checked, against which limit, what it guards, and why."""

from dataclasses import asdict, dataclass
from typing import Any, Literal

Status = Literal["pass", "fail", "not_evaluated"]
Limit = Literal["at most", "at least", ""]

TORQUE = "torque: "
"""What a verdict guards begins so where its number judges torque itself: an error of it, its share,
a share of its variance, or how likely a difference of it is."""

_INTERVALS = "whether intervals hold what they promise"
_SEARCH = "whether the estimate is an optimum at all"
_DATA = "whether the recording can tell the parameters"
_POSE = "where the plate is drawn; no torque depends on it"
_TRACK = "the tracked pose and its stated uncertainty"
_EDGE = "shape of the edge, which torque follows"
_CAMERA = "lengths measured in photographs"
_LOOP = "whether commands reach the motors in time"
_PROBE_LINE = "the line, before a motor runs"
_PROBE_SENSORS = "the sensors, before a motor runs"
_PROBE_MOTORS = "the motors, before they run in earnest"

MEANINGS: dict[str, tuple[Limit, str]] = {
    "bench wrong": (
        "at most",
        "whether each answer of model and kernel is right or refused: how many are neither",
    ),
    "fit finite": ("at most", "whether there are numbers at all: how many are missing"),
    "fit optimum": ("at least", f"{_SEARCH}: starts that ended there"),
    "fit k-hat": ("at most", f"{_INTERVALS}: tail index of the importance weights, enough draws"),
    "fit bounds": ("at most", f"{_SEARCH}: largest distance from a prior in its sds"),
    "fit identifiability": ("at most", f"{_DATA}: largest posterior sd over prior sd"),
    "fit null-directions": ("at most", f"{_DATA}: directions that are left to the prior"),
    "fit whiteness": (
        "at least",
        "nothing of the torque by itself; it tells how much data an interval rests on: "
        "independent observations per parameter",
    ),
    "fit r-squared": ("at least", TORQUE + "share of its variance that the law explains"),
    "fit strokes": ("at least", f"{_DATA}: ratio of the fastest to the slowest stroke"),
    "fit hold-out": (
        "at most",
        TORQUE + "median rms error on unseen strokes, share of the rms of all strokes",
    ),
    "fit structure left": (
        "at most",
        TORQUE + "lower limit of twice the rms of what the law lacks in every stroke, share of the "
        "drive (rms)",
    ),
    "fit recordings": (
        "at most",
        TORQUE + "rms error on a recording by the others, share of the rms of all recordings",
    ),
    "fit physical": ("at most", "signs of levels: sds by which one is below zero"),
    "fit start": ("at least", f"{_SEARCH}: least way from its start, in prior sds"),
    "fit near rest": (
        "at most",
        "friction at half of the slowest swept rate: half width of its interval, share of it",
    ),
    "fit inertia": (
        "at most",
        "that sweeps and the probe's pushes find one inertia: how far apart, in their sds",
    ),
    "fit bandwidth": ("at most", f"{_INTERVALS}: sds by which a parameter moves with the cutoff"),
    "fit steady sweeps": (
        "at most",
        "friction at the slowest rates: share of time at rest in the sweeps that rested most",
    ),
    "fit interrupted strokes": (
        "at most",
        "that strokes are as planned: share of those of one speed in which motors were let go",
    ),
    "fit sensors": ("at most", "what was measured: share of samples that a sensor spoilt"),
    "fit sensor zeros": (
        "at most",
        TORQUE + "zero of the sensors, share of the drive (rms); it is subtracted",
    ),
    "fit zero drift": (
        "at most",
        TORQUE + "two sds of what is left of the zeros, share of the drive (rms)",
    ),
    "fit foundations": ("at most", "what the fit builds on: failed verdicts there"),
    "fit scatter at rest": (
        "at most",
        "response: scatter of cracks at rest over what noise, encoder and friction explain",
    ),
    "fit teeth": (
        "at most",
        "kappa, which a harmonic puts off by tens of percent: power at a half or a third of the "
        "line's frequency over its own",
    ),
    "fit stale sheets": (
        "at most",
        "response and fracture energy, which strokes through cut material pull down: largest "
        "share of a sheet's closing strokes that cut nothing",
    ),
    "fit opening zero": ("at most", TORQUE + "error of its mean over the scene, share of it"),
    "fit torque zero": ("at most", TORQUE + "error of its mean over the scene, share of it"),
    "fit edge shape": ("at most", TORQUE + "error of its mean over the scene, share of it"),
    "fit friction by load": ("at most", TORQUE + "error of its mean over the scene, share of it"),
    "fit clear edge": ("at most", f"{_EDGE}: share of points that are neither edge nor nick"),
    "fit photographs agree": ("at most", f"{_EDGE}: sds between photographs, or share of length"),
    "fit residual against claimed sd": (
        "at most",
        f"{_INTERVALS} of the edge: mean residual of an eighth of the edge in sds that are claimed "
        "there",
    ),
    "fit camera": (
        "at most",
        f"{_EDGE}: standard error of the camera where the blade was, px",
    ),
    "fit blade lengths": (
        "at most",
        f"{_EDGE}: difference of a pair's blades in length, in sds of equally long ones",
    ),
    "fit lamps apart": (
        "at least",
        f"{_EDGE}: whether a shadow taken for metal would show: angle between lamps, deg",
    ),
    "fit sizes of the errors": ("", f"{_INTERVALS} of the edge"),
    "fit.camera uncertainty": ("", f"{_CAMERA}: whether their error is known"),
    "fit.camera focal length": ("at most", f"{_CAMERA}: sd of the focal length, share of it"),
    "fit.camera views": ("at most", f"{_CAMERA}: error of the worst photograph over the median"),
    "fit.camera corners": ("at least", f"{_CAMERA}: corners seen"),
    "fit.camera projection": ("at most", f"{_CAMERA}: sd of a projected point, px"),
    "fit.camera two halves": ("at least", f"{_CAMERA}: p-value of two halves' difference"),
    "fit.plate ambiguity": ("at least", f"{_POSE}: odds of the better of two poses"),
    "fit.plate at rest": (
        "at most",
        f"{_POSE}: error in the common pose over the photograph's own",
    ),
    "fit.plate residuals": ("at most", f"{_POSE}: sd of corners, px"),
    "fit.plate halves": ("at most", f"{_POSE}: squared difference of two halves, in covariances"),
    "fit.plate size": ("at least", f"{_POSE}: width of the smallest square or marker, px"),
    "fit.plate camera": (
        "at most",
        f"{_POSE}: standard error of the camera where the plate's target was, px",
    ),
    "fit.plate rig frame": ("at most", f"{_POSE}: directions left open, or sd of corners, px"),
    "verify calibration": (
        "at least",
        f"{_INTERVALS}: p-value of uniform ranks; below, 90 % intervals must hold 84 to 96 %",
    ),
    "verify refits": ("at most", f"{_INTERVALS}: share of simulated fits that are unreliable"),
    "verify halves": ("at least", f"{_INTERVALS}: p-value of two halves' difference"),
    "verify halves-effort": (
        "at least",
        TORQUE + "difference of two halves' predictions against what they claim, p-value",
    ),
    "verify prior": ("at most", "what is the prior's: sensitivity to its power"),
    "capture until tolerance": (
        "at least",
        TORQUE + "share of the felt places whose band is within the scene's tolerance, as it ended",
    ),
    "package bound": ("at most", TORQUE + "error of the tables over the scene, N m"),
    "package bound share": ("at most", TORQUE + "error of the tables, share of the largest torque"),
    "package extremes": ("at most", "the motors: steps that gave no number"),
    "package centre": ("at least", TORQUE + "share of the scene that lies in the posterior's band"),
    "package failed fits": (
        "at most",
        "what the package is made from: checks that its fits failed",
    ),
    "package review": ("at least", "whether the report was accepted: 1 if so"),
    "package signature": (
        "at least",
        "whether what is rendered is what a key signed that is trusted: 1 if so",
    ),
    "render admission": (
        "at most",
        "stability of what is felt: rendered stiffness over what the rig renders in a hand",
    ),
    "render felt torque": (
        "at most",
        TORQUE + "its change by what the rig cannot render stably, rms over the scene's strokes",
    ),
    "render deadline": ("at most", f"{_LOOP}: 99 % of the latencies, us"),
    "render misses": ("at most", f"{_LOOP}: share of lost frames"),
    "render faults": ("at most", f"{_LOOP}: faults that the device latched"),
    "render supervision": ("at most", f"{_LOOP}: frames with damping only"),
    "render plate pose": (
        "at most",
        TORQUE + "share of the time without the full force, for want of the plate's pose",
    ),
    "render motor sense": (
        "at most",
        "sense of motor and force sensor: energy that the rig would have given, J",
    ),
    "render passivity": ("at most", "energy beyond the model's, which is felt as buzzing: J"),
    "track clock jumps": ("at most", f"{_TRACK}: how often a clock of camera or rig jumped"),
    "track refused pictures": ("at most", f"{_TRACK}: share of pictures beyond the gate"),
    "track refused contacts": ("at most", f"{_TRACK}: share of contacts beyond the gate"),
    "track picture consistency": ("at most", f"{_TRACK}: mean NIS of pictures over its 6"),
    "track contact consistency": ("at most", f"{_TRACK}: mean NIS of contacts over its 1"),
    "control deadline": ("at most", f"{_LOOP}: 99 % of the latencies, us"),
    "control misses": ("at most", f"{_LOOP}: share of lost frames"),
    "control faults": ("at most", f"{_LOOP}: faults that the device latched"),
    "control supervision": ("at most", f"{_LOOP}: frames with damping only"),
    "control force": ("at most", "force on a surface: rms of its error while the path goes on, N"),
    "control path": ("at most", "path on a surface: 95 % of its errors while it goes on, mm"),
    "control touch": ("at most", "what is pressed on: largest force of a touch, N"),
    "control contact": ("at most", "path on a surface: how often contact was lost or let go of"),
    "control no force": (
        "at most",
        "force on a surface: what the balance made of none before the touch, N",
    ),
    "device round trip": ("at most", f"{_LOOP}: 99 % of the answers, ms"),
    "device frame intervals": ("at most", f"{_LOOP}: 99 % of the intervals, ms"),
    "device lost frames": ("at most", f"{_LOOP}: frames lost, %"),
    "device latency timer": ("at most", f"{_LOOP}: ms that the adapter holds data back"),
    "device control margin": (
        "at least",
        "whether the rig follows a capture without swinging: phase margin of its controller, "
        "degrees",
    ),
    "device steady sweeps": (
        "at most",
        "friction at the slowest rates: rate in rad/s below which blades stick and slip",
    ),
    "device drift": (
        "at most",
        "rates and accelerations: error of the device's clock beyond two standard errors, ppm",
    ),
    "probe numbers": ("at most", f"{_PROBE_SENSORS}: fields that are no number"),
    "probe stops": ("at most", f"{_PROBE_SENSORS}: opening beyond the stated stops, rad"),
    "probe clock by tick": ("at most", f"{_PROBE_LINE}: device_us a frame over tick_us, less 1"),
    "probe clock by host": ("at most", f"{_PROBE_LINE}: device clock over this computer's, less 1"),
    "probe lost frames": ("at most", f"{_PROBE_LINE}: frames lost or garbled, %"),
    "probe encoder jitter": ("at most", f"{_PROBE_SENSORS}: sd of the opening at rest, rad"),
    "probe rest": ("at most", f"{_PROBE_SENSORS}: motion with the motors off, rad"),
    "probe torque zero": ("at most", f"{_PROBE_SENSORS}: it is subtracted, N m"),
    "probe torque noise": ("at most", f"{_PROBE_SENSORS}: sd, N m"),
    "probe force zero": ("at most", f"{_PROBE_SENSORS}: it is subtracted, N"),
    "probe force noise": ("at most", f"{_PROBE_SENSORS}: sd, N"),
    "probe handle radius": ("at most", f"{_PROBE_SENSORS}: device's over recipe's, less 1"),
    "probe encoder step": ("at most", f"{_PROBE_SENSORS}: step seen over step stated"),
    "probe opening zero": ("at most", f"{_PROBE_SENSORS}: both stops by hand less stated, rad"),
    "probe left half open": ("", f"{_PROBE_SENSORS}: distance from a stop, rad"),
    "probe lost commands": ("at most", f"{_PROBE_LINE}: share of single commands"),
    "probe inertia": ("at most", f"{_PROBE_MOTORS}: sd of its logarithm, from the pushes"),
    "probe count scale": ("at most", f"{_PROBE_SENSORS}: range counted over range stated, less 1"),
    "probe faults": ("at most", f"{_PROBE_MOTORS}: faults that do not clear"),
    "probe enable": ("", f"{_PROBE_MOTORS}: whether they follow ENABLE"),
    "probe lag": ("at most", f"{_PROBE_MOTORS}: from a state to the effect of its answer, ms"),
    "probe watchdog": ("at most", f"{_PROBE_MOTORS}: silence after which the device brakes, ms"),
    "probe watchdog value": ("", f"{_PROBE_MOTORS}: whether BRAKE_AFTER_MS can be set"),
    "probe watchdog flags": ("at most", f"{_PROBE_MOTORS}: flags that are missing"),
    "probe fault clears": ("at most", f"{_PROBE_MOTORS}: 1 if it does not"),
    "probe blades move": ("", f"{_PROBE_MOTORS}: largest torque that was tried, mN m"),
    "probe blades direction": ("at least", f"{_PROBE_MOTORS}: 1 if pairs of pushes obey"),
    "probe sledge move": ("", f"{_PROBE_MOTORS}: largest force that was tried, N"),
    "probe sledge direction": ("at least", f"{_PROBE_MOTORS}: 1 if pairs of pushes obey"),
    "probe measured torque": ("at most", f"{TORQUE}measured over commanded, less 1"),
    "probe clipping": ("at most", f"{_PROBE_MOTORS}: 1 if a torque above the limit is not clipped"),
    "host resolution": ("at most", f"{_LOOP}: steps of this computer's clock, ns"),
    "host wake-up lateness": ("at most", f"{_LOOP}: 99 % of the delays, ms"),
    "host real-time rights": ("at least", f"{_LOOP}: priority that is granted"),
}
"""By scope and check: on which side of its threshold a value is good, and what the check guards.

A scope counts from its whole name to its first word: "fit.plate halves" goes before "fit halves".
"""


@dataclass(frozen=True)
class Verdict:
    """One check with its outcome.

    ``scope`` names what was judged (``"fit.friction"``), ``check`` the question asked
    (``"whiteness"``). ``value`` and ``threshold`` are numbers in the unit that ``guards`` states;
    both are None where a check could not be evaluated. ``why`` is a sentence for people.
    ``limit`` says whether ``value`` may be at most or at least ``threshold``; ``guards`` what the
    number is, and whether it bounds an error of torque. Both come from :data:`MEANINGS`.

    >>> verdict = Verdict("fit.cut", "k-hat", "pass", 0.31, 0.7, "The weights are well behaved.")
    >>> verdict.status, verdict.limited
    ('pass', '0.31, at most 0.7')
    """

    scope: str
    check: str
    status: Status
    value: float | None
    threshold: float | None
    why: str
    limit: Limit = ""
    guards: str = ""

    def __post_init__(self) -> None:
        """Take direction and meaning from the table, where it knows the check."""
        limit, guards = meaning_of(self.scope, self.check)
        object.__setattr__(self, "limit", limit)
        object.__setattr__(self, "guards", guards)

    @property
    def limited(self) -> str:
        """The value and its limit in words; empty where there is no number."""
        if self.value is None:
            return ""
        if self.threshold is None or not self.limit:
            return f"{self.value:.3g}"
        return f"{self.value:.3g}, {self.limit} {self.threshold:.3g}"

    @property
    def bounds_torque(self) -> bool:
        """Whether the number is an error of torque or a share of torque."""
        return self.guards.startswith(TORQUE)

    def as_dict(self) -> dict[str, Any]:
        """Give the verdict as the plain object that ``--json`` prints."""
        return asdict(self)


def judge(
    scope: str, check: str, value: float, limit: float, good: str, bad: str | None = None
) -> Verdict:
    """Judge a value by its limit: ``good`` is said where it passes, ``bad`` where it fails.

    :data:`MEANINGS` says whether the value may be at most or at least the limit; the limit itself
    passes, NaN fails. Raises ValueError for a check whose limit has no direction there.

    >>> verdict = judge("fit.plate", "residuals", 0.4, 0.3, "0.4 px.", "0.4 px: too much.")
    >>> verdict.status, verdict.limited, verdict.why
    ('fail', '0.4, at most 0.3', '0.4 px: too much.')
    """
    direction, _ = meaning_of(scope, check)
    if not direction:
        raise ValueError(f"the limit of {scope} {check} has no direction in MEANINGS")
    passes = value <= limit if direction == "at most" else value >= limit
    why = good if passes or bad is None else bad
    return Verdict(scope, check, "pass" if passes else "fail", float(value), float(limit), why)


def not_evaluated(
    scope: str, check: str, why: str, limit: float | None = None, value: float | None = None
) -> Verdict:
    """A check that could not be made, or decides nothing here, and why."""
    return Verdict(scope, check, "not_evaluated", value, limit, why)


def meaning_of(scope: str, check: str) -> tuple[Limit, str]:
    """Direction of a check's limit and what it guards; empty for a check that is not known.

    >>> meaning_of("fit.plate", "halves")[0], meaning_of("verify.cut", "halves")[0]
    ('at most', 'at least')
    """
    parts = scope.split(".")
    for count in range(len(parts), 0, -1):
        meaning = MEANINGS.get(f"{'.'.join(parts[:count])} {check}")
        if meaning is not None:
            return meaning
    return "", ""


def failed(verdicts: tuple[Verdict, ...]) -> tuple[Verdict, ...]:
    """Return the verdicts whose status is ``fail``, in order."""
    return tuple(verdict for verdict in verdicts if verdict.status == "fail")
