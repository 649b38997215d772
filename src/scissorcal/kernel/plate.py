"""A plate whose pose is estimated: its section with the rig's plane, and the model's step there."""

import math
from dataclasses import dataclass, fields
from typing import Any

from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.layout import fill_struct
from scissorcal.kernel.stepping import StepOutput, step_output
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
