"""Options of commands, as the command line reads them and the library takes them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

NONE = "none"


@dataclass(frozen=True)
class RigOptions:
    """Which rig is opened, and how.

    ``device`` is a port, or "sim" for a virtual rig with the recipe's specimen, in virtual time
    unless ``realtime``; ``seed`` is that of its noise. ``baud`` takes the place of the recipe's
    rate.
    """

    device: str
    seed: int = 0
    baud: int | None = None
    realtime: bool = False


SIM_RIG = RigOptions("sim")


@dataclass(frozen=True)
class CaptureOptions:
    """How a capture is made.

    ``hand`` (cuts only): motors off, a person or the virtual hand moves the handles. ``designed``
    takes the list that is worth most now (True) or the recipe's (False); by default as the recipe's
    capture.plan says. ``until_tolerance`` chooses each stroke by what was recorded before it, until
    the scene's tolerance is reached: at least ``at_least`` strokes (pairs of sweeps), at most
    ``max_minutes`` planned minutes after the first part (None: those that the recipe's list takes).
    ``long`` says that a capture of more than 4 hours is meant.
    """

    hand: bool = False
    designed: bool | None = None
    until_tolerance: bool = False
    at_least: int = 0
    max_minutes: float | None = None
    long: bool = False


@dataclass(frozen=True)
class RenderOptions:
    """What is rendered, and how.

    ``package_path`` is the workspace's own if None; ``trusted_key`` a file of public keys that must
    have signed package and review. On a simulator a virtual hand makes ``strokes`` at
    ``rate_rad_per_s``. ``camera`` (a number, or "sim" with the device "sim") follows an estimated
    plate, which a person taps for ``taps_s`` before. ``accept_derated`` and ``allow_mismatch`` are
    those of `scissorcal.render.Rendering`, as is ``on_device``. With ``no_record`` no recording is
    kept.
    """

    package_path: Path | None = None
    seconds: float = 30.0
    strokes: int = 4
    rate_rad_per_s: float = 0.3
    camera: str = NONE
    taps_s: float = 0.0
    accept_derated: bool = False
    allow_mismatch: bool = False
    on_device: bool = False
    trusted_key: Path | None = None
    no_record: bool = False


@dataclass(frozen=True)
class ControlOptions:
    """The path that is followed, and where the plate stands.

    ``force_N`` and ``speed_mm_per_s`` hold where the file does not state them. ``pose`` is text
    (`workday.tracking.stated_pose` reads it); ``camera`` (a number, or "sim" with the device "sim")
    finds the plate while the path is followed; without both it stands where the fit of its
    photographs has it. With ``no_record`` no recording is kept.
    """

    path_file: Path
    force_N: float = 2.0
    speed_mm_per_s: float = 10.0
    pose: str | None = None
    camera: str = NONE
    no_record: bool = False


@dataclass(frozen=True)
class TrackOptions:
    """By what a plate is tracked, and for how long.

    ``camera`` is a camera's number, a video file, a track's recording (which is followed again, by
    the recipe as it is now), "sim" or "none"; ``device`` a port, "sim" or "none". A track ends
    after ``seconds``, with the pictures, or by an interrupt. ``camera_delay_ms`` takes the place of
    the recipe's plate.tracking.camera_delay_ms.
    """

    camera: str = NONE
    device: str = NONE
    seconds: float | None = None
    camera_delay_ms: float | None = None
    seed: int = 0
    baud: int | None = None

    @property
    def rig(self) -> RigOptions:
        """The rig whose blade's tip touches the plate."""
        return RigOptions(self.device, self.seed, self.baud)


@dataclass(frozen=True)
class FitOptions:
    """How fits are made.

    ``effort`` is the recipe's where not given. ``force`` fits again where nothing changed.
    ``critic`` asks for the critic of friction, at draft effort too; a stored fit without it is made
    again. Where the workspace cannot be written, a fit is kept in ``save_to``
    (`workday.history`).
    """

    effort: Literal["draft", "standard", "thorough"] | None = None
    force: bool = False
    seed: int = 0
    save_to: Path | None = None
    critic: bool = False


@dataclass(frozen=True)
class PredictOptions:
    """What is predicted of which motion: the effort of empty motion, or the load at the far end.

    ``motion`` is a recording, or a table as ``export`` writes it (``time_s`` and ``opening_rad``,
    or ``opening_m``; for a load ``motor_torque_Nm`` too). A measured sample lies in the band with
    the probability ``level``. ``table`` (.csv) and ``plot`` (.svg, .png) are written where named.
    """

    what: Literal["friction", "load"]
    motion: Path
    level: float = 0.9
    table: Path | None = None
    plot: Path | None = None


@dataclass(frozen=True)
class ExportOptions:
    """What a package is written as; ``package`` is its file, the workspace's if not given."""

    html: Path | None = None
    c: Path | None = None
    header: Path | None = None
    fmu: Path | None = None
    package: Path | None = None
    overwrite: bool = False


@dataclass(frozen=True)
class VerifySettings:
    """What is checked: how many simulated ``fits``, drawn from which prior (see `make_study`)."""

    checks: tuple[Literal["sbc", "halves", "prior"], ...] = ("sbc", "halves", "prior")
    fits: int = 100
    prior: Literal["local", "recipe"] = "local"
    spread: float = 3.0
    seed: int = 0


@dataclass(frozen=True)
class Processes:
    """Where work is done: in ``workers`` processes of this computer, or on a ``cluster``.

    One for each core where nothing is given.
    """

    workers: int | None = None
    cluster: str | None = None


@dataclass(frozen=True)
class TradeOptions:
    """Which knobs are measured, all if none is named; seconds for the whole run, None for no limit.

    ``force`` measures these knobs again; measurements of others are kept.
    """

    knobs: list[str] | None = None
    budget_s: float | None = None
    seed: int = 0
    force: bool = False


@dataclass(frozen=True)
class PrototypeOptions:
    """What the page of a package shows, and which rig it may start commands on.

    With a ``camera`` it may start a track, too. ``package_path`` is the workspace's own if None,
    ``port`` that of the page on this computer, 0 a free one.
    """

    device: str = NONE
    camera: str = NONE
    package_path: Path | None = None
    port: int = 0
