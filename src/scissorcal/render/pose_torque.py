"""How uncertain a plate's pose makes the rendered torque."""

from dataclasses import dataclass, fields, replace
from statistics import NormalDist

import numpy as np

from scissorcal.aliases import Array
from scissorcal.kernel import Kernel, ModelTables, PlacedModel, Section
from scissorcal.package.grid import FELT_SHARE

OPENINGS, CONTACTS = 24, 12


@dataclass(frozen=True)
class TorqueSpread:
    """What the pose's uncertainty does to the torque at one state of the rig.

    ``torque_Nm`` is the package's there, ``sd_Nm`` its standard deviation by the pose.
    ``half_width`` is half of the interval at the scene's confidence over the torque, or over 5 % of
    the scene's largest where that is more.
    """

    torque_Nm: float
    sd_Nm: float
    half_width: float


class PoseTorque:
    """The torque of a package as its plate's section has it.

    Where the scene cuts it is that of a running crack at the opening: a place of the near edge that
    is wrong by a constant moves crack and plate alike and leaves it as it is. Where the scene
    presses, it is that of the pressed edge. ``limit_Nm`` is the torque limit of the rendering.
    """

    def __init__(self, tables: ModelTables, confidence: float, limit_Nm: float) -> None:
        self._tables = tables
        self._placed = PlacedModel(tables)
        self._widths = NormalDist().inv_cdf(0.5 + 0.5 * confidence)
        self._limit = limit_Nm
        self._least = FELT_SHARE * _largest(tables, limit_Nm)

    def spread(
        self, section: Section, covariance: Array, opening: float, advance: float
    ) -> TorqueSpread:
        """The spread of torque by ``covariance`` (5, 5) of the section's numbers.

        One standard deviation either way along each principal axis, so that bends within the
        uncertainty count; infinite where the torque is not defined that near. ``opening`` (rad) is
        taken within the scene's range.
        """
        theta = float(np.clip(opening, self._tables.opening_min, self._tables.opening_max))
        middle = _numbers(section)
        torque = self._torque(middle, theta, advance)
        if not np.all(np.isfinite(covariance)):
            return TorqueSpread(torque, np.inf, np.inf)
        changes = self._changes(middle, _principal(covariance), theta, advance)
        sd = float(np.sqrt(np.sum(np.square(changes))))
        sd = sd if np.isfinite(sd) and np.isfinite(torque) else np.inf
        size = max(abs(torque), self._least) if np.isfinite(torque) else self._least
        width = self._widths * sd / size if size > 0.0 else (0.0 if sd == 0.0 else np.inf)
        return TorqueSpread(torque, sd, width)

    def largest_share(
        self, section: Section, covariance: Array, opening: float, advance: float
    ) -> int:
        """Which of the section's numbers would spread the torque most by its own uncertainty."""
        theta = float(np.clip(opening, self._tables.opening_min, self._tables.opening_max))
        alone = np.diag(np.sqrt(np.maximum(np.diag(covariance), 0.0)))
        changes = np.abs(self._changes(_numbers(section), alone, theta, advance))
        return int(np.argmax(np.where(np.isfinite(changes), changes, np.inf)))

    def _changes(self, middle: Array, ways: Array, opening: float, advance: float) -> Array:
        """Half of the torque's change from one side of the middle to the other, (n,)."""
        return np.array(
            [
                0.5
                * (
                    self._torque(middle + way, opening, advance)
                    - self._torque(middle - way, opening, advance)
                )
                for way in ways
            ]
        )

    def _torque(self, numbers: Array, opening: float, advance: float) -> float:
        torque = self._placed.torque(Section(*numbers.tolist()), opening, advance, 0.0)
        return min(max(torque, -self._limit), self._limit)  # not a number stays one


def _largest(tables: ModelTables, limit_Nm: float) -> float:
    """Largest torque of the material over the scene, within the limit."""
    openings = np.linspace(tables.opening_min, tables.opening_max, OPENINGS)[:, None]
    contacts = np.linspace(tables.contact_min, tables.contact_max, CONTACTS)[None]
    torque = Kernel(replace(tables, render_friction=False)).torque(openings, 0.0, contacts)
    return float(np.nanmax(np.minimum(np.abs(torque), limit_Nm), initial=0.0))


def _numbers(section: Section) -> Array:
    return np.array([getattr(section, field.name) for field in fields(Section)])


def _principal(covariance: Array) -> Array:
    """Rows: one standard deviation along each principal axis, in units of each number's own sd."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    unit = np.where(sd > 0.0, sd, 1.0)
    values, axes = np.linalg.eigh(covariance / np.outer(unit, unit))
    ways: Array = (axes * np.sqrt(np.maximum(values, 0.0))).T * unit
    return ways[np.any(ways != 0.0, axis=1)]
