"""Coverage of a capture: which speeds were recorded at which angles, per direction, live."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.device.cut_trajectory import cut_openings, press_openings
from scissorcal.device.trajectory import advance_range, opening_range, sliding_speeds
from scissorcal.kernel import Identity
from scissorcal.recipe.requirements import CaptureKind
from scissorcal.recipe.schema import Recipe

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions
    from rich.table import Table
    from rich.text import Text

Range = tuple[float, float]
Direction = Literal["closing", "opening", "backward", "forward"]

FALLING: tuple[Direction, ...] = ("closing", "backward")

ANGLE_CELLS = 8
NEEDED_S = 0.02
RATE_WINDOW_S = 0.02


@dataclass(frozen=True)
class CoveredAxis:
    """Which axis a capture moves, in the words and units that people are shown.

    ``channel`` and ``effort`` are channels of a sample; ``places``, ``rates`` and ``efforts`` take
    their SI units to those shown.
    """

    channel: Literal["opening", "advance"]
    unit: str
    places: float
    rate_unit: str
    rates: float
    effort: Literal["motor_torque", "force_command"]
    effort_name: str
    effort_unit: str
    efforts: float

    def motion(self, kind: str, speed: float) -> str:
        """A stroke in words, without its speed where that is not finite.

        >>> ADVANCE.motion("backward", 0.012), OPENING.motion("excitation", float("nan"))
        ('backward at 12 mm/s', 'excitation')
        """
        pace = f" at {self.rates * speed:g} {self.rate_unit}" if np.isfinite(speed) else ""
        return f"{kind}{pace}"


OPENING = CoveredAxis(
    channel="opening",
    unit="deg",
    places=float(np.degrees(1.0)),
    rate_unit="rad/s",
    rates=1.0,
    effort="motor_torque",
    effort_name="motor torque",
    effort_unit="mN m",
    efforts=1e3,
)
ADVANCE = CoveredAxis(
    channel="advance",
    unit="mm",
    places=1e3,
    rate_unit="mm/s",
    rates=1e3,
    effort="force_command",
    effort_name="commanded force",
    effort_unit="N",
    efforts=1.0,
)


class CoverageGrid:
    """Seconds of motion by direction, speed and place; a cell is filled once it has ``needed_s``.

    ``speeds`` (rad/s, ascending) are the nominal ones; a cell of speed reaches half-way to its
    neighbours in the logarithm, and by the same factor outwards. ``cells`` are ranges of opening
    (rad); of the advance both are in metres. Motion outside all cells is not counted. Samples may
    come in blocks of any size.
    """

    def __init__(
        self,
        speeds: tuple[float, ...],
        cells: tuple[Range, ...],
        directions: tuple[Direction, ...] = ("closing", "opening"),
        needed_s: float = NEEDED_S,
        axis: CoveredAxis = OPENING,
    ) -> None:
        self.axis = axis
        self.speeds = tuple(sorted(set(speeds)))
        self.directions = directions
        self.needed_s = needed_s
        self.cells = cells
        self.speed_edges = _speed_edges(np.asarray(self.speeds))
        self.seconds = np.zeros((len(directions), len(self.speeds), len(cells)))
        self._time = np.zeros(0)
        self._opening = np.zeros(0)

    def add(self, samples: NDArray[np.void], counted: NDArray[np.bool_] | None = None) -> None:
        """Count a block of samples (SAMPLE_DTYPE) that follows what was added before.

        The rate at a sample is the difference over a window of 20 ms that ends there; a gap or a
        repeat of the device's clock ends the window. ``counted`` masks the samples that count, by
        default all.
        """
        if len(samples) == 0:
            return
        time = np.concatenate([self._time, samples["device_time_us"] * 1e-6])
        opening = np.concatenate([self._opening, samples[self.axis.channel]])
        step = np.diff(time, prepend=time[0])
        usual = float(np.median(step[1:])) if len(step) > 1 else 0.0
        window = max(1, round(RATE_WINDOW_S / usual)) if usual > 0 else 1
        new = np.arange(len(self._time), len(time))
        new = new[new >= window]
        span = time[new] - time[new - window]
        sound = (span > 0) & (span < 1.5 * RATE_WINDOW_S)
        if counted is not None:
            sound &= counted[new - len(self._time)]
        new, span = new[sound], span[sound]
        rate = (opening[new] - opening[new - window]) / span
        middle = 0.5 * (opening[new] + opening[new - window])
        self._count(rate, middle, span / window)
        keep = min(len(time), window)
        self._time, self._opening = time[-keep:], opening[-keep:]

    @property
    def filled(self) -> NDArray[np.bool_]:
        """Which cells have enough, shape (directions, speeds, angles)."""
        return np.asarray(self.seconds >= self.needed_s)

    @property
    def share(self) -> float:
        """Share of the cells that are filled, from 0 to 1."""
        return float(self.filled.mean())

    def sentence(self) -> str:
        """One line: how many cells are filled, and which speeds are not.

        >>> CoverageGrid((0.1, 0.5), even_cells((0.2, 0.8))).sentence()
        '0 of 32 cells filled; thin: closing at 0.1, 0.5 rad/s; opening at 0.1, 0.5 rad/s'
        """
        parts = []
        for d, direction in enumerate(self.directions):
            speeds = [
                f"{self.axis.rates * speed:g}"
                for speed, filled in zip(self.speeds, self.filled[d].all(axis=1), strict=True)
                if not filled
            ]
            if speeds:
                parts.append(f"{direction} at {', '.join(speeds)} {self.axis.rate_unit}")
        counts = f"{int(self.filled.sum())} of {self.filled.size} cells filled"
        return f"{counts}; thin: {'; '.join(parts)}" if parts else counts

    def table(self, *, narrow: bool = False) -> "Table":
        """Return the grid as a table for rich: a row per speed, a column per place.

        In a ``narrow`` one a column is named by the lower end of its place alone.
        """
        from rich.table import Table

        axis = self.axis
        table = Table(padding=(0, 0 if narrow else 1))
        table.add_column(axis.rate_unit, justify="right", no_wrap=True)
        for cell in self.cells:
            low, high = (axis.places * end for end in cell)
            name = f"{low:.0f}" if narrow else f"{low:.0f}-{high:.0f}"
            table.add_column(name, justify="center", no_wrap=True)
        for d, direction in enumerate(self.directions):
            for s, speed in enumerate(self.speeds):
                marks = [self._mark(float(seconds)) for seconds in self.seconds[d, s]]
                name = f"{direction} {axis.rates * speed:g}"
                table.add_row(name, *marks, end_section=s + 1 == len(self.speeds))
        return table

    def __rich_console__(
        self, console: "Console", options: "ConsoleOptions"
    ) -> "Iterator[Table | Text]":
        """The table that a terminal has place for, under a title; else the sentence."""
        from rich.measure import Measurement
        from rich.text import Text

        of = f"{self.axis.channel} ({self.axis.unit})"
        roomy = options.update(width=10_000)
        for narrow in (False, True):
            table = self.table(narrow=narrow)
            if Measurement.get(console, roomy, table).maximum <= options.max_width:
                over = f"{of}, from" if narrow else of
                speed = f"speed ({self.axis.rate_unit})"
                yield Text(f"coverage {100 * self.share:.0f} %: {speed} over {over}")
                yield table
                return
        yield Text(self.sentence())

    def _mark(self, seconds: float) -> str:
        if seconds >= self.needed_s:
            return "[green]█[/green]"
        return "[yellow]▄[/yellow]" if seconds > 0 else "[dim]·[/dim]"

    def _count(self, rate: Array, opening: Array, seconds: Array) -> None:
        speed = np.searchsorted(self.speed_edges, np.abs(rate), side="right") - 1
        towards = np.full(len(rate), -1)
        for d, direction in enumerate(self.directions):
            towards[(rate < 0) if direction in FALLING else (rate > 0)] = d
        fits = (speed >= 0) & (speed < len(self.speeds)) & (towards >= 0)
        low, high = np.asarray(self.cells, dtype=np.float64).reshape(-1, 2).T
        inside = (opening[:, None] >= low) & (opening[:, None] < high) & fits[:, None]
        sample, cell = np.nonzero(inside)  # cells may overlap
        shape = self.seconds.shape
        place = np.ravel_multi_index((towards[sample], speed[sample], cell), shape)
        counted = np.bincount(place, seconds[sample], minlength=self.seconds.size)
        self.seconds += counted.reshape(shape)


def even_cells(opening: Range, count: int = ANGLE_CELLS) -> tuple[Range, ...]:
    """Divide a range of openings into cells of equal width."""
    edges = [float(edge) for edge in np.linspace(*opening, count + 1)]
    return tuple(pairwise(edges))


def coverage_of(
    recipe: Recipe, identity: Identity, kind: CaptureKind, hand: bool = False
) -> CoverageGrid:
    """Grid of a capture: its speeds over the openings of the scene, or the travel of the carriage.

    Friction counts both directions, a cut closing alone. Planned presses have a cell for each place
    at which they press.
    """
    capture = recipe.capture
    if kind == "friction-advance":
        cells = even_cells(advance_range(recipe, identity))
        return CoverageGrid(sliding_speeds(recipe), cells, ("backward", "forward"), axis=ADVANCE)
    cells = even_cells(opening_range(recipe, identity))
    if kind == "friction":
        return CoverageGrid(capture.friction.speeds_rad_per_s, cells)
    if not hand and recipe.scene.cut:
        cells = even_cells(cut_openings(recipe, identity))
    elif not hand:
        cells = press_openings(recipe, identity)
    return CoverageGrid(capture.cut.speeds_rad_per_s, cells, ("closing",))


def _speed_edges(speeds: Array) -> Array:
    """Edges of the cells of speed: geometric means inside, the same factor outside."""
    inner = np.sqrt(speeds[1:] * speeds[:-1])
    first = speeds[0] ** 2 / inner[0] if len(inner) else speeds[0] / 2
    last = speeds[-1] ** 2 / inner[-1] if len(inner) else speeds[-1] * 2
    return np.concatenate([[first], inner, [last]])
