"""What photographs gave, as far as the scene asks for it: camera, blade and plate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scissorcal.recipe.requirements import GeometryKind, requirements
from scissorcal.recipe.schema import Recipe
from scissorcal.report.inputs import Geometry
from scissorcal.report.panel import Panel, absent
from scissorcal.report.pictures import Picture, PictureFile
from scissorcal.report.sections.blade import blade_pictures, show_blade
from scissorcal.report.sections.blade_facts import BladeSection, take_blade
from scissorcal.report.sections.camera import camera_pictures, show_camera
from scissorcal.report.sections.camera_facts import CameraSection, take_camera
from scissorcal.report.sections.headline import Headline
from scissorcal.report.sections.plate import PlateSection, plate_pictures, show_plate, take_plate
from scissorcal.verdicts import Verdict

KINDS: tuple[GeometryKind, ...] = ("camera", "blade", "plate")
TITLES: dict[GeometryKind, str] = {
    "camera": "Camera",
    "blade": "Blade",
    "plate": "Plate",
}
PHOTOGRAPHS: dict[GeometryKind, str] = {
    "camera": "board-*.jpg",
    "blade": "blade-*.jpg",
    "plate": "plate-*.jpg",
}


@dataclass(frozen=True)
class MissingGeometry:
    """A fit of photographs that the scene requires and that is not there."""

    fit: GeometryKind
    why: str


@dataclass(frozen=True)
class GeometrySection:
    """What photographs gave; None for what the scene does not require, or what is missing."""

    headlines: tuple[Headline, ...]
    camera: CameraSection | None
    blade: BladeSection | None
    plate: PlateSection | None
    missing: tuple[MissingGeometry, ...]


@dataclass(frozen=True)
class GeometryView:
    """One fit of photographs on the page."""

    anchor: str
    title: str
    panels: tuple[Panel, ...]


def take_geometry(recipe: Recipe, geometry: Geometry) -> GeometrySection:
    """Gather the facts on what the scene requires of photographs, and name what is missing."""
    needs = requirements(recipe)
    wanted = [kind for kind in KINDS if needs.needs_geometry(kind)]
    there = geometry.fits
    missing = tuple(
        MissingGeometry(kind, geometry.missing.get(kind) or _how(kind))
        for kind in wanted
        if kind not in there
    )
    headlines = [
        write_geometry_headline(kind, there[kind].verdicts) for kind in wanted if kind in there
    ]
    headlines += [
        Headline(item.fit, "care", f"The {item.fit} fit is not there yet.", (item.why,))
        for item in missing
    ]
    pictures = {kind: geometry.pictures.get(kind, ()) for kind in KINDS}
    camera, blade, plate = geometry.camera, geometry.blade, geometry.plate
    return GeometrySection(
        tuple(headlines),
        take_camera(camera, pictures["camera"]) if camera and "camera" in wanted else None,
        take_blade(blade, pictures["blade"]) if blade and "blade" in wanted else None,
        take_plate(plate, pictures["plate"]) if plate and "plate" in wanted else None,
        missing,
    )


def geometry_verdicts(section: GeometrySection, geometry: Geometry) -> tuple[Verdict, ...]:
    """Verdicts of the fits that the section shows, in its order."""
    shown = {"camera": section.camera, "blade": section.blade, "plate": section.plate}
    fits = geometry.fits
    return tuple(v for kind in KINDS if shown[kind] for v in fits[kind].verdicts)


def geometry_pictures(
    section: GeometrySection, geometry: Geometry
) -> dict[str, tuple[PictureFile, ...]]:
    """The picture files of what the section shows, by fit, in the order in which they matter."""
    files: dict[str, tuple[PictureFile, ...]] = {}
    if section.camera is not None:
        files["camera"] = camera_pictures(section.camera, geometry.pictures.get("camera", ()))
    if section.blade is not None:
        files["blade"] = blade_pictures(section.blade, geometry.pictures.get("blade", ()))
    if section.plate is not None:
        files["plate"] = plate_pictures(section.plate, geometry.pictures.get("plate", ()))
    return files


def show_geometry(
    section: GeometrySection, pictures: dict[str, tuple[Picture, ...]]
) -> tuple[GeometryView, ...]:
    """The page's parts on photographs, in the order in which they build on one another."""
    missing = {item.fit: item.why for item in section.missing}
    views = []
    for kind in KINDS:
        panels: tuple[Panel, ...] = ()
        own = pictures.get(kind, ())
        if kind == "camera" and section.camera is not None:
            panels = show_camera(section.camera, own)
        elif kind == "blade" and section.blade is not None:
            panels = show_blade(section.blade, own)
        elif kind == "plate" and section.plate is not None:
            panels = show_plate(section.plate, own)
        elif kind in missing:
            panels = (absent(f"{kind}-missing", "Not there yet", missing[kind]),)
        if panels:
            views.append(GeometryView(kind, TITLES[kind], panels))
    return tuple(views)


def write_geometry_headline(fit: GeometryKind, verdicts: Sequence[Verdict]) -> Headline:
    """Weigh the verdicts on a fit of photographs into one sentence."""
    failed = [verdict for verdict in verdicts if verdict.status == "fail"]
    unmade = [verdict for verdict in verdicts if verdict.status == "not_evaluated"]
    if failed:
        sentence = f"Do not rely on the {fit} fit: {_names(failed)} failed."
        again = f"Then run `scissorcal fit {fit}` and `scissorcal report` again."
        return Headline(fit, "reject", sentence, (*(verdict.why for verdict in failed), again))
    if unmade or not verdicts:
        doubt = f"{_names(unmade)} could not be evaluated" if unmade else "nothing was checked"
        return Headline(
            fit,
            "care",
            f"Use the {fit} fit with care: {doubt}.",
            tuple(verdict.why for verdict in unmade)
            or (f"Run `scissorcal fit {fit} --force`, so that its checks are made.",),
        )
    count = len(verdicts)
    made = "its one check" if count == 1 else f"all {count} checks"
    return Headline(
        fit,
        "unverified",
        f"The {fit} fit is unverified: it passed {made} of its own, and whether its intervals "
        "hold was not tested on these photographs.",
        ("Look at its pictures below: is what was drawn what you see?",),
    )


def _names(verdicts: Sequence[Verdict]) -> str:
    return ", ".join(verdict.check for verdict in verdicts)


def _how(kind: GeometryKind) -> str:
    return (
        f"The scene requires it: run `scissorcal capture {kind} --image {PHOTOGRAPHS[kind]}`, then "
        f"`scissorcal fit {kind}`."
    )
