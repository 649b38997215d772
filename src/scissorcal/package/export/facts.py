"""What an export states of its package; refuses a package that the exported step cannot render."""

from dataclasses import dataclass

import numpy as np

from scissorcal.errors import InputError
from scissorcal.identity import VERSION
from scissorcal.kernel.c_text import model_bytes
from scissorcal.kernel.compiled_step import compiled_step, missing_tools
from scissorcal.package.grid import spread_points
from scissorcal.package.keys import can_check
from scissorcal.package.manifest import Manifest
from scissorcal.package.model_package import ModelPackage
from scissorcal.package.signature import signature_refusal, signer_words

COUNTED_STATES = 300


@dataclass(frozen=True)
class ExportFacts:
    """What README, header and FMU state of a package.

    ``signature`` is "not signed", "signed" or "signed, not checked" (where cryptography is not
    installed). ``table_bytes`` are the model's arrays of constants, ``model_bytes`` its struct on a
    32-bit processor. ``instructions`` says how many a step takes on a Cortex-M4F and how they were
    counted, or why they were not.
    """

    manifest: Manifest
    signature: str
    knots: dict[str, int]
    table_bytes: int
    model_bytes: int
    instructions: str
    warnings: tuple[str, ...]

    @property
    def covered(self) -> tuple[str, ...]:
        """Ranges, bound and limits, one line each."""
        ranges, limits, bound = self.manifest.ranges, self.manifest.limits, self.manifest.bound
        openings, contacts = np.degrees(ranges.opening_rad), np.multiply(ranges.contact_m, 1e3)
        rates = ranges.opening_rate_rad_per_s
        proved = "not proved" if bound.proved_Nm is None else f"proved: {bound.proved_Nm:.2g}"
        return (
            f"opening {openings[0]:.4g} to {openings[1]:.4g} deg",
            f"rate {rates[0]:.4g} to {rates[1]:.4g} rad/s, closing and opening",
            f"contact {contacts[0]:.4g} to {contacts[1]:.4g} mm",
            f"error bound {bound.stated_Nm:.2g} N m against the exact model ({proved}), "
            f"{100 * bound.share:.2g} % of the largest torque {bound.scene_torque_Nm:.3g} N m; "
            f"{100 * bound.allowed_share:.2g} % is allowed",
            f"limits of a loop: {limits.torque_Nm:.4g} N m, {limits.force_N:.4g} N; "
            "the step does not apply them",
        )

    @property
    def identity(self) -> tuple[str, ...]:
        """Name, hash and signature, one line each."""
        made = self.manifest.provenance.scissorcal_version
        words = "" if self.signature == "not signed" else f" ({signer_words(self.manifest)})"
        return (
            f"package {self.manifest.name}, built by scissorcal {made}, exported by {VERSION}",
            f"content hash {self.manifest.content_hash}",
            f"signature: {self.signature}{words}",
        )

    @property
    def size(self) -> tuple[str, ...]:
        """Bytes and instructions, one line each."""
        knots = ", ".join(f"{name} {count}" for name, count in self.knots.items())
        return (
            f"tables {self.table_bytes} bytes (knots: {knots}), "
            f"model {self.model_bytes} bytes on a 32-bit processor, all constant",
            f"state of a step: 16 bytes; {self.instructions}",
        )

    @property
    def result(self) -> dict[str, object]:
        """The same for ``--json``."""
        return {
            "name": self.manifest.name,
            "content_hash": self.manifest.content_hash,
            "signature": self.signature,
            "ranges": self.manifest.ranges.model_dump(),
            "bound": self.manifest.bound.model_dump(),
            "table_bytes": self.table_bytes,
            "model_bytes": self.model_bytes,
            "instructions": self.instructions,
            "warnings": self.warnings,
        }


def export_facts(package: ModelPackage, *, count: bool = True) -> ExportFacts:
    """What is stated of a package; ``count`` asks for its instructions where tools are installed.

    Raises InputError for a drawn plate, a plate whose pose is estimated, and a signature that is of
    something else.
    """
    manifest, tables = package.manifest, package.tables
    _refuse(manifest)
    arrays, struct = model_bytes(tables)
    named = {name.removeprefix("tables/").removesuffix(".npy"): name for name in package.arrays}
    knots = {
        name: package.arrays[file].shape[1]
        for name, file in named.items()
        if file.startswith("tables/") and name != "mean_energy"
    }
    return ExportFacts(
        manifest=manifest,
        signature=_signature(manifest),
        knots=knots,
        table_bytes=arrays,
        model_bytes=struct,
        instructions=_instructions(package) if count else "instructions not counted",
        warnings=package.warnings,
    )


def _refuse(manifest: Manifest) -> None:
    if manifest.pieces is not None:
        raise InputError(
            f"The package {manifest.name} is of a drawn plate of {len(manifest.pieces)} pieces, "
            "which the exported step does not have: build a package of the uniform sheet "
            "(a recipe without plate.layers) and export that."
        )
    if manifest.plate_pose == "estimated":
        raise InputError(
            f"The package {manifest.name} is rendered at the pose of its plate, which the exported "
            'step does not follow: build a package with scene.plate_pose = "known" and export that.'
        )
    why = signature_refusal(manifest) if can_check() else ""
    if why:
        raise InputError(f"The package {manifest.name} {why}.")


def _signature(manifest: Manifest) -> str:
    if manifest.signature is None:
        return "not signed"
    return "signed" if can_check() else "signed, not checked"


def _instructions(package: ModelPackage) -> str:
    if reason := missing_tools("cortex-m4f"):
        return f"instructions not counted: {reason.removesuffix('.')}"
    points = spread_points(package.manifest.ranges, COUNTED_STATES)
    energy = np.full(len(points.opening), package.tables.fracture_energy)
    states = np.column_stack([points.opening, points.opening_rate, points.contact, energy])
    cost = compiled_step(package.tables, states, target="cortex-m4f")
    return (
        f"{cost.stroke[0]} instructions a step of a slow stroke, at most {cost.states.max()} of "
        f"{len(states)} states (Cortex-M4F, arm-none-eabi-gcc -O2, counted under qemu)"
    )
