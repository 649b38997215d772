"""Which plate a rendering follows: a tracker's, the package's own fitted pose, or none."""

from scissorcal.errors import MissingError
from scissorcal.kernel import ModelTables
from scissorcal.package import ModelPackage
from scissorcal.recording import RecordingWriter
from scissorcal.render.plate_estimate import fixed_plate
from scissorcal.render.plate_pose import PlatePlacer
from scissorcal.render.plate_record import PlateRecord
from scissorcal.tracking.plate_pose import PoseSource


def plate_placer(
    package: ModelPackage,
    source: PoseSource | None,
    tables: ModelTables,
    torque_limit_Nm: float,
    writer: RecordingWriter | None = None,
) -> PlatePlacer | None:
    """What follows the plate of a package; None where its scene has a known pose.

    Without a ``source`` the pose is the one that was fitted to photographs, which the package
    carries, as long as the rendering lasts. ``writer`` gets what is placed. Raises MissingError
    where there is none in the rig's frame.
    """
    manifest = package.manifest
    if manifest.plate_pose == "known":
        return None
    if source is None:
        if manifest.plate is None or manifest.plate.frame != "rig":
            raise MissingError(
                f'The scene of {manifest.name} has plate_pose = "estimated", and its package has '
                "no pose of the plate in the rig's frame. Photograph the plate's target and the "
                "rig card ('scissorcal capture plate --image ... --stances ...'), run 'scissorcal "
                "fit plate' and 'scissorcal package build', or give the pose of a tracker."
            )
        source = fixed_plate(manifest.plate)
    scene = package.recipe.scene
    return PlatePlacer(
        source,
        tables,
        tolerance=scene.tolerance_percent / 100.0,
        confidence=scene.confidence_percent / 100.0,
        torque_limit_Nm=torque_limit_Nm,
        record=PlateRecord(writer) if writer else None,
    )
