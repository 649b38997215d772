"""A package as the image that a device loads and renders by itself."""

from scissorcal.errors import InputError
from scissorcal.kernel import ModelTables, ServoConfig, model_image
from scissorcal.package.model_package import ModelPackage


def image_of(
    package: ModelPackage, config: ServoConfig | None = None, tables: ModelTables | None = None
) -> bytes:
    """The image of a package, of at most 16.6 kB: what a device takes by LOAD_BEGIN and renders.

    ``config`` has limits, ramp and what watches the energy, by default the package's own limits
    alone; ``tables`` what a rig admits of the package's, by default all. A step from the image is
    bit for bit that of ``package.kernel()``.

    Raises InputError for a package that a device cannot render: of a drawn plate, whose pieces have
    a crack each, and of a plate whose pose is estimated, which only the host follows.
    """
    manifest = package.manifest
    remedy = "Render it from this computer: leave --on-device out."
    if package.pieces:
        raise InputError(
            f"The package {manifest.name} has a drawn plate of {len(package.pieces)} pieces, and a "
            f"device renders one uniform sheet. {remedy}"
        )
    if manifest.plate_pose == "estimated":
        raise InputError(
            f"The package {manifest.name} follows a plate whose pose is estimated, and a device "
            f"knows no pose. {remedy}"
        )
    return model_image(tables or package.tables, config or _own_limits(package))


def _own_limits(package: ModelPackage) -> ServoConfig:
    limits = package.manifest.limits
    translates = "translation_force" in package.manifest.mechanics.render
    return ServoConfig(
        torque_limit=limits.torque_Nm,
        torque_slew=limits.torque_slew_Nm_per_s,
        force_limit=limits.force_N if translates else 0.0,
        force_slew=limits.force_slew_N_per_s,
        ramp_s=limits.engagement_ramp_s,
    )
