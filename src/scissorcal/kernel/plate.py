"""Plates other than one whole sheet at a known place, and the model's step on them.

Either the pose is estimated, and the servo takes the section of plate and rig's plane; or the plate
is drawn, and consists of pieces with gaps between them. A plate is not both at once.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.layout import fill_struct
from scissorcal.kernel.stepping import StepOutput, step_many, step_output
from scissorcal.kernel.tables import ModelTables, model_struct


@dataclass(frozen=True)
class Section:
    """Where the rig's plane meets the upper face of a plate.

    ``edge_x`` and ``edge_y`` (m) are the near edge in the rig's frame, ``pitch`` (rad) the face's
    rise against the advance. ``stretch`` is the section's length per length of the plate along the
    cut, ``thickening`` the thickness in the plane over the plate's own. Between two moving blades
    the plate is held in the middle: there ``pitch`` is 0 and ``edge_y`` the centred face's height.
    """

    edge_x: float
    edge_y: float
    pitch: float = 0.0
    stretch: float = 1.0
    thickening: float = 1.0

    def is_sound(self, moving_blades: int) -> bool:
        """Whether the kernel takes it: finite, and of a plate that these blades can meet."""
        struct = ffi.new("sc_section *")
        _fill_section(struct, self)
        return bool(lib.sc_section_is_sound(struct, moving_blades))


@dataclass(frozen=True)
class PlateConfig:
    """How the servo follows estimates of the plate's pose; by default it is known.

    The section moves to a new estimate within ``move_s``. Where an estimate is not usable, or older
    than ``stale_us``, the force falls to nothing within ``fall_s``. ``face_low`` and ``face_high``
    (m) are the heights of the upper face over which the tables' ``release_falls`` holds. Raises
    ValueError for a time that is not positive and finite.
    """

    is_estimated: bool = False
    stale_us: int = 100_000
    move_s: float = 0.015
    fall_s: float = 0.1
    face_low: float = 0.0
    face_high: float = 0.0

    def __post_init__(self) -> None:
        for name in ("stale_us", "move_s", "fall_s"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be above 0 and finite.")
        if not (math.isfinite(self.face_low) and math.isfinite(self.face_high)):
            raise ValueError("face_low and face_high must be finite.")


KNOWN_PLATE = PlateConfig()
"""Nothing of this is evaluated."""


@dataclass(frozen=True)
class Pull:
    """What the material pushes the plate with, by number of its section: N, N, N m and J."""

    edge_x: float
    edge_y: float
    pitch: float
    stretch: float


class PlacedModel:
    """A model on a plate that moves, stepped in C as in the servo.

    >>> placed = PlacedModel(tables)                                        # doctest: +SKIP
    >>> placed.step(Section(0.03, 1e-4), 0.5, -0.3, -0.03)[0].torque        # doctest: +SKIP
    0.0531
    """

    def __init__(self, tables: ModelTables, config: PlateConfig = KNOWN_PLATE) -> None:
        self.tables = tables
        self._model, self._keep = model_struct(tables)
        self._config = ffi.new("sc_plate_config *")
        fill_struct(self._config, config)
        self._state = ffi.new("sc_crack *")
        self._out = ffi.new("sc_step_output *")
        self._pull = ffi.new("sc_pull *")
        self._section = ffi.new("sc_section *")

    @property
    def crack(self) -> float:
        """Crack tip in the plate, along the cut from its near edge, m."""
        return float(self._state.crack)

    def reset(self, crack: float = 0.0) -> None:
        """Put the crack tip at ``crack`` (m); a fresh sheet has it at 0."""
        self._state.crack = crack
        self._state.detached = 0

    def step(
        self, section: Section, opening: float, rate: float, advance: float
    ) -> tuple[StepOutput, Pull]:
        """Move blades (rad, rad/s, m) and plate; what the step gives, and the pull on the plate.

        ``contact``, ``height`` and ``indentation`` of the output are in the plate's axes.
        """
        _fill_section(self._section, section)
        lib.sc_plate_step(
            self._config,
            self._model,
            self._section,
            self._state,
            opening,
            rate,
            advance,
            self._out,
            self._pull,
        )
        pull = Pull(*(float(getattr(self._pull, field.name)) for field in fields(Pull)))
        return step_output(self._out), pull

    def torque(self, section: Section, opening: float, advance: float, crack: float) -> float:
        """Torque (N m) without friction, blades at rest: where the tables cut, as a crack runs.

        Else pressed, with the material's front at ``crack``. NaN where a step would be INVALID.
        """
        _fill_section(self._section, section)
        return float(lib.sc_plate_torque(self._model, self._section, opening, advance, crack))


def _fill_section(struct: Any, section: Section) -> None:
    """Copy a section, a hundred times a second and more: quicker than `fill_struct`."""
    struct.edge_x, struct.edge_y, struct.pitch = section.edge_x, section.edge_y, section.pitch
    struct.stretch, struct.thickening = section.stretch, section.thickening


def placing(section: Section, usable: bool, age_s: float) -> Any:
    """The C struct of an estimate, for the servo and for a loop's block."""
    struct = ffi.new("sc_placing *")
    _fill_section(struct.section, section)
    struct.usable = int(usable)
    struct.age_us = round(min(max(age_s, 0.0), 1000.0) * 1e6)
    return struct


MOST_PIECES = int(lib.SC_PIECES_MAX)
MOST_STRIPS = int(lib.SC_STRIPS_MAX)
"""Of all pieces together."""
LARGEST_SCALE = 1000.0


@dataclass(frozen=True)
class Strip:
    """The part of a piece up to ``end_m`` (plate frame), with the energy that its cut takes.

    0 J/m is a strip that is not cut, as in :class:`ModelTables`. Raises ValueError for a number
    that is not finite, or an energy below 0.
    """

    end_m: float
    fracture_energy_J_per_m: float

    def __post_init__(self) -> None:
        if not _is_finite(self.end_m):
            raise ValueError(f"A strip must end at a finite place, not at {self.end_m} m.")
        energy = self.fracture_energy_J_per_m
        if not (_is_finite(energy) and energy >= 0.0):
            raise ValueError(f"A strip's fracture energy is {energy} J/m; it must be 0 or more.")


@dataclass(frozen=True)
class Piece:
    """A stretch of material without a gap, from ``begin_m`` (plate frame) to its last strip's end.

    ``upper_face_m`` is its y_top, as :class:`ModelTables` has it; its response is ``scale`` times
    the model's. Strips are bonded: where the crack leaves one it is in the next. Raises ValueError
    for numbers that the kernel would not take.

    >>> Piece(0.0, 1e-4, 1.0, (Strip(0.02, 0.6), Strip(0.05, 1.2))).end_m
    0.05
    """

    begin_m: float
    upper_face_m: float
    scale: float
    strips: tuple[Strip, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "strips", tuple(self.strips))
        if not _is_finite(self.begin_m):
            raise ValueError(f"A piece must begin at a finite place, not at {self.begin_m} m.")
        if not (_is_finite(self.upper_face_m) and np.float32(self.upper_face_m) > 0.0):
            raise ValueError(
                f"A piece's upper face is at {self.upper_face_m} m; it must be above 0."
            )
        if not (0.0 < self.scale <= LARGEST_SCALE and np.float32(self.scale) > 0.0):
            raise ValueError(
                f"A piece's scale is {self.scale}; it must be above 0, at most {LARGEST_SCALE:g}."
            )
        if not self.strips:
            raise ValueError("A piece needs at least one strip.")
        ends = np.array([self.begin_m, *(strip.end_m for strip in self.strips)], dtype=np.float32)
        if not np.all(ends[1:] > ends[:-1]):
            raise ValueError(
                "The ends of a piece's strips must ascend from its begin, also once rounded to "
                "float32."
            )
        most = max(strip.fracture_energy_J_per_m for strip in self.strips)
        if not _is_finite(most / self.scale):
            raise ValueError("A piece's fracture energy divided by its scale overflows float32.")

    @property
    def end_m(self) -> float:
        """Place of its far edge in the plate frame."""
        return self.strips[-1].end_m


class PiecesModel:
    """A model on a plate made of pieces, stepped in C as in the servo; at first a fresh sheet.

    The tables' own ``upper_face`` and ``fracture_energy`` are not used: the pieces have theirs.

    >>> piece = Piece(0.0, 5e-5, 1.0, (Strip(0.05, 0.6),))              # doctest: +SKIP
    >>> PiecesModel(tables, [piece]).step(0.5, -0.3, -0.03).torque      # doctest: +SKIP
    0.0531
    """

    def __init__(self, tables: ModelTables, pieces: Sequence[Piece]) -> None:
        self.tables = tables
        self.pieces = tuple(pieces)
        self._model, self._keep = model_struct(tables)
        self._config = ffi.new("sc_pieces_config *")
        fill_pieces(self._config, self.pieces, self._model)
        self._state = ffi.new("sc_pieces *")
        self._out = ffi.new("sc_step_output *")
        self.reset()

    def reset(self) -> None:
        """Put a fresh sheet: all cracks at their near edges, felt once the blades have opened."""
        lib.sc_pieces_fresh(self._config, self._state)

    @property
    def cracks(self) -> tuple[float, ...]:
        """Crack tip of each piece (m, plate frame); its far end where it is cut through."""
        return tuple(float(self._state.of[i].crack.crack) for i in range(len(self.pieces)))

    @property
    def cut_through(self) -> tuple[bool, ...]:
        """Whether each piece is: then it gives no force until the sheet is fresh."""
        return tuple(
            self._state.of[i].strip == len(piece.strips) for i, piece in enumerate(self.pieces)
        )

    def step(self, opening: float, rate: float, advance: float) -> StepOutput:
        """Move the blades to ``opening`` (rad) and ``advance`` (m) at ``rate`` (rad/s).

        ``contact``, ``indentation``, ``height`` and ``response`` are those of the piece of the
        largest response or, where none touches, of the one over which the edge stands lowest.
        """
        lib.sc_pieces_step(
            self._config, self._model, self._state, opening, rate, advance, self._out
        )
        return step_output(self._out)

    def step_many(
        self, opening: ArrayLike, rate: ArrayLike, advance: ArrayLike
    ) -> NDArray[np.void]:
        """Take N steps in one C loop; inputs broadcast to shape (N,).

        Returns shape (N,) with STEP_DTYPE.
        """
        stepped = (self._config, self._model, self._state)
        return step_many(lib.sc_pieces_step_many, stepped, opening, rate, advance)


def fill_pieces(struct: Any, pieces: Sequence[Piece], model: Any) -> None:
    """Copy pieces into the C struct and prepare them for a model.

    Raises ValueError for none at all, and for more than the kernel holds.
    """
    _check_pieces(pieces)
    strips = [strip for piece in pieces for strip in piece.strips]
    struct.count = len(pieces)
    first = 0
    for i, piece in enumerate(pieces):
        to = struct.piece[i]
        to.begin, to.upper_face, to.scale = piece.begin_m, piece.upper_face_m, piece.scale
        to.first, to.count = first, len(piece.strips)
        first += len(piece.strips)
    for k, strip in enumerate(strips):
        struct.strip[k].end = strip.end_m
        struct.strip[k].fracture_energy = strip.fracture_energy_J_per_m
    if not lib.sc_pieces_are_sound(struct):
        raise ValueError("The kernel refuses these pieces: their numbers do not fit float32.")
    lib.sc_pieces_prepare(model, struct)


def _check_pieces(pieces: Sequence[Piece]) -> None:
    """Raise ValueError for no pieces at all, and for more than the kernel holds."""
    strips = sum(len(piece.strips) for piece in pieces)
    if not pieces:
        raise ValueError("A plate of pieces needs at least one; a uniform sheet has no list.")
    if len(pieces) > MOST_PIECES or strips > MOST_STRIPS:
        raise ValueError(
            f"A plate has up to {MOST_PIECES} pieces and {MOST_STRIPS} strips in all, not "
            f"{len(pieces)} and {strips}."
        )


def refuse_pieces(pieces: Sequence[Piece], has_model: bool, plate_is_estimated: bool) -> None:
    """Raise ValueError for pieces that cannot be rendered: without a model, on a tracked plate."""
    _check_pieces(pieces)
    if not has_model:
        raise ValueError("Pieces of a plate need the tables of a model, and there are none.")
    if plate_is_estimated:
        raise ValueError(
            "Pieces of a plate do not go together with an estimated pose of it: render them with "
            "the pose known, or a uniform sheet with the pose estimated."
        )


def largest_overlap(
    pieces: Sequence[Piece], reach_m: float = math.inf, each: Sequence[float] | None = None
) -> float:
    """The largest sum of ``each`` over pieces that one blade can press at once.

    That is over pieces of which a stretch lies within ``reach_m`` along the cut, by default the
    whole line. ``each`` is by default the pieces' scales: then this is the factor by which
    overlapping pieces stiffen the scene of a uniform sheet, at equal indentations. Where strips
    are tougher than that sheet, their indentations are deeper: give each piece's own stiffness.

    >>> sheet = Piece(0.0, 1e-4, 1.0, (Strip(0.05, 0.6),))
    >>> layer = Piece(0.02, 3e-4, 2.0, (Strip(0.03, 0.6),))
    >>> far = Piece(0.06, 1e-4, 5.0, (Strip(0.07, 0.6),))
    >>> largest_overlap([sheet, layer, far], 0.005), largest_overlap([sheet, layer, far])
    (5.0, 8.0)
    """
    amounts = [piece.scale for piece in pieces] if each is None else list(each)
    if len(amounts) != len(pieces):
        raise ValueError("Give one number for each piece.")
    if not reach_m >= 0.0:
        raise ValueError(f"A blade's reach is 0 m or more, not {reach_m} m.")
    return max(
        (
            sum(
                amount
                for piece, amount in zip(pieces, amounts, strict=True)
                if piece.begin_m <= far.begin_m <= piece.end_m + reach_m
            )
            for far in pieces
        ),
        default=0.0,
    )


def _is_finite(number: float) -> bool:
    with np.errstate(over="ignore"):
        return bool(np.isfinite(np.float32(number)))
