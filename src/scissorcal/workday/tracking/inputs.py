"""What a track builds on: the camera's fit, the rig's frame, the tip, and where the plate was."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.plate.fit import plate_target
from scissorcal.device.link import Link
from scissorcal.errors import InputError, MissingError
from scissorcal.model.blade_point import BladePoint
from scissorcal.recipe.plate_surface import plate_surface
from scissorcal.recipe.schema import Recipe
from scissorcal.tracking.rows import TipContacts
from scissorcal.workday.engine import Engine
from scissorcal.workday.rigs import SIM
from scissorcal.workday.runs.cut import blade_edge
from scissorcal.workday.runs.fit import available, load_result
from scissorcal.workday.runs.friction import axis_of_fit
from scissorcal.workday.runs.plate import locate_workspace_rig
from scissorcal.workday.runs.probe import last_probe
from scissorcal.workday.tracking.session import RigDrive, TrackFacts
from scissorcal.workday.tracking.track_recorder import PoseFinder, RecordedTrack, TrackAbout

KnownPose = tuple[Array, Array, Array]
"""Rotation (3, 3), place (3,) in m and covariance (6, 6) in the rig's frame."""

REST_RATE_RAD_PER_S = 0.02
"""Below it blades are taken to stand, and dry friction to hold a share of its level."""


def pose_finder(
    engine: Engine,
    recipe: Recipe,
    camera: str,
    *,
    needs_rig: bool,
    otherwise: str = "track with --device none",
) -> PoseFinder:
    """The fitted camera, and the rig's frame if its card tells all of it.

    MissingError where there is no camera's fit, or where contacts need a frame that is not known;
    ``otherwise`` is what can be done without it, ``camera`` the one that the run names.
    """
    fitted = load_result(engine, "camera")
    located = locate_workspace_rig(engine, fitted.camera)
    rig = None if located is None or located.undetermined else located
    if rig is None and needs_rig:
        photographs = (
            "--camera sim --positions sim"
            if camera == SIM
            else "--image rig-*.jpg --positions positions.csv"
        )
        gap = f" ({', '.join(located.undetermined)} is not determined)" if located else ""
        raise MissingError(
            f"The camera's place in the rig's frame is not known{gap}, so contacts and pictures "
            "cannot be told together: photograph the rig card at several advances and openings "
            f"('scissorcal capture plate {photographs}'), or {otherwise}."
        )
    return PoseFinder(fitted.camera, plate_target(recipe), rig, recipe.fit.plate.priors)


def track_about(engine: Engine, recipe: Recipe, camera: str, eye: PoseFinder | None) -> TrackAbout:
    return TrackAbout(
        source=Path(camera).name,
        frame="rig" if eye is None or eye.rig else "camera",
        camera_inputs_hash=load_result(engine, "camera").inputs_hash if eye else "",
        width=eye.camera.width if eye else 0,
        height=eye.camera.height if eye else 0,
        camera_delay_ms=recipe.plate.tracking.camera_delay_ms,
    )


def track_facts(
    engine: Engine,
    about: TrackAbout,
    link: Link | None = None,
    radius_m: float | None = None,
    recipe: Recipe | None = None,
) -> TrackFacts:
    """What a track builds on, with a rig where ``link`` or ``radius_m`` (of its handles) is given.

    ``recipe`` takes the place of the workspace's.
    """
    recipe = recipe or engine.recipe
    facts = TrackFacts(plate_surface(recipe.plate.surface, engine.workspace.root), about)
    if about.camera_inputs_hash:
        calibrated = load_result(engine, "camera").camera.covariance is not None
        facts = replace(facts, calibrated=calibrated)
    if link is not None:
        radius_m = link.identity.handle_radius
    if radius_m is None:
        return facts
    contacts, known = _tip_contacts(engine, recipe)
    drive = _rig_drive(engine, radius_m, link)
    return replace(facts, drive=drive, contacts=contacts, friction_known=known)


def _tip_contacts(engine: Engine, recipe: Recipe) -> tuple[TipContacts, bool]:
    """Contacts of the upper blade's tip, and whether friction of the opening was fitted."""
    edge = blade_edge(engine, recipe)
    tip = BladePoint.on_edge(edge, edge.length_m, recipe.rig.moving_blades)
    if "friction" not in available(engine, ("friction",)):
        return TipContacts(tip), False
    law = axis_of_fit(load_result(engine, "friction"), "kg m^2")
    return TipContacts(tip, replace(law, rest_rate=REST_RATE_RAD_PER_S)), True


def _rig_drive(engine: Engine, radius_m: float, link: Link | None = None) -> RigDrive:
    """Zeros of the sensors are those that the last probe of this rig found."""
    probe = last_probe(engine.workspace, link)
    if probe is None:
        return RigDrive(radius_m)
    zero = probe.torque_zero_Nm
    return RigDrive(radius_m, 0.0 if zero is None else zero.mean, probe.rest.handle_zero_N)


def known_pose(engine: Engine) -> KnownPose:
    """The fitted pose of the plate in the rig's frame; MissingError where there is none."""
    fit = load_result(engine, "plate")
    if fit.rig_plate is None or fit.rig_plate.covariance is None:
        raise MissingError(
            "Without a camera a track starts from the fit of the plate, which has no pose in the "
            "rig's frame: photograph the rig card too ('scissorcal capture plate --help'), or name "
            "a camera."
        )
    pose = fit.rig_plate
    return pose.matrix, np.array(pose.translation_m), pose.covariance


def refuse_other_camera(path: Path, track: RecordedTrack, fitted: Any) -> None:
    """InputError where a track's pictures were located by another camera than the present fit's."""
    about, camera = track.about, fitted.camera
    if not about.camera_inputs_hash:
        raise InputError(f"{path.name} was recorded without a camera: there is nothing to locate.")
    if not camera.takes(about.width, about.height):
        raise InputError(
            f"{path.name} has pictures of {about.width} x {about.height}, and the camera was "
            f"fitted at {camera.width} x {camera.height}: its poses are of another camera. Restore "
            "that camera's fit ('scissorcal fit log camera'), or track anew."
        )
    if about.camera_inputs_hash != fitted.inputs_hash:
        raise InputError(
            f"{path.name} holds poses by another fit of the camera "
            f"({about.camera_inputs_hash[:8]}) than the present one ({fitted.inputs_hash[:8]}): "
            "restore that fit ('scissorcal fit log camera', 'scissorcal fit restore'), or track "
            "anew."
        )
