"""A fit of a cut predicts the material's torque: the equations of docs/model.md, the package."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scissorcal.calibration import FitResult
from scissorcal.errors import InputError
from scissorcal.package import build_package, open_package
from tests.package.fits import cut_fit, friction_fit, recipe

OPENINGS = np.radians([20.0, 30.0, 40.0])


class Straight:
    """A straight edge of a recipe between two turning blades, by the equations alone."""

    def __init__(self) -> None:
        rig = recipe().rig
        self.offset = 1e-3 * rig.edge.offset_mm
        self.taper = np.radians(rig.edge.taper_deg)
        self.top = recipe().upper_face_m
        self.reference = 1e-3 * recipe().fit.cut.reference_indentation_mm

    def slope(self, opening):
        return np.tan(0.5 * opening + self.taper)

    def contact_of(self, opening, height):
        """Contact at which the edge has a height: s from y(s), then x(s)."""
        beta, rise = 0.5 * opening, np.tan(self.taper)
        s = (height - self.offset * np.cos(beta)) / (np.sin(beta) + rise * np.cos(beta))
        return s * np.cos(beta) - (self.offset + rise * s) * np.sin(beta)

    def height_of(self, opening, contact):
        beta, rise = 0.5 * opening, np.tan(self.taper)
        s = (contact + self.offset * np.sin(beta)) / (np.cos(beta) - rise * np.sin(beta))
        return s * np.sin(beta) + (self.offset + rise * s) * np.cos(beta)


def quantiles(torque: np.ndarray) -> np.ndarray:
    return np.quantile(torque, [0.05, 0.5, 0.95], axis=0)


def drawn(fit: FitResult, name: str) -> np.ndarray:
    return fit.sample(name)[:, None]


def bands(fit: FitResult, *args, **kwargs) -> list[np.ndarray]:
    band = fit.predict(*args, **kwargs)
    return [band.low, band.torque, band.high]


@pytest.mark.parametrize("kappa", [None, 0.75])
def test_a_running_crack_takes_its_mean_energy(kappa: float | None) -> None:
    fit, edge = cut_fit(recipe(), kappa=kappa), Straight()
    power, energy = drawn(fit, "response_exponent"), drawn(fit, "fracture_energy")
    share = np.ones_like(power)
    if kappa:
        kept = drawn(fit, "kappa")
        share = (1.0 - kept ** ((power + 1.0) / power)) / (
            (power + 1.0) * (1.0 - kept ** (1 / power))
        )
    slope = edge.slope(OPENINGS)
    force = share * energy / (2.0 * slope)
    depth = edge.reference * (force / drawn(fit, "response_force")) ** (1.0 / power)
    contact = edge.contact_of(OPENINGS, edge.top - depth)
    expected = force * (contact + (edge.top - depth) * slope)
    assert np.array(bands(fit, OPENINGS, -0.2)) == pytest.approx(quantiles(expected), rel=1e-9)


@pytest.mark.parametrize("depth", [5e-5, 2e-5, -1e-4])
def test_a_crack_that_rests_bears_the_response_alone(depth: float) -> None:
    """The edge less deep than where the crack runs, or above the sheet; force grows with speed."""
    fit, edge = cut_fit(recipe(), damping=2.0), Straight()
    contact = edge.contact_of(OPENINGS, edge.top - depth)
    assert edge.height_of(OPENINGS, contact) == pytest.approx(edge.top - depth, abs=1e-15)
    lever = contact + (edge.top - depth) * edge.slope(OPENINGS)
    ratio = (max(depth, 0.0) / edge.reference) ** drawn(fit, "response_exponent")
    force = drawn(fit, "response_force") * ratio
    for rate in (-0.5, 0.3):
        sinking = -lever * rate / 2.0
        expected = lever * force * (1.0 + drawn(fit, "rate_damping") * sinking)
        found = bands(fit, OPENINGS, rate, contact=contact)
        assert np.array(found) == pytest.approx(quantiles(expected), rel=1e-8, abs=1e-15)


def test_material_beyond_the_tip_is_out_of_reach() -> None:
    band = cut_fit(recipe()).predict(0.3, -0.2, contact=[0.2, 0.03])
    assert band.torque[0] == band.high[0] == 0.0
    assert band.contact is not None
    assert band.contact.tolist() == [0.2, 0.03]


def test_it_is_what_the_package_feels_less_friction(tmp_path: Path) -> None:
    """Within the package's own bound of error, at the scene's openings, rates and contacts."""
    chosen = recipe()
    cut, friction = cut_fit(chosen, kappa=0.7), friction_fit(offset=0.0)
    cut = replace(cut, draws=np.repeat(cut.map_point[None, :], len(cut.draws), 0))
    friction = replace(friction, draws=np.repeat(friction.map_point[None, :], 400, 0))
    path = tmp_path / "paper.zip"
    summary = build_package(chosen, friction, cut, path, np.random.default_rng(3))
    rng = np.random.default_rng(8)
    opening = np.radians(rng.uniform(12.0, 50.0, 200))
    rate, contact = rng.uniform(-1.0, -0.05, 200), rng.uniform(0.015, 0.06, 200)
    felt = (
        cut.predict(opening, rate, contact=contact).torque - friction.predict(opening, rate).torque
    )
    off = np.abs(open_package(path).torque(opening, rate, contact) - felt)
    assert off.max() < summary.manifest.bound.stated_Nm
    assert felt.min() > 10.0 * summary.manifest.bound.stated_Nm


def test_what_is_not_of_a_fit_is_refused_with_what_to_do() -> None:
    pressed = cut_fit(recipe("press-only"), energy=None)
    with pytest.raises(InputError, match="give contact"):
        pressed.predict(0.5, -0.2)
    assert pressed.predict(0.3, -0.2, contact=0.03).torque.shape == ()
    with pytest.raises(InputError, match="leave acceleration out"):
        cut_fit(recipe()).predict(0.5, -0.2, 3.0)
    with pytest.raises(InputError, match="take the fit of the cut"):
        friction_fit().predict(0.5, -0.2, contact=0.03)
    broken = cut_fit(recipe())
    broken = replace(broken, draws=np.full_like(broken.draws, np.nan))
    with pytest.raises(InputError, match="look at its verdicts"):
        broken.predict(0.5, -0.2)
    with pytest.raises(InputError, match="not finite"):
        cut_fit(recipe()).predict(0.5, -0.2, contact=np.nan)


def test_a_prediction_of_a_whole_series_is_held_in_parts() -> None:
    """More places than are held at once; each is as alone."""
    fit = cut_fit(recipe(), draws=400)
    openings = np.linspace(0.3, 0.6, 6001)
    whole = fit.predict(openings, -0.2)
    assert whole.high[-1] == fit.predict(openings[-1], -0.2).high
    assert whole.torque.shape == (6001,)
