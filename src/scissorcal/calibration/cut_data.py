"""Cuts made ready for a fit: conditioned, freed from friction, with the geometry they need."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.conditioning import Bins
from scissorcal.calibration.friction_experiment import friction_law
from scissorcal.calibration.layout import Layout, Parameter
from scissorcal.calibration.result import FitResult
from scissorcal.model import Cutting, Edge, Response, cut_torque_along, friction_torque
from scissorcal.recipe.schema import Recipe

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CrackHistory:
    """What the crack did at each bin of CutData.whole, all (n,).

    ``advancing`` says whether it moved, ``last`` which bin moved it last (itself, while it
    advances), ``begun`` whether the sheet has been cut into at all.
    """

    advancing: NDArray[np.bool_]
    last: NDArray[np.int64]
    begun: NDArray[np.bool_]


class CutData:
    """Conditioned cuts with the friction they are to be freed from.

    ``whole`` has every bin with a sheet in place, which the crack's history needs; ``used``
    (whole,) marks those within strokes and surely moving, ``bins`` holds them. ``begins`` (whole,)
    marks the first bin of each sheet, ``strokes`` numbers the strokes of the
    used bins, ``runs`` their uninterrupted stretches.
    """

    def __init__(self, every: Bins, recipe: Recipe, friction: FitResult) -> None:
        loaded = every.sheet >= 0
        self.whole = every.where(loaded)
        self.used = self.whole.moving & (self.whole.stroke >= 0)
        self.bins = self.whole.where(self.used)
        self.strokes = self.bins.stroke
        self.runs = np.cumsum(~self.used)[self.used] + len(self.used) * self.bins.stroke
        self.geometry = geometry_of(recipe)
        self.center = float(friction.structure["angle_center"])
        self.friction_layout, self.friction_mean, self.friction_precision = _friction_prior(
            friction
        )
        self.inertia = friction.parameter("inertia").mean
        self.empty_noise = float(friction.diagnostics["residual_rms"])
        self.sheets = _runs(self.whole.sheet)
        node = self.whole.rate * self.whole.bin_s / np.sqrt(12.0)
        self.fine_opening = np.stack(
            [self.whole.opening - node, self.whole.opening + node], axis=1
        ).ravel()
        self.fine_advance = np.repeat(self.whole.advance, 2)
        self.begins = np.zeros(len(self.whole.sheet), dtype=bool)
        self.begins[[run.start for run in self.sheets if run.stop > run.start]] = True

    def material_torque(self, u: Array) -> Array:
        """Torque that is left for the material, given a point's friction parameters (last)."""
        own = u[-len(self.friction_layout.parameters) :]
        values = self.friction_layout.natural(own)
        bins = self.bins
        empty = friction_torque(friction_law(values, self.center), bins.opening, bins.rate)
        offset = values.get("offset", np.asarray(0.0))
        return np.asarray(self.inertia * bins.acceleration + empty + offset - bins.drive)

    def along(self, cutting: Cutting) -> tuple[Array, Array]:
        """Model torque, averaged over each bin of ``whole``, and the crack tip at its end.

        The response bends within a bin where the blades close fast, so that the mean is taken over
        the two Gauss-Legendre points of the bin, not its middle.
        """
        torque = np.empty(2 * len(self.whole.opening))
        tip = np.empty_like(torque)
        for run in self.sheets:
            fine = slice(2 * run.start, 2 * run.stop)
            torque[fine], tip[fine] = cut_torque_along(
                cutting, self.fine_opening[fine], self.fine_advance[fine], 0.0
            )
        return torque.reshape(-1, 2).mean(axis=1), tip[1::2]

    def history(self, cutting: Cutting) -> CrackHistory:
        """When the crack advances, by a model of it."""
        _, tip = self.along(cutting)
        moved = np.where(self.begins, 0.0, np.diff(tip, prepend=tip[:1])) > 0
        index = np.arange(len(tip))
        last = np.maximum.accumulate(np.where(moved | self.begins, index, 0))
        return CrackHistory(moved, last, tip > 0.0)

    def contact(self, cutting: Cutting) -> Array:
        """Contact x_c at every used bin."""
        return np.asarray((self.along(cutting)[1] - self.whole.advance)[self.used])


def cutting_from(structure: dict[str, Any], values: dict[str, Array]) -> Cutting:
    """The model of a cut from a fit's structure and parameters by name.

    ``values`` may hold scalars or arrays that broadcast with what the model is evaluated on.
    """
    edge = structure["edge"]
    return Cutting(
        edge=Edge(**edge),
        response=Response(
            structure["response"],
            values["response_force"],
            values["response_exponent"],
            structure["reference_indentation_m"],
        ),
        moving_blades=structure["moving_blades"],
        upper_face_m=structure["upper_face_m"],
        fracture_energy=values.get("fracture_energy"),
        kappa=values.get("kappa", 1.0),
        closure=structure["closure"],
    )


def geometry_of(recipe: Recipe) -> dict[str, Any]:
    """A recipe's geometry as the structure that a cut's fit carries."""
    edge = recipe.rig.edge
    return {
        "closure": recipe.scene.closure,
        "reference_indentation_m": recipe.fit.cut.reference_indentation_mm * 1e-3,
        "moving_blades": recipe.rig.moving_blades,
        "upper_face_m": recipe.upper_face_m,
        "edge": {
            "family": edge.family,
            "offset_m": edge.offset_mm * 1e-3,
            "taper_rad": float(np.radians(edge.taper_deg)),
            "length_m": edge.length_mm * 1e-3,
            "curvature_per_m": edge.curvature_per_m,
        },
    }


def _runs(labels: NDArray[np.int64]) -> list[slice]:
    ends = [0, *(np.flatnonzero(np.diff(labels)) + 1).tolist(), len(labels)]
    return [slice(low, high) for low, high in pairwise(ends)]


def _friction_prior(friction: FitResult) -> tuple[Layout, Array, Array]:
    """Friction's posterior as a normal prior in unconstrained coordinates.

    Without the inertia, which is held at its mean: it is known to a percent, while the noise of
    the acceleration in a cut would draw it towards zero.
    """
    signed = ("offset", "angle_slope", "angle_curvature")
    columns, rows = [], []
    for parameter in friction.parameters:
        if parameter.name == "inertia":
            continue
        draws = friction.column(parameter.name)
        signed_one = parameter.name in signed
        u = draws if signed_one else np.log(draws)
        columns.append(u)
        rows.append(
            Parameter(
                parameter.name,
                parameter.unit,
                "identity" if signed_one else "log",
                float(u.mean()),
                float(u.std(ddof=1)),
                parameter.meaning,
            )
        )
    cloud = np.stack(columns, axis=1)
    covariance = np.cov(cloud, rowvar=False)
    return Layout(tuple(rows)), cloud.mean(axis=0), np.linalg.inv(covariance)
