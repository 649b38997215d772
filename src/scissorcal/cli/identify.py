"""``scissorcal identify``"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import typer

from scissorcal.cli.import_ import pairs
from scissorcal.cli.options import options_of
from scissorcal.cli.output import Answer, command
from scissorcal.cli.progress import progress
from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.identify import Held, Identified, LogOptions, Sensors

Target = Literal["mujoco", "urdf", "sdf", "c", "json", "csv"]
Effort = Literal["draft", "standard"]


@dataclass(frozen=True)
class Layout:
    """How the logs are read: columns, units and scales by channel."""

    columns: list[str] | None = None
    units: list[str] | None = None
    scales: list[str] | None = None
    joint: Literal["rotary", "linear"] | None = None
    rate_Hz: float | None = None
    allow_gaps: bool = False
    delimiter: str | None = None

    @property
    def options(self) -> "LogOptions":
        """The same for the reader of logs."""
        from scissorcal.identify import LogOptions
        from scissorcal.recording.table import column_of

        return LogOptions(
            columns={name: column_of(at) for name, at in pairs("column", self.columns)},
            units=dict(pairs("unit", self.units)),
            scales=dict(pairs("scale", self.scales)),
            kind=self.joint,
            rate_Hz=self.rate_Hz,
            allow_gaps=self.allow_gaps,
            delimiter=self.delimiter,
        )


@dataclass(frozen=True)
class Declared:
    """What is known of the sensors, and what the law is to have."""

    delay: list[str] | None = None
    gain: list[str] | None = None
    offset: list[str] | None = None
    term: list[str] | None = None
    cutoff_Hz: float = 75.0

    @property
    def fits_delay(self) -> bool:
        """Whether the delay of the effort is to be estimated."""
        return ("effort", "fit") in pairs("delay", self.delay)

    @property
    def sensors(self) -> "Sensors":
        """The known numbers; InputError for what no log of motion and effort tells."""
        from scissorcal.identify import Sensors

        known: dict[str, dict[str, float]] = {}
        for what, words in (("delay", self.delay), ("gain", self.gain), ("offset", self.offset)):
            known[what] = {}
            for name, value in pairs(what, words):
                if value == "fit":
                    if (what, name) != ("delay", "effort"):
                        raise InputError(_not_estimated(what, name))
                    continue
                try:
                    known[what][name] = float(value)
                except ValueError:
                    raise InputError(
                        f"--{what} {name}={value}: give a number, in SI units."
                    ) from None
        return Sensors(known["delay"], known["gain"], known["offset"])


_LOG = "Logs of one joint and layout: CSV, Parquet, .mat, or recordings (.mcap)."
_CHANNEL = "CHANNEL=..."
_WORDS = {
    "columns": typer.Option("-c", "--column", metavar=_CHANNEL, help="Column of a channel."),
    "units": typer.Option("-u", "--unit", metavar=_CHANNEL, help="Unit of a channel's column."),
    "scales": typer.Option("-s", "--scale", metavar=_CHANNEL, help="Factor of a channel's column."),
    "joint": typer.Option("--joint", help="Kind of joint, where no unit shows it."),
    "rate_Hz": typer.Option("--rate-hz", help="Samples per second, if there is no time column."),
    "allow_gaps": typer.Option("--allow-gaps", help="Keep gaps in time, with a note."),
    "delimiter": typer.Option(help="What separates the columns of a CSV file."),
    "delay": typer.Option(
        "--delay", metavar=_CHANNEL, help="Delay of a sensor in s; effort=fit estimates it."
    ),
    "gain": typer.Option("--gain", metavar=_CHANNEL, help="Gain of a sensor: reading per unit."),
    "offset": typer.Option("--offset", metavar=_CHANNEL, help="Offset of a sensor, in SI."),
    "term": typer.Option("--term", help="A term that the law has besides: 'sin(position)', ..."),
    "cutoff_Hz": typer.Option("--cutoff-hz", min=0.1, help="Where the windows pass half."),
}


@command
@options_of(_WORDS)
def identify(
    logs: Annotated[list[Path], typer.Argument(dir_okay=False, help=_LOG)],
    layout: Layout,
    declared: Declared,
    compare: Annotated[
        list[Path] | None, typer.Option(dir_okay=False, help="A log to predict, not fitted.")
    ] = None,
    to: Annotated[
        Target | None,
        typer.Option(help="Print the joint for another program, or write it with --export."),
    ] = None,
    export: Annotated[
        Path | None, typer.Option(dir_okay=False, help="The file that --to writes.")
    ] = None,
    effort: Annotated[Effort, typer.Option(help="Intervals: by curvature, or sampled.")] = "draft",
    output: Annotated[Path, typer.Option(dir_okay=False, help="The page.")] = Path("joint.html"),
) -> Answer:
    """Identify any joint from its log: inertia, friction, what is not known, exports.

    Needs no workspace. Channels are time, position, effort and, where the far end works against
    something, load. Columns and units are found from the headings (angle_deg, torque [N m]); where
    they are not, the command asks for -c, -u or -s. Several logs are fitted together.

    A reading of a sensor is gain times the quantity plus offset, late by delay: --gain effort=1.02,
    --offset effort=0.1, --delay effort=0.002; --delay effort=fit estimates it.

    \b
    Example:
      $ scissorcal identify DATA_EMPS.mat -c time=t -c position=qm -c effort=vir \\
          -u time=s -u position=m -u effort=V -s effort=gtau --to mujoco --export joint.xml
      Parameters: stribeck + angle + presliding, asymmetric: inertia 95.60 (95.12 to 96.10) kg; ...
      ...
      joint.html
      $ scissorcal identify run1.csv run2.csv --compare run3.csv
      ...
    """
    from datetime import UTC, datetime

    from scissorcal.identify import export_text, page_of, panels_of
    from scissorcal.identity import VERSION
    from scissorcal.report.panel import panels_text

    _refuse(logs, compare or [], output, to, export)
    joint, held = _identified(logs, compare or [], layout, declared, effort)
    panels = panels_of(joint, held)
    _write(output, page_of(joint, panels, (datetime.now(UTC), VERSION)))
    text, files = f"{panels_text(panels)}\n\n{output}", [output]
    if to and export:
        _write(export, export_text(joint, to))
        text += f"\n{export}: {_what_it_leaves(joint, to)}"
        files.append(export)
    elif to:
        text = export_text(joint, to).rstrip("\n")
    return Answer(_result(joint, held, to), text, files=files)


def _identified(
    logs: list[Path], compare: list[Path], layout: Layout, declared: Declared, effort: Effort
) -> "tuple[Identified, list[Held]]":
    """The joint of the logs, and how well it predicts each log to compare."""
    from scissorcal import identify as joints
    from scissorcal.identify.columns import named

    options, sensors = layout.options, declared.sensors
    with progress() as tell:
        tell(0.1, "reading")
        recordings = [named(joints.read_log(path, options)) for path in logs]
        others = [named(joints.read_log(path, options)) for path in compare]
        tell(0.3, "fitting")
        joint = joints.identify(
            recordings,
            effort=effort,
            sensors=sensors,
            fit_delay=declared.fits_delay,
            adopt=tuple(declared.term or ()),
            cutoff_Hz=declared.cutoff_Hz,
        )
        tell(0.8, "predicting")
        return joint, [joints.compare(joint, other) for other in others]


def _write(path: Path, text: str) -> None:
    from scissorcal.files import replacing

    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")


def _result(joint: "Identified", held: "list[Held]", to: Target | None) -> dict[str, Any]:
    """What ``--json`` prints: the joint, each compared log, what the export leaves."""
    from scissorcal.identify import off_by, result_of

    compared = [
        {
            "log": log.source,
            "rms": log.rms,
            "relative_rms": log.relative_rms,
            "share_inside": log.share_inside,
            "beyond": log.beyond,
            "differs": log.differs,
        }
        for log in held
    ]
    left = off_by(joint, to) if to else None
    return {**result_of(joint), "compared": compared, "export_off_by": left}


def _what_it_leaves(joint: "Identified", to: Target) -> str:
    """What an export leaves, in one sentence."""
    from scissorcal.identify import off_by

    if to in ("json", "csv"):
        return "all of the law" if to == "json" else "the friction curve in the middle of travel"
    return f"off the fitted law by {off_by(joint, to):.3g} {joint.fit.effort_unit} rms"


def _not_estimated(what: str, name: str) -> str:
    """Why a value of a sensor is not estimated, and what to do."""
    if what == "offset" and name == "effort":
        return (
            "--offset effort=fit is not needed: the law has the constant effort, or unequal "
            "friction by direction that contains it. Leave it out, or give a number."
        )
    why = {
        "gain": "it multiplies the whole law, so that no log tells it",
        "offset": "it moves the place alone, so that no log tells it",
        "delay": "only the delay of the effort against the position shows",
    }[what]
    if (what, name) == ("gain", "load"):
        return "--gain load=fit is not needed: laws with a load have its scale, load_gain."
    remedy = "estimate --delay effort=fit" if what == "delay" else "give a number"
    return f"--{what} {name}=fit: {why}; {remedy}."


def _refuse(
    logs: list[Path], compare: list[Path], output: Path, to: str | None, export: Path | None
) -> None:
    """Raise InputError for options that contradict each other."""
    if export and not to:
        raise InputError(f"--export {export} needs --to: one of {', '.join(get_args(Target))}.")
    if output.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"--output {output} is a page: give it a name that ends in .html.")
    for written in (output, *([export] if export else ())):
        for path in (*logs, *compare):
            if path.exists() and written.exists() and written.samefile(path):
                raise InputError(f"{written} is a log that is read: name another file.")
