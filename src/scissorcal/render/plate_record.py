"""The estimates of a plate's pose in a recording: attached tables of what was placed."""

from scissorcal.recording import RecordingWriter
from scissorcal.render.plate_section import PlateSection

ROW_NAMES = (
    "time_s",
    "edge_x_m",
    "edge_y_m",
    "pitch_rad",
    "stretch",
    "thickening",
    "height_m",
    "usable",
)
"""Columns of what is kept of each estimate; ``time_s`` is of the source's clock, ``pitch_rad`` and
``height_m`` are the plate's, also where they are not rendered."""
ROWS_A_TABLE = 6000
"""A minute at 100 Hz: a killed rendering loses no more, and memory does not grow."""


class PlateRecord:
    """Attaches estimates to a recording as ``plate-0001.csv`` and so on, a minute each.

    One row an estimate that had a place; ``usable`` is 0 where it was not used. Samples with the
    flag PLATE_OUT were rendered with less than their force.
    """

    def __init__(self, writer: RecordingWriter) -> None:
        self._writer = writer
        self._rows: list[str] = []
        self._tables = 0

    def add(self, time_s: float, placed: PlateSection, usable: bool) -> None:
        """Keep one estimate."""
        section = placed.section
        place = (time_s, section.edge_x, section.edge_y, placed.pitch_rad)
        shape = (section.stretch, section.thickening, placed.height_m, float(usable))
        self._rows.append(",".join(f"{value:.9g}" for value in (*place, *shape)))
        if len(self._rows) >= ROWS_A_TABLE:
            self.flush()

    def flush(self) -> None:
        """Attach what is not attached yet."""
        if self._rows:
            self._tables += 1
            text = "\n".join([",".join(ROW_NAMES), *self._rows]) + "\n"
            self._writer.attach(f"plate-{self._tables:04d}.csv", text.encode(), "text/csv")
        self._rows = []
